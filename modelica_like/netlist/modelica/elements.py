"""Elements of arrays: their places and names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import product

from modelica_like.netlist.modelica.tree import Expr

Place = tuple[int, ...]
"""Of an element, from one in each dimension; empty where there is no array."""


@lru_cache(maxsize=64)  # a loop over an array names all of it for each of its elements
def named_array(path: str, shape: tuple[int, ...], kind: str) -> Expr:
    """Return the array of the names `path[1]`, `path[2]` and so on."""
    return _named(path, shape, "name" if kind != "Boolean" else "condition")


def _named(path: str, shape: tuple[int, ...], kind: str) -> Expr:
    if not shape:
        return Expr(kind, ((path, ()),))
    inner = [f"{path[:-1]},{k}]" if path.endswith("]") else f"{path}[{k}]" for k in range(1, shape[0] + 1)]
    return Expr("array", tuple(_named(index, shape[1:], kind) for index in inner))


def elements_of(name: str, shape: tuple[int, ...]) -> list[tuple[str, Place]]:
    """Return the names of an array's elements with their places, or the name itself with none."""
    return [(named_at(name, place), place) for place in product(*(range(1, size + 1) for size in shape))]


def named_at(name: str, place: Place) -> str:
    """Return the name of an element, `name[2,3]`."""
    return f"{name}[{','.join(map(str, place))}]" if place else name


def place_of(path: str) -> Place:
    """Return the place at the end of a path, such as `(2, 3)` of `name[2,3]`."""
    return tuple(int(index) for index in path.partition("[")[2].rstrip("]").split(",") if index)


def extent(places: Iterable[Place]) -> tuple[int, ...]:
    """Return the shape of an array whose elements have these places."""
    return tuple(map(max, zip(*places, strict=True)))


def in_braces(texts: Sequence[str], shape: tuple[int, ...]) -> str:
    """Return the text of an array, of those of its elements row by row."""
    step = len(texts) // shape[0]
    if len(shape) > 1:
        texts = [in_braces(texts[k : k + step], shape[1:]) for k in range(0, len(texts), step)]
    return f"{{{', '.join(texts)}}}"
