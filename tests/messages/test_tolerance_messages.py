"""What is said where tolerances are not asked for rightly."""

from collections.abc import Callable
from pathlib import Path

import pytest

from modelica_like import tolerance
from modelica_like.errors import ModelicaLikeError, NetlistError, UnitError, UnknownName, ValueOutOfRange
from modelica_like.netlist import loads

D = Path(__file__).parents[2] / "examples" / "machine_table_direct.toml"
ZERO = """
[parts]
load = { is = "ConstantTorque", tau_constant = "0 N.m" }
wheel = { is = "Inertia", J = "1 kg.m2", phi = 0, w = 0 }
[connect]
a = ["load.flange", "wheel.flange_a"]
[simulate]
until = "1 s"
"""
PAIR = {"clutch.capacity": "±10 %", "load_torque": "±10 %"}
THREE = {**PAIR, "lead": "±1 %"}
CALLS: dict[str, tuple[type[ModelicaLikeError], Callable[[], object], str]] = {
    "nothing scatters": (
        ValueOutOfRange,
        lambda: tolerance(D, "clutch.tau", {}),
        """Nothing scatters.
  in machine_table_direct.toml
Give parameters with their tolerances: { "clutch.mu_static" = "±10 %" }.""",
    ),
    "a name": (
        UnknownName,
        lambda: tolerance(D, "clutch.tau", {"clutch.capacty": "±10 %"}),
        """machine_table_direct has no parameter 'clutch.capacty'; did you mean 'clutch.capacity'?
  in machine_table_direct.toml""",
    ),
    "a text that says nothing": (
        ValueOutOfRange,
        lambda: tolerance(D, "clutch.tau", {"clutch.capacity": "about 10 %"}),
        """clutch.capacity: 'about 10 %' says nothing about how it scatters.
  in machine_table_direct.toml
Write one of ±10 %, ±0.5 N.m, normal(20 N.m, 1 N.m), normal(5 %), uniform(18 N.m, 22 N.m), measured.csv.""",
    ),
    "the unit": (
        UnitError,
        lambda: tolerance(D, "clutch.tau", {"clutch.capacity": "±1 kg"}),
        """clutch.capacity expects N.m; '1 kg' is kg.
  in machine_table_direct.toml""",
    ),
    "no width": (
        ValueOutOfRange,
        lambda: tolerance(D, "clutch.tau", {"clutch.capacity": "±0 N.m"}),
        """clutch.capacity: 0 N.m is not positive.
  in machine_table_direct.toml
Give a positive tolerance in the parameter's unit.""",
    ),
    "per cent of nothing": (
        ValueOutOfRange,
        lambda: tolerance(loads(ZERO), "wheel.w", {"load.tau_constant": "±10 %"}),
        """load.tau_constant is 0, and per cent of it are nothing.
  in netlist.toml
Give a positive tolerance in the parameter's unit.""",
    ),
    "values of a distribution": (
        ValueOutOfRange,
        lambda: tolerance(D, "clutch.tau", {"clutch.capacity": "uniform(10 N.m)"}),
        """clutch.capacity: uniform(10 N.m) has not the values that it needs.
  in machine_table_direct.toml
Write one of ±10 %, ±0.5 N.m, normal(20 N.m, 1 N.m), normal(5 %), uniform(18 N.m, 22 N.m), measured.csv.""",
    ),
    "bounds the wrong way round": (
        ValueOutOfRange,
        lambda: tolerance(D, "clutch.tau", {"clutch.capacity": "uniform(20 N.m, 10 N.m)"}),
        """clutch.capacity: the lower bound 20 is not below the upper bound 10.
  in machine_table_direct.toml""",
    ),
    "no file": (
        NetlistError,
        lambda: tolerance(D, "clutch.tau", {"clutch.capacity": "no_such_file.csv"}),
        """clutch.capacity: the measured values in 'no_such_file.csv' cannot be read: No such file or directory.
  in machine_table_direct.toml""",
    ),
    "no output": (
        ValueOutOfRange,
        lambda: tolerance(D, (), {"clutch.capacity": "±10 %"}),
        """There is no output: give at least one name.""",
    ),
    "the precision": (
        ValueOutOfRange,
        lambda: tolerance(D, "clutch.tau", {"clutch.capacity": "±10 %"}, precision=2.0),
        """The precision must be between 0 and 1, and the runs at least 2048: they are 2 and 100000.""",
    ),
    "correlated with nothing": (
        UnknownName,
        lambda: tolerance(
            D, "clutch.tau", {"clutch.capacity": "±10 %"}, correlated=[{"of": ["clutch.capacity", "lead"], "rho": 0.5}]
        ),
        """correlated: 'lead' does not scatter.
  in machine_table_direct.toml""",
    ),
    "no correlation": (
        ValueOutOfRange,
        lambda: tolerance(
            D,
            "clutch.tau",
            {"clutch.capacity": "±10 %", "lead": "±1 %"},
            correlated=[{"of": ["clutch.capacity", "lead"], "rho": 1.5}],
        ),
        """correlated needs at least two parameters `of`, and `rho` between -1 and 1.
  in machine_table_direct.toml
Write { of = ["shaft1.c", "shaft2.c"], rho = 0.8 }.""",
    ),
    "correlations that contradict each other": (
        ValueOutOfRange,
        lambda: tolerance(D, "clutch.tau", THREE, correlated=[{"of": list(THREE), "rho": -0.9}]),
        """The correlations contradict each other.
  in machine_table_direct.toml
Use smaller ones.""",
    ),
    "shares of what is correlated": (
        ValueOutOfRange,
        lambda: tolerance(D, "clutch.tau", PAIR, correlated=[{"of": list(PAIR), "rho": 0.5}], shares=True),
        """Shares of the variance are defined for parameters that are independent.
Leave out `shares`.""",
    ),
    "a limit with a probability": (
        ValueOutOfRange,
        lambda: tolerance(D, (), {"lead": "±1 %"}, subject_to="P(clutch.lock_time <= 0.4 s) >= 99 %"),
        """'P(clutch.lock_time <= 0.4 s) >= 99 %' asks for a probability, which is the answer here.
Write the limit alone.""",
    ),
    "no text in a netlist": (
        NetlistError,
        lambda: tolerance(loads(ZERO + '[tolerances]\n"wheel.J" = 3\n'), "wheel.w"),
        """tolerances.wheel.J must be a text.
  in netlist.toml:9 `[tolerances]`
Write "±10 %", "normal(20 N.m, 1 N.m)" or "uniform(1, 2)".""",
    ),
    "no list in a netlist": (
        NetlistError,
        lambda: tolerance(loads(ZERO + "[tolerances]\ncorrelated = 3\n"), "wheel.w"),
        """tolerances.correlated must be a list of tables.
  in netlist.toml:9 `[tolerances]`
Write [{ of = ["a", "b"], rho = 0.8 }].""",
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_message(check_message: Callable[..., None], name: str) -> None:
    check_message(*CALLS[name])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("torque,N.m\nx\n", "clutch.capacity: 'values.csv' has no column of numbers."),
        ("torque,kg\n1\n2\n", "clutch.capacity: 'values.csv' has no column of numbers."),
        ("5\n5\n", "clutch.capacity: 'values.csv' has no scatter."),
    ],
)
def test_files_of_measured_values(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "values.csv").write_text(text)
    (tmp_path / "drive.toml").write_text(D.read_text().replace('sizing = "sizing/machine_table.toml"\n', ""))
    with pytest.raises(ModelicaLikeError) as caught:
        tolerance(tmp_path / "drive.toml", "clutch.tau", {"clutch.capacity": "values.csv"})
    assert caught.value.what == message
