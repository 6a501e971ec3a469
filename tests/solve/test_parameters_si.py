"""New parameter values of a compiled model."""

import pytest

from components import Inertia
from modelica_like import build
from modelica_like.language import Assembly


def test_plain_numbers_are_si_whatever_unit_the_netlist_uses() -> None:
    parts = {"disc": Inertia(J="J", phi=0, w=0)}
    model = build(Assembly("bench", parts=parts, parameters={"J": "1182.6 kg.mm2", "n": 3}))
    position = model.parameter_position["J"]
    assert model.p[position] == pytest.approx(1182.6e-6, rel=1e-12)
    assert model.with_parameters({"J": 2e-3}).p[position] == 2e-3
    assert model.with_parameters({"J": "900 kg.mm2"}).p[position] == pytest.approx(9e-4, rel=1e-12)
    assert model.with_parameters({"n": 4}).p[model.parameter_position["n"]] == 4.0
