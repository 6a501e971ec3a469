"""Lines that snapshots of messages name, in the test's own file and in the library."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

LIBRARY = Path(__file__).parents[2] / "components"


@pytest.fixture
def expand(request: pytest.FixtureRequest) -> Callable[[str], str]:
    """Replace {marker} by the number of the line that ends in it, and {file:marker} likewise in the library."""

    def number(match: re.Match[str]) -> str:
        name, _, marker = match.group(1).rpartition(":")
        lines = (LIBRARY / name if name else request.path).read_text().splitlines()
        end = marker if name else f"# {marker}"
        return str(
            1 + next(k for k, line in enumerate(lines) if line.strip().endswith(end) or (name and line.strip() == end))
        )

    return lambda text: re.sub(r"\{([a-z ]+|[a-z_]+\.py:[^{}]+)\}", number, text)
