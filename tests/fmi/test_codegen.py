"""The C code from the inside: tapes against CasADi, linear algebra against NumPy, the integrator's order."""

import ctypes
import subprocess
from collections.abc import Callable
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from modelica_like import build
from modelica_like.fmi.build import compiler_command, native_platform
from modelica_like.fmi.interface import interface
from modelica_like.fmi.model_file import SECTIONS, generate
from modelica_like.fmi.sources import RUNTIME
from modelica_like.fmi.tables import make_tables
from modelica_like.fmi.tape import ARGUMENTS
from modelica_like.language import Component, Equations, Parameter, Variable, cos, der, param, var

EXAMPLES = Path(__file__).parents[2] / "examples"
DOUBLES = ctypes.POINTER(ctypes.c_double)
INSIDE = """
#include <stdlib.h>
#include "core.h"
static char message[MESSAGE_LENGTH];
Model *read_model(void) {
    return model_read((const unsigned char *)model_data, model_data_size, calloc, free, message);
}
const Tape *tape(const Model *m, int k) { return (const Tape *)(const void *)&m->tapes + k; }

Instance *made(const Model *m) {
    return instance_new((Instance){.model = m, .name = "one", .allocate = calloc, .release = free}, m->token);
}

/* Solves with the step matrix. Tells whether LU without exchanges has done it, or that the matrix is singular. */
int solved(Instance *c, const double *matrix, double *x) {
    memcpy(c->matrix, matrix, (size_t)c->model->step.n_nonzeros * sizeof(double));
    if (!factor_matrix(c)) return -1;
    solve_step(c, x);
    return c->by_lu;
}
void solve_dense(int n, const double *m, const int *order, double *x) { lu_solve(n, m, order, x); }
"""
TAPES = [name.split(".")[1] for name in SECTIONS if name.startswith("tapes.") and name.endswith(".runs")]


def pointer(values: np.ndarray) -> Any:
    return values.ctypes.data_as(DOUBLES)


class Inside:
    """A model's C code with all functions visible."""

    def __init__(self, drive: Any, folder: Path) -> None:
        self.model = build(EXAMPLES / drive if isinstance(drive, str) else drive)
        self.tables = make_tables(self.model)
        for name, text in generate(self.model, interface(self.model), token="{t}").items():
            (folder / name).write_text(text)
        (folder / "inside.c").write_text(INSIDE)
        command = [*compiler_command(native_platform()), "-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
        files = ["inside.c", "model_data.c", *RUNTIME]
        subprocess.run([*command, "-o", "inside.so", *files, "-lm"], cwd=folder, check=True)
        self.library = ctypes.CDLL(str(folder / "inside.so"))
        for name in ("read_model", "tape", "made"):
            getattr(self.library, name).restype = ctypes.c_void_p
        self.read = ctypes.c_void_p(self.library.read_model())
        assert self.read.value
        slots = self.tables.slots
        self.first = dict(zip(ARGUMENTS, accumulate((slots.sizes[n] for n in ARGUMENTS), initial=0), strict=False))
        self.constants = sum(slots.sizes.values())
        longest = max(len(t.operations) for t in self.tables.tapes.values())
        self.size = self.constants + len(slots.constants) + longest

    def tape(self, name: str) -> Any:
        return ctypes.c_void_p(self.library.tape(self.read, TAPES.index(name)))

    def slots(self, arguments: dict[str, np.ndarray]) -> np.ndarray:
        slots = np.zeros(self.size)
        for name, values in arguments.items():
            slots[self.first[name] : self.first[name] + len(values)] = values
        slots[self.constants :][: len(self.tables.slots.constants)] = self.tables.slots.constants
        return slots

    def random(self, seed: int) -> dict[str, np.ndarray]:
        """Values near those of the model, so that roots and logarithms exist."""
        random, model = np.random.default_rng(seed), self.model
        near = {"p": model.p * random.uniform(0.9, 1.1, len(model.p)), "u": model.u + random.normal(size=len(model.u))}
        modes = [random.integers(len(one.names)) if one.names else 0.0 for one in model.flat_discretes]
        sizes = self.tables.slots.sizes
        free = {name: random.normal(size=sizes[name]) for name in ("x", "z", "y")}
        hidden = random.uniform(size=model.discrete_size - len(modes))
        return {"t": random.uniform(0, 1, 1), **free, **near, "d": np.concatenate([modes, hidden])}


@pytest.fixture(scope="module")
def inside(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Any], Inside]:
    made: dict[Any, Inside] = {}

    def make(drive: Any) -> Inside:
        if drive not in made:
            made[drive] = Inside(drive, tmp_path_factory.mktemp("inside"))
        return made[drive]

    return make


DRIVES = ["msl/rotational/CoupledClutches.toml", "msl/rotational/LossyGearDemo1.toml", "dc_bench.toml"]
MOST_SLOW = [DRIVES[0], *(pytest.param(one, marks=pytest.mark.slow) for one in DRIVES[1:])]
FUNCTIONS = (
    "alg", "variables", "guards_soon", "moments", "resets", "start_conditions", "start_values", "discrete_starts",
    "determinants", "derived",
)  # fmt: skip


@pytest.mark.parametrize("drive", MOST_SLOW)
def test_tapes_give_the_bits_of_casadi(inside, drive):
    code = inside(drive)
    for seed in range(5):
        values = code.random(seed)
        for name in FUNCTIONS:
            function = code.model.functions[name]
            expected = function(*(values[argument] for argument in function.name_in())).full().ravel()
            found = np.zeros(max(len(expected), 1))
            code.library.tape_run(code.tape(name), pointer(code.slots(values)), pointer(found))
            assert np.array_equal(found[: len(expected)], expected, equal_nan=True), name


def rates_function(code: Inside) -> tuple[ca.Function, list[Any]]:
    a = code.model.arguments
    everything = list(a.values())
    rates = ca.vertcat(code.model.equations.ode(*everything), code.model.equations.alg(*everything))
    return ca.Function("rates", everything, [rates], list(a), ["rates"]), everything


@pytest.mark.parametrize("drive", MOST_SLOW)
def test_tangents_and_adjoints_are_those_of_casadi(inside, drive):
    code = inside(drive)
    function, everything = rates_function(code)
    jacobian = ca.Function("jacobian", everything, [ca.jacobian(function(*everything), ca.vertcat(*everything))])
    given = code.first["y"]
    count = function.numel_out(0)
    for seed in range(3):
        values = code.random(seed)
        exact = jacobian(*(values[name] for name in ARGUMENTS[:-1])).full()
        slots, outputs = code.slots(values), np.zeros(count)
        code.library.tape_run(code.tape("rates"), pointer(slots), pointer(outputs))
        random = np.random.default_rng(seed + 10)
        dots, bars = np.zeros(code.size), np.zeros(code.size)
        dots[:given] = random.normal(size=given)
        weights = random.normal(size=count)
        along = np.zeros(count)
        code.library.tape_tangent(code.tape("rates"), pointer(slots), pointer(dots), pointer(along))
        code.library.tape_adjoint(code.tape("rates"), pointer(slots), pointer(bars), pointer(weights))
        scale = 1.0 + np.abs(exact) @ np.abs(dots[:given])
        assert np.max(np.abs(along - exact @ dots[:given]) / scale) < 1e-11
        scale = 1.0 + np.abs(weights) @ np.abs(exact)
        # Adjoints of operations in between may be as large as the largest of all, and cancel in a small one.
        rounding = 4 * np.finfo(float).eps * scale.max()
        assert np.max((np.abs(bars[:given] - weights @ exact) - rounding) / scale) < 1e-11


def test_dense_systems_are_solved(inside):
    library = inside(DRIVES[0]).library
    random = np.random.default_rng(5)
    for n in (1, 2, 5, 20):
        a, b = random.normal(size=(n, n)), random.normal(size=n)
        order = (ctypes.c_int * n)()
        factors = np.asfortranarray(a).ravel("F").copy()
        assert library.lu_factor(n, pointer(factors), order) == 1
        for solve, matrix in (("solve_dense", a), ("lu_solve_transposed", a.T)):
            x = b.copy()
            getattr(library, solve)(n, pointer(factors), order, pointer(x))
            assert x == pytest.approx(np.linalg.solve(matrix, b), rel=1e-9, abs=1e-9)
    singular = np.array([1.0, 2.0, 2.0, 4.0])
    assert library.lu_factor(2, pointer(singular), (ctypes.c_int * 2)()) == 0


@pytest.mark.parametrize("shape", [(1, 3), (3, 3), (2, 5), (4, 3)])
@pytest.mark.parametrize("rank", [1, 2, 3])
def test_least_squares_give_the_shortest_solution(inside, shape, rank):
    library = inside(DRIVES[0]).library
    random = np.random.default_rng(7)
    rank = min(rank, *shape)
    a = random.normal(size=(shape[0], rank)) @ random.normal(size=(rank, shape[1]))
    b, x = random.normal(size=shape[0]), np.zeros(shape[1])
    rows, right = a.copy(), b.copy()
    library.least_squares(*shape, pointer(rows), pointer(right), pointer(x))
    assert x == pytest.approx(np.linalg.lstsq(a, b, rcond=1e-12)[0], rel=1e-9, abs=1e-9)


class Circle(Component):
    """Index 1 with a nonlinear implicit equation; the solution is a = z = cos(t), b = sin(t)."""

    a: Variable = var("1", "cosine", state="prefer")
    b: Variable = var("1", "sine", state="prefer")
    z: Variable = var("1", "cosine again")
    rate: Parameter = param("1/s", "angular speed", default=1.0)

    def build(self) -> None:
        self.a, self.b = 1.0, 0.0

    def equations(self) -> Equations:
        cosine = cos(self.rate * self.time)
        yield der(self.a) == self.rate * (3 * (self.z - self.a) + 2 * (cosine - self.a) * self.b - self.b)
        yield der(self.b) == self.rate * self.z * (1 + self.a**2 - self.z**2)
        yield self.z**3 + self.z == self.a**3 + cosine


class Piece(ctypes.Structure):
    _fields_ = [("begin", ctypes.c_double), ("end", ctypes.c_double)] + [
        (name, ctypes.c_double * 3) for name in ("first", "last", "d0", "d1", "d2")
    ]


def test_the_integrator_has_order_five_and_dense_output_of_order_four(inside):
    code = inside(Circle())
    library = code.library
    assert code.model.implicit == ("z",)
    c = ctypes.c_void_p(library.made(code.read))
    library.rosenbrock_step.argtypes = [
        ctypes.c_void_p, ctypes.c_double, DOUBLES, ctypes.c_double, ctypes.c_int, ctypes.c_void_p
    ]  # fmt: skip
    library.rosenbrock_step.restype = ctypes.c_double
    library.piece_at.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, DOUBLES]

    def exact(t: float) -> np.ndarray:
        values = {"a": np.cos(t), "b": np.sin(t)}
        return np.array([*(values[name] for name in code.model.states), np.cos(t)])

    errors, between = [], []
    for steps in (64, 128):
        point, piece = exact(0.0), Piece()
        inner = 0.0
        for k in range(steps):
            t, h = k / steps, 1 / steps
            assert library.rosenbrock_step(c, t, pointer(point), h, 0, ctypes.byref(piece)) >= 0
            middle = np.zeros(3)
            library.piece_at(code.read, ctypes.byref(piece), t + 0.4 * h, pointer(middle))
            inner = max(inner, np.max(np.abs(middle - exact(t + 0.4 * h))))
            point = np.array(piece.last[:])
        errors.append(np.max(np.abs(point - exact(1.0))))
        between.append(inner)
    library.instance_free(c)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 4.7), (orders, errors)
    assert np.all(np.log2(np.array(between[:-1]) / between[1:]) > 3.7), between
    assert errors[-1] < 1e-11


STEP_MATRICES = ["msl/rotational/CoupledClutches.toml", "lepelletier.toml", "elements/full_turns.toml"]


def solve_by(code: Inside, matrix: np.ndarray, right: np.ndarray) -> tuple[int, np.ndarray]:
    """Solve with a matrix of the model's step pattern in C."""
    columns, x = np.array(code.tables.step["colind"]), right.copy()
    values = np.concatenate(
        [matrix[list(code.tables.step["row"][a:b]), k] for k, (a, b) in enumerate(pairwise(columns))]
    )
    c = ctypes.c_void_p(code.library.made(code.read))
    how = code.library.solved(c, pointer(values), pointer(x))
    code.library.instance_free(c)
    return how, x


def step_matrix(code: Inside, diagonal: float, seed: int) -> np.ndarray:
    """A matrix of the pattern with entries about one, and what comes from a step's length for the states."""
    step, random = code.tables.step, np.random.default_rng(seed)
    matrix = np.zeros((len(step["row_place"]),) * 2)
    for column, (first, end) in enumerate(pairwise(step["colind"])):
        matrix[list(step["row"][first:end]), column] = random.normal(size=end - first)
    states = range(len(code.model.states))
    matrix[states, states] += diagonal
    return matrix


@pytest.mark.parametrize("drive", STEP_MATRICES)
@pytest.mark.parametrize("diagonal", [30.0, 1e5])
def test_step_matrices_are_solved_without_exchanges(inside, drive, diagonal):
    code = inside(drive)
    for seed in range(20):
        matrix = step_matrix(code, diagonal, seed)
        right = np.random.default_rng(seed + 100).normal(size=len(matrix))
        how, x = solve_by(code, matrix, right)
        backward = np.abs(right - matrix @ x) / (np.abs(matrix) @ np.abs(x) + np.abs(right))
        assert how == 1
        # The limit of the growth times the rounding unit: an equation's error beside its terms.
        assert np.max(backward) < 1e4 * np.finfo(float).eps


@pytest.mark.parametrize("pivot", [0.0, 1e-20])
def test_step_matrices_whose_pivots_vanish_are_solved_by_qr(inside, pivot):
    """[pivot 1; 1 pivot] has the inverse [-pivot 1; 1 -pivot] / (1 - pivot²)."""
    code = inside(Circle())
    matrix = np.array([[pivot, 1.0, 0.5], [1.0, pivot, 0.0], [0.0, 0.0, 2.0]])
    how, x = solve_by(code, matrix, np.array([3.0, 5.0, 4.0]))
    assert how == 0
    assert x == pytest.approx([5.0, 2.0, 2.0], rel=1e-15)
    for singular in (0.0, np.nan):
        matrix[2, 2] = singular
        assert solve_by(code, matrix, np.ones(3))[0] == -1
