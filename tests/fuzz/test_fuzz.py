"""No input ends in anything but a sentence; what the fuzzer has found stays found."""

from collections.abc import Callable
from pathlib import Path

import pytest
from fuzzer import attempt

from modelica_like import simulate
from modelica_like.errors import ModelicaLikeError
from modelica_like.netlist import loads
from modelica_like.netlist.write import dumps

BATCHES = 6
INPUTS = 3000


@pytest.mark.parametrize("batch", range(BATCHES))
def test_mutated_inputs_are_told(batch: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    size = INPUTS // BATCHES
    crashes = [crash for number in range(batch * size, (batch + 1) * size) if (crash := attempt(number))]
    assert crashes == []
    assert list(tmp_path.iterdir()) == []


WHEEL = '[parts]\nk = { is = "Inertia", J = 1, phi = 0, w = 0 }\n'
FOUND: dict[str, tuple[Callable[[], object], str]] = {
    "a replaced part whose type is a number": (
        lambda: loads('[parts]\nk = { is = "Inertia", J = { is = 1 } }\n'),
        "parts.k.J has no type.",
    ),
    "a mode that is a time of day": (
        lambda: loads('[parts]\nk = { is = "ElastoBacklash", flanks = 07:32:00 }\n'),
        "ElastoBacklash.flanks has no mode '07:32:00'. It has pressed, meeting, leaving.",
    ),
    "a mode that is a list": (
        lambda: loads('[parts]\nk = { is = "P", y_max = 1, limit = [["0 rad/s", 0.1]] }\n'),
        "P.limit has no mode '[['0 rad/s', 0.1]]'. It has",
    ),
    "a formula that is a number": (
        lambda: loads('[parts]\nk = { is = "TimeFormula", formula = -0.0 }\n'),
        "TimeFormula.formula = -0.0 must be a text.",
    ),
    "a run shorter than times": (
        lambda: simulate(loads(WHEEL), 5e-324),
        "A run of 4.94066e-324 s is too short: no times can be told apart in it.",
    ),
}


@pytest.mark.parametrize("name", FOUND)
def test_found_by_the_fuzzer(name: str) -> None:
    act, told = FOUND[name]
    with pytest.raises(ModelicaLikeError) as caught:
        act()
    assert caught.value.what.startswith(told)


@pytest.mark.parametrize("name", ["description", "simulate", "origin"])
def test_a_part_may_be_called_like_an_entry_of_the_file(name: str) -> None:
    """It was written as the description of the netlist."""
    drive = loads(f'description = "two"\n[parts]\n{name} = {{ is = "Fixed" }}\n[simulate]\nuntil = 1\n')
    again = loads(dumps(drive))
    assert list(again.parts) == [name]
    assert dumps(again) == dumps(drive)
    assert 'description = "two"' in dumps(again)
