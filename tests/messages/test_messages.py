"""Every error has a snapshot in this folder, and names its source shortly."""

import re
from pathlib import Path

import modelica_like.errors as errors
from modelica_like.errors import ModelicaLikeError

HERE = Path(__file__)


def test_every_error_has_a_snapshot():
    """In a neighbouring file, which names the error in a test and not only where it imports it."""
    bases = {errors.ModelicaLikeError, errors.SolveError}  # never raised themselves
    every = {kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, ModelicaLikeError)}
    elsewhere = "".join(file.read_text() for file in HERE.parent.glob("test_*.py") if file != HERE)
    told = {kind for kind in every if re.search(rf"\(\s*(errors\.)?{kind.__name__}\b", elsewhere)}
    assert every - told - bases == set()


def test_a_source_is_told_shortly():
    assert str(errors.Source("/home/me/gears.py", 31, "yield a == b")) == "gears.py:31 `yield a == b`"
    assert str(errors.Source("drive.toml", 3)) == "drive.toml:3"
    assert str(errors.Source("drive.toml")) == "drive.toml"
    long = str(errors.Source("x.py", 1, "yield " + "a + " * 100))
    assert len(long) == len("x.py:1 ``") + 160
    assert long.endswith("…`")
