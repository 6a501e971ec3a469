"""Reading Modelica text: `load("drive.mo")`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from modelica_like.errors import ModelicaLikeError, ModelicaTextError
from modelica_like.language.inside import inside
from modelica_like.netlist.modelica.build import build_component
from modelica_like.netlist.modelica.buses import join_buses
from modelica_like.netlist.modelica.classes import Classes, given_libraries
from modelica_like.netlist.modelica.instance import Given, Instance, Member
from modelica_like.netlist.modelica.library import Known
from modelica_like.netlist.modelica.tree import ClassText
from modelica_like.netlist.modelica.values import Notes
from modelica_like.netlist.modelica.written import Written


def load_modelica(path: str | Path) -> Written:
    """Read a model from a Modelica file.

    Args:
        path: a `.mo` file, or a class in it: `drive.mo:Rotor`; by default the last model of the file.

    Raises:
        NetlistError: the file cannot be read.
        ModelicaTextError: it is not Modelica, or uses what is not supported.
    """
    file, dot, name = str(path).rpartition(".mo:")
    return read_modelica(Path(f"{file}.mo"), name)[0] if dot else read_modelica(Path(path))[0]


def read_modelica(path: Path, name: str = "", *, table: bool = True) -> tuple[Written, list[str]]:
    """Read a model, and what its reader should know; see `load_modelica`.

    Args:
        path: of the text.
        name: of the class.
        table: whether components stand for classes of the standard library; without, its own text is needed.
    """
    classes = Classes(path, table=table)
    text = classes.chosen(name)
    component, notes = _built(classes, text)
    # A variable whose start value is not fixed starts at the start value of its class, which is zero.
    names = {"from": "StartTime", "until": "StopTime"}
    times = {key: text.experiment[name] for key, name in names.items() if name in text.experiment}
    if times.get("from") == 0.0:
        del times["from"]
    settings = {key: f"{time:g} s" for key, time in times.items()} | {"start": "rest", "on_chattering": "rest"}
    inside(component).simulate, inside(component).display = settings, notes.display
    if given := given_libraries():
        inside(component).libraries = {"libraries": [str(place.resolve()) for place in given]}
    for part in component.walk():
        if isinstance(part, Written):
            inside(part).origin = f"{path.resolve()}:{inside(part).text}"
    return component, [*notes.told, *inside(component).remarks]


def _built(classes: Classes, text: ClassText) -> tuple[Written, Notes]:
    """Return the component of a class.

    A part that a component of ours cannot be is read from its class's own text, and an `outer` part without an `inner`
    one above it has one in the class that is read, with the values of its class.
    """
    inner: dict[str, Member] = {}
    while True:
        notes, untabled = Notes(), set(classes.untabled)
        try:
            instance = Instance(classes, text, Given())
            instance.members |= {name: member for name, member in inner.items() if name not in instance.members}
            join_buses(instance)
            component = build_component(instance, notes)
            told = (
                f"There is no inner {name}: a {m.declaration.type} with its own values is taken."
                for name, m in inner.items()
            )
            inside(component).remarks = tuple(told)
            return component, notes
        except RecursionError:
            raise ModelicaTextError(
                "Classes, functions or formulas are nested too deeply.", where=text.place(text.line)
            ) from None
        except ModelicaLikeError:
            classes.untabled |= {part for part, path in classes.lacking.items() if classes.text_of(path) is not None}
            lacking = {
                name for name, member in classes.missing.items() if name not in inner and _is_whole(classes, member)
            }
            for name in lacking:
                member = classes.missing[name]
                declaration = replace(member.declaration, prefixes=frozenset({"inner"}))
                inner[name] = Member(declaration, member.text, Given())
            if (classes.untabled == untabled and not lacking) or classes.spent:
                raise


def _is_whole(classes: Classes, member: Member) -> bool:
    """Tell whether a class can be a part as it is."""
    kind = classes.find(member.declaration.type, member.text)
    parts = isinstance(kind, ClassText) and not kind.partial and kind.kind in ("model", "block", "class", "record")
    return (parts or isinstance(kind, Known)) and not member.declaration.dimensions
