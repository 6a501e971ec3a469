"""Texts are parsed in many threads: by a page's requests, by sweeps."""

import gc
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from modelica_like.parsing import parse

TEXT = "\n".join(f"def f{k}(a, b=1, *c):\n    return [a + b * (c[0] - a) for a in (b, (c, (a, a)))]" for k in range(60))


def test_threads_parse_one_after_the_other() -> None:
    """CPython 3.11 counts the depth of trees for all threads together: `ast.parse` ends in a SystemError here."""

    def let_others_run(*_: Any) -> None:
        time.sleep(0)

    threshold = gc.get_threshold()
    gc.set_threshold(50)
    gc.callbacks.append(let_others_run)
    try:
        with ThreadPoolExecutor(8) as threads:
            sizes = list(threads.map(lambda _: len(parse(TEXT).body), range(60)))
    finally:
        gc.callbacks.remove(let_others_run)
        gc.set_threshold(*threshold)
    assert sizes == [60] * 60
