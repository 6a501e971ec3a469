"""Every example that can be written as Modelica text is read by this package, and is Modelica to another compiler."""

from pathlib import Path

import pytest
import rumoca

from modelica_like import load
from modelica_like.errors import ModelicaTextError, NetlistError
from modelica_like.netlist import loads
from modelica_like.netlist.modelica.read import read_modelica
from modelica_like.netlist.modelica.write import modelica_text

EXAMPLES = Path(__file__).parents[2] / "examples"
NETLISTS = [path for path in sorted(EXAMPLES.rglob("*.toml")) if "[parts" in path.read_text(encoding="utf-8")]
WRITTEN = 80
"""At least; the others have parts without a counterpart in Modelica, each told with its name."""


def errors(text: str) -> list[str]:
    return [one.message for one in rumoca.validate_source(text) if one.level == "error"]


def test_another_compiler_refuses_what_is_no_modelica() -> None:
    assert errors("model A\n  Real end;\nend A;\n")
    assert errors("model A\n  Real x[1];\n  Real x[2];\nend A;\n")
    assert errors("model A\n  Real 'end';\nequation\n  'end' = 1;\nend A;\n") == []


@pytest.mark.slow
def test_the_text_of_every_example_is_read(tmp_path: Path) -> None:
    written = 0
    for path in NETLISTS:
        try:
            drive = load(path, trust=True)
            text = modelica_text(drive)
        except (ModelicaTextError, NetlistError):
            continue
        written += 1
        (tmp_path / "drive.mo").write_text(text, encoding="utf-8")
        model, _ = read_modelica(tmp_path / "drive.mo")
        assert list(model.parts) == list(drive.parts), path
        assert errors(text) == [], path
    assert written >= WRITTEN


RESERVED = """
[parts]
when = { is = "Inertia", J = 1, phi = 0, w = 2 }
end = { is = "Damper", d = 1 }
algorithm = { is = "Fixed" }
table = { is = "Table", table = [[0, 0], [1, 3]] }
loop = { is = "Torque" }
[connect]
a = ["when.flange_b", "end.flange_a"]
b = ["end.flange_b", "algorithm.flange"]
c = ["table.y", "loop.tau"]
d = ["loop.flange", "when.flange_a"]
[simulate]
until = 1
"""


def test_reserved_words_are_written_in_quotes(tmp_path: Path) -> None:
    text = modelica_text(loads(RESERVED, str(tmp_path / "drive.toml")))
    assert errors(text) == []
    assert "Inertia 'when'(" in text
    (tmp_path / "drive.mo").write_text(text)
    model, _ = read_modelica(tmp_path / "drive.mo")
    assert {"when", "end", "loop", "algorithm"} <= model.parts.keys()
