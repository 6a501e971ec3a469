"""Tables of structural fields: every wrong shape and every wrong cell, and the sentence that tells it."""

import pytest

from components import BooleanTable, Clutch, CombiTable, FlexibleShaft, LossyGear, ShiftSchedule, Table
from modelica_like.errors import (
    LanguageError,
    ModelicaLikeError,
    NetlistError,
    UnitError,
    ValueOutOfRange,
)
from modelica_like.netlist import loads

ROW = "[slip speed in rad/s, sliding friction coefficient]"
WRONG: dict[str, tuple[type[ModelicaLikeError], str]] = {
    "[]": (NetlistError, f"Clutch.mu_pos = [] must be a list of rows {ROW}."),
    "3": (NetlistError, f"Clutch.mu_pos = 3 must be a list of rows {ROW}."),
    "'x'": (NetlistError, f"Clutch.mu_pos = 'x' must be a list of rows {ROW}."),
    "{a = 1}": (NetlistError, f"Clutch.mu_pos = {{'a': 1}} must be a list of rows {ROW}."),
    "[3]": (NetlistError, f"Clutch.mu_pos, row 1: 3 must be {ROW}."),
    "[[0]]": (NetlistError, f"Clutch.mu_pos, row 1: [0] must be {ROW}."),
    "[[0, 1], [1, 1, 1]]": (NetlistError, f"Clutch.mu_pos, row 2: [1, 1, 1] must be {ROW}."),
    "[[0, [1]]]": (NetlistError, "Clutch.mu_pos, row 1, sliding friction coefficient: [1] must be a number."),
    "[[true, 1]]": (NetlistError, "Clutch.mu_pos, row 1, slip speed: True must be a number or a quantity in rad/s."),
    "[['2 m', 1]]": (UnitError, "Clutch.mu_pos, row 1, slip speed expects rad/s; '2 m' is m."),
    "[[nan, 1]]": (ValueOutOfRange, "Clutch.mu_pos, row 1, slip speed must be a finite number, not nan."),
    "[[1, 1], [1, 2]]": (
        NetlistError, "Clutch.mu_pos, row 2: the slip speed 1 is not above 1, that of the row before."
    ),
}  # fmt: skip


@pytest.mark.parametrize("given", WRONG)
def test_a_wrong_table_is_told_with_shape_unit_and_line(given: str) -> None:
    text = f'[parts]\nk = {{ is = "Clutch", mu_pos = {given} }}\n'
    with pytest.raises(ModelicaLikeError) as caught:
        loads(text, "bad.toml")
    kind, told = WRONG[given]
    assert type(caught.value) is kind
    assert str(caught.value).startswith(f'{told}\n  in bad.toml:2 `k = {{ is = "Clutch", mu_pos = {given} }}`')


PYTHON = {
    "a value with a unit where the scale has it": (NetlistError, lambda: Table(table=[(0, "5 N.m")]), """\
Table.table, row 1, value: '5 N.m' must be a number."""),
    "a list of rows for a flat one": (NetlistError, lambda: BooleanTable(times=[[0, 1]]), """\
BooleanTable.times, row 1, time of a change: [0, 1] must be a number or a quantity in s."""),
    "rows of different lengths": (NetlistError, lambda: CombiTable(table=[(0, 1, 2), (1, 2)]), """\
CombiTable.table, row 2: [1, 2] must be [time in s, value, …]."""),
    "a number for a text": (NetlistError, lambda: ShiftSchedule(shifts=[(0, 1, 0)]), """\
ShiftSchedule.shifts, row 1, gear: 1 must be a text."""),
    "five columns": (NetlistError, lambda: LossyGear(loss_table=[(0, 1)]), """\
LossyGear.loss_table, row 1: [0, 1] must be \
[speed |w_a| in rad/s, eta_mf1, eta_mf2, |tau_bf1| in N.m, |tau_bf2| in N.m]."""),
    "more out than in": (ValueOutOfRange, lambda: LossyGear(loss_table=[(0, 1.5, 0.9, 0, 0)]), """\
LossyGear.loss_table, row 1, eta_mf1: 1.5 is above 1."""),
    "more out than in, the other way": (ValueOutOfRange, lambda: LossyGear(loss_table=[(0, 0.9, 1.5, 0, 0)]), """\
LossyGear.loss_table, row 1, eta_mf2: 1.5 is above 1."""),
    "quantities and a scale": (NetlistError, lambda: Clutch(mu_pos=[("1 rpm", 1)], w_scale=2), """\
Clutch.mu_pos has quantities, but w_scale scales plain numbers.
Write numbers and w_scale, or quantities without w_scale."""),
    "no piece": (LanguageError, lambda: FlexibleShaft(n=0), "A flexible shaft has at least one piece, not 0."),
}  # fmt: skip


@pytest.mark.parametrize("name", PYTHON)
def test_in_python(name: str) -> None:
    kind, make, told = PYTHON[name]
    with pytest.raises(kind) as caught:
        make()
    what, *rest = told.split("\n")
    assert caught.value.what == what
    assert caught.value.advice == "\n".join(rest)


LONG = "9" * 401
NUMBERS = {
    f"J = {LONG}": "Inertia.J is too large for a number.",
    f"J = {'9' * 5000}": "A number has more than 4300 digits.",
    f"J = '{'9' * 600} kg.m2'": f"Inertia.J must be a finite number, not {'9' * 160}… kg.m2.",
    "count = 100000000": "parts.k: count = 100000000 must be a whole number from 1 to 100000.",
}


@pytest.mark.parametrize("given", NUMBERS)
def test_endless_numbers(given: str) -> None:
    with pytest.raises(ModelicaLikeError) as caught:
        loads(f'[parts]\nk = {{ is = "Inertia", {given} }}\n', "bad.toml")
    assert caught.value.what == NUMBERS[given]
    assert "  in bad.toml:2 `k = " in str(caught.value)


def test_the_limit_on_parts_holds_before_they_are_made() -> None:
    with pytest.raises(NetlistError) as caught:
        loads('[parts]\nk = { is = "FlexibleShaft", n = 100_000_000 }\n', "bad.toml")
    assert caught.value.what == "FlexibleShaft.n is larger than 100000; no drive has that many parts."


@pytest.mark.parametrize("text", ["[]\n[]\n", "= 1\n= 1\n", "[]\n[parts]\n[]\n"])
def test_headers_without_a_name(text: str) -> None:
    with pytest.raises(NetlistError, match="is not TOML: "):
        loads(text, "bad.toml")
