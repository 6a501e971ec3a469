"""Output of `check`: sizes, states, index, blocks and energy terms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from rich.console import Group, RenderableType
from rich.markup import escape

from modelica_like.compile import compile
from modelica_like.flatten import FlatModel, flatten
from modelica_like.garbage import without_garbage_search
from modelica_like.language import Component, Expr
from modelica_like.show.report.tables import Listed, table
from modelica_like.structure import ReducedDae, reduce

_SHOWN = 12


@without_garbage_search()
def structure_report(component: Component) -> RenderableType:
    """Flatten and reduce a model and report the result."""
    flat = flatten(component)
    reduced = reduce(flat)
    if any(instance.template.update_forms for instance in flat.instances):
        compile(reduced)  # finds loops among discrete variables
    terms = (("stored", "stored_energy"), ("dissipated", "loss_power"), ("from outside", "source_power"))
    rows: list[tuple[str, str]] = []
    for what, term in terms:
        names = [c.label for c in flat.components.values() if _is_there(getattr(c, term)())]
        rows.append((what, listed(names) or "none"))
    parts: list[RenderableType] = [_sizes(flat, reduced), "", table("energy", "what", "components", rows=rows)]
    parts += ["", *(f"[dim]{escape(notice)}[/]" for notice in reduced.notices)] if reduced.notices else []
    return Group(*parts)


def _sizes(flat: FlatModel, reduced: ReducedDae) -> Listed:
    kinds = Counter(type(component).__name__ for component in flat.components.values() if not component.parts)
    equations = len(flat.linear) + len(flat.general)
    declared = [discrete for discrete in flat.discretes if not discrete.hidden]
    modes = [discrete.path for discrete in declared if discrete.names]
    numbers = [discrete.path for discrete in declared if not discrete.names]
    block_kinds = Counter((len(block.unknowns), block.kind) for block in reduced.blocks)
    sizes: list[tuple[str, int, str]] = [
        (
            "components",
            kinds.total(),
            ", ".join(f"{count} {name}" if count > 1 else name for name, count in kinds.items()),
        ),
        ("equations", equations, ""),
        ("unknowns", len(flat.variables) - len(flat.inputs), ""),
        ("parameters", len(flat.parameters), ""),
        ("modes", len(modes), listed(modes)),
        ("discrete values", len(numbers), listed(numbers)),
        ("states", len(reduced.states), listed(reduced.states)),
        ("implicit", len(reduced.implicit), listed(reduced.implicit)),
        ("index", reduced.index, ""),
        (
            "blocks",
            len(reduced.blocks),
            ", ".join(f"{count} of size {size} ({kind})" for (size, kind), count in sorted(block_kinds.items())),
        ),
    ]
    return table(f"{flat.name} can be simulated", "what", "number>", "which", rows=sizes, name="sizes")


def listed(names: Iterable[str]) -> str:
    """Return the first names and the number of others."""
    items = list(names)
    more = f", … {len(items) - _SHOWN} more" if len(items) > _SHOWN else ""
    return ", ".join(items[:_SHOWN]) + more


def _is_there(term: Expr | float) -> bool:
    return not (isinstance(term, int | float) and term == 0)
