"""Pages of component types: they are current, complete, and their mathematics says what the class says."""

import ast
import re
from collections import Counter
from pathlib import Path as File
from xml.etree import ElementTree

import pytest
from calls import called

from components import PI, Clutch, OneWayClutch, SeriesDCMachine, ThermalMass
from components.interfaces import Flange
from modelica_like.language import (
    Component,
    Equations,
    Events,
    Expr,
    Input,
    Mode,
    Output,
    Parameter,
    Variable,
    column,
    interpolate,
    negate,
    param,
    var,
)
from modelica_like.language import rows as table_rows
from modelica_like.language.inside import declarations
from modelica_like.netlist import library_types, loads
from modelica_like.show.report.component_pages import latex_names
from modelica_like.show.report.component_pages.latex import Path, Unwritable
from modelica_like.show.report.component_pages.library import component_pages, domain, examples_by_type
from modelica_like.show.report.component_pages.page import page
from modelica_like.show.report.component_pages.source import Event, Source, Term, _reader

ROOT = File(__file__).parents[2]
FOLDER = ROOT / "docs" / "components"
EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def pages() -> dict[File, str]:
    return component_pages(FOLDER, EXAMPLES)


def test_every_type_occurs_in_an_example() -> None:
    assert sorted(library_types().keys() - examples_by_type(EXAMPLES).keys()) == []


def test_every_page_says_everything(pages: dict[File, str]) -> None:
    for name, kind in library_types().items():
        text = next(page for file, page in pages.items() if file.name == f"{name}.md")
        declared = [
            *declarations(kind).fields,
            *declarations(kind).connectors,
            *declarations(kind).modes,
            *declarations(kind).structural,
        ]
        assert [one for one in declared if f"| `{one}` |" not in text] == []
        assert "<summary>Equations</summary>" in text or "## Parts" in text


def test_a_page_begins_with_symbol_example_and_parameters(pages: dict[File, str]) -> None:
    for name, kind in library_types().items():
        text = next(page for file, page in pages.items() if file.name == f"{name}.md")
        symbol, example, first = text.index("![symbol of"), text.index("```toml"), text.index("\n## ")
        assert symbol < example < first
        if any(isinstance(field, Parameter) for field in declarations(kind).fields.values()):
            assert text[first:].startswith("\n## Parameters\n")
        (line,) = re.findall(r"```toml\n(.*)\n```", text)
        assert isinstance(next(iter(loads(f"[parts]\n{line}\n").parts.values())), kind)


def test_every_page_has_its_symbol_with_all_leads(pages: dict[File, str]) -> None:
    for name, kind in library_types().items():
        drawing = ElementTree.fromstring(next(text for file, text in pages.items() if file.name == f"{name}.svg"))
        signals = [one for one in declarations(kind).fields.values() if isinstance(one, Input | Output)]
        ends = [one for one in declarations(kind).connectors.values() if not one.optional]
        leads = [one for one in drawing.iter() if one.get("class", "").startswith("on-") and one.get("stroke")]
        assert len(leads) == len(signals) + len(ends), name
        assert (float(drawing.get("width", 0)) < 400, float(drawing.get("height", 0)) < 200) == (True, True)


def test_the_index_has_every_type_once_by_what_it_connects(pages: dict[File, str]) -> None:
    text = pages[FOLDER / "README.md"]
    tiles = re.findall(r"^- !\[\]\(([^)]+)\.svg\) \[(\w+)\]\(([^)]+)\.md\) \S", text, re.MULTILINE)
    assert sorted(name for _, name, _ in tiles) == sorted(library_types())
    assert all(picture == page for picture, _, page in tiles)
    assert (domain(Clutch), domain(PI), domain(ThermalMass)) == ("shaft", "signals", "heat")
    assert domain(SeriesDCMachine) == "circuit and shaft"


def test_what_is_long_is_closed_at_first(pages: dict[File, str]) -> None:
    clutch, inertia = (next(text for file, text in pages.items() if file.name == f"{name}.md")
                       for name in ("Clutch", "Inertia"))  # fmt: skip
    assert '<details id="equations" markdown="1">' in clutch
    assert '<details id="equations" markdown="1" open>' in inertia


def test_links_of_the_pages_lead_somewhere(pages: dict[File, str]) -> None:
    written = {file.resolve() for file in pages}
    broken = [
        (file.name, link)
        for file, text in pages.items()
        for link in re.findall(r"\]\(([^)#]+)", text)
        if not (file.parent / link).resolve().exists() and (file.parent / link).resolve() not in written
    ]
    assert broken == []


def test_source_links_name_the_line_of_the_class(pages: dict[File, str]) -> None:
    for name, kind in library_types().items():
        file, text = next((file, page) for file, page in pages.items() if file.name == f"{name}.md")
        link, line = re.findall(r"\(([^)#]+)#L(\d+)\)", text)[0]
        source = (file.parent / link).resolve().read_text(encoding="utf-8").splitlines()
        assert source[int(line) - 1].startswith(f"class {kind.__name__}(")


# -- what Markdown and LaTeX need --------------------------------------------------------------------------------------


def formulas(text: str) -> list[str]:
    return [a or b for a, b in re.findall(r"\$\$\n(.*?)\n\$\$|\$([^$\n]+)\$", text, re.DOTALL)]


def test_the_mathematics_is_well_formed(pages: dict[File, str]) -> None:
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


def test_no_two_fields_of_a_page_have_one_symbol(pages: dict[File, str]) -> None:
    for kind in library_types().values():
        fields = [latex_names.name(name) for name in declarations(kind).fields]
        ends = [
            latex_names.name(f"{name}.{field}")
            for name, connector in declarations(kind).connectors.items()
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


class Pump(Component):
    """A class with everything that a page has to tell apart."""

    flange = Flange("shaft end")
    support = Flange("housing", optional=True)
    rows: tuple[tuple[float, float], ...] = table_rows(column("speed", rising=True), column("flow"))
    stage = Mode("idle", "busy")
    x: Variable = var("1", "first")
    y: Variable = var("1", "second")
    p: Parameter = param("1", "parameter", default=None)
    q: Parameter = param("1", "in the place of p", default=None)

    @property
    def load(self) -> Expr:
        """Load of the pump."""
        speeds, flows = zip(*self.rows, strict=True)
        twice = 2 * interpolate(self.x, speeds, flows)
        return twice + self.y

    def given_or(self, value: Expr) -> Expr:
        """Return what holds without p."""
        if self.given("p"):
            return self.p * value
        return self.q

    def equations(self) -> Equations:
        flange, gain = self.flange, self.given_or(self.x)
        yield self.y == gain - self.load
        yield flange.tau == 0
        if self.support.used:
            yield self.support.tau == -flange.tau
        for _ in range(2):
            yield self.x == self.y

    def events(self) -> Events:
        now = {self.x: 0, self.y: self.time}
        yield self.stage.initially("busy", when=self.x > 0)
        yield self.stage.go(("idle", "busy"), "busy", at=2 * self.p, reset=now, notice="is late")
        if not self.given("p"):
            return
        yield self.stage.go("busy", "idle", when=negate(self.x > 0))

    def stored_energy(self) -> Expr:
        return 0.5 * self.p * self.x**2


def written(expression: str) -> str:
    """Return how an expression of the pump is written."""
    source = Source(Pump)
    reader = _reader(source, source.method("equations"), {name: Path(name) for name in ("x", "y", "p")})
    return reader.latex(ast.parse(expression, mode="eval").body)


@pytest.mark.parametrize(
    ("expression", "latex"),
    [
        ("x + y - p", "x + y - p"),
        ("x - (y - p)", r"x - \left(y - p\right)"),
        ("-(x + y)", r"-\left(x + y\right)"),
        ("2*x*y", r"2 \cdot x \cdot y"),
        ("-x*y", r"-x \cdot y"),
        ("p*-(x - y)", r"p \cdot \left(-\left(x - y\right)\right)"),
        ("x - -y", r"x - \left(-y\right)"),
        ("0.5*x**2/p", r"\frac{0.5 \cdot x^{2}}{p}"),
        ("x/y/p", r"\frac{\frac{x}{y}}{p}"),
        ("(x + y)*p", r"\left(x + y\right) \cdot p"),
        ("(x/y)**p", r"\left(\frac{x}{y}\right)^{p}"),
        ("x**-p", "x^{-p}"),
        ("(-x)**2", r"\left(-x\right)^{2}"),
        ("exp(-x/p)", r"\exp\left(-\frac{x}{p}\right)"),
        ("sqrt(absolute(x))", r"\sqrt{\left\lvert x \right\rvert}"),
        ("maximum(x, 0)", r"\max\left(x, 0\right)"),
        ("der(x)*der(der(y))", r"\dot{x} \cdot \ddot{y}"),
        ("der(x*y)", r"\frac{d}{dt} \left(x \cdot y\right)"),
        ("x*self.time", r"x \cdot t"),
        ("self.flange.phi", r"\varphi_{\text{flange}}"),
        ("x <= y", r"x \le y"),
        ("x < y", r"x \lt y"),
        ("any_of(x < 0, all_of(y > 0, p != 1))", r"x \lt 0 \lor y \gt 0 \land p \ne 1"),
        ("negate(x > 0)", r"\lnot \left(x \gt 0\right)"),
        ("all_of(any_of(x < 0, y < 0), p > 0)", r"\left(x \lt 0 \lor y \lt 0\right) \land p \gt 0"),
        ("self.stage.is_('idle', 'busy')", r"\text{stage} = \text{idle or busy}"),
        (
            "-self.stage.choose(idle=x, otherwise=0)",
            r"-\left(\begin{cases} x & \text{idle} \cr 0 & \text{otherwise} \end{cases}\right)",
        ),
        ("where(x > p, x, y)", r"\begin{cases} x & \text{if } x \gt p \cr y & \text{otherwise} \end{cases}"),
        (
            "where(x < 0, 1, where(x < p, 2, 3))",
            r"\begin{cases} 1 & \text{if } x \lt 0 \cr 2 & \text{if } x \lt p \cr 3 & \text{otherwise} \end{cases}",
        ),
        (
            "where(x < 0, where(y < 0, 1, 2), 3)",
            r"\begin{cases} \begin{cases} 1 & \text{if } y \lt 0 \cr 2 & \text{otherwise} \end{cases} & "
            r"\text{if } x \lt 0 \cr 3 & \text{otherwise} \end{cases}",
        ),
    ],
)
def test_expression(expression: str, latex: str) -> None:
    assert written(expression) == latex


@pytest.mark.parametrize("expression", ["unknown(x)", "[x for x in y]", "x @ y", "x.y(0).z(1)", "f'{x}'"])
def test_what_has_no_notation_is_not_written(expression: str) -> None:
    with pytest.raises(Unwritable):
        written(expression)


# -- statements --------------------------------------------------------------------------------------------------------


GIVEN_OR = r"\text{given or}"


def test_equations_read_as_they_stand() -> None:
    assert Source(Pump).says("equations") == [
        Term(r"\text{gain}", rf"{GIVEN_OR}\left(x\right)"),
        Term("y", r"\text{gain} - \text{load}"),
        Term(r"\tau_{\text{flange}}", "0"),
        Term(r"\tau_{\text{support}}", r"-\tau_{\text{flange}}", where=r"\text{if } \text{support is connected}"),
        "```python\nfor _ in range(2):\n    yield (self.x == self.y)\n```",
    ]


def test_what_is_called_is_defined_with_its_sentence() -> None:
    source = Source(Pump)
    source.says("equations")
    assert list(source.definitions()) == [
        "What holds without p:",
        Term(
            rf"{GIVEN_OR}\left(\text{{value}}\right)",
            r"\begin{cases} p \cdot \text{value} & \text{if } \text{p is given} \cr q & \text{otherwise} \end{cases}",
        ),
        "Load of the pump:",
        Term(r"\text{twice}", r"2 \cdot \text{rows}\left(x\right)"),
        Term(r"\text{load}", r"\text{twice} + y"),
    ]
    assert (list(source.asked), source.uses["p"], source.uses["q"]) == (["p"], [{"p": True}], [{"p": False}])


def test_events_have_times_and_new_values() -> None:
    assert Source(Pump).says("events") == [
        Event("stage", "", "busy", r"x \gt 0", "", ""),
        Event("stage", "idle, busy", "busy", r"t = 2 \cdot p", "$x := 0$; $y := t$", "is late"),
        Event(
            "stage", "busy", "idle", r"\lnot \left(x \gt 0\right)", "", "", r"\text{if } \text{p is given}",
        ),
    ]  # fmt: skip


def test_energy_terms() -> None:
    assert Source(Pump).energy() == [Term(r"\text{stored energy}", r"0.5 \cdot p \cdot x^{2}")]


def test_a_parameter_in_the_place_of_another_says_so() -> None:
    text = page(Pump, FOLDER / "Pump.md")
    assert "| `p` | $p$ | 1 | optional | parameter |" in text
    assert "| `q` | $q$ | 1 | required without `p` | in the place of p |" in text


def test_bases_are_read_in_their_order(pages: dict[File, str]) -> None:
    """A clutch: its ends, what its loss does, then its friction; a freewheel beside it leaves the first out."""
    clutch = [said.left for said in Source(Clutch).says("equations") if isinstance(said, Term)]
    assert clutch[:5] == [
        r"\varphi_{\text{rel}}", r"\tau_{\text{flange a}}", r"\tau_{\text{flange b}}", r"\dot{\varphi}_{\text{rel}}",
        r"Q_{\text{flow, heat port}}",
    ]  # fmt: skip
    assert Term(r"\text{loss power}", r"\text{dissipation}") not in Source(Clutch).energy()
    one_way = Source(OneWayClutch)
    one_way.says("equations")
    assert any(r"\text{sliding friction of PressedFriction}" in str(said) for said in one_way.definitions())
    limits = Source(PI).says("events")
    assert {said.where for said in limits if isinstance(said, Event)} == {r"\text{if } \text{y max is given}"}


# -- the command -------------------------------------------------------------------------------------------------------


def test_the_command_writes_pages_and_leaves_other_files_alone(tmp_path: File) -> None:
    mine = tmp_path / "mine.md"
    mine.write_text("mine")
    result = called(["docs", "-o", str(tmp_path), "Clutch", "Inertia"])
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
    arguments: list[str], message: str, tmp_path: File, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    File("drive.toml").write_text("[parts]\na is b\n")
    result = called(["docs", *arguments])
    assert (result.exit_code, result.stderr) == (2, message)
    assert not File("new").exists()
