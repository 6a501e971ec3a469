"""What `equations()` yields: places in the source, refused statements, the balance of a component."""

import inspect
import math

import numpy as np
import pytest

from modelica_like.errors import ComponentUnbalanced, LanguageError, ModelicaLikeError, WiringErrors
from modelica_like.flatten import flatten
from modelica_like.language import (
    Component,
    Connector,
    Equations,
    Variable,
    connect,
    der,
    flow,
    free,
    signal_in,
    signal_out,
    var,
)


class Flange(Connector):
    phi: Variable = var("rad", "angle")
    tau: Variable = flow("N.m", "torque")


class Compliant(Component, partial=True):
    flange_a = Flange("left", free=True)
    flange_b = Flange("right", free=True)
    phi_rel: Variable = var("rad", "relative angle")
    tau: Variable = var("N.m", "torque")

    def equations(self) -> Equations:
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi
        yield self.flange_b.tau == self.tau
        yield self.flange_a.tau == -self.tau


class Elastic(Compliant):
    def equations(self) -> Equations:
        yield from super().equations()
        yield (
            self.tau
            == 100 * self.tau  # a comment that is not part of the equation
            - 3 * self.tau
        )


def line_of(function: object, text: str) -> int:
    """Line of a text within the source of a function or class."""
    lines, first = inspect.getsourcelines(function)  # type: ignore[arg-type]
    return first + next(k for k, line in enumerate(lines) if text in line)


def sources(component: Component) -> list[tuple[str, int, str]]:
    flat = flatten(component)
    return [(s.file, s.line, s.text) for s in flat.instances[0].template.sources]


def test_every_equation_knows_its_line_and_text():
    found = sources(Elastic())
    assert [file for file, _, _ in found] == [__file__] * 4
    assert found[0][1:] == (
        line_of(Compliant, "yield self.phi_rel"), "yield self.phi_rel == self.flange_b.phi - self.flange_a.phi",
    )  # fmt: skip
    assert found[2][1] == line_of(Compliant, "yield self.flange_a.tau")


def test_an_equation_over_several_lines_is_told_on_one():
    file, line, text = sources(Elastic())[3]
    assert line == line_of(Elastic, "yield (")
    assert text == "yield ( self.tau == 100 * self.tau - 3 * self.tau )"


def test_equations_of_a_helper_generator_are_found_where_they_stand():
    class Delegating(Compliant):
        def law(self) -> Equations:
            yield self.tau == 0  # in the helper

        def equations(self) -> Equations:
            yield from super().equations()
            yield from self.law()

    assert sources(Delegating())[3][1:] == (line_of(Delegating, "# in the helper"), "yield self.tau == 0")


def test_equations_may_come_from_a_list():
    class Listed(Compliant):
        def equations(self) -> Equations:
            return iter([*super().equations(), self.tau == 0])

    assert sources(Listed())[3] == ("", 0, "")


def test_text_with_wide_characters_is_cut_at_the_right_column():
    class Wide(Compliant):
        def equations(self) -> Equations:
            yield from super().equations()
            "Δφ·ω"
            yield self.tau == 0
            "ü"

    assert sources(Wide())[3][2] == "yield self.tau == 0"


def refused(equation: object) -> ModelicaLikeError:
    class Wrong(Compliant):
        def equations(self) -> Equations:
            yield from super().equations()
            yield equation(self)  # type: ignore[operator]

    with pytest.raises(LanguageError) as caught:
        flatten(Wrong())
    assert caught.value.where[0].line == line_of(Wrong, "yield equation(self)")
    return caught.value


def test_a_number_on_the_left_stays_an_equation_or_is_refused():
    """Python turns `0 == x` round, so it works; it types as bool, so the language asks for a symbol on the left."""

    class Turned(Compliant):
        def equations(self) -> Equations:
            yield from super().equations()
            yield 0 == self.tau  # type: ignore[misc]  # noqa: SIM300

    assert len(sources(Turned())) == 4


@pytest.mark.parametrize(
    ("equation", "message"),
    [
        (lambda c: c.tau == c.tau, "Wrong has an equation whose two sides are the same, or have only numbers."),
        (lambda c: c.tau - c.tau == 0, "Wrong has an equation whose two sides are the same, or have only numbers."),
        (lambda c: 1 == 2, "Wrong has an equation that Python evaluated to False."),
        (lambda c: c.flange_a == c.flange_b, "Wrong has an equation that Python evaluated to False."),
        (lambda c: c.tau, "Wrong.equations() yields Symbol instead of an equation."),
        (lambda c: c.tau - 1, "Wrong.equations() yields SX instead of an equation."),
        (lambda c: c.tau < 1, "Wrong.equations() yields SX instead of an equation."),
        (lambda c: None, "Wrong.equations() yields NoneType instead of an equation."),
        (lambda c: c.flange_a, "Wrong.equations() yields Flange instead of an equation."),
        (lambda c: (c.tau == 0, c.phi_rel == 0), "Wrong.equations() yields tuple instead of an equation."),
        (lambda c: iter([c.tau == 0]), "Wrong.equations() yields list_iterator instead of an equation."),
    ],
)
def test_what_is_no_equation_is_refused_with_its_line(equation, message):
    error = refused(equation)
    assert error.what == message
    assert error.advice


@pytest.mark.parametrize(
    "condition",
    [
        lambda c: c.tau == (2 if c.tau > 1 else 3),
        lambda c: c.tau == 0 if c.phi_rel > 0 else c.tau == 1,
        lambda c: c.tau == c.phi_rel == 0,
        lambda c: c.tau > 0 and c.tau == 0,
        lambda c: c.tau == max(c.tau, 0),
    ],
)
def test_python_cannot_decide_about_symbols(condition):
    class Deciding(Compliant):
        def equations(self) -> Equations:
            yield from super().equations()
            yield condition(self)

    with pytest.raises(
        LanguageError, match=r"^Deciding\.equations\(\) asks Python whether a relation of symbols"
    ) as caught:
        flatten(Deciding())
    (place,) = caught.value.where
    assert place.file == __file__
    assert "c.tau" in place.text or "c.phi_rel" in place.text
    assert "where(condition, a, b)" in caught.value.advice


def test_a_function_of_math_makes_nan_of_a_symbol():
    class Lost(Compliant):
        def equations(self) -> Equations:
            yield from super().equations()
            yield self.tau == self.tau * math.sqrt(self.phi_rel)

    with pytest.raises(LanguageError, match=r"^Lost: an expression contains nan\.") as caught:
        flatten(Lost())
    assert "math.sqrt" in caught.value.where[0].text
    assert "import sqrt" in caught.value.advice


def test_numbers_of_numpy_are_numbers():
    class Numeric(Compliant):
        def equations(self) -> Equations:
            yield from super().equations()
            yield np.float64(2.0) * self.tau == np.float64(0.0) + self.tau * np.int64(3)

    assert len(sources(Numeric())) == 4


def test_connect_takes_connectors_and_signals_only():
    class Empty(Compliant):
        pass

    one = Empty()
    for wrong in (1.0, "flange_a", one, one.tau + 1):
        with pytest.raises(LanguageError, match=r"^connect\(\) was given"):
            connect(one.flange_a, wrong)  # type: ignore[arg-type]
    with pytest.raises(LanguageError, match="only one end"):
        connect(one.flange_a)


def test_free_takes_connectors_only():
    class Empty(Compliant):
        pass

    with pytest.raises(LanguageError, match=r"^free\(\) was given"):
        free(Empty().tau)  # type: ignore[arg-type]


def test_equations_that_are_returned_instead_of_yielded_are_refused():
    class Returned(Compliant):
        def equations(self) -> Equations:
            return self.tau == 0  # type: ignore[return-value]

    with pytest.raises(LanguageError, match=r"^Returned\.equations\(\) returns SX instead of yielding equations"):
        flatten(Returned())


def test_nothing_returned_is_refused():
    class Nothing(Compliant):
        def equations(self) -> Equations:  # type: ignore[return]
            connect(self.flange_a, self.flange_b)

    with pytest.raises(LanguageError, match=r"^Nothing\.equations\(\) returns NoneType instead of yielding equations"):
        flatten(Nothing())


# -- balance ---------------------------------------------------------------------------------------------------------


def test_a_forgotten_super_is_told():
    class Forgotten(Compliant):
        def equations(self) -> Equations:
            yield self.tau == 0

    with pytest.raises(ComponentUnbalanced) as caught:
        flatten(Forgotten())
    assert caught.value.what == (
        "Forgotten declares 1 equation for 4 unknowns (phi_rel, tau, flange_a.tau, flange_b.tau)."
    )
    assert caught.value.advice == (
        "Its base Compliant has equations of its own: is `yield from super().equations()` missing?"
    )


def test_a_forgotten_yield_is_told():
    class Forgotten(Component):
        x: Variable = var("1", "x")
        y: Variable = var("1", "y")

        def equations(self) -> Equations:
            yield self.x == 1
            self.y == 2

    with pytest.raises(ComponentUnbalanced) as caught:
        flatten(Forgotten())
    assert caught.value.what == "Forgotten declares 1 equation for 2 unknowns (x, y)."
    assert caught.value.advice == "Each own variable, output and flow needs one: is a `yield` missing?"


def test_an_equation_too_many_is_told():
    class Eager(Compliant):
        def equations(self) -> Equations:
            yield from super().equations()
            yield self.tau == 0
            yield self.phi_rel == 0

    with pytest.raises(ComponentUnbalanced, match="Eager declares 5 equations for 4 unknowns") as caught:
        flatten(Eager())
    assert "remove an equation" in caught.value.advice


def test_inputs_need_no_equation_and_outputs_do():
    class Gain(Component):
        u = signal_in("1", "in", default=1.0)
        y = signal_out("1", "out")

        def equations(self) -> Equations:
            yield self.y == 2 * self.u

    flat = flatten(Gain())
    assert [flat.variables[node].path for node in flat.inputs] == ["u"]
    assert len(flat.linear) + len(flat.general) == 1


def test_optional_connectors_count_only_where_they_are_used():
    class Housed(Component):
        shaft = Flange("shaft", free=True)
        support = Flange("housing", optional=True)

        def equations(self) -> Equations:
            yield self.shaft.tau == 0
            if self.support.used:
                yield self.support.tau == 0

    class Wall(Component):
        flange = Flange("wall")

        def equations(self) -> Equations:
            yield self.flange.phi == 0

    class Both(Component):
        alone, held, wall = Housed(), Housed(), Wall()

        def equations(self) -> Equations:
            yield connect(self.held.support, self.wall.flange)

    names = [v.path for v in flatten(Both()).variables]
    assert "held.support.tau" in names
    assert not any(name.startswith("alone.support") for name in names)


def test_several_errors_are_told_together():
    class Mixed(Compliant):
        def equations(self) -> Equations:
            yield from super().equations()
            yield self.tau == self.phi_rel

    class Drive(Component):
        first, second = Mixed(), Mixed()

        def equations(self) -> Equations:
            yield connect(self.first.flange_b, self.second.flange_a)

    with pytest.raises(ModelicaLikeError, match=r"left N\.m, right rad") as caught:
        flatten(Drive())
    assert not isinstance(caught.value, WiringErrors)  # the same line is told once, not for each instance


def test_der_of_an_expression_is_the_chain_rule():
    class Ratio(Component):
        x: Variable = var("m", "x")
        v: Variable = var("m/s", "v")
        y: Variable = var("m2/s", "y")
        z: Variable = var("m/s2", "z")

        def equations(self) -> Equations:
            yield self.v == der(self.x)
            yield der(self.x) == -self.x * self.one
            yield self.y == der(self.x**2)
            yield self.z == der(der(self.x))

        from modelica_like.language import Parameter, param

        one: Parameter = param("1/s", "rate", default=1.0)

    from modelica_like import simulate

    run = simulate(Ratio(x=2.0), 1.0, rtol=1e-10, atol=1e-12)
    assert run["y"] == pytest.approx(2 * run["x"] * run["v"], rel=1e-12)
    assert run["z"] == pytest.approx(run["x"], rel=1e-12)
