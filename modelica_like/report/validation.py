"""The checks of an FMU as a table."""

from __future__ import annotations

from rich.markup import escape
from rich.table import Table

from modelica_like.fmi.validate import FAILED, PASSED, Validation
from modelica_like.report.types import table

_STYLES = {PASSED: "green", FAILED: "bold red"}


def validation_table(validation: Validation) -> Table:
    """Return one row per check."""
    made = table(escape(validation.fmu), "check", "verdict", "")
    for check in validation.checks:
        style = _STYLES.get(check.verdict, "dim")
        made.add_row(check.name, f"[{style}]{check.verdict}[/]", escape(check.sentence))
    return made
