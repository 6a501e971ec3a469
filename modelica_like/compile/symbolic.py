"""A compiled model as named CasADi symbols: for own optimal control, own integrators, closed formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import casadi as ca

from modelica_like.errors import LanguageError, UnknownName, did_you_mean, extra_module

if TYPE_CHECKING:
    from modelica_like.compile.compiled import CompiledDae

_UNARY = {
    ca.OP_ASSIGN: lambda sp, a: a, ca.OP_NEG: lambda sp, a: -a, ca.OP_SQ: lambda sp, a: a**2,
    ca.OP_TWICE: lambda sp, a: 2 * a, ca.OP_INV: lambda sp, a: 1 / a, ca.OP_SQRT: lambda sp, a: sp.sqrt(a),
    ca.OP_EXP: lambda sp, a: sp.exp(a), ca.OP_LOG: lambda sp, a: sp.log(a), ca.OP_SIN: lambda sp, a: sp.sin(a),
    ca.OP_COS: lambda sp, a: sp.cos(a), ca.OP_TAN: lambda sp, a: sp.tan(a), ca.OP_ASIN: lambda sp, a: sp.asin(a),
    ca.OP_ACOS: lambda sp, a: sp.acos(a), ca.OP_ATAN: lambda sp, a: sp.atan(a), ca.OP_SINH: lambda sp, a: sp.sinh(a),
    ca.OP_COSH: lambda sp, a: sp.cosh(a), ca.OP_TANH: lambda sp, a: sp.tanh(a), ca.OP_FABS: lambda sp, a: sp.Abs(a),
    ca.OP_FLOOR: lambda sp, a: sp.floor(a), ca.OP_CEIL: lambda sp, a: sp.ceiling(a), ca.OP_ERF: lambda sp, a: sp.erf(a),
    ca.OP_ASINH: lambda sp, a: sp.asinh(a), ca.OP_ACOSH: lambda sp, a: sp.acosh(a),
    ca.OP_ATANH: lambda sp, a: sp.atanh(a),
    ca.OP_SIGN: lambda sp, a: sp.sign(a), ca.OP_NOT: lambda sp, a: 1 - a,
}  # fmt: skip
_BINARY = {
    ca.OP_ADD: lambda sp, a, b: a + b, ca.OP_SUB: lambda sp, a, b: a - b, ca.OP_MUL: lambda sp, a, b: a * b,
    ca.OP_DIV: lambda sp, a, b: a / b, ca.OP_POW: lambda sp, a, b: a**b, ca.OP_CONSTPOW: lambda sp, a, b: a**b,
    ca.OP_FMIN: lambda sp, a, b: sp.Min(a, b), ca.OP_FMAX: lambda sp, a, b: sp.Max(a, b),
    ca.OP_ATAN2: lambda sp, a, b: sp.atan2(a, b),
    ca.OP_LT: lambda sp, a, b: sp.Piecewise((1, a < b), (0, True)),
    ca.OP_LE: lambda sp, a, b: sp.Piecewise((1, a <= b), (0, True)),
    ca.OP_EQ: lambda sp, a, b: sp.Piecewise((1, sp.Eq(a, b)), (0, True)),
    ca.OP_IF_ELSE_ZERO: lambda sp, a, b: sp.Piecewise((b, sp.Ne(a, 0)), (0, True)),
    ca.OP_NE: lambda sp, a, b: sp.Piecewise((1, sp.Ne(a, b)), (0, True)),
    ca.OP_HYPOT: lambda sp, a, b: sp.sqrt(a**2 + b**2),
    ca.OP_AND: lambda sp, a, b: a * b, ca.OP_OR: lambda sp, a, b: sp.Max(a, b),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Symbolic:
    """The equations of a compiled model, all in SI units.

    Between events d is constant: it holds modes, discrete values and what follows from them. `Segment.d` of a run has
    its numbers.

    Attributes:
        model: the model.
        t: time.
        x: states, shape (states,).
        z: algebraic unknowns, shape (algebraic,).
        p: parameters, shape (parameters,).
        u: open inputs, shape (inputs,).
        d: discrete values, shape (discrete,).
        rates: derivatives of x.
        residuals: zero for the right z.
        guards: positive where an event can fire, in the order of `events`.
        events: names of the events: `clutch.mode: backward → stuck`.
    """

    model: CompiledDae
    t: Any = field(repr=False)
    x: Any = field(repr=False)
    z: Any = field(repr=False)
    p: Any = field(repr=False)
    u: Any = field(repr=False)
    d: Any = field(repr=False)
    rates: Any = field(repr=False)
    residuals: Any = field(repr=False)
    guards: Any = field(repr=False)
    events: tuple[str, ...]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of x."""
        return self.model.states

    @property
    def algebraic(self) -> tuple[str, ...]:
        """Names of z."""
        return self.model.implicit

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of p."""
        return tuple(parameter.path for parameter in self.model.flat_parameters)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of u."""
        return tuple(self.model.flat_variables[k].path for k in self.model.inputs)

    @property
    def arguments(self) -> dict[str, Any]:
        """The symbols by their names: t, x, z, p, u, d."""
        return {"t": self.t, "x": self.x, "z": self.z, "p": self.p, "u": self.u, "d": self.d}

    def __getitem__(self, name: str) -> Any:
        """Return a variable, parameter or mode as an expression of the symbols.

        Raises:
            UnknownName: there is no such name.
        """
        model = self.model
        for positions, column in (
            (model.parameter_position, lambda: self.p), (model.discrete_position, lambda: self.d),
            (model.position, lambda: model.equations.variables(*self.arguments.values())),
            (model.derived_position, lambda: model.equations.derived(self.p)),
        ):  # fmt: skip
            if name in positions:
                return column()[positions[name]]
        near = did_you_mean(name, [*model.position, *model.parameter_position]) or "."
        raise UnknownName(f"{model.name} has no variable or parameter '{name}'{near}")

    def function(self, names: Mapping[str, Any], *, d: Any, p: Any = None) -> ca.Function:
        """Return f(t, x, z, u) with expressions as results, for one smooth phase.

        Args:
            names: results by name: expressions of the symbols, or paths of variables.
            d: numbers for d, such as `run.segments[0].d`.
            p: numbers for p; by default those of the model.
        """
        results = [self[value] if isinstance(value, str) else value for value in names.values()]
        given = [self.t, self.x, self.z, self.p, self.u, self.d]
        whole = ca.Function("whole", given, results)
        open_ends = (self.t, self.x, self.z, self.u)
        t, x, z, u = (ca.SX.sym(name, symbol.numel()) for name, symbol in zip("txzu", open_ends, strict=True))
        values = whole.call([t, x, z, ca.DM(self.model.p if p is None else p), u, ca.DM(d)])
        return ca.Function(self.model.name, [t, x, z, u], values, ["t", "x", "z", "u"], list(names))

    def sympy(self, expression: Any) -> Any:
        """Return an expression as a SymPy matrix, with a symbol for each name.

        Args:
            expression: of the symbols; or the path of a variable.

        Raises:
            MissingExtra: SymPy is not installed.
            LanguageError: SymPy has no such function.
        """
        sp = extra_module("sympy", "formulas")
        column = self[expression] if isinstance(expression, str) else expression
        shown = [["t"], self.states, self.algebraic, self.parameters, self.inputs]
        names = [*shown, [f"d{k}" for k in range(self.d.numel())]]
        names[-1][: len(self.model.flat_discretes)] = [item.path for item in self.model.flat_discretes]
        symbols = [[sp.Symbol(name, real=True) for name in group] for group in names]
        function = ca.Function("expression", [*self.arguments.values()], [ca.densify(column)])
        values, rows = _evaluated(sp, function, symbols), column.size1()
        return sp.Matrix(rows, column.size2(), lambda i, j: values[i + j * rows])


def _evaluated(sp: Any, function: ca.Function, given: list[list[Any]]) -> list[Any]:
    """Evaluate a function of SX by its instructions, in SymPy."""
    work: dict[int, Any] = {}
    results: dict[int, Any] = {}
    for k in range(function.n_instructions()):
        operation, inputs = function.instruction_id(k), function.instruction_input(k)
        if operation == ca.OP_OUTPUT:
            results[function.instruction_output(k)[1]] = work[inputs[0]]
            continue
        if operation == ca.OP_INPUT:
            value = given[inputs[0]][inputs[1]]
        elif operation == ca.OP_CONST:
            value = sp.nsimplify(function.instruction_constant(k), rational=True)
        elif operation in _UNARY:
            value = _UNARY[operation](sp, work[inputs[0]])
        elif operation in _BINARY:
            value = _BINARY[operation](sp, *(work[place] for place in inputs))
        else:
            named = {value: name[3:].lower() for name, value in vars(ca).items() if name.startswith("OP_")}
            raise LanguageError(
                f"There is no formula of the function {named.get(operation, operation)} in SymPy.",
                advice="Ask for the parts of the expression without it.",
            )
        work[function.instruction_output(k)[0]] = value
    return [results[k] for k in sorted(results)]


def symbolic(model: CompiledDae) -> Symbolic:
    """Return a model as named symbols."""
    given = model.arguments
    values = [*given.values()]
    events = tuple(_event(model, form) for form in model.events.transitions if not form.timed)
    rates, residuals, guards = (
        function(*values) for function in (model.equations.ode, model.equations.alg, model.events.guards)
    )
    return Symbolic(
        model, given["t"], given["x"], given["z"], given["p"], given["u"], given["d"], rates, residuals, guards, events
    )


def _event(model: CompiledDae, form: Any) -> str:
    """Return the name of a transition."""
    discrete = model.flat_discretes[form.mode] if 0 <= form.mode < len(model.flat_discretes) else None
    if discrete is None or not discrete.names:
        return form.because or str(form.source)
    sources = ", ".join(discrete.names[source] for source in form.sources)
    return f"{discrete.path}: {sources} → {discrete.names[form.target]}"
