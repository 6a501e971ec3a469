"""Building a model: what it leaves behind."""

import gc

import pytest

from components import Inertia
from modelica_like import build
from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Assembly


@pytest.mark.parametrize("collects", [True, False])
def test_the_garbage_collector_is_left_as_it_was(collects):
    before = gc.isenabled()
    (gc.enable if collects else gc.disable)()
    try:
        build(Assembly("fine", parts={"mass": Inertia(J=1.0)}, free=["mass.flange_a", "mass.flange_b"]))
        assert gc.isenabled() is collects
        with pytest.raises(ModelicaLikeError):
            build(Assembly("wrong", parts={"mass": Inertia()}))
        assert gc.isenabled() is collects
    finally:
        (gc.enable if before else gc.disable)()
