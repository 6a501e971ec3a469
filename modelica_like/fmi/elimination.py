"""LU of the step matrix without exchanges: which entries are its pivots, in which order, and what fills in."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from heapq import heapify, heappop, heappush
from itertools import accumulate

from modelica_like.fmi.tape import ARGUMENTS, Slots, Tape

Entries = list[tuple[int, int]]
"""Rows and columns of nonzeros."""

SURE, BY_POINT, BY_MODES, ELSEWHERE = 0, 1, 2, 3
"""How much a nonzero is in doubt: parameters decide it, the point, modes; added where it is no entry of a block of
equations for implicit unknowns, which are regular by themselves."""


def lu_pattern(entries: Entries, doubts: Sequence[int], states: int) -> dict[str, tuple[int, ...]]:
    """Analyse a square, structurally regular matrix M/(h gamma) - J.

    Every unknown gets an equation, a state its own, in which M/(h gamma) is large for small steps, so that what is
    eliminated is on the diagonal. It goes in the order of least degrees. What modes may make zero comes last, and is
    eliminated with exchanges.

    Args:
        entries: its nonzeros, those of states on the diagonal among them.
        doubts: of every nonzero.
        states: number of states, the first unknowns.

    Returns:
        By their names in model.h: `ends` and `rows` of columns of L below the diagonal, without the last ones, and then
        of columns of U above it, in rows without the last ones; `row_place`: permuted position of every row;
        `column_order`: columns by position.
    """
    size = 1 + max((row for row, _ in entries), default=-1)
    rows, pivot_doubts = _matching(entries, doubts, states, size)
    column_of = {row: column for column, row in enumerate(rows)}
    columns: list[set[int]] = [set() for _ in range(size)]
    for row, column in entries:
        columns[column].add(column_of[row])
    late = [column for column, doubt in enumerate(pivot_doubts) if doubt % ELSEWHERE == BY_MODES]
    order = _least_degrees(columns, set(late))
    order += late
    place = {column: k for k, column in enumerate(order)}
    lower, upper = _filled([{place[row] for row in columns[column]} for column in order], size - len(late))
    tables = {"row_place": tuple(place[column_of[row]] for row in range(size)), "column_order": tuple(order)}
    factors = lower + upper
    tables["ends"] = (0, *accumulate(map(len, factors)))
    tables["rows"] = tuple(row for column in factors for row in column)
    return tables


def doubts_of(tape: Tape, slots: Slots) -> list[int]:
    """Return how much the results of a tape are in doubt."""
    kinds = {"p": SURE, "d": BY_MODES}
    known = [kinds.get(name, BY_POINT) for name in ARGUMENTS for _ in range(slots.sizes[name])]
    known += [SURE] * len(slots.constants)
    for _, left, right in tape.operations:
        known.append(max(known[left], known[right]))
    return [known[slot] for slot in tape.outputs]


def _matching(entries: Entries, doubts: Sequence[int], states: int, size: int) -> tuple[list[int], list[int]]:
    """Return the row that each column gets, and how much these entries are in doubt.

    Paths augment, first through what is least in doubt.
    """
    doubt = {
        entry: 0 if entry[0] == entry[1] < states else of + ELSEWHERE * (min(entry) < states)
        for entry, of in zip(entries, doubts, strict=True)
    }
    owners, rows = {k: k for k in range(states)}, {k: k for k in range(states)}
    open_columns: Iterable[int] = range(states, size)
    for level in range(2 * ELSEWHERE):
        reached: dict[int, list[int]] = defaultdict(list)
        for (row, column), of in doubt.items():
            if of <= level:
                reached[column].append(row)
        seen: set[int] = set()
        open_columns = [column for column in open_columns if not _augment(column, reached, owners, rows, seen)]
    return [rows[k] for k in range(size)], [doubt[rows[k], k] for k in range(size)]


def _augment(
    column: int, reached: dict[int, list[int]], owners: dict[int, int], rows: dict[int, int], seen: set[int]
) -> bool:
    """Match one more column, if there is a path. Rows that were `seen` in vain lead nowhere for others, too."""
    sources: dict[int, int] = {}
    queue = [column]
    for source in queue:
        for row in reached.get(source, ()):
            if row in sources or row in seen:
                continue
            sources[row] = source
            if row in owners:
                queue.append(owners[row])
                continue
            while source != column:
                owners[row], rows[source], row = source, row, rows[source]
                source = sources[row]
            owners[row], rows[column] = column, row
            return True
    seen |= sources.keys()
    return False


def _least_degrees(columns: list[set[int]], late: set[int]) -> list[int]:
    """Order of elimination on the graph of the matrix and its transpose, without those that are late."""
    neighbours: list[set[int]] = [set() for _ in columns]
    for column, rows in enumerate(columns):
        for row in rows - {column}:
            neighbours[row].add(column)
            neighbours[column].add(row)
    # Of equals, the one that has waited longest: so are branches eliminated in turn, which processors do at once.
    heap = [(len(around), 0, k) for k, around in enumerate(neighbours) if k not in late]
    heapify(heap)
    order: dict[int, None] = {}
    while heap:
        degree, _, chosen = heappop(heap)
        around = neighbours[chosen]
        if chosen in order or degree != len(around):
            continue
        order[chosen] = None
        for other in around:
            neighbours[other] |= around
            neighbours[other] -= {other, chosen}
            if other not in late:
                heappush(heap, (len(neighbours[other]), len(order), other))
    return list(order)


def _filled(columns: list[set[int]], eliminated: int) -> tuple[list[list[int]], list[list[int]]]:
    """Columns of L below and of U above the diagonal, with what fills in; without what is not `eliminated` here."""
    lower: list[list[int]] = []
    upper: list[list[int]] = []
    for j, column in enumerate(columns):
        end = min(j, eliminated)
        filled, above = set(column), [k for k in column if k < end]
        heapify(above)
        used: list[int] = []
        while above:
            k = heappop(above)
            used.append(k)
            for row in lower[k]:
                if row not in filled:
                    filled.add(row)
                    if row < end:
                        heappush(above, row)
        upper.append(used)
        if j < eliminated:
            lower.append(sorted(row for row in filled if row > j))
    return lower, upper
