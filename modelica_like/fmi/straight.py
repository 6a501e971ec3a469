"""Tapes as straight C functions: the same operations on the same slots, so that values are equal to the bit.

What parameters and modes decide is a function of its own, which runs when these change. Of the rest, what counts only
where a condition holds stands in a block of that condition. The text has numbers of slots and operations only: no name
and no value of a model; models of one structure share it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from heapq import heappop, heappush
from itertools import accumulate

from modelica_like.fmi.straight_lu import straight_lu
from modelica_like.fmi.straight_step import straight_step
from modelica_like.fmi.tables import Tables
from modelica_like.fmi.tape import ARGUMENTS, Tape

TAPES = {"rates": 0, "jacobian": 1, "alg": 2, "alg_jacobian": 3, "guards": 5, "edges": 6, "guards_soon": 7}
"""Tapes that are compiled, with their numbers in model.h."""
_LONGEST = 1000
"""Operations of a function: compilers take more than proportional time for long ones."""
_FEW = 64
"""Copies that are no loop."""

_PLAIN = {"ADD": "{} + {}", "SUB": "{} - {}", "MUL": "{} * {}", "DIV": "{} / {}", "NEG": "-{}"}
"""As in operations.h; compilers take half the time for these as for calls that they inline."""

Path = tuple[str | int, ...]
"""Conditions under which an operation counts, from the outside: their slots, or marks of guards as C text."""


def straight(tables: Tables) -> str:
    """Write the tapes that runs evaluate most as C text, which includes rodas.h of the run-time."""
    guards = sorted((one.index, one.mode, one.sources) for one in tables.model.events.transitions if not one.timed)
    first = {group: guard for guard, *group in reversed(guards) for group in [tuple(group)]}
    marks: list[Path] = [(f"w[{first[tuple(group)]}]",) for _, *group in guards]
    parts, table, count = ['#include "rodas.h"\n'], "", 0
    for name, number in TAPES.items():
        writer = _Writer(tables, tables.tapes[name], 2 * marks if name == "guards" else ())
        parts += writer.functions(number, moving=name == "rates")
        slopes = f"slopes_{number}" if name == "rates" else "0"
        table += f"    [{number}] = {{{len(writer.kept)}, {count}, known_{number}, run_{number}, {slopes}}},\n"
        count += len(writer.kept)
    solver = straight_lu(tables)
    solver += straight_step(tables) if solver else ""
    names = ", ".join(("factor", "solve", "stages") if solver else 3 * "0")
    return "\n".join([*parts, solver, f"CODES {{{{\n{table}}}, {names}}};\n"])


class _Writer:
    """Writes one tape.

    Args:
        tables: of the model.
        tape: one of its tapes.
        marks: under which conditions its outputs are wanted; by default they all are.
    """

    def __init__(self, tables: Tables, tape: Tape, marks: Sequence[Path] = ()) -> None:
        sizes = tables.slots.sizes
        fixed = [name in "pd" for name in ARGUMENTS for _ in range(sizes[name])]
        moving = [name in "tu" for name in ARGUMENTS for _ in range(sizes[name])]
        fixed += [True] * len(tables.slots.constants)
        moving += [False] * len(tables.slots.constants)
        self.tape, self.base = tape, len(fixed)
        for _, left, right in tape.operations:
            fixed.append(fixed[left] and fixed[right])
            moving.append(moving[left] or moving[right])
        self.fixed, self.moving = fixed, moving
        self.paths = self._paths(marks or [()] * len(tape.outputs))
        read = [slot for slot in self.paths if slot >= self.base and fixed[slot]]
        self.kept = {slot: k for k, slot in enumerate(sorted(read))}
        self.places: dict[int, list[int]] = {}
        for n, slot in enumerate(tape.outputs):
            self.places.setdefault(slot, []).append(n)

    def functions(self, number: int, *, moving: bool) -> list[str]:
        """Return the texts of `known_…`, `run_…`, and of `slopes_…` by time if something is `moving`."""
        needed = set(self.kept)
        for slot in range(self.base + len(self.tape.operations) - 1, self.base - 1, -1):
            if slot in needed:
                needed.update(other for other in self._operands(slot) if other >= self.base)
        known = dict.fromkeys(sorted(needed), ())
        rest = {slot: path for slot, path in self.paths.items() if slot >= self.base and not self.fixed[slot]}
        texts = [self._function(f"known_{number}", "double *restrict k", known, self._keep)]
        arguments = "const double *restrict k, const unsigned char *restrict w, double *restrict o"
        texts.append(self._function(f"run_{number}", arguments, rest, self._output))
        if moving:
            arguments = "const double *restrict k, double *restrict m, double *restrict o, double *restrict g"
            texts.append(self._function(f"slopes_{number}", arguments, rest, self._output_slope, slopes=True))
        return texts

    def _operands(self, slot: int) -> tuple[int, int]:
        return self.tape.operations[slot - self.base][1:]

    def _paths(self, marks: Sequence[Path]) -> dict[int, Path]:
        """Under which conditions slots are read; of what is fixed, only what the rest reads."""
        paths: dict[int, Path] = {}

        def read(slot: int, path: Path) -> None:
            paths[slot] = _common(paths[slot], path) if slot in paths else path

        for slot, mark in zip(self.tape.outputs, marks, strict=True):
            read(slot, mark)
        for slot in range(self.base + len(self.tape.operations) - 1, self.base - 1, -1):
            if slot not in paths or self.fixed[slot]:
                continue
            name, left, right = self.tape.operations[slot - self.base]
            read(left, paths[slot])
            read(right, (*paths[slot], left) if name == "IF_ELSE_ZERO" else paths[slot])
        return paths

    def _keep(self, slot: int, value: str, _: str) -> str:
        return f" k[{self.kept[slot]}] = {value};" if slot in self.kept else ""

    def _output(self, slot: int, value: str, _: str) -> str:
        return "".join(f" o[{n}] = {value};" for n in self.places.get(slot, ()))

    def _output_slope(self, slot: int, value: str, slope: str) -> str:
        slopes = slope != "0"  # of others they are zero before
        return "".join(f" o[{n}] = {value};" + slopes * f" g[{n}] = {slope};" for n in self.places.get(slot, ()))

    def _function(
        self, name: str, arguments: str, paths: dict[int, Path], after: Callable[[int, str, str], str], *,
        slopes: bool = False,
    ) -> str:  # fmt: skip
        order = self._order(paths)
        parts = [order[k : k + _LONGEST] for k in range(0, len(order), _LONGEST)] or [[]]
        number = {slot: k for k, part in enumerate(parts) for slot in part}
        apart = {other for slot in order for other in self._reads(slot, paths) if number.get(other) != number[slot]}
        texts: list[str] = []
        called = ", ".join(argument.split("restrict ")[1] for argument in arguments.split(", "))
        for k, part in enumerate(parts):
            body = _Body(self, paths, apart, after, slopes=slopes)
            for slot in part:
                body.write(slot)
            if k == len(parts) - 1 and after != self._keep:
                body.rest(slot for slot in dict.fromkeys(self.tape.outputs) if slot not in paths)
            apart_too = "__attribute__((noinline)) " if len(parts) > 1 else ""
            texts.append(f"static {apart_too}void {name}_{k}(double *restrict s, {arguments}) {{\n{body.text()}}}\n")
        calls = "".join(f"    {name}_{k}(s, {called});\n" for k in range(len(parts)))
        return "".join([*texts, f"static void {name}(double *restrict s, {arguments}) {{\n{calls}}}\n"])

    def _reads(self, slot: int, paths: dict[int, Path]) -> set[int]:
        """Operations whose values one needs, with those of its conditions."""
        conditions = (other for other in paths[slot] if isinstance(other, int))
        return {other for other in (*self._operands(slot), *conditions) if other in paths}

    def _order(self, paths: dict[int, Path]) -> list[int]:
        """Order of operations in which those of a condition follow each other."""
        users: dict[int, list[int]] = {slot: [] for slot in paths}
        missing: dict[int, int] = {}
        ready: dict[Path, list[int]] = {}
        waiting: list[tuple[int, int, Path]] = []  # paths that are ready, the shortest first

        def add(slot: int) -> None:
            if paths[slot] not in ready:
                heappush(waiting, (len(paths[slot]), slot, paths[slot]))
            ready.setdefault(paths[slot], []).append(slot)

        for slot in sorted(paths):
            reads = self._reads(slot, paths)
            for other in reads:
                users[other].append(slot)
            missing[slot] = len(reads)
            if not reads:
                add(slot)
        order: list[int] = []
        while waiting:
            path = heappop(waiting)[-1]
            for slot in ready[path]:  # grows while it is read
                order.append(slot)
                for user in users[slot]:
                    missing[user] -= 1
                    if not missing[user]:
                        add(user)
            del ready[path]
        return order


class _Body:
    """The body of a function: operations in nested blocks of their conditions; arguments are those of `_function`."""

    def __init__(
        self, writer: _Writer, paths: dict[int, Path], apart: set[int], after: Callable[[int, str, str], str], *,
        slopes: bool,
    ) -> None:  # fmt: skip
        self._writer, self._paths, self._apart, self._after, self._slopes = writer, paths, apart, after, slopes
        self._lines: list[tuple[int, str]] = []
        self._open: list[tuple[str | int, int]] = []  # conditions, each with the number of its block
        self._blocks = 0
        self._here: dict[int, int] = {}  # block of every operation
        self._outside: set[int] = set()

    def write(self, slot: int) -> None:
        """Write an operation."""
        self._enter(self._paths[slot])
        name, left, right = self._writer.tape.operations[slot - self._writer.base]
        values = self._value(left), self._value(right)
        self._here[slot] = self._open[-1][1] if self._open else 0
        value = _PLAIN.get(name, f"value_{name}({{}}, {{}})").format(*values)
        if name == "ELEMENT":
            value = f"element(s + {right}, {values[0]})"
        line = f"v{slot} = {value};"
        slope = "0"
        if self._slopes and self._writer.moving[slot]:
            slope = f"g{slot}"
            line += f" g{slot} = slope_{name}({', '.join(values)}, v{slot}, {self._slope(left)}, {self._slope(right)});"
        if slot in self._apart:
            line += f" s[{slot}] = v{slot};" + (f" m[{slot}] = {slope};" if self._slopes else "")
        self._lines.append((slot, line + self._after(slot, f"v{slot}", slope)))

    def rest(self, slots: Iterable[int]) -> None:
        """Write outputs that are no operations of this function; compilers are slow with many stores."""
        self._enter(())
        copies: dict[str, list[tuple[int, int]]] = {}
        for slot in slots:
            array, place = self._value(slot)[:-1].split("[")
            copies.setdefault(array, []).extend((n, int(place)) for n in self._writer.places[slot])
            if self._slopes and self._writer.moving[slot]:
                self._lines += [(-1, f"g[{n}] = m[{slot}];") for n in self._writer.places[slot]]
        for array, pairs in copies.items():
            if len(pairs) <= _FEW:
                self._lines += [(-1, f"o[{n}] = {array}[{place}];") for n, place in pairs]
                continue
            to, of = ("{" + ", ".join(map(str, places)) + "}" for places in zip(*pairs, strict=True))
            self._lines.append((-1, f"static const int to_{array}[] = {to}, of_{array}[] = {of};"))
            loop = f"for (int n = 0; n < {len(pairs)}; n++) o[to_{array}[n]] = {array}[of_{array}[n]];"
            self._lines.append((-1, loop))

    def text(self) -> str:
        """Return the text; what is read outside of its block is declared before."""
        self._enter(())
        lines = [self._declared(slot, " = 0") for slot in sorted(self._outside)]
        for slot, line in self._lines:
            lines.append(line if slot < 0 or slot in self._outside else f"{self._declared(slot)} {line}")
        return "".join(f"    {line}\n" for line in lines)

    def _declared(self, slot: int, value: str = "") -> str:
        slope = f", g{slot}{value}" if self._slopes and self._writer.moving[slot] else ""
        return f"double v{slot}{value}{slope};"

    def _enter(self, path: Path) -> None:
        shared = len(_common(path, tuple(condition for condition, _ in self._open)))
        self._lines += [(-1, "}")] * (len(self._open) - shared)
        del self._open[shared:]
        for condition in path[shared:]:
            text = self._value(condition) if isinstance(condition, int) else condition
            self._lines.append((-1, f"if ({text}) {{"))
            self._blocks += 1
            self._open.append((condition, self._blocks))

    def _value(self, slot: int) -> str:
        if slot in self._here:
            if self._here[slot] not in (0, *(block for _, block in self._open)):
                self._outside.add(slot)
            return f"v{slot}"
        kept = slot in self._writer.kept and slot not in self._paths
        return f"k[{self._writer.kept[slot]}]" if kept else f"s[{slot}]"

    def _slope(self, slot: int) -> str:
        if not self._slopes or not self._writer.moving[slot]:
            return "0"
        return f"g{slot}" if slot in self._here else f"m[{slot}]"


def _common(one: Path, other: Path) -> Path:
    same = accumulate((a == b for a, b in zip(one, other, strict=False)), lambda a, b: a and b)
    return one[: sum(same)]
