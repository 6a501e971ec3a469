"""The stages of a step as a straight C function.

It has the operations of `take_stages` in integrate.c in their order, with coefficients from rodas.h, so that steps are
equal to the bit. Its loops have constant lengths, and its points lie where rates read them.
"""

from __future__ import annotations

from collections.abc import Iterator

from modelica_like.fmi.tables import Tables

_STAGES, _LAST_POINTS, _DENSE = 8, 6, 3
"""As in rodas.h; number of rows that dense output has besides its ends."""


def straight_step(tables: Tables) -> str:
    """Write `stages` as C text, which calls `run_0` for the rates and `solve`."""
    sizes = tables.slots.sizes
    states, size = sizes["x"], sizes["x"] + sizes["z"]
    inputs = 1 + size + sizes["p"]
    lines = [
        "const double t = a->t, h = a->h, *restrict first = a->first, *restrict slope = a->slope;",
        "double *restrict g = a->stages, *restrict y = s + 1, *restrict r = a->last;",
        _loop(size, "g[n] = a->rates[n];"),
    ]
    for stage in range(_STAGES):
        here = stage * size
        if stage > 0:
            lines += [f"s[0] = t + RODAS_TIME[{stage}] * h;", _loop(size, _point(stage, size))]
            lines += [f"s[{inputs + k}] = a->u[{k}] + a->u_rate[{k}] * (s[0] - a->u_time);" for k in range(sizes["u"])]
            lines.append(f"run_0(s, k, 0, g + {here});")
        lines += [f"const double c{stage}_{j} = RODAS_C[{stage}][{j}] / h;" for j in range(stage)]
        lines.append(f"const double b{stage} = h * RODAS_D_TIME[{stage}];")
        earlier = "".join(f" + c{stage}_{j} * g[{j * size} + n]" for j in range(stage))
        lines.append(_loop(states, f"g[{here} + n] = g[{here} + n]{earlier} + b{stage} * slope[n];"))
        lines.append(_loop(size, f"g[{here} + n] = g[{here} + n] + b{stage} * slope[n];", states))
        lines.append(f"if (!all_finite({size}, g + {here})) return 0;")
        lines.append(f"solve(a->lu, a->pivots, a->last_lu, a->last_order, g + {here});")
    lines += [*_dense(size), f"return all_finite({size}, r);"]
    head = "static int stages(double *restrict s, const double *restrict k, const Step *restrict a) {\n"
    return head + "".join(f"    {line}\n" for line in lines) + "}\n"


def _point(stage: int, size: int) -> str:
    if stage >= _LAST_POINTS:
        return f"y[n] += g[{(stage - 1) * size} + n];"
    return "y[n] = first[n]" + "".join(f" + RODAS_A[{stage}][{j}] * g[{j * size} + n]" for j in range(stage)) + ";"


def _dense(size: int) -> Iterator[str]:
    yield _loop(size, f"r[n] = y[n] + g[{(_STAGES - 1) * size} + n];")
    for row in range(_DENSE):
        terms = "".join(f" + RODAS_DENSE[{row}][{j}] * g[{j * size} + n]" for j in range(_STAGES))
        yield _loop(size, f"r[{(row + 1) * size} + n] = 0{terms};")


def _loop(end: int, body: str, begin: int = 0) -> str:
    return f"for (int n = {begin}; n < {end}; n++) {body}" if begin < end else ""
