"""Whether an acceleration is known before the equation that asks for it."""

from dataclasses import replace
from typing import Any

import casadi as ca
import pytest
from linear_models import model

from components import (
    BearingFriction,
    ConstantSpeed,
    Inertia,
    LinearSpeedDependentTorque,
    LossyGear,
    SpringDamper,
)
from modelica_like import simulate
from modelica_like.flatten import flatten
from modelica_like.language import Assembly
from modelica_like.structure import reduce
from modelica_like.structure.alias import find_aliases
from modelica_like.structure.prescribed import Flags
from modelica_like.structure.system import System, build_system

FLAG, OTHER = ca.SX.sym("flag"), ca.SX.sym("other")
W, F, A = 0, 1, 2
"""Nodes of a speed, a force, and the acceleration."""


def system(flags: list[tuple[Any, int]], given: bool = False) -> System:
    """A speed and a force; the speed may be given."""
    made = model([1, 0], [{W: 1.0}] if given else [], [-3.0] if given else None)
    made = replace(made, flags=tuple(flags), q=ca.vertcat(*(symbol for symbol, _ in flags), 7))
    return build_system(made, find_aliases(made))


def told(made: System, flags: Flags, unknowns: list[int]) -> list[float]:
    """Settle the flags; return their values in the parameters of the model."""
    assert flags.settle(made.residual, unknowns)
    assert made.model.flags == ()
    values = ca.Function("q", [made.model.time], [made.model.q])(0.3).full().ravel()
    assert values[-1] == 7.0
    assert not ca.depends_on(made.residual, ca.vertcat(FLAG, OTHER))
    return [float(one) for one in values[:-1]]


def symbol(made: System, node: int) -> Any:
    return made.symbols[level(made, node)]


def level(made: System, node: int) -> int:
    placed = made.node_level[node]
    assert placed
    return placed[0]


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(("known", "expected"), [("nothing", 0.0), ("acceleration", 1.0), ("force", 0.0)])
def test_a_motion_is_prescribed_if_its_acceleration_is_known_without_the_equation(
    known: str, expected: float, swapped: bool
) -> None:
    """The equation with the flag is f = 2 a if it is, f = 3 otherwise."""
    made = system([(FLAG, W)])
    w, f, a, t = symbol(made, W), symbol(made, F), symbol(made, A), made.model.time
    law = FLAG * (f - 2 * a) + (1 - FLAG) * (f - 3 - a)
    free = {"nothing": a - w - f, "acceleration": a - t, "force": f - t}[known]
    rows = ca.vertcat(law, free) if swapped else ca.vertcat(free, law)
    made.residual = rows
    flags = Flags(made)
    assert ca.depends_on(made.residual[0 if swapped else 1], t)
    assert not ca.depends_on(made.residual, FLAG)
    assert told(made, flags, [level(made, F), level(made, A)]) == [expected]
    values = [
        ca.Function("r", [made.everything, t], [one])(range(1, 4), 8.0).full().tolist()
        for one in (made.residual, ca.substitute(rows, FLAG, ca.SX(expected)))
    ]
    assert values[0] == values[1]


def test_several_flags_are_settled_one_by_one() -> None:
    """The force is no motion: nothing is its acceleration."""
    made = system([(OTHER, F), (FLAG, W)])
    a, f = symbol(made, A), symbol(made, F)
    made.residual = ca.vertcat(a - f, FLAG * (f - 2 * a) + (1 - FLAG) * (f - 3) + OTHER)
    assert told(made, Flags(made), [level(made, A), level(made, F)]) == [1.0, 0.0]


def test_a_motion_that_is_a_number_is_prescribed() -> None:
    made = system([(FLAG, W)], given=True)
    made.residual = ca.vertcat(FLAG * symbol(made, F) - 3)
    assert told(made, Flags(made), [0]) == [1.0]


def test_without_flags_nothing_is_asked() -> None:
    made = system([])
    residual, before = made.residual, made.model
    assert Flags(made).settle(made.residual, [1, 2]) is False
    assert made.residual is residual
    assert made.model is before


@pytest.mark.parametrize("driven", [True, False])
def test_of_a_symbol_that_is_settled_nothing_is_left(driven: bool) -> None:
    """Until then the time takes its place, in derivatives, too; and neither drive depends on time."""
    source = {"source": ConstantSpeed(w_fixed=3.0)} if driven else {}
    parts = {**source, "rotor": Inertia(J=1.0), "friction": BearingFriction(tau_pos=((0, 1), (10, 2)))}
    flat = flatten(Assembly("drive", parts=parts, series={"shaft": list(parts)}))
    assert flat.flags
    reduced = reduce(flat)
    assert reduced.flat.flags == ()
    everything = ca.vertcat(reduced.ode, reduced.alg, reduced.values)
    assert not ca.depends_on(everything, ca.vertcat(flat.time, *(symbol for symbol, _ in flat.flags)))


def test_flags_stay_open_where_parameters_decide_the_structure() -> None:
    """Without inertia the fan has no state; the mesh still asks whether the motor prescribes the speed."""
    parts = {
        "motor": ConstantSpeed(w_fixed=150.0),
        "gear": LossyGear(ratio=3.0, loss_table=((0, 0.96, 0.95, 0, 0),)),
        "shaft": SpringDamper(c=1e5, d=200.0, phi_rel=0.0),
        "impeller": Inertia(J=0.0),
        "fan": LinearSpeedDependentTorque(tau_nominal=-40.0, w_nominal=50.0),
    }
    run = simulate(Assembly("drive", parts=parts, series={"drive": list(parts)}), 0.5)
    assert run["fan.w"][-1] == pytest.approx(50.0, rel=1e-9)  # against c = 1e5, d = 200 the fan has long settled
    assert run["gear.flange_a.tau"][-1] == pytest.approx(40.0 / 3 / 0.96, rel=1e-9)
