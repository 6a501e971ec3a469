"""Laws: large expressions that stand once for all that use them, with slots for what they are made of."""

from __future__ import annotations

from dataclasses import dataclass, field

from modelica_like.netlist.modelica import fold
from modelica_like.netlist.modelica.fold import OUTSIDE
from modelica_like.netlist.modelica.tree import Expr, with_operands

SLOT = "#"
"""Before the number of an argument in a law."""


@dataclass(frozen=True)
class Law:
    """An expression of slots, and whether something in it is demanded."""

    result: Expr
    demanding: bool = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "demanding", _demanding(self.result))

    def of(self, arguments: tuple[Expr, ...]) -> Expr:
        """Return the expression with arguments in the slots."""

        def filled(node: Expr) -> Expr:
            place = slot_of(node)
            return with_operands(node, filled) if place is None else arguments[place]

        return filled(self.result)


def slot_of(node: Expr) -> int | None:
    """Return the number of a slot, None of what is none."""
    is_slot = node.kind in ("name", "condition") and node.args[0][0].startswith(SLOT)
    return int(node.args[0][0].removeprefix(SLOT)) if is_slot else None


def opened(value: Expr, arguments: list[Expr]) -> Expr:
    """Return a value with slots for all that is not known, which becomes an argument."""
    if value.kind == "array":
        return Expr("array", tuple(opened(item, arguments) for item in value.args), value.line)
    if value.kind == "record":
        return with_operands(value, lambda item: opened(item, arguments))
    if value.kind in (*fold.KNOWN, "object"):
        return value
    arguments.append(value)
    kind = "condition" if fold.is_condition(value) else "name"
    return Expr(kind, ((f"{SLOT}{len(arguments) - 1}", ()),), value.line)


def closed(value: Expr, arguments: list[Expr], line: int) -> Expr:
    """Return an expression of slots with those of the arguments that it has; of an array element by element."""
    if value.kind in ("array", "tuple", "record"):
        return with_operands(value, lambda item: closed(item, arguments, line))
    places: dict[int, int] = {}

    def counted(node: Expr) -> Expr:
        place = slot_of(node)
        if place is None:
            return with_operands(node, counted)
        return Expr(node.kind, ((f"{SLOT}{places.setdefault(place, len(places))}", ()),), node.line)

    law = counted(value)
    return Expr("shared", (Law(law), *(arguments[place] for place in places)), line) if places else value


def _demanding(node: Expr) -> bool:
    if node.kind == OUTSIDE or (node.kind == "shared" and node.args[0].demanding):
        return True
    inner = node.args[1] if node.kind == "call" else node.args
    return any(_demanding(operand) for operand in inner if isinstance(operand, Expr))
