"""Linearisation of an elastic chain, as a ratio to one simulation of it by hand-written CasADi IDAS.

Run with `python benchmarks/linearize.py [N ...]`.
"""

from __future__ import annotations

import sys
import time

from chain import Chain, best, hand_written

from modelica_like import build
from modelica_like.analyse.linear.linearize import linearize


def measure(n: int) -> str:
    model = build(Chain(n=n))
    begin = time.process_time()
    linear = linearize(model)
    first = time.process_time() - begin
    again, _ = best(lambda: linearize(model), 5)
    function, x0, p = hand_written(n)
    run, _ = best(lambda: function(x0=x0, p=p), 3)
    return (
        f"N = {n:5}: {len(linear.states)} states, first {first * 1e3:7.1f} ms, again {again * 1e3:7.1f} ms = "
        f"{again / run:.2f} x one hand-written simulation"
    )


def main(sizes: list[int]) -> None:
    for n in sizes:
        print(measure(n))


if __name__ == "__main__":
    main([int(text) for text in sys.argv[1:]] or [10, 100, 1000])
