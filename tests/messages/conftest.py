"""What all snapshots of messages share: the check, and the lines they name in the test's own file and the library."""

import pickle
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from modelica_like.errors import ModelicaLikeError

LIBRARY = Path(__file__).parents[2] / "components"


@pytest.fixture
def expand(request: pytest.FixtureRequest) -> Callable[[str], str]:
    """Replace {marker} by the number of the line that ends in it, and {file:marker} likewise in the library."""

    def number(match: re.Match[str]) -> str:
        name, _, marker = match.group(1).rpartition(":")
        lines = (next(LIBRARY.rglob(name)) if name else request.path).read_text().splitlines()
        end = marker if name else f"# {marker}"
        return str(
            1 + next(k for k, line in enumerate(lines) if line.strip().endswith(end) or (name and line.strip() == end))
        )

    return lambda text: re.sub(r"\{([a-z ]+|[a-z_]+\.py:[^{}]+)\}", number, text)


@pytest.fixture
def check_message(expand: Callable[[str], str]) -> Callable[[type[ModelicaLikeError], Callable[[], object], str], None]:
    """Check the kind and the sentences of the error in which a call ends, and that a worker process can hand it on."""

    def check(kind: type[ModelicaLikeError], make: Callable[[], object], text: str) -> None:
        with pytest.raises(ModelicaLikeError) as caught:
            make()
        assert str(caught.value) == expand(text)
        assert type(caught.value) is kind
        twin = pickle.loads(pickle.dumps(caught.value))
        assert str(twin) == str(caught.value)
        assert type(twin) is kind

    return check
