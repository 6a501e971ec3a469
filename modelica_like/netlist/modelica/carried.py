"""Connections of truth values between written components: beside the number, the value itself, in the same instant.

A signal is a number that holds between events. What a class concludes from it comes a round later than the value of
which the number is made, and a value that is true for an instant only is never seen in it.
"""

from __future__ import annotations

from dataclasses import dataclass

from modelica_like.errors import Source
from modelica_like.language import Component, boolean
from modelica_like.language.assembly import declare
from modelica_like.language.fields import Discrete, Input, Output
from modelica_like.language.inside import inside
from modelica_like.netlist.modelica.instance import Instance
from modelica_like.netlist.modelica.signals import Equation, kept, own_signal, taken
from modelica_like.netlist.modelica.tree import Expr
from modelica_like.netlist.modelica.wiring import Wire
from modelica_like.netlist.modelica.written import MEMORY, Written


@dataclass
class Carried:
    """Equations between truth values that connections carry.

    Args:
        component: with its parts.
        instance: it is made of.

    Attributes:
        equations: of the component.
        reached: ends that have the value itself.
        instants: own ends among them whose value is true for instants only.
    """

    component: Written
    instance: Instance

    def __post_init__(self) -> None:
        self.equations: list[Equation] = []
        self.reached: set[str] = set()
        self.instants: set[str] = set()

    def along(self, wire: Wire) -> None:
        """Give the ends of a connection the value of the one that drives them, if that is a truth value."""
        source = next((end for end in wire.ends if self._drives(end)), "")
        for end in wire.ends if source else ():
            if end != source and self._takes(end, wire.source):
                if self._is_instant(source) and "." not in end:
                    self.instants.add(end)
                self.equations.append((kept(end), Expr("condition", kept(source).args), wire.source))
                self.reached |= {end, source}

    def _at(self, end: str) -> tuple[Written | None, str]:
        """Return the component that has a signal, None if it is not a written one, and the name in it."""
        path, _, name = end.rpartition(".")
        part: Component | None = self.component
        for head in path.split(".") if path else ():
            part = part.parts.get(head) if part is not None else None
        return part if isinstance(part, Written) else None, name

    def _is_instant(self, source: str) -> bool:
        part, name = self._at(source)
        return part is not None and name in (inside(part).instants if part is not self.component else self.instants)

    def _drives(self, end: str) -> bool:
        part, name = self._at(end)
        field = part.fields.get(name) if part is not None else None
        if part is None or field is None:
            return False
        if part is not self.component:
            return isinstance(field, Output) and self._remembers(part, name)
        own = own_signal(self.instance, name)
        if own is None or own[1].kind != "Boolean" or not isinstance(field, Input):
            return False
        if f"{name}{MEMORY}" not in part.fields:
            declare(part, f"{name}{MEMORY}", boolean(field.description))
            place = own[0].text.place(own[0].declaration.line)
            self.equations.append((kept(name), taken(name, own[1]), place))
        return True

    def _remembers(self, part: Written, name: str) -> bool:
        memory = part.fields.get(f"{name}{MEMORY}")
        return isinstance(memory, Discrete) and memory.kind == "boolean"

    def _takes(self, end: str, source: Source) -> bool:
        """Let an end have the value itself; what it concluded from the number goes."""
        part, name = self._at(end)
        field = part.fields.get(name) if part is not None else None
        own = part is self.component
        if part is None or not isinstance(field, Output if own else Input) or (own and self._remembers(part, name)):
            return False
        memory = f"{name}{MEMORY}"
        if memory not in part.fields:
            declare(part, memory, boolean(field.description))
        if not own:
            record = inside(part)
            record.statements = tuple(e for e in record.statements if e[0].args != kept(name).args)
            record.elsewhere |= {memory}
        return True
