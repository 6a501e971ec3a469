"""Tables with quantities are those of numbers in SI units, in equations, netlists and the JSON schema."""

import json
import math
from pathlib import Path

import jsonschema
import pytest

from components import BearingFriction, Clutch, LossyGear, Table
from modelica_like import load, simulate
from modelica_like.netlist import loads, schema
from modelica_like.netlist.write import dumps


def test_quantities_are_numbers_in_si_units() -> None:
    given = Clutch(mu_pos=[["0 rpm", 0.14], ["60 rpm", "10 %"], [50, 0.08]])
    assert given.mu_pos == ((0.0, 0.14), (pytest.approx(2 * math.pi), pytest.approx(0.1)), (50.0, 0.08))
    assert BearingFriction(tau_pos=[(0, "2 N.m"), ("1 rad/s", 3)]).tau_pos == ((0.0, 2.0), (1.0, 3.0))
    gear = LossyGear(loss_table=[(0, 0.9, "80 %", "10 N.cm", 0)])
    assert gear.loss_table == ((0.0, 0.9, pytest.approx(0.8), pytest.approx(0.1), 0.0),)
    assert Table(table=[("0 s", 1), ("1 min", 2)]).table == ((0.0, 1.0), (60.0, 2.0))


DRIVE = """
[parts]
torque = { is = "ConstantTorque", tau_constant = 0 }
bearing = { is = "BearingFriction", tau_pos = %s }
rotor = { is = "Inertia", J = 1, phi = 0, w = 100 }
[series]
shaft = ["torque", "bearing", "rotor"]
[simulate]
until = "1 s"
"""


def test_the_run_is_the_same() -> None:
    """tau = 1 N·m + w·(2 N·m)/(100 rad/s): w' = -(1 + w/50), w = -50 + 150·exp(-t/50)."""
    exact = -50 + 150 * math.exp(-1 / 50)
    for rows in ("[[0, 1], [100, 3]]", '[["0 rpm", "1 N.m"], ["100 rad/s", "300 N.cm"]]'):
        assert simulate(loads(DRIVE % rows, "drive.toml")).final["rotor.w"] == pytest.approx(exact, rel=1e-6)


def test_a_netlist_keeps_quantities(tmp_path: Path) -> None:
    text = dumps(loads(DRIVE % '[["0 rpm", "1 N.m"], [100, 3]]', "drive.toml"))
    assert '[["0 rpm", "1 N.m"], [100, 3]]' in text
    (tmp_path / "again.toml").write_text(text)
    assert dumps(load(tmp_path / "again.toml")) == text


def test_the_schema_knows_rows() -> None:
    known = schema()
    rows = known["definitions"]["Clutch"]["properties"]["mu_pos"] | {
        key: known[key] for key in ("$schema", "definitions")
    }
    json.dumps(known)
    validator = jsonschema.Draft7Validator(rows)
    for right in ([[0, 0.1]], [["0 rad/s", 0.1], ["5 rad/s", "10 %"]]):
        assert validator.is_valid(right)
    for wrong in ([], 3, [[0]], [[0, 1, 2]], [[0, [1]]], [[0, True]], {"a": 1}):
        assert not validator.is_valid(wrong)
