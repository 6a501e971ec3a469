"""Linearisation at a point: A, B, C, D with names and units, right through locked and open clutches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from modelica_like.analyse.linear.held import free_motions
from modelica_like.analyse.linear.points import At, Drive, point_of
from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import UnknownName, did_you_mean, missing_extra
from modelica_like.initialize import Point
from modelica_like.initialize.kept import Kept

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.analyse.linear.modes import Modes

Matrix = np.ndarray[Any, np.dtype[np.float64]]
_SHOWN = 12


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Small motions about a point: der(x) = A x + B u, y = C x + D u, in deviations from x0, u0, y0.

    Attributes:
        model: the compiled model.
        point: where it was linearised.
        A: shape (states, states).
        B: shape (states, inputs).
        C: shape (outputs, states).
        D: shape (outputs, inputs).
        states: names of the states that can move.
        held: names of the states that modes hold: they follow from the others, or stay as they are.
        inputs: names of inputs and parameters.
        outputs: names of variables.
        units: coherent SI unit of every name.
        shape: deviations of all states of the model by those of `states`, shape (all states, states).
    """

    model: CompiledDae = field(repr=False)
    point: Point = field(repr=False)
    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    states: tuple[str, ...]
    held: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str] = field(repr=False)
    shape: Matrix = field(repr=False)

    @property
    def time(self) -> float:
        """Time of the point in s."""
        return self.point.t

    def eigenvalues(self) -> Any:
        """Return the eigenvalues of A in rad/s, complex, shape (states,)."""
        return np.linalg.eigvals(self.A)

    def modes(self) -> Modes:
        """Return eigenvalues, damping, shapes, participation, and where the energy of each mode is."""
        from modelica_like.analyse.linear.modes import find_modes

        return find_modes(self)

    def response(self, frequencies: Any) -> Any:
        """Return the frequency response, complex, shape (outputs, inputs, frequencies).

        Args:
            frequencies: in Hz.
        """
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequencies, float))
        eye = np.eye(len(self.states))
        gains = [self.C @ np.linalg.solve(one * eye - self.A, self.B.astype(complex)) + self.D for one in s]
        return np.stack(gains, axis=-1)

    def bode(self, frequencies: Any = None) -> Figure:
        """Draw magnitude and phase of every output by every input.

        Args:
            frequencies: in Hz; by default around the frequencies of the modes.
        """
        from modelica_like.analyse.linear.pictures import draw_bode

        return draw_bode(self, frequencies)

    def to_scipy(self) -> Any:
        """Return a scipy.signal.StateSpace.

        Raises:
            MissingExtra: scipy is not installed.
        """
        try:
            from scipy.signal import StateSpace
        except ImportError:
            raise missing_extra("scipy", "analyse") from None
        return StateSpace(self.A, self.B, self.C, self.D)

    def to_control(self) -> Any:
        """Return a state space of python-control, with the names of its signals.

        Raises:
            MissingExtra: python-control is not installed.
        """
        try:
            import control
        except ImportError:
            raise missing_extra("control", "analyse") from None
        # python-control reserves dots for signals of interconnected systems.
        plain = {kind: [_plain(name) for name in getattr(self, kind)] for kind in ("states", "inputs", "outputs")}
        return control.ss(self.A, self.B, self.C, self.D, name=_plain(self.model.name), **plain)

    def __str__(self) -> str:
        lines = [
            f"LinearModel of {self.model.name} at t = {self.time:g} s: {len(self.states)} states, "
            f"{len(self.inputs)} inputs, {len(self.outputs)} outputs"
        ]
        for title, names in (
            ("states", self.states),
            ("held", self.held),
            ("inputs", self.inputs),
            ("outputs", self.outputs),
        ):
            shown = ", ".join(f"{name} [{self.units[name]}]" for name in names[:_SHOWN])
            if names:
                lines.append(f"  {title}: {shown}{', …' if len(names) > _SHOWN else ''}")
        return "\n".join(lines)


def linearize(
    drive: Drive, at: At = None, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None,
) -> LinearModel:  # fmt: skip
    """Linearise a drive about a point of its motion, in the modes that are active there.

    Surfaces that stick move as one: what a mode holds is no state of its own.

    Args:
        drive: a component, a netlist file, a compiled model, or a solution.
        at: a time in s (of the solution; other drives are simulated up to there), or a start: `given`, `rest`,
            `steady`. By default the end of a solution, otherwise the given start.
        inputs: names of inputs and parameters; by default the inputs of the model.
        outputs: names of variables; by default the outputs of the model, or its states if it has none.

    Raises:
        UnknownName: a name is not known.
        ModelicaLikeError: the drive cannot be built, started or simulated.
    """
    model, point = point_of(drive, at)
    u_names, y_names = _input_names(model, inputs), _output_names(model, outputs)
    a, b, c, d = slopes_at(model, point, u_names, y_names)
    motions = free_motions(model, point, a)
    keep, shape = motions.keep, motions.shape
    if len(keep) < len(a):
        a, b, c = a[keep] @ shape, b[keep], c @ shape
    kept = set(keep)
    names = tuple(model.states[k] for k in keep)
    held = tuple(name for k, name in enumerate(model.states) if k not in kept)
    units = _units(model, (*u_names, *y_names))
    return LinearModel(model, point, a, b, c, d, names, held, u_names, y_names, units, shape)


def slopes_at(
    model: CompiledDae, point: Point, inputs: Sequence[str], outputs: Sequence[str]
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Return total derivatives of the rates by states and inputs, and of outputs by both, z following.

    Raises:
        UnknownName: a name is not known.
    """
    columns, rows = _columns(model, inputs), _rows(model, outputs)
    key = "linearize", columns, rows
    if key not in model._cache:
        model._cache[key] = _jacobians(model, columns, rows)
    parts = model._cache[key](point.t, point.x, point.z, model.p, model.u, point.d)
    f, g, h = ([_dense(one) for one in parts[k : k + 3]] for k in (0, 3, 6))
    if model.implicit:
        follow = [np.linalg.solve(g[1], -g[k]) for k in (0, 2)]
        f = [f[0] + f[1] @ follow[0], f[1], f[2] + f[1] @ follow[1]]
        h = [h[0] + h[1] @ follow[0], h[1], h[2] + h[1] @ follow[1]]
    return f[0], f[2], h[0], h[2]


def held_by(model: CompiledDae, point: Point, kept: Kept, names: Sequence[str]) -> Matrix:
    """Return derivatives of the variables that modes hold by inputs or parameters, at constant states."""
    held = [model.flat_variables[node].path for node in kept.held]
    return slopes_at(model, point, names, held)[3] if held else np.zeros((0, len(names)))


def _jacobians(model: CompiledDae, columns: Sequence[tuple[str, int]], rows: Sequence[int]) -> ca.Function:
    symbols = model.arguments
    arguments = list(symbols.values())
    inputs = ca.vertcat(*(symbols[kind][k] for kind, k in columns))
    outputs = model.variables(*arguments)[list(rows)] if rows else ca.SX(0, 1)
    by = (symbols["x"], symbols["z"], inputs)
    vectors = (model.ode(*arguments), model.alg(*arguments), outputs)
    # Differentiation by a stacked vector, then columns: inputs may be elements of arguments.
    slopes = [ca.jacobian(one, unknown) for one in vectors for unknown in by]
    return ca.Function("linearize", arguments, slopes)


def _dense(matrix: Any) -> Matrix:
    """Fill a dense matrix; CasADi's own conversion of large sparse ones is slow."""
    result = np.zeros(matrix.shape)
    rows, columns = matrix.sparsity().get_triplet()
    result[rows, columns] = matrix.nonzeros()
    return result


def _input_names(model: CompiledDae, names: Sequence[str] | None) -> tuple[str, ...]:
    return tuple(model.flat_variables[k].path for k in model.inputs) if names is None else tuple(names)


def _output_names(model: CompiledDae, names: Sequence[str] | None) -> tuple[str, ...]:
    if names is not None:
        return tuple(names)
    top = [one.path for one in model.flat_variables if one.kind == "output" and "." not in one.path]
    return tuple(top) or model.states


def _columns(model: CompiledDae, names: Sequence[str]) -> tuple[tuple[str, int], ...]:
    known = {name: ("p", k) for name, k in model.parameter_position.items()}
    known.update({model.flat_variables[k].path: ("u", n) for n, k in enumerate(model.inputs)})
    for name in names:
        if name not in known:
            raise UnknownName(f"{model.name} has no input or parameter '{name}'{did_you_mean(name, known) or '.'}")
    return tuple(known[name] for name in names)


def _rows(model: CompiledDae, names: Sequence[str]) -> tuple[int, ...]:
    for name in names:
        if name not in model.position:
            hint = did_you_mean(name, model.position) or "."
            raise UnknownName(f"{model.name} has no variable '{name}'{hint}")
    return tuple(model.position[name] for name in names)


def _units(model: CompiledDae, names: Sequence[str]) -> dict[str, str]:
    variables = {one.path: str(one.unit) for one in (*model.flat_variables, *model.flat_parameters)}
    return {name: _unit(variables, name) for name in (*model.states, *names)}


def _unit(variables: Mapping[str, str], name: str) -> str:
    """Return the unit of a variable, or of the derivative `der(x)` of one."""
    return variables[name] if name in variables else f"{_unit(variables, name[4:-1])}/s"


def _plain(name: str) -> str:
    return name.replace(".", "_")
