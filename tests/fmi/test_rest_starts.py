"""Starts of FMUs from rest."""

import pytest

from components import Damper, IdealGear, Inertia, Spring, SpringDamper
from modelica_like.language import Assembly


def drive(coupled):
    """Two inertias, coupled; nothing is said about the second one."""
    parts = {"a": Inertia(J=1.0, phi=0.5, w=-7.7), "e": coupled, "b": Inertia(J=0.3)}
    drive = Assembly("drive", parts=parts, series={"shaft": [*parts]})
    drive.simulate.update(start="rest", until=1.0)
    return drive


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize(("coupled", "w"), [(Damper(d=1.0), 0.0), (SpringDamper(c=200.0, d=1.0), 3.0)])
def test_what_only_a_damper_moves_stands_still(exported, version, coupled, w):
    """b.w is no state: that it is zero behind a damper is an equation for the relative speed."""
    case = exported(drive(coupled), version)
    assert case.model.states == ("a.phi", "a.w", "e.phi_rel", "e.w_rel")
    fmu = case.started("me", **{"a.w": 3.0})
    read = fmu.getReal if version == "2.0" else fmu.getFloat64
    names = ["a.w", "b.w", "e.w_rel", "a.phi", "b.phi", "e.tau"]
    assert read([case.ref(name) for name in names]) == [3.0, w, w - 3.0, 0.5, 0.5, w - 3.0]


@pytest.mark.parametrize("between", [["spring"], ["soft", "gear", "softer"]])
def test_springs_turn_the_other_side_along(exported, between):
    """Without an inertia in between, and where the relative speed of a spring is no variable."""
    parts = {"a": Inertia(J=1.0, w=-7.7), "spring": Spring(c=200.0), "b": Inertia(J=0.3)}
    parts |= {"soft": SpringDamper(c=200.0, d=1.0), "gear": IdealGear(ratio=2.5), "softer": SpringDamper(c=50.0, d=1.0)}
    series = ["a", *between, "b"]
    drive = Assembly("drive", parts={name: parts[name] for name in series}, series={"shaft": series})
    drive.simulate.update(start="rest", until=1.0)
    case = exported(drive, "3.0")
    fmu = case.started("me", **{"a.w": 3.0})
    ratio = 2.5 if "gear" in between else 1.0
    assert fmu.getFloat64([case.ref(name) for name in ("a.w", "b.w")]) == pytest.approx([3.0, 3.0 / ratio], rel=1e-12)
