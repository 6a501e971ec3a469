"""The mutants are sound: every change is one, and what is listed as equivalent still exists."""

import ast
from pathlib import Path

from changes import changes
from mutants import ROOT, equivalents, narrow_tests, sources

SOURCE = '''
def f(a, b, c):
    """Text with 1 + 1."""
    if a and not b <= -c:
        raise ValueError(f"{a + 1}")
    return min(a - b, 2 * c)
'''


def test_what_is_changed(tmp_path: Path) -> None:
    (tmp_path / "f.py").write_text(SOURCE)
    found = [f"{one.line}: {one.before} → {one.after}" for one in changes(tmp_path, "f.py")]
    assert found == [
        "4: a and not b <= -c → a", "4: a and not b <= -c → not b <= -c", "4: and → or", "4: not b <= -c → b <= -c",
        "4: <= → <", "4: <= → >=", "4: -c → c", "6: min → max", "6: a - b → a", "6: a - b → b", "6: - → +", "6: 2 → 3",
        "6: * → /",
    ]  # fmt: skip
    for one in changes(tmp_path, "f.py"):
        assert one.applied(SOURCE) != SOURCE
        ast.parse(one.applied(SOURCE))


def test_every_file_has_tests() -> None:
    for file in sources():
        missing = [one for one in narrow_tests(file) if not (ROOT / one).exists()]
        assert not missing, file


def test_what_is_equivalent_still_exists() -> None:
    for one in equivalents():
        places = [(change.place, f"{change.before} → {change.after}") for change in changes(ROOT, one["file"])]
        assert (one["place"], one["change"]) in places, one
        assert one["reason"]
