"""The LU factorisation of a step matrix along its pattern, and solutions with it, as straight C functions.

They are those of linear.c with the same operations in the same order, so that factors are equal to the bit; where they
return 0, linear.c tells what to do instead.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from modelica_like.fmi.tables import Tables

_MOST = 600
"""Entries of L and U: these take a compiler 4 s, and more of them more than proportionally."""


def straight_lu(tables: Tables) -> str:
    """Write `factor` and `solve` as C text; "" for a pattern that is too large."""
    if len(tables.lu["rows"]) > _MOST:
        return ""
    writer = _Lu(tables)
    texts = (
        ("int factor(const double *restrict j, double d, double *restrict l, double *restrict p, double *restrict q)",
         [*writer.factor(), "return 1;"]),
        ("void solve(const double *restrict l, const double *restrict p, const double *q, const int *o, double *x)",
         writer.solve()),
    )  # fmt: skip
    return "".join(f"static {head} {{\n" + "".join(f"    {line}\n" for line in body) + "}\n" for head, body in texts)


class _Lu:
    """Columns of L and U as places among the factors, with their rows."""

    def __init__(self, tables: Tables) -> None:
        ends, rows, size = tables.lu["ends"], tables.lu["rows"], len(tables.lu["row_place"])
        columns = [[(k, rows[k]) for k in range(begin, end)] for begin, end in itertools.pairwise(ends)]
        self.tables, self.size, self.first = tables, size, len(columns) - size
        self.lower_columns, self.upper_columns = columns[: self.first], columns[self.first :]
        self.row_place, self.column_order = tables.lu["row_place"], tables.lu["column_order"]

    def factor(self) -> Iterator[str]:
        """Lines of `factor_matrix`, after the matrix of `factor_step`."""
        step, source = self.tables.step, {k: n for n, k in enumerate(self.tables.to_step)}
        for k in range(len(step["row"])):
            parts = [f"-j[{source.get(k)}]"] * (k in source) + ["d"] * (k in self.tables.diagonal)
            yield f"const double m{k} = {' + '.join(parts)};"
        yield from (f"double w{row} = 0;" for row in range(self.size))
        yield from (f"raise_to(&w{self.row_place[row]}, fabs(m{k}));" for k, row in enumerate(step["row"]))
        yield from (f"w{row} = 1 / w{row};" for row in range(self.size))
        yield "double size, subtracted;"
        for column in range(self.size):
            yield from self._column(column)

    def _column(self, column: int) -> Iterator[str]:
        step, of = self.tables.step, self.column_order[column]
        given = {self.row_place[step["row"][k]]: k for k in range(step["colind"][of], step["colind"][of + 1])}
        below = self.lower_columns[column] if column < self.first else []
        used = {row for _, row in self.upper_columns[column]} | {row for _, row in below} | set(given)
        used |= {row for _, above in self.upper_columns[column] for _, row in self.lower_columns[above]} | {column}
        start = (f"x{row}_{column} = " + (f"m{given[row]}" if row in given else "0") for row in sorted(used))
        yield f"double {', '.join(start)};"
        yield "size = subtracted = 0;"
        yield from (f"raise_to(&size, w{row} * fabs(x{row}_{column}));" for row in given)
        for k, row in self.upper_columns[column]:
            factor = f"x{row}_{column}"
            yield f"l[{k}] = {factor};"
            yield f"raise_to(&subtracted, fabs({factor}) * s{row});"
            yield from (f"x{other}_{column} -= l{at} * {factor};" for at, other in self.lower_columns[row])
        yield "if (!(subtracted <= MOST_GROWTH * size)) return 0;"
        if column >= self.first:
            place = (column - self.first) * (self.size - self.first) - self.first
            for row in range(self.first, self.size):
                yield f"q[{place + row}] = " + (f"x{row}_{column};" if row in used else "0;")
            return
        yield f"const double p{column} = p[{column}] = 1 / x{column}_{column};"
        yield f"if (!isfinite(p{column}) || p{column} == 0) return 0;"
        yield f"double s{column} = 0;"
        for k, row in below:
            yield f"const double l{k} = l[{k}] = x{row}_{column} * p{column};"
            yield f"raise_to(&s{column}, w{row} * fabs(l{k}));"

    def solve(self) -> Iterator[str]:
        """Lines of `solve_step`."""
        yield from (f"double y{place} = x[{row}];" for row, place in enumerate(self.row_place))
        for column, below in enumerate(self.lower_columns):
            yield from (f"y{row} -= l[{k}] * y{column};" for k, row in below)
        last = range(self.first, self.size)
        if last:
            yield f"double last[] = {{{', '.join(f'y{row}' for row in last)}}};"
            yield f"lu_solve({len(last)}, q, o, last);"
            yield from (f"y{row} = last[{k}];" for k, row in enumerate(last))
        for column in reversed(range(self.size)):
            solved = f"y{column} *= p[{column}]" if column < self.first else f"y{column}"
            yield f"x[{self.column_order[column]}] = {solved};"
            yield from (f"y{row} -= l[{k}] * y{column};" for k, row in self.upper_columns[column])
