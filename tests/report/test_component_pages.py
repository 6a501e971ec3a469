"""Pages of component types: they are current, complete, and their mathematics says what the class says."""

import re
from collections import Counter
from pathlib import Path

import pytest
from typer.testing import CliRunner

from components import BearingFriction, Clutch, Inertia, LossyGear, Pulse, TimingBelt
from modelica_like.cli import app
from modelica_like.errors import LanguageError
from modelica_like.language import (
    Component,
    Equations,
    Expr,
    Output,
    Parameter,
    Variable,
    absolute,
    der,
    exp,
    interpolate,
    maximum,
    param,
    signal_out,
    sqrt,
    var,
    where,
)
from modelica_like.netlist import library_types
from modelica_like.report.component_pages import latex_names
from modelica_like.report.component_pages.library import component_pages, examples_by_type
from modelica_like.report.component_pages.statements import Statements, statements
from modelica_like.report.component_pages.variants import variants

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "components"
EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def pages() -> dict[Path, str]:
    return component_pages(FOLDER, EXAMPLES)


def test_the_pages_are_current(pages: dict[Path, str]) -> None:
    """Otherwise: modelica-like docs -o docs/components --examples examples."""
    committed = {file: file.read_text(encoding="utf-8") for file in FOLDER.rglob("*.md")}
    assert sorted(committed) == sorted(pages)
    assert [file.name for file, text in pages.items() if committed[file] != text] == []


def test_every_type_occurs_in_an_example() -> None:
    assert sorted(library_types().keys() - examples_by_type(EXAMPLES).keys()) == []


def test_every_page_says_everything(pages: dict[Path, str]) -> None:
    for name, kind in library_types().items():
        text = next(page for file, page in pages.items() if file.stem == name)
        declared = [*kind._class_fields, *kind._class_connectors, *kind._class_modes, *kind._structural]
        assert [one for one in declared if f"| `{one}` |" not in text] == []
        assert "structural values" not in text
        assert "## Equations" in text or "## Parts" in text


def test_links_of_the_pages_lead_somewhere(pages: dict[Path, str]) -> None:
    front = ROOT / "docs" / "README.md"
    broken = [
        (file.name, link)
        for file, text in {**pages, front: front.read_text(encoding="utf-8")}.items()
        for link in re.findall(r"\]\(([^)#]+)", text)
        if not (file.parent / link).exists()
    ]
    assert broken == []


def test_source_links_name_the_line_of_the_class(pages: dict[Path, str]) -> None:
    for name, kind in library_types().items():
        file, text = next((file, page) for file, page in pages.items() if file.stem == name)
        link, line = re.findall(r"\(([^)#]+)#L(\d+)\)", text)[0]
        source = (file.parent / link).read_text(encoding="utf-8").splitlines()
        assert source[int(line) - 1].startswith(f"class {kind.__name__}(")


# -- what Markdown and LaTeX need --------------------------------------------------------------------------------------


def formulas(text: str) -> list[str]:
    return [a or b for a, b in re.findall(r"\$\$\n(.*?)\n\$\$|\$([^$\n]+)\$", text, re.DOTALL)]


def test_the_mathematics_is_well_formed(pages: dict[Path, str]) -> None:
    count = 0
    for text in pages.values():
        for formula in formulas(text):
            count += 1
            # Markdown takes the backslash away from punctuation, and reads < as the begin of a tag.
            assert not re.search(r"\\[^a-zA-Z]|<|>|\|", formula), formula
            assert formula.count("{") == formula.count("}"), formula
            assert formula.count(r"\left") == formula.count(r"\right"), formula
            begun, ended = (Counter(re.findall(rf"\\{word}{{(\w+)}}", formula)) for word in ("begin", "end"))
            assert begun == ended
    assert count > 10 * len(library_types())


def test_no_two_fields_of_a_page_have_one_symbol(pages: dict[Path, str]) -> None:
    for kind in library_types().values():
        fields = [latex_names.name(name) for name in kind._class_fields]
        ends = [
            latex_names.name(f"{name}.{field}")
            for name, connector in kind._class_connectors.items()
            for field in connector.fields
        ]
        assert [symbol for symbol, n in Counter(fields + ends).items() if n > 1] == [], kind.__name__


# -- names and numbers -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "dots", "latex"),
    [
        ("J", 0, "J"),
        ("w", 1, r"\dot{\omega}"),
        ("phi_rel", 2, r"\ddot{\varphi}_{\text{rel}}"),
        ("flange_a.tau", 0, r"\tau_{\text{flange a}}"),
        ("Ra", 0, "R_{a}"),
        ("t12", 0, "t_{12}"),
        ("ap.v", 0, r"v_{\text{ap}}"),
        ("wrap_angle", 0, r"\text{wrap angle}"),
        ("integral", 1, r"\frac{d}{dt} \text{integral}"),
        ("prescribed(w)", 0, r"\text{prescribed}\left(\omega\right)"),
    ],
)
def test_name(path: str, dots: int, latex: str) -> None:
    assert latex_names.name(path, dots) == latex


@pytest.mark.parametrize(
    ("value", "latex"),
    [
        (0.5, "0.5"),
        (6.283185307179586, r"2 \pi"),
        (-1.5707963267948966, r"-\frac{\pi}{2}"),
        (1e-9, "10^{-9}"),
        (2.5e-7, r"2.5 \cdot 10^{-7}"),
        (1e30, r"\infty"),
        (3.1416, "3.1416"),
    ],
)
def test_number(value: float, latex: str) -> None:
    assert latex_names.number(value) == latex


# -- expressions -------------------------------------------------------------------------------------------------------


def written(expression: str) -> str:
    """Return how an expression of x, y, v and p is written on the right side of an equation."""

    class Written(Component):
        x: Variable = var("1", "first")
        y: Variable = var("1", "second")
        v: Output = signal_out("1", "result")
        p: Parameter = param("1", "parameter")

        def equations(self) -> Equations:
            names = {"x": self.x, "y": self.y, "p": self.p, "der": der, "absolute": absolute, "exp": exp}
            names |= {"sqrt": sqrt, "maximum": maximum, "where": where, "t": self.time}
            yield self.v == eval(expression, names)

    return statements(Written, {}).equations[0].right


@pytest.mark.parametrize(
    ("expression", "latex"),
    [
        ("x + y - p", "x +y -p"),
        ("x - (y - p)", "x -y +p"),
        ("-(x + y)", "-x -y"),
        ("2*x*y", r"2 \cdot x \cdot y"),
        ("0.5*p*x**2", r"\tfrac{1}{2} p \cdot x^{2}"),
        ("0.5*(x - y)", r"\tfrac{1}{2} \left(x -y\right)"),
        ("p*-(x - y)", r"-p \cdot \left(x -y\right)"),
        ("0.5*x**2/p", r"\frac{x^{2}}{2 \cdot p}"),
        ("x**3", "x^{3}"),
        ("x/y/p", r"\frac{x}{y \cdot p}"),
        ("(x + y)*p", r"\left(x +y\right) \cdot p"),
        ("x**p", "x^{p}"),
        ("(x + y)**p", r"\left(x +y\right)^{p}"),
        ("exp(-x/p)", r"\exp\left(-\frac{x}{p}\right)"),
        ("sqrt(absolute(x))", r"\sqrt{\left\lvert x \right\rvert}"),
        ("maximum(x, 0)", r"\max\left(x, 0\right)"),
        ("der(x*y)", r"y \cdot \dot{x} +x \cdot \dot{y}"),
        ("x*t", r"x \cdot t"),
        ("where(x > p, x, y)", r"\begin{cases} x & \text{if } x \gt p \cr y & \text{otherwise} \end{cases}"),
        ("where(x < 0, 0, y)", r"\begin{cases} 0 & \text{if } x \lt 0 \cr y & \text{otherwise} \end{cases}"),
        (
            "-where(x < 0, 1, where(x < p, 2, 3))",
            r"-\begin{cases} 1 & \text{if } x \lt 0 \cr 2 & \text{if } x \lt p \cr 3 & \text{otherwise} \end{cases}",
        ),
    ],
)
def test_expression(expression: str, latex: str) -> None:
    assert written(expression) == latex


# -- statements --------------------------------------------------------------------------------------------------------


def lines(said: Statements) -> dict[str, str]:
    return {term.left: term.right for term in (*said.equations, *said.definitions, *said.energy.values())}


def test_an_inertia() -> None:
    said = lines(statements(Inertia, {}))
    assert said[r"J \cdot \dot{\omega}"] == r"\tau_{\text{flange a}} +\tau_{\text{flange b}}"
    assert said[r"\text{stored energy}"] == r"\tfrac{1}{2} J \cdot \omega^{2}"


def test_a_clutch_names_its_friction_and_its_table() -> None:
    said = lines(statements(Clutch, {}))
    assert said[r"\mu\left(\text{speed}\right)"] == (
        r"\mu_{\text{pos}}\left(\frac{\text{speed}}{\omega_{\text{scale}}}\right)"
    )
    assert said[r"\text{loss power}"] == r"\tau \cdot \omega_{\text{rel}}"
    assert r"\tau -\text{sliding friction}\left(0\right) & \text{mode: start forward}" in said["0"]


def test_columns_of_a_table_are_functions() -> None:
    said = lines(statements(LossyGear, {}))
    assert said[r"\text{efficiencies}_{1}\left(\text{speed}\right)"] == (
        r"\text{loss table}_{2}\left(\frac{\text{speed}}{\omega_{\text{scale}}}\right)"
    )


def test_variants_say_what_differs() -> None:
    base = statements(TimingBelt, {})
    others = variants(TimingBelt, {}, base)
    assert others.keys() == {"`support` connected", "`heat_port` connected", "a value for `mu`"}
    slipping = others["a value for `mu`"]
    assert {(event.source, event.target) for event in slipping.events} == {
        ("sticking", "forward"),
        ("sticking", "backward"),
        ("forward", "sticking"),
        ("backward", "sticking"),
    }
    assert lines(slipping)[r"\text{slip force}"] == (
        r"2 \cdot F_{0} \cdot \tanh\left(\tfrac{1}{2} \mu \cdot \text{wrap angle}\right)"
    )
    assert lines(others["`heat_port` connected"])[r"\text{loss power}"] == "0"


def test_events_have_times_and_new_values() -> None:
    falling = next(event for event in statements(Pulse, {}).events if event.target == "low")
    assert falling.source == "high"
    assert falling.when == r"t = \text{begin} +\text{width} \cdot \text{period}"
    assert falling.resets == (r"\text{done} := \text{completed}\left(\text{width} \cdot \text{period}\right)",)


def test_what_stands_in_a_table_can_only_be_looked_up() -> None:
    class Squared(BearingFriction):
        def sliding_friction(self, speed: Expr | float) -> Expr:
            return self.tau_scale * self.tau_pos[1][1] ** 2

    with pytest.raises(LanguageError) as caught:
        statements(Squared, {})
    assert str(caught.value) == "Squared does not look up `tau_pos` along straight lines."


def test_a_property_that_calls_a_table_is_one_definition() -> None:
    class Magnet(Component):
        rows: tuple[tuple[float, float], ...] = ((0.0, 1.0), (2.0, 3.0))
        y: Output = signal_out("1", "force")
        u: Variable = var("1", "current")

        @property
        def force(self) -> Expr:
            """Force of the coil."""
            currents, forces = zip(*self.rows, strict=True)
            return 2 * interpolate(self.u, currents, forces)

        def equations(self) -> Equations:
            yield self.y == self.force

    Magnet.__annotations__["rows"] = tuple[tuple[float, float], ...]
    said = statements(Magnet, {})
    assert said.equations[0].right == r"\text{force}"
    assert (said.definitions[0].right, said.definitions[0].description) == (
        r"2 \cdot \text{rows}\left(u\right)",
        "force of the coil",
    )


# -- the command -------------------------------------------------------------------------------------------------------


def test_the_command_writes_pages_and_leaves_other_files_alone(tmp_path: Path) -> None:
    mine = tmp_path / "mine.md"
    mine.write_text("mine")
    result = CliRunner().invoke(app, ["docs", "-o", str(tmp_path), "Clutch", "Inertia"])
    assert (result.exit_code, result.stdout) == (0, f"2 pages in {tmp_path}\n")
    assert {file.relative_to(tmp_path).as_posix() for file in tmp_path.rglob("*.md")} == {
        "mine.md",
        "friction/Clutch.md",
        "inertias/Inertia.md",
    }
    assert mine.read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["-o", "new", "--examples", "nowhere"],
            "There is no folder 'nowhere' with examples.\nName a folder of netlists.\n",
        ),
        (["-o", "drive.toml", "Clutch"], "drive.toml: Not a directory.\n"),
        (
            ["-o", "new", "Cluch"],
            "There is no component type 'Cluch'; did you mean 'Clutch'?\n`modelica-like library` lists all types.\n",
        ),
        (
            ["-o", "new", "--examples", "."],
            "'drive.toml' is not TOML: expected '=' after a key in a key/value pair.\n  in drive.toml:2 `a is b`\n",
        ),
    ],
)
def test_what_the_command_refuses(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("drive.toml").write_text("[parts]\na is b\n")
    result = CliRunner().invoke(app, ["docs", *arguments])
    assert (result.exit_code, result.stderr) == (2, message)
    assert not Path("new").exists()
