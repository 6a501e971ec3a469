"""The standard library's examples from its own text, against trajectories that others computed."""

import time

import pytest
from library_examples import MISSING, examples, run_example
from library_references import LIBRARY

from modelica_like.netlist.modelica.parse import parse_modelica

pytestmark = pytest.mark.skipif(not LIBRARY.is_dir(), reason="the standard library's text is not here")
MECHANICS = ("Modelica.Mechanics.", "ModelicaTest.Rotational.", "ModelicaTest.Translational.")


def _check(name: str) -> None:
    outcome = run_example(name)
    assert outcome.kind == ("refused" if name in MISSING else "right"), outcome.words


@pytest.mark.parametrize("name", [name for name in examples() if name.startswith(MECHANICS)])
def test_mechanics(name: str) -> None:
    _check(name)


@pytest.mark.slow  # 200 examples: two minutes
@pytest.mark.parametrize("name", [name for name in examples() if not name.startswith(MECHANICS)])
def test_other_packages(name: str) -> None:
    _check(name)


def test_what_is_missing_is_an_example() -> None:
    assert set(MISSING) <= set(examples())


def test_every_file_of_the_library_is_read() -> None:
    files = sorted(LIBRARY.rglob("*.mo"))
    begin = time.process_time()
    classes = [parse_modelica(file.read_text(encoding="utf-8"), str(file)) for file in files]
    assert time.process_time() - begin < 10  # 2 s of CPU
    assert len(classes) == len(files) > 1900
