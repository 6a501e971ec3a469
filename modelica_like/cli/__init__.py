"""The command line: `modelica-like check drive.toml` and the others."""

from __future__ import annotations

import sys
from importlib import import_module

from modelica_like.cli.app import app as app

# In the order in which the help lists their commands.
for _group in (
    "models",
    "analysis",
    "sweeps",
    "sensitivity",
    "export",
    "cosimulation",
    "types",
    "validation",
    "design",
):
    import_module(f"modelica_like.cli.{_group}")


def main() -> None:
    """Run the command line; classes of modules in the working directory can be used in netlists."""
    sys.path.insert(0, "")
    app()
