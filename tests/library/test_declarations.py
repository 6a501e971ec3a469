"""Names, units, defaults and limits of all components are what users' netlists rely on; a change of one is a decision.

`python tests/library/test_declarations.py` writes the list anew.
"""

from collections.abc import Iterator
from pathlib import Path

from modelica_like.netlist import library_types

LIST = Path(__file__).with_name("declarations.txt")
SHOWN = ("unit_text", "default", "min", "max", "above", "nominal", "guess", "state", "tunable")


def declarations() -> Iterator[str]:
    """One line for each declaration of each component, inherited ones included."""
    for name, kind in sorted(library_types().items()):
        yield name
        for field in kind._class_fields.values():
            about = (f"{what} {getattr(field, what)}" for what in SHOWN if getattr(field, what, None) is not None)
            yield f"  {field.name}: {type(field).__name__}, {', '.join(about)}"
        yield from (f"  {field} = {_told(default)}" for field, default in kind._structural.items())
        yield from (f"  {mode}: {' '.join(one.names)}" for mode, one in kind._class_modes.items())


def _told(default: object) -> str:
    return "required" if type(default) is object else repr(default)


def test_declarations_are_what_netlists_rely_on() -> None:
    known, found = LIST.read_text(encoding="utf-8").splitlines(), list(declarations())
    changed = [f"- {line}" for line in known if line not in set(found)]
    changed += [f"+ {line}" for line in found if line not in set(known)]
    assert changed == []
    assert known == found


if __name__ == "__main__":
    LIST.write_text("\n".join(declarations()) + "\n", encoding="utf-8")
