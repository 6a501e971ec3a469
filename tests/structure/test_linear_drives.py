"""Random linear drives against linear algebra: the reduced system has the poles of the flat equations."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, note, settings
from hypothesis import strategies as st

from components import ConstantTorque, Damper, Fixed, IdealGear, IdealPlanetary, Inertia, Spring, SpringDamper
from modelica_like.errors import Overdetermined
from modelica_like.flatten import FlatModel, flatten
from modelica_like.language import Assembly, Component
from modelica_like.structure import reduce
from modelica_like.structure.reduce import ReducedDae

POINTS = [0.7 + 0.3j, -1.1 + 2.0j, 2.5 - 0.4j, -0.3 - 1.7j, 1.9 + 1.3j, 0.2 + 3.1j]
"""Where the characteristic polynomials are compared."""


def flat_matrix(flat: FlatModel, s: complex) -> np.ndarray:
    """Equations over variables, der replaced by s: its determinant is the characteristic polynomial."""
    assert not flat.general
    values = [one.value for one in flat.parameters]
    matrix = np.zeros((len(flat.linear), len(flat.variables)), complex)
    symbols = [ca.SX(flat.coefficient(c)) for e in flat.linear for _, c in e.terms]
    numbers = iter(ca.Function("c", [flat.p], [ca.vertcat(*symbols)])(values).full().ravel())
    for row, equation in enumerate(flat.linear):
        for node, _ in equation.terms:
            variable, order = flat.nodes[node]
            matrix[row, variable] += next(numbers) * s**order
    return matrix


def poles(reduced: ReducedDae) -> np.ndarray:
    """Eigenvalues of the reduced system."""
    flat = reduced.flat
    a = [ca.jacobian(f, v) for f in (reduced.ode, reduced.alg) for v in (reduced.x, reduced.z)]
    parts = ca.Function("a", [flat.p, reduced.x, reduced.z, flat.time, flat.d], a)
    fx, fz, gx, gz = (np.array(part.full()) for part in parts([one.value for one in flat.parameters], 0, 0, 0, 0))
    matrix = fx - fz @ np.linalg.solve(gz, gx) if gz.size else fx
    return np.linalg.eigvals(matrix)


def assert_same_poles(flat: FlatModel, reduced: ReducedDae) -> None:
    """The determinant of the flat equations over the product of (s - pole) is one constant: no pole is missing."""
    found = poles(reduced)
    logs = []
    for s in POINTS:
        sign, magnitude = np.linalg.slogdet(flat_matrix(flat, s))
        factors = s - found
        logs.append(np.log(sign) + magnitude - np.sum(np.log(factors.astype(complex))))
    ratios = np.exp(np.array(logs) - logs[0])
    np.testing.assert_allclose(ratios, 1.0, rtol=1e-6)


def assert_equations_hold(flat: FlatModel, reduced: ReducedDae, seed: int) -> None:
    """At any states, all flat equations are fulfilled by the values of all variables and derivatives."""
    p = [one.value for one in flat.parameters]
    x = np.random.default_rng(seed).normal(size=len(reduced.states))
    assert reduced.z.numel() == 0
    everything = ca.Function("v", [reduced.x, reduced.z, flat.p, flat.time, flat.d], [reduced.values])
    values = everything(x, 0, p, 0, 0).full().ravel()
    total = [
        sum(ca.SX(flat.coefficient(c)) * values[node] for node, c in e.terms) + flat.coefficient(e.constant)
        for e in flat.linear
    ]
    residual = ca.Function("r", [flat.p], [ca.vertcat(*total)])(p).full().ravel()
    np.testing.assert_allclose(residual, 0.0, atol=1e-9 * (1.0 + np.max(np.abs(values))))


@st.composite
def drives(draw: st.DrawFn) -> Assembly:
    """Inertias joined at random by gears, springs, dampers, planetary sets and ground."""
    number = draw(st.integers(1, 5))
    parts: dict[str, Component] = {f"j{k}": Inertia(J=draw(st.sampled_from([0.5, 1.0, 2.0]))) for k in range(number)}
    wires: dict[str, list[str]] = {f"shaft{k}": [f"j{k}.flange_b"] for k in range(number)}
    for n in range(draw(st.integers(0, 5))):
        kind = draw(st.sampled_from(["gear", "spring", "elastic", "damper", "planet", "push", "ground", "massless"]))
        a, b, c = (draw(st.integers(0, number - 1)) for _ in range(3))
        name = f"{kind}{n}"
        if kind == "gear":
            parts[name] = IdealGear(ratio=draw(st.sampled_from([2.0, -3.0, 0.7])))
        elif kind == "spring":
            parts[name] = Spring(c=draw(st.sampled_from([1.0, 7.0])))
        elif kind in ("elastic", "massless", "ground"):
            parts[name] = SpringDamper(c=draw(st.sampled_from([1.0, 7.0])), d=draw(st.sampled_from([0.3, 1.1])))
        elif kind == "damper":
            parts[name] = Damper(d=draw(st.sampled_from([0.4, 2.0])))
        elif kind == "planet":
            parts[name] = IdealPlanetary(ratio=draw(st.sampled_from([2.0, 3.5])))
            for end, shaft in (("sun", a), ("ring", b), ("carrier", c)):
                wires[f"shaft{shaft}"].append(f"{name}.{end}")
            assume(len({a, b, c}) == 3)
            continue
        else:
            parts[name] = ConstantTorque(tau_constant=1.0)
            wires[f"shaft{a}"].append(f"{name}.flange")
            continue
        wires[f"shaft{a}"].append(f"{name}.flange_a")
        if kind == "ground":
            parts[f"fixed{n}"] = Fixed()
            wires[name] = [f"{name}.flange_b", f"fixed{n}.flange"]
        elif kind == "massless":
            parts[f"second{n}"] = SpringDamper(c=2.0, d=0.6)
            wires[name] = [f"{name}.flange_b", f"second{n}.flange_a"]
            wires[f"shaft{b}"].append(f"second{n}.flange_b")
        else:
            assume(a != b)
            wires[f"shaft{b}"].append(f"{name}.flange_b")
    return Assembly("drive", parts=parts, connect={k: ends for k, ends in wires.items() if len(ends) > 1})


@given(drives(), st.integers(0, 1000))
@settings(deadline=None, max_examples=60)
def test_random_drives(drive, seed):
    note(f"{list(drive.parts.values())} {drive.wires}")
    flat = flatten(drive)
    try:
        reduced = reduce(flat)
    except Overdetermined:
        # Rigid loops: then the flat equations are singular for every s.
        matrix = flat_matrix(flat, 0.7 + 0.3j)
        assert matrix.shape[0] != matrix.shape[1] or np.linalg.matrix_rank(matrix) < matrix.shape[0]
        return
    assert_equations_hold(flat, reduced, seed)
    assert_same_poles(flat, reduced)


def joined(parts: dict[str, Component], *wires: tuple[str, ...]) -> Assembly:
    return Assembly("drive", parts=parts, connect={f"w{k}": list(ends) for k, ends in enumerate(wires)})


def test_geared_inertias_move_as_one():
    """Acceleration of the input shaft by the torque over the reduced inertia, J1 + J2 / i1² + J3 / (i1 i2)²."""
    drive = joined(
        {"push": ConstantTorque(tau_constant=10.0), "a": Inertia(J=1.0), "b": Inertia(J=2.0), "c": Inertia(J=3.0),
         "g": IdealGear(ratio=2.0), "h": IdealGear(ratio=-0.5)},
        ("push.flange", "a.flange_a"), ("a.flange_b", "g.flange_a"), ("g.flange_b", "b.flange_a"),
        ("b.flange_b", "h.flange_a"), ("h.flange_b", "c.flange_a"),
    )  # fmt: skip
    flat = flatten(drive)
    reduced = reduce(flat)
    assert reduced.states == ("push.phi", "a.w")
    assert reduced.index == 3
    rates = ca.Function("f", [flat.p, reduced.x, flat.time, flat.d], [reduced.ode])(
        [p.value for p in flat.parameters], [0.3, 5.0], 0, 0
    )
    assert np.array(rates).ravel() == pytest.approx([5.0, 10.0 / (1.0 + 2.0 / 4.0 + 3.0 / 1.0)], rel=1e-14)
    assert_equations_hold(flat, reduced, 1)


def test_a_planetary_set_has_two_degrees_of_freedom():
    drive = joined(
        {"s": Inertia(J=1.0), "r": Inertia(J=2.0), "c": Inertia(J=3.0), "p": IdealPlanetary(ratio=2.0),
         "push": ConstantTorque(tau_constant=7.0)},
        ("s.flange_b", "p.sun"), ("r.flange_b", "p.ring"), ("c.flange_b", "p.carrier"), ("push.flange", "s.flange_a"),
    )  # fmt: skip
    flat = flatten(drive)
    reduced = reduce(flat)
    assert len(reduced.states) == 4
    assert_equations_hold(flat, reduced, 2)
    # (1 + i) wc = ws + i wr. Lagrange with ws and wr free: M [as, ar] = [tau, 0] with
    # M = diag(Js, Jr) + Jc g gᵀ, g = [1, i] / (1 + i).
    g = np.array([1.0, 2.0]) / 3.0
    expected = np.linalg.solve(np.diag([1.0, 2.0]) + 3.0 * np.outer(g, g), [7.0, 0.0])
    names = [flat.node_name(k) for k in range(len(flat.nodes))]
    values = (
        ca.Function("v", [flat.p, reduced.x, flat.time, flat.d], [reduced.values])(
            [p.value for p in flat.parameters], 0, 0, 0
        )
        .full()
        .ravel()
    )
    found = [values[names.index(f"der({n}.w)")] for n in "sr"]
    assert found == pytest.approx(expected, rel=1e-13)


def test_parallel_springs_share_their_state():
    drive = joined(
        {"a": Inertia(J=1.0), "b": Inertia(J=2.0), "g": SpringDamper(c=2.0, d=0.1), "h": SpringDamper(c=3.0, d=0.2)},
        ("a.flange_b", "g.flange_a", "h.flange_a"), ("b.flange_a", "g.flange_b", "h.flange_b"),
    )  # fmt: skip
    flat = flatten(drive)
    reduced = reduce(flat)
    assert len(reduced.states) == 4
    # Relative motion: reduced mass 2/3, c = 5, d = 0.3; and the rigid body.
    relative = np.roots([2.0 / 3.0, 0.3, 5.0])
    found = sorted(poles(reduced), key=lambda s: (round(abs(s), 6), s.imag))
    assert np.abs(found[:2]) == pytest.approx([0, 0], abs=1e-7)
    assert sorted(found[2:], key=lambda s: s.imag) == pytest.approx(sorted(relative, key=lambda s: s.imag), rel=1e-12)


def test_a_massless_point_between_spring_dampers_keeps_one_state():
    drive = joined(
        {"a": Inertia(J=1.0), "b": Inertia(J=2.0), "g": SpringDamper(c=2.0, d=0.5), "h": SpringDamper(c=3.0, d=0.2)},
        ("a.flange_b", "g.flange_a"), ("g.flange_b", "h.flange_a"), ("h.flange_b", "b.flange_a"),
    )  # fmt: skip
    flat = flatten(drive)
    reduced = reduce(flat)
    assert len(reduced.states) == 5
    assert_same_poles(flat, reduced)
