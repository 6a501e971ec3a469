"""A terminal is asked, once, whether it trusts a folder."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

from modelica_like.trust import Decide, trust


def decide() -> Decide:
    """Return what decides about folders that are not trusted: the user, or nobody where there is no terminal."""

    @cache
    def asked(folder: Path) -> bool:
        if not (sys.stdin and sys.stdin.isatty() and sys.stderr.isatty()):
            return False
        sys.stderr.write(
            f"The netlist uses Python modules of '{folder}', which can do all that you can.\n"
            "Trust this folder from now on? [y/N] "
        )
        sys.stderr.flush()
        if sys.stdin.readline().strip().lower() not in ("y", "yes"):
            return False
        trust(folder)
        return True

    return asked
