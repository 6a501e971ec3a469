"""The mutants are sound: every change is one, and what is listed as equivalent still exists."""

import ast
from pathlib import Path

from changes import changes
from judge import at_import
from lines import ROOT, Lines
from mutants import equivalents

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


def test_tests_are_found_by_lines_that_moved(tmp_path: Path) -> None:
    found = Lines()
    found.texts = {"f.py": SOURCE}
    found.seconds = {"slow": 2.0, "fast": 1.0, "other": 0.1, "o.py::made": 3.0, "t/test_f.py::own": 4.0}
    own = "t/test_f.py::own"
    found.runs = {"f.py": {3: {""}, 4: {"slow", "fast", "+o.py"}, 6: {"other"}}}
    text = "import math\n" + SOURCE.replace("2 * c)", "2 *\n        c)")
    (tmp_path / "f.py").write_text(text)
    for one in changes(tmp_path, "f.py"):
        tests = ["fast", "slow", own], ["o.py::made", own]
        if one.line != 5:  # a new one
            tests = ["other", "fast", "slow", own], []
        assert tuple(map(list, found.tests(one, text))) == tests
        assert list(found.users(one)) == ["other", "fast", "slow"]
    assert {one.line for one in changes(tmp_path, "f.py")} == {5, 7}


def test_what_takes_a_new_import(tmp_path: Path) -> None:
    text = "class A:\n    x = 1\n    def f(self, y=2):\n        return [y - i for i in self.g]\n"
    (tmp_path / "f.py").write_text(text)
    found = {f"{one.before} → {one.after}": at_import(one, text) for one in changes(tmp_path, "f.py")}
    assert found == {"1 → 2": True, "2 → 3": True, "y - i → y": False, "y - i → i": False, "- → +": False}


def test_what_is_equivalent_still_exists() -> None:
    for one in equivalents():
        places = [(change.place, f"{change.before} → {change.after}") for change in changes(ROOT, one["file"])]
        assert (one["place"], one["change"]) in places, one
        assert one["reason"]
