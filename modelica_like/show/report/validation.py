"""The checks of an FMU as a table."""

from __future__ import annotations

from rich.text import Text

from modelica_like.fmi.validate import FAILED, PASSED, Validation
from modelica_like.show.report.tables import Listed, table

_STYLES = {PASSED: "green", FAILED: "bold red"}


def validation_table(validation: Validation) -> Listed:
    """Return one row per check."""
    rows = (
        (check.name, Text(check.verdict, _STYLES.get(check.verdict, "dim")), check.sentence)
        for check in validation.checks
    )
    return table(validation.fmu, "check", "verdict", "because", rows=rows, name="checks")
