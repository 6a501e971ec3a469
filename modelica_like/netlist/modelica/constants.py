"""Constants of classes: which class around or imported has one, and the instance that gives its value."""

from __future__ import annotations

from modelica_like.netlist.modelica.classes import Classes
from modelica_like.netlist.modelica.instance import Given, Instance
from modelica_like.netlist.modelica.tree import ClassText, Declaration, Extends, Import


def holder_of(classes: Classes, text: ClassText) -> Instance:
    """Return the instance of a class for its constants."""
    if id(text) not in classes.holders:
        classes.holders[id(text)] = Instance(classes, text, Given())
    return classes.holders[id(text)]


def around(classes: Classes, text: ClassText, name: str, *, itself: bool) -> ClassText | None:
    """Return the class around one that has a constant; packages have those of their bases, too.

    Args:
        classes: finds classes.
        text: the class that names the constant.
        name: of the constant.
        itself: whether the class is one of those that may have it.
    """
    level = text if itself else classes.around(text)
    if text.heir is not None and name in holder_of(classes, text.heir).members:
        return text.heir
    while level is not None:
        if any(isinstance(element, Declaration) and element.name == name for element in level.elements):
            return level
        inherits = level.kind == "package" and any(isinstance(element, Extends) for element in level.elements)
        if inherits and name in holder_of(classes, level).members:
            return level
        level = classes.around(level)
    return None


def imported(classes: Classes, text: ClassText, name: str) -> ClassText | None:
    """Return the package of a constant that is imported by its own name."""
    level: ClassText | None = text
    while level is not None:
        for element in level.elements:
            if isinstance(element, Import) and {name, "*"} & {element.alias, *element.names}:
                path = element.path if {name, "*"} & {*element.names} else element.path.rpartition(".")[0]
                package = classes.full(path)
                known = isinstance(package, ClassText)
                if known and ("*" not in element.names or name in holder_of(classes, package).members):
                    return package
        level = classes.around(level)
    return None
