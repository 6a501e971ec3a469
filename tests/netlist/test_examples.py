"""Every netlist of the examples reads, fits the schema, and is written back without loss."""

import tomllib
from pathlib import Path

import jsonschema
import pytest
from some import some

from modelica_like.language.inside import declarations, inside
from modelica_like.netlist import dumps, load, loads, schema

EXAMPLES = sorted(
    path
    for path in (Path(__file__).parents[2] / "examples").rglob("*.toml")
    if not {"sizing", "cosim"} & set(path.parts)
)


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft7Validator:
    jsonschema.Draft7Validator.check_schema(schema())
    return jsonschema.Draft7Validator(schema())


@pytest.mark.parametrize("path", some(EXAMPLES, lambda path: path.stem))
def test_example_is_read_and_written_without_loss(path: Path, validator: jsonschema.Draft7Validator) -> None:
    original = load(path)
    text = dumps(original, folder=path.parent)
    again = loads(text, str(path.parent / "again.toml"))
    assert dumps(again, folder=path.parent) == text
    assert [part.path for part in again.walk()] == [part.path for part in original.walk()]
    for ours, theirs in zip(again.walk(), original.walk(), strict=True):
        assert type(ours) is type(theirs)
        assert inside(ours).values == inside(theirs).values
        assert inside(ours).starts == inside(theirs).starts
        assert inside(ours).start_modes == inside(theirs).start_modes
        assert all(getattr(ours, key) == getattr(theirs, key) for key in declarations(ours).structural)
    assert (again.wires, again.chains, again.free_ends) == (original.wires, original.chains, original.free_ends)
    assert again.simulate == original.simulate
    validator.validate(tomllib.loads(path.read_text(encoding="utf-8")))
    validator.validate(tomllib.loads(text))
