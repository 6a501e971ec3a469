"""Every way in which a Modelica text is refused, and the sentence that tells it."""

from pathlib import Path

import pytest

from modelica_like import build, export_html, load, simulate, split
from modelica_like.errors import (
    ComponentUnbalanced,
    ExportError,
    LanguageError,
    LimitPassed,
    ModelicaLikeError,
    ModelicaTextError,
    SingularAtStart,
    Underdetermined,
    UnknownName,
    ValueOutOfRange,
)
from modelica_like.netlist.modelica.flat_text import flat_text
from modelica_like.netlist.modelica.write import modelica_text

R = "Modelica.Mechanics.Rotational.Components"


def model(declarations: str = "", equations: str = "", before: str = "") -> str:
    """Return a text: class A with declarations from line 3, and equations from line 5, after `before` in line 1."""
    return f"{before}\nmodel A\n{declarations}\nequation\n{equations}\nend A;\n"


CONNECTED = "connector U = input Boolean; connector Y = output Boolean; block C U u; end C;"
CAUSAL = "connector K input Boolean b; output Boolean c; end K; block D K k; equation k.c = k.b; end D;"
OUTER = (
    "connector F Real v; flow Real i; end F; model W F f; equation f.v = 1; end W; "
    "model B outer W w; F g; equation g.i = g.v; connect(g, w.f); end B;"
)
NESTED = "connector F Real v; flow Real i; end F; connector K input Boolean b; F f; end K; block D K k; end D;"
BUS = (
    "connector U = input Real; connector Y = output Real; expandable connector B end B; block G U u; end G; "
    "block S Y y = 1; end S;"
)
BUS_IN_BUS = (
    "connector Y = output Real; expandable connector I end I; expandable connector B I sub; end B; "
    "block S Y y = 1; end S;"
)
ENDLESS = "while true loop y := 1; end while"
GROWING = "function f input Real u; output Real y; algorithm y := u; for i in 1:60 loop y := y*y + y; end for; end f;"
LESS = (
    "function f input Real v[:]; input Real u; output Real w; "
    "algorithm w := u; while w > v[1] loop w := w - 1; end while; end f;"
)
SLICED = "when time > 0.5 then w[k, {2, 1}] := {1, 2}; end when;"
DRAWN = 'function f input Integer a[:]; output Real y; external "C" y = ModelicaRandom_{}(a); end f;'
TYPES = (
    "type M = enumeration(a, b); type N = enumeration(a, b); model B parameter Real k = 1; end B; "
    "record P parameter Real u = 1; parameter Real v = 1; end P;"
)
SIGNALS = (
    'block P Modelica.Blocks.Interfaces.RealOutput y(unit = "kW") = 3; end P; '
    'block Q Modelica.Blocks.Interfaces.RealInput u(unit = "W"); end Q;'
)
F = "function f input Real speed; output Real y; algorithm y := speed; end f;"
MESSAGES: dict[str, tuple[str, str]] = {
    "a variable of a bus without a source": (
        model("B bus; G g;", "connect(bus.x, g.u);", BUS),
        "Nothing gives bus.x a value.\n  in a.mo:5 `connect(bus.x, g.u);`\n"
        "Connect exactly one output with a variable of a bus.",
    ),
    "a variable of a bus with two sources": (
        model("B bus; S r, s;", "connect(bus.x, r.y);\nconnect(s.y, bus.x);", BUS),
        "r.y and s.y give bus.x a value.\n  in a.mo:5 `connect(bus.x, r.y);`\n  in a.mo:6 `connect(s.y, bus.x);`\n"
        "Connect exactly one output with a variable of a bus.",
    ),
    "a bus and a signal": (
        model("B bus; G g;", "connect(bus, g.u);", BUS),
        "bus is a bus, and g.u is none.\n  in a.mo:5 `connect(bus, g.u);`\nConnect a variable of the bus.",
    ),
    "a bus in a bus that is nowhere": (
        model("B bus; S s;", "connect(bus.sub.x, s.y);", BUS),
        "There is no connector bus.sub.\n  in a.mo:5 `connect(bus.sub.x, s.y);`\n"
        "Declare it in the class of the bus, or join it with a connector.",
    ),
    "a bus and one that is in it": (
        model("B bus; S s;", "connect(bus, bus.sub);\nconnect(bus.sub.x, s.y);", BUS_IN_BUS),
        f"A bus is joined with one that is in it.\n  in a.mo:1 `{BUS_IN_BUS}`\n"
        "Connect it with a bus that stands beside it.",
    ),
    "transport": (
        model("Real x; Real y;", "(x, y) = spatialDistribution(time, 0, time, true);"),
        "spatialDistribution (of a constant velocity it is delay(u, T)): that is not supported here.\n"
        "  in a.mo:5 `(x, y) = spatialDistribution(time, 0, time, true);`",
    ),
    "units of a connection": (
        model("P p; Q q;", "connect(p.y, q.u);", before=SIGNALS),
        "p.y is in kW, and q.u in W.\n  in a.mo:5 `connect(p.y, q.u);`\n"
        f"  in a.mo:1 `{SIGNALS}`\n  in a.mo:1 `{SIGNALS}`\n"
        "Declare both in one unit, or convert between them: a connection does not.",
    ),
    "no end": ("model A\n  Real x;\n", "model A of line 1 has no 'end A;'.\n  in a.mo:3"),
    "wrong end": ("model A\n  Real x;\nend B;\n", "model A of line 1 ends with 'end B'.\n  in a.mo:3 `end B;`"),
    "no semicolon": (model("Real x", "x = 1;"), "Expected ';' before 'equation'.\n  in a.mo:4 `equation`"),
    "no equation": (model("Real x;", "x + 1;"), "Expected '=' before ';'.\n  in a.mo:5 `x + 1;`"),
    "a strange sign": (model("Real x;", "x = 1 $ 2;"), "'$' has no meaning in Modelica.\n  in a.mo:5 `x = 1 $ 2;`"),
    "no expression": (model("Real x;", "x = * 2;"), "Expected an expression before '*'.\n  in a.mo:5 `x = * 2;`"),
    "empty": ("// nothing\n", "The file has no class.\n  in a.mo:1 `// nothing`"),
    "no model": ("function f\nend f;\n", "'a.mo' has no model. Its models: none.\n  in a.mo:1 `function f`"),
    "unknown class": (model("Inertiaa J;"), "There is no class 'Inertiaa'.\n  in a.mo:3 `Inertiaa J;`"),
    "a class that is not in the table": (
        model("Modelica.Mechanics.MultiBody.World world;"),
        "There is no class 'Modelica.Mechanics.MultiBody.World'.\n"
        "  in a.mo:3 `Modelica.Mechanics.MultiBody.World world;`\n"
        "No component here stands for this class of the standard library.\n"
        "Give the library's own text by --library.",
    ),
    "unknown parameter": (
        model(f"{R}.Inertia a(JJ = 1);"),
        f"{R}.Inertia has no 'JJ' here; did you mean 'J'?\n  in a.mo:3 `{R}.Inertia a(JJ = 1);`",
    ),
    "unknown name": (
        model("Real speed;", "speed = 2*sped;"),
        "There is no 'sped'; did you mean 'speed'?\n  in a.mo:5 `speed = 2*sped;`",
    ),
    "unknown variable of a part": (
        model("B b; Real x;", "x = b.z;", "model B Real y = 1; end B;"),
        "b has no 'z'.\n  in a.mo:5 `x = b.z;`",
    ),
    "unknown end": (
        model(f"{R}.Inertia a;", "connect(a.flange_b, b.flange_a);"),
        "A has no 'b'.\n  in a.mo:5 `connect(a.flange_b, b.flange_a);`",
    ),
    "outer without inner": (
        model("outer Real g; Real x;", "x = g;"),
        "outer g has no inner g above it.\n  in a.mo:5 `x = g;`",
    ),
    "a displayUnit that is no text": (
        model(f"{R}.Inertia a(w(displayUnit = true));"),
        f"a.w.displayUnit is a String, and true is none.\n  in a.mo:3 `{R}.Inertia a(w(displayUnit = true));`",
    ),
    "a start of an input that changes": (
        model("Real x = 1; Modelica.Blocks.Interfaces.RealInput u(start = x);"),
        "A start value of u that only a run knows: that is not supported here.\n"
        "  in a.mo:3 `Real x = 1; Modelica.Blocks.Interfaces.RealInput u(start = x);`",
    ),
    "a displayUnit that is a variable": (
        model(f"Real x = 1; {R}.Inertia a(w(displayUnit = x));"),
        "A displayUnit of a.w that is no text: that is not supported here.\n"
        f"  in a.mo:3 `Real x = 1; {R}.Inertia a(w(displayUnit = x));`",
    ),
    **{
        f"no condition: {text}": (
            model("Integer k = 2; Boolean b = time > 1; Real x;", text),
            f"{what}.\n  in a.mo:5 `{text}`",
        )
        for text, what in {
            "x = if k then 1 else 2;": "The condition of this 'if' is a number",
            "if k then x = 1; else x = 2; end if;": "The condition of this 'if' is a number",
            "der(x) = 1; when k then reinit(x, 0); end when;": "The condition of this 'when' is a number",
            'x = 1; assert(k, "k");': "The condition of this 'assert' is a number",
            "x = if not k then 1 else 2;": "'not' joins conditions, and a number is none",
            "x = if b and pre(k) then 1 else 2;": "'and' joins conditions, and a number is none",
            "x = if b > k then 1 else 2;": "A condition and a number cannot be compared by >",
            "der(x) = b;": "A condition is no number: write `if … then 1 else 0`",
            "x = pre(b);": "x is a Real, and a truth value is none",
        }.items()
    },
    "a Boolean with a number": (
        model("Integer k = 2; Boolean b = k;"),
        "b is a Boolean, and a formula of numbers is none.\n  in a.mo:3 `Integer k = 2; Boolean b = k;`",
    ),
    **{
        f"declared: {text}": (
            model(text, before=TYPES),
            f"{what.rstrip('?')}{'?' if what.endswith('?') else '.'}\n  in a.mo:3 `{text}`",
        )
        for text, what in {
            "Real z(strat = 3) = 1;": "z, a Real, has no 'strat'; did you mean 'start'?",
            "B b(k.x = 1);": "k, a Real, has no 'x'",
            "Real z(start(x = 1)) = 1;": "z.start has no 'x'",
            "Real z(stateSelect = StateSelect.allways);": "StateSelect has no 'allways'; did you mean 'always'?",
            f"{R}.Inertia a(w(fixd = true));": "a.w has no 'fixd'; did you mean 'fixed'?",
            "Modelica.Mechanics.Rotational.Interfaces.Flange_a f(ph(start = 1));": "f has no 'ph'; did you mean 'phi'?",
            "Real z(fixed = 1) = 1;": "z.fixed is a Boolean, and 1 is none",
            "Real z(unit = 3) = 1;": "z.unit is a String, and 3 is none",
            'Real z(min = "a") = 1;': 'z.min is a Real, and "a" is none',
            "Real z(stateSelect = 3) = 1;": "z.stateSelect is a StateSelect, and 3 is none",
            "Integer n = if time > 1 then 2 else 2.5;": "n is an Integer, and 2.5 is none",
            "Real z = time > 1;": "z is a Real, and a truth value is none",
            "Boolean z = time + 1;": "z is a Boolean, and a formula of numbers is none",
            "parameter M m = N.a;": "m is a value of M, and N.a is none",
            "parameter Integer n(min = 1) = 0;": "n = 0 is out of range: it must be at least 1",
            "parameter Real v[2](each max = 1) = {1, 2};": "v = 2 is out of range: it must be at most 1",
            "parameter Real v[2, 2] = {1, 2};": "v has the size 2, 2, and its value the size 2",
            "parameter Real v[2] = 1;": "v has the size 2, and its value is no array",
            "parameter Real v = {1, 2};": "v is no array, and its value is one",
            "parameter Real v[:, 2] = {{1, 2}, {3}};": "v has a value whose rows are of different lengths",
            "P p = P(1, 2, 3);": "P(…) with more than 2 values: that is not supported here",
        }.items()
    },
    "stream": (
        model("C c;", before="connector C stream Real h; flow Real m; end C;"),
        "'stream' before h: that is not supported here.\n  in a.mo:1 `connector C stream Real h; flow Real m; end C;`",
    ),
    "external function": (
        model("Real x = f(1);", before='function f input Real u; output Real y; external "C"; end f;'),
        "f(…), a function of another language: that is not supported here.\n"
        "  in a.mo:3 `Real x = f(1);`\n"
        "Write its algorithm in Modelica.",
    ),
    "overdetermined connectors": (
        model("Real x;", "Connections.branch(a.R, b.R);"),
        "Connections.branch(…) among equations: that is not supported here.\n"
        "  in a.mo:5 `Connections.branch(a.R, b.R);`",
    ),
    "state machine": (
        model("Real x;", "x = transition(a, b);"),
        "A state machine: that is not supported here.\n  in a.mo:5 `x = transition(a, b);`",
    ),
    "clock": (
        model("Real x;", "x = subSample(x, 2);"),
        "A clock that follows another: that is not supported here.\n  in a.mo:5 `x = subSample(x, 2);`",
    ),
    "algorithm for a part": (
        "model A\n  Real x;\nalgorithm\n  z := 1;\nend A;\n",
        "An assignment to z: that is not supported here.\n  in a.mo:4 `z := 1;`",
    ),
    "a 'when' and more in an algorithm": (
        "model A\n  Integer n;\nalgorithm\n  n := 1;\n  when time > 1 then\n    n := 2;\n  end when;\nend A;\n",
        "n, which a 'when' and other statements give a value,: that is not supported here.\n"
        "  in a.mo:5 `when time > 1 then`",
    ),
    "a loop that may end": (
        model(
            "Real x = f({time, 1});",
            before="function f input Real u[:]; output Real y; algorithm y := 0; for i in 1:2 loop "
            "if u[i] > 1 then break; end if; y := y + 1; end for; end f;",
        ),
        "A loop that ends where only a run knows: that is not supported here.\n"
        "  in a.mo:1 `function f input Real u[:]; output Real y; algorithm y := 0; for i in 1:2 loop "
        "if u[i] > 1 then break; end if; y := y + 1; end for; end f;`",
    ),
    "a package handed on with a modification": (
        "package P\n  package C\n    constant Real k = 1;\n  end C;\n  model A\n    replaceable package K = C;\n"
        "    Real y = K.k;\n  end A;\n  model B\n    replaceable package K = C;\n"
        "    A a(redeclare package K = K(k = 2));\n"
        "  end B;\n  model T\n    B b(redeclare package K = C);\n  end T;\nend P;\n",
        "package K = K(…), which is handed on with a modification,: that is not supported here.\n"
        "  in a.mo:11 `A a(redeclare package K = K(k = 2));`\n"
        "Give the modification where it is replaced first.",
    ),
    "a text as a number": (
        model("Real x;", 'x = 2*"two";'),
        'A text, an array or a choice stands where a number belongs.\n  in a.mo:5 `x = 2*"two";`',
    ),
    "two results": (
        model("Real x;", "(x, y) = f(1);"),
        "There is no 'y'.\n  in a.mo:5 `(x, y) = f(1);`",
    ),
    "pre of what changes all the time": (
        model("Real x;", "x = pre(x) + 1;"),
        "pre(x): only what changes at events has a value before them.\n  in a.mo:5 `x = pre(x) + 1;`",
    ),
    "two whens": (
        model("discrete Real x;", "when time > 1 then x = 1; end when; when time > 2 then x = 2; end when;"),
        "Two whens determine x.\n  in a.mo:5 `when time > 1 then x = 1; end when; when time > 2 then x = 2; end when;`",
    ),
    "a when that never comes": (
        model("discrete Real x;", "when 2 > 1 then x = 1; end when;"),
        "The condition of this 'when' never changes.\n  in a.mo:5 `when 2 > 1 then x = 1; end when;`",
    ),
    "branches of different length": (
        model("Real x; Real y;", "if time > 1 then x = 1; y = 1; else x = 2; end if;"),
        "An 'if' whose branches have different numbers of equations: that is not supported here.\n"
        "  in a.mo:5 `if time > 1 then x = 1; y = 1; else x = 2; end if;`",
    ),
    "a changing connection": (
        model(f"{R}.Inertia a; {R}.Inertia b;", "if time > 1 then connect(a.flange_b, b.flange_a); end if;"),
        "A connection or an event in a branch that changes during a run: that is not supported here.\n"
        "  in a.mo:5 `if time > 1 then connect(a.flange_b, b.flange_a); end if;`",
    ),
    "a base with a component": (
        f"model A\n  extends {R}.Inertia;\nend A;\n",
        f"A extends {R}.Inertia, for which a component of its own stands here: that is not supported here.\n"
        f"  in a.mo:2 `extends {R}.Inertia;`\n"
        "Write it as a part, and connect its ends. Give the library's own text by --library.",
    ),
    "a base that is not there": (
        "model A\n  extends B;\nend A;\n",
        "There is no class 'B'.\n  in a.mo:2 `extends B;`",
    ),
    "a value that is not supported": (
        model(f"{R}.Clutch k(fn_max = 1, smoothness = Modelica.Blocks.Types.Smoothness.ContinuousDerivative);"),
        "Clutch.smoothness = ContinuousDerivative: that is not supported here.\n"
        f"  in a.mo:3 `{R}.Clutch k(fn_max = 1, smoothness = Modelica.Blocks.Types.Smoothness.ContinuousDerivative);`\n"
        "The component Clutch has smoothness = LinearSegments only. Give the library's own text by --library.",
    ),
    "an index outside": (
        model("parameter Real k[2] = {1, 2}; Real x;", "x = k[3];"),
        "The index 3 is outside 1 to 2.\n  in a.mo:5 `x = k[3];`",
    ),
    "sizes that differ": (
        model("Real x[2];", "x = {1, 2, 3};"),
        "The sizes of both sides differ.\n  in a.mo:5 `x = {1, 2, 3};`",
    ),
    "a parameter without a value": (
        model("parameter Integer n; Real x[n];"),
        "n has no value.\n  in a.mo:3 `parameter Integer n; Real x[n];`\n  in a.mo:3 `parameter Integer n; Real x[n];`",
    ),
    "a parameter of itself": (
        model("parameter Integer n = m; parameter Integer m = n; Real x[n];"),
        "n depends on itself.\n  in a.mo:3 `parameter Integer n = m; parameter Integer m = n; Real x[n];`",
    ),
    "a class that extends itself": (
        "model A\n  extends A;\nend A;\n",
        "A extends itself.\n  in a.mo:1 `model A`",
    ),
    "a class that contains itself": (
        "model A\n  A a;\nend A;\n",
        "A contains itself.\n  in a.mo:2 `A a;`",
    ),
    "a broken assertion": (
        model("parameter Real k = 3;", 'assert(2 > 3, "k is too large");'),
        'An assertion is broken: k is too large.\n  in a.mo:5 `assert(2 > 3, "k is too large");`',
    ),
    "an unknown function": (
        model("Real x;", "x = bessel(2);"),
        "The function bessel: that is not supported here.\n"
        "  in a.mo:5 `x = bessel(2);`\nOwn functions with an algorithm are read.",
    ),
    "ticks over a connection": (
        model(
            "B b; Modelica.Electrical.Analog.Ideal.IdealClosingSwitch s;",
            "connect(b.y, s.control);",
            "connector Y = output Boolean; block B Y y; equation y = sample(0, 1); end B;",
        ),
        "b.y is true for instants only, which a connection does not carry here.\n"
        "  in a.mo:5 `connect(b.y, s.control);`\n"
        "Write the 'when' in the class of the sample, or name the variable: when block.y then.",
    ),
    "a connector's variable without a value": (
        model("D d;", "", CAUSAL),
        f"Nothing gives d.k.b a value.\n  in a.mo:1 `{CAUSAL}`\n"
        "Connect it, or write an equation for it where its connector is.",
    ),
    "no end that gives a value": (
        model("D d; D e;", "connect(d.k, e.k);", CAUSAL),
        "None of d.k, e.k gives b a value.\n  in a.mo:5 `connect(d.k, e.k);`\nExactly one end of a connection does.",
    ),
    "several ends that give a value": (
        model("D d; D e;", "connect(d.k, e.k);", CAUSAL.replace("input", "output")),
        "2 of d.k, e.k give b a value.\n  in a.mo:5 `connect(d.k, e.k);`\nExactly one end of a connection does.",
    ),
    "a connector in a connector with inputs": (
        model("D d;", "", NESTED),
        f"f beside inputs and outputs in a connector: that is not supported here.\n  in a.mo:1 `{NESTED}`",
    ),
    "two values before the start": (
        "model A\n  discrete Real n;\ninitial equation\n  pre(n) = 1;\n  pre(n) = 2;\n"
        "equation\n  when time > 1 then\n    n = 2;\n  end when;\nend A;\n",
        "Initial equations give n two values.\n  in a.mo:5 `pre(n) = 2;`",
    ),
    "two whens of an algorithm, one of them with other branches": (
        "model A\n  Real a; Real b;\nalgorithm\n  when time > 1 then\n    a := 1;\n  elsewhen time > 2 then\n"
        "    b := 1;\n  end when;\n  when time > 3 then\n    a := 2;\n  end when;\nend A;\n",
        "a, which another 'when' and some branches of this one give a value: that is not supported here.\n"
        "  in a.mo:4 `when time > 1 then`",
    ),
    "an outer part's connector": (
        model("inner W w; B b;", "", OUTER),
        f"A connection with w.f, which is outer: that is not supported here.\n  in a.mo:1 `{OUTER}`\n"
        "Connect it where the inner part is; equations may use its variables.",
    ),
    "a strange connector": (
        model("C c;", "c.k.b = true;", "connector K input Boolean b; Boolean c; end K; model C K k; end C;"),
        "c in a connector, neither input nor output: that is not supported here.\n"
        "  in a.mo:1 `connector K input Boolean b; Boolean c; end K; model C K k; end C;`",
    ),
    "cardinality of a number": (
        model("Real x; Real y[2] = {1, 2};", "x = cardinality(y);"),
        "cardinality(…) of what is no single connector: that is not supported here.\n  in a.mo:5 `x = cardinality(y);`",
    ),
    "a Boolean of a part": (
        model("C c;", "c.u = time > 1;", CONNECTED),
        "An equation for c.u, a Boolean of a part: that is not supported here.\n"
        "  in a.mo:5 `c.u = time > 1;`\nConnect a signal.",
    ),
    "a deep formula": (
        model("Real x;", f"x =\n{'(' * 400}1{')' * 400};")[:-1],
        f"This is nested more than 100 deep.\n  in a.mo:6 `{'(' * 159}…`",
    ),
    "classes in classes": (400 * "model M\n", "This is nested more than 100 deep.\n  in a.mo:101 `model M`"),
    "a long product": (
        model("Real x;", f"x =\n{'*'.join(['time'] * 302)};"),
        f"A formula has more than 300 levels.\n  in a.mo:6 `{'*'.join(['time'] * 32)}…`",
    ),
    "an algorithm that grows": (
        model("Real x = f(time);", before=GROWING),
        f"A formula has more than 500000 numbers, names and operations.\n  in a.mo:1 `{GROWING}`\n"
        "The loops of a function are written out, and so is what it gives on: take shorter loops and arrays.",
    ),
    "no end of steps": (
        model("Real x = f(time);", before=GROWING.replace("for i in 1:60 loop y := y*y + y; end for", ENDLESS)),
        "The text has too many parts and equations: reading it takes more than 1000000 steps.\n"
        f"  in a.mo:1 `{GROWING.replace('for i in 1:60 loop y := y*y + y; end for', ENDLESS)}`\n"
        "Look for loops and arrays that are longer than meant, and for classes that contain each other.",
    ),
    "a step of zero": (
        model("Real x[3];", "for i in 1:0:2 loop x[i] = 1; end for;"),
        "The range 1:0:2 has a step of 0.\n  in a.mo:5 `for i in 1:0:2 loop x[i] = 1; end for;`",
    ),
    **{
        f"arrays: {formula}": (model("Real x;", f"x = {formula};"), f"{what}.\n  in a.mo:5 `x = {formula};`")
        for formula, what in {
            "identity(time)": "The size of an array must be known",
            "identity(100000)": "An array cannot have 1e+10 elements: it has 0 to 100000",
            "scalar({1, 2})": "scalar(…) needs an array of one element, not of 2",
            "scalar(fill(1, 0))": "scalar(…) needs an array of one element, not of 0",
            "transpose({{1, 2}, {3}})": "transpose(…) needs a matrix: rows of the same length",
            "sum({1, 2}, {3})": "sum(…) has 1 argument, not 2",
            "product(3)": "product(…) needs an array",
            "zeros()": "zeros(…) has at least 1 argument, not 0",
            "fill(1)": "fill(…) has at least 2 arguments, not 1",
            "Integer()": "Integer(…) has 1 argument, not 0",
            "Integer(x)": "Integer(…) needs a value of an enumeration: integer(…) takes whole numbers of others",
            "homotopy(actual = x, simplified = x, other = 1)": "homotopy(…) has no argument 'other'",
            "homotopy(x, actual = x)": "homotopy(…) is given actual twice",
            "getInstanceName(1)": "getInstanceName(…) has 0 arguments, not 1",
            "pre(2*x)": "pre(…) needs a variable: a formula has no value before an event",
            "if edge(x) then 1 else 0": "edge(…) needs a Boolean variable",
            "der(x > 1)": "der(…) needs a number, and a condition is none",
            "reinit(x, 1)": "reinit(…) is a statement, and no value",
            "smooth(order = 0, expr = x)": "smooth(…) has no argument 'order'",
            "x[1]": "x is no array and has no subscript",
        }.items()
    },
    **{
        f"inputs: {formula}": (model("Real x;", f"x = {formula};", F), f"{what}\n  in a.mo:5 `x = {formula};`")
        for formula, what in {
            "f(1, 2)": "f has 1 input, not 2.",
            "f(speeds = 1)": "f has no input 'speeds'; did you mean 'speed'?",
            "f(1, speed = 1)": "f is given speed twice.",
            "f()": "f needs a value for its input speed.",
        }.items()
    },
    **{
        f"statements: {statement}": (model("Real x = 1;", statement), f"{what}\n  in a.mo:5 `{statement}`")
        for statement, what in {
            "assert(x > 0);": "assert(…) has 2 to 3 arguments, not 1.",
            'assert(x > 0, "low", lvl = AssertionLevel.warning);': "assert(…) has no argument 'lvl'.",
            'Modelica.Utilities.Streams.error("low", x);': "Streams.error(…) has 1 argument, not 2.",
            "when x > 1 then terminate(); end when;": "terminate(…) has 1 argument, not 0.",
            "when x > 1 then reinit(x); end when;": "reinit(…) has 2 arguments, not 1.",
        }.items()
    },
    "a value before of the time": (
        model("Real x;", "x = pre(time);"),
        "pre(time): only what changes at events has a value before them.\n  in a.mo:5 `x = pre(time);`",
    ),
    "values for some elements of a matrix of parts": (
        model(f"{R}.Inertia r[2,3](J = {{1, 2}});"),
        "An array of 2 by 3 elements is given 2 values.\n"
        "  in a.mo:3 `Modelica.Mechanics.Rotational.Components.Inertia r[2,3](J = {1, 2});`\n"
        "Write 'each' where all elements take the same.",
    ),
    "a sample without an interval": (
        model("Real x;", "when sample(0, 0) then x = time; end when;"),
        "sample(…) needs an interval above 0, not 0.\n  in a.mo:5 `when sample(0, 0) then x = time; end when;`",
    ),
    "a text beside a number": (
        model("Real x;", 'x = (if "x" > 1 then 1 else 0);'),
        'A text and a number cannot be compared.\n  in a.mo:5 `x = (if "x" > 1 then 1 else 0);`',
    ),
    "an order of two enumerations": (
        model("parameter M m = M.a; Real x;", "x = (if m < N.b then 1 else 0);", TYPES),
        "M.a and N.b have no order here: compare them by == or <>.\n  in a.mo:5 `x = (if m < N.b then 1 else 0);`",
    ),
    "a state of random numbers that is too short": (
        model("Real x;", "x = f({1, 2});", DRAWN.format("xorshift128plus")),
        "The state of xorshift128plus has 4 whole numbers, not 2.\n  in a.mo:5 `x = f({1, 2});`",
    ),
    "random numbers with a hidden state": (
        model("Real x;", "x = f({1, 2});", DRAWN.format("impureRandom_xorshift1024star")),
        "Random numbers whose state is hidden are not supported: draw them by "
        "Modelica.Math.Random.Generators.Xorshift1024star.random, with a state of your own.\n"
        "  in a.mo:5 `x = f({1, 2});`",
    ),
    "a subscript of an initial equation": (
        model(
            "Integer k = integer(time) + 1; Real v[2] = {1, 2}; parameter Real p(fixed = false); "
            "initial equation p = v[k];"
        ),
        "A subscript of an initial equation must be known.\n"
        "  in a.mo:3 `Integer k = integer(time) + 1; Real v[2] = {1, 2}; parameter Real p(fixed = false); "
        "initial equation p = v[k];`",
    ),
    "a subscript of what is outside": (
        model("Integer k = integer(time) + 1; B b(u = w[k]); Real w[2] = {1, 2};", before="model B Real u; end B;"),
        "A subscript of what is outside of a class must be known.\n"
        "  in a.mo:3 `Integer k = integer(time) + 1; B b(u = w[k]); Real w[2] = {1, 2};`",
    ),
    "a subscript of nothing": (
        model("Integer k = integer(time) + 1; parameter Real v[0]; Real x;", "x = v[k];"),
        "An array without elements has none at a subscript.\n  in a.mo:5 `x = v[k];`",
    ),
    "a slice beside a subscript of a run": (
        model("Integer k = integer(time) + 1; Real w[2, 2];", f"algorithm {SLICED}"),
        "A slice beside a subscript that only a run knows: that is not supported here.\n"
        f"  in a.mo:5 `algorithm {SLICED}`",
    ),
    "a large array": (
        model("Real v[100000000];"),
        "An array cannot have 1e+08 elements: it has 0 to 100000.\n  in a.mo:3 `Real v[100000000];`",
    ),
    "a large matrix": (
        model("Real v[10000, 10000];"),
        "v, an array of 100000000 elements (at most 100000): that is not supported here.\n"
        "  in a.mo:3 `Real v[10000, 10000];`",
    ),
    "a size that is no whole number": (
        model("Real v[2.5];"),
        "An array cannot have 2.5 elements: it has 0 to 100000.\n  in a.mo:3 `Real v[2.5];`",
    ),
    "an index that is no whole number": (
        model("Real v[2]; Real x;", "x = v[1.5];"),
        "The index 1.5 is no whole number from 1 to 2.\n  in a.mo:5 `x = v[1.5];`",
    ),
    "a large number": (
        model("Real x;", "x = 1e400;"),
        "1e400 is too large for a number.\n  in a.mo:5 `x = 1e400;`",
    ),
    "a comment without an end": (model() + "/* x", "A comment has no end.\n  in a.mo:7 `/* x`"),
    "a text without an end": (model('Real x "speed;'), 'A text has no end.\n  in a.mo:3 `Real x "speed;`'),
    "no array": (model("Real x;", "x = sum(1);"), "sum(…) needs an array.\n  in a.mo:5 `x = sum(1);`"),
    "too few arguments": (
        model("Real x;", "der() = 1;"),
        "der(…) has 1 argument, not 0.\n  in a.mo:5 `der() = 1;`",
    ),
    "no simplified law": (
        model("Real x;", "homotopy(actual = x) = 1;"),
        "homotopy(…) has 2 arguments, not 1.\n  in a.mo:5 `homotopy(actual = x) = 1;`",
    ),
    "a modification of nothing": (
        model("B b(kk = 3);", before="model B parameter Real k = 1; end B;"),
        "B has no 'kk'; did you mean 'k'?\n  in a.mo:3 `B b(kk = 3);`",
    ),
    "a modification of nothing in a base": (
        model("extends B(kk = 3); parameter Real kk = 1;", before="model B parameter Real k = 1; end B;"),
        "B has no 'kk'; did you mean 'k'?\n  in a.mo:3 `extends B(kk = 3); parameter Real kk = 1;`",
    ),
    "a parameter of the class around": (
        model("model C Real y = k; end C;\nparameter Real k = 3; C c;"),
        "k is a parameter of A: other classes, those in it too, see its constants only.\n"
        "  in a.mo:3 `model C Real y = k; end C;`\nGive C a parameter for it, or declare it as a constant.",
    ),
    "a variable of the class around": (
        model("model C Real y = t; end C;\nReal t = time; C c;"),
        "t is a variable of A: other classes, those in it too, see its constants only.\n"
        "  in a.mo:3 `model C Real y = t; end C;`\nGive C an input for it.",
    ),
    "a parameter around a function": (
        model(
            "function f input Real u; output Real y; algorithm y := u*k; end f;\nparameter Real k = 3; Real x = f(1);"
        ),
        "k is a parameter of A: other classes, those in it too, see its constants only.\n"
        "  in a.mo:3 `function f input Real u; output Real y; algorithm y := u*k; end f;`\n"
        "Give f an input for it, or declare it as a constant.",
    ),
    **{
        f"by initial equations: {text}": (
            model(f"parameter Real p(fixed = false);\n{text}", before="model C parameter Real k; end C;"),
            f"{what} depends on p, which has fixed = false: only parameters of its own class may do that.\n"
            f"  in a.mo:4 `{text}`\n"
            "Leave it out, and write an initial equation for it; a parameter needs fixed = false, too.",
        )
        for text, what in {
            "C c(k = p);": "c.k",
            "parameter Real q = 2*p; C c(k = q);": "c.k",
            f"{R}.Inertia J(J = p);": "J.J",
            f"{R}.Inertia J(w(start = p));": "J.w.start",
            "Real z(start = p);": "z.start",
        }.items()
    },
    "two values": (
        model("B b(k = 1, k = 2);", before="model B parameter Real k; end B;"),
        "One modification gives k two values.\n  in a.mo:3 `B b(k = 1, k = 2);`\nRemove one of them.",
    ),
    "a final parameter": (
        model("B b(k = 3);", before="model B final parameter Real k = 1; end B;"),
        "k is final: it cannot be changed from outside.\n"
        "  in a.mo:3 `B b(k = 3);`\n  in a.mo:1 `model B final parameter Real k = 1; end B;`",
    ),
    "a final modification": (
        model("C c(b.k = 3);", before="model C B b(final k = 1); end C; model B parameter Real k; end B;"),
        "b.k is final: it cannot be changed from outside.\n  in a.mo:3 `C c(b.k = 3);`\n"
        "  in a.mo:1 `model C B b(final k = 1); end C; model B parameter Real k; end B;`",
    ),
    "more values than elements": (
        model(f"{R}.Inertia a[2](J = {{1, 2, 3}});"),
        f"An array of 2 elements is given 3 values.\n  in a.mo:3 `{R}.Inertia a[2](J = {{1, 2, 3}});`\n"
        "Write 'each' where all elements take the same.",
    ),
    "no value": (
        model("Real x;", "x = log(-1);"),
        "A formula of -1 has no value.\n  in a.mo:5 `x = log(-1);`",
    ),
}


NAMES = (
    "unknown parameter", "unknown name", "unknown variable of a part", "unknown end", "a modification of nothing",
    "a modification of nothing in a base", "outer without inner", "two results",
)  # fmt: skip


@pytest.mark.parametrize("case", MESSAGES)
def test_every_refusal_has_its_sentence(case: str, tmp_path: Path, check_message) -> None:
    text, message = MESSAGES[case]
    (tmp_path / "a.mo").write_text(text)
    out_of_range = ValueOutOfRange if "is out of range" in message else ModelicaTextError
    kind = UnknownName if case in NAMES or (case.startswith("declared") and " has no " in message) else out_of_range
    check_message(kind, lambda: load(tmp_path / "a.mo"), message)


@pytest.mark.parametrize(
    ("declaration", "of", "number"),
    [
        ("Real y(nominal = -1);", "A.y", "-1"),
        ("parameter Real m = 2; Real y(nominal = 0*m);", "A.y", "0"),
        ("parameter Real y(nominal = -3) = 1;", "A.y", "-3"),
        ("discrete Real y(start = 1, nominal = -3);", "A.y", "-3"),
        ("Real y[2](nominal = {1, -2});", "A.y[2]", "-2"),
        ("B y;", "B.i", "-5"),
    ],
)
def test_nominal_values_are_positive(declaration: str, of: str, number: str, tmp_path: Path, check_message) -> None:
    before = "connector B Real v; flow Real i(nominal = -5); end B;"
    (tmp_path / "a.mo").write_text(model(declaration, before=before))
    told = (
        f"The nominal value of {of} must be a positive, finite number, not {number}.\n"
        f"  in a.mo:3 `{declaration}`\n"
        "It is the order of magnitude of a variable, in SI units, which tells how exact a run must be.\n"
        "Give a typical magnitude, or leave it out: it is 1 then."
    )
    check_message(ValueOutOfRange, lambda: load(tmp_path / "a.mo"), told)


def test_several_errors_are_told_together(tmp_path: Path) -> None:
    (tmp_path / "a.mo").write_text(model(f"{R}.Inertia a(JJ = 1); {R}.Spring b(cc = 1);"))
    with pytest.raises(ModelicaLikeError) as caught:
        load(tmp_path / "a.mo")
    assert "has no 'JJ'" in str(caught.value)
    assert "has no 'cc'" in str(caught.value)


def test_errors_of_the_drive_point_into_the_text(tmp_path: Path) -> None:
    (tmp_path / "a.mo").write_text(model("Real x; Real y;", "x = 1;\ny = x; y = 2;"))
    with pytest.raises(ModelicaLikeError) as caught:
        build(load(tmp_path / "a.mo"))
    assert str(caught.value) == (
        "A declares 3 equations for 2 unknowns (x, y).\n"
        "  in a.mo:6 `y = x; y = 2;`\n"
        "Each own variable, output and flow takes one: remove an equation, or declare the missing unknown."
    )


def test_the_value_before_an_event_of_what_changes_between_them(tmp_path: Path, check_message) -> None:
    (tmp_path / "a.mo").write_text(
        model("G g; Real x;", "x = pre(g.v);", "model G Real v; equation der(v) = 1; end G;")
    )
    check_message(
        LanguageError,
        lambda: build(load(tmp_path / "a.mo")),
        "pre(v): only what changes at events has a value before them.\n  in a.mo:5 `x = pre(g.v);`\n"
        "In a 'when', name a variable.",
    )


def test_an_input_of_a_part_with_a_connection_and_an_equation(tmp_path: Path, check_message) -> None:
    block = "block G input Real u; output Real y; equation y = 3*u; end G;"
    (tmp_path / "a.mo").write_text(model("G g; G h(u = 1);", "connect(h.y, g.u);\ng.u = time;", block))
    check_message(
        ComponentUnbalanced,
        lambda: build(load(tmp_path / "a.mo")),
        "A declares 2 equations for 1 unknowns (h_u).\n  in a.mo:6 `g.u = time;`\n"
        "g.u is an input of a part: connect it, or write one equation, g.u = …",
    )


def test_rigid_parts_whose_ends_are_all_free(tmp_path: Path, check_message) -> None:
    port = "Modelica.Thermal.HeatTransfer.Interfaces.HeatPort"
    collector = (
        f"model C parameter Integer m = 3; {port}_a a[m]; {port}_b b; "
        "equation b.Q_flow + sum(a.Q_flow) = 0; a.T = fill(b.T, m); end C;"
    )
    (tmp_path / "a.mo").write_text(model("C c(m = 2);", before=collector))
    check_message(
        Underdetermined,
        lambda: build(load(tmp_path / "a.mo")),
        "Nothing determines c.a[1].T: c.b, c.a[1], c.a[2] are free, so they carry no heat flow, and no part gives the "
        "temperature.\n  in a.mo:3 `C c(m = 2);`\n"
        "Connect a part that has or prescribes a temperature to one of them.",
    )


def test_a_formula_with_names_inside_and_outside_of_a_class(tmp_path: Path, check_message) -> None:
    (tmp_path / "box.toml").write_text('[parameters]\ni = 3\n[parts]\na = { is = "Inertia", J = "1 kg.m2" }\n')
    (tmp_path / "drive.toml").write_text(
        '[parameters]\nn = 7\n[parts]\nq = { is = "./box.toml", "a.J" = "2*n*i*1 kg.m2" }\n'
    )
    told = (
        "q.a.J = 2.0 * n * i * 1 kg.m2 uses n, which is outside of q, and names in it.\n"
        '  in drive.toml:4 `q = { is = "./box.toml", "a.J" = "2*n*i*1 kg.m2" }`\n'
        "q becomes a class, which knows its own names only.\n"
        "Give it a number."
    )
    check_message(ModelicaTextError, lambda: modelica_text(load(tmp_path / "drive.toml")), told)


ENDS = {
    "a subscript": ("Real y = v[integer(2*time) + 2];", "0.5", "has a subscript that is none of 1 to 2, in a.mo:3"),
    "a subscript in a when": (
        "Real y; equation when time > 0.25 then y = v[integer(4*time) + 2]; end when;", "0.25",
        "has a subscript that is none of 1 to 2, in a.mo:3",
    ),
    "a while": (
        "Real y; equation when time > 0.25 then y = f(v, 4*time + 2); end when;", "0.25",
        "has a 'while' that does not end after 2 rounds, in a.mo:3",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", ENDS)
def test_what_ends_a_run(case: str, tmp_path: Path, check_message) -> None:
    declarations, time, what = ENDS[case]
    (tmp_path / "a.mo").write_text(model(f"parameter Real v[2] = {{0, 0}}; {declarations}", before=LESS))
    drive = load(tmp_path / "a.mo")
    check_message(LimitPassed, lambda: simulate(drive, 1.0), f"At {time} s A {what}.")


def test_a_parameter_of_which_whole_numbers_are_made(tmp_path: Path, check_message) -> None:
    (tmp_path / "a.mo").write_text(model("parameter Real a = 1; parameter Integer n = integer(2*a); Real x = n;"))
    (tmp_path / "drive.toml").write_text('[parts]\nb = { is = "./a.mo:A", a = 3 }\n')
    told = (
        "A.a was read as a number, of which others were made, and cannot change afterwards.\n"
        '  in drive.toml:2 `b = { is = "./a.mo:A", a = 3 }`\n'
        "Change it in the text, or extend the class with this value under a name of its own."
    )
    check_message(LanguageError, lambda: load(tmp_path / "drive.toml"), told)


def test_parameters_for_which_other_equations_hold(tmp_path: Path, check_message) -> None:
    losses = "if G <= 0 then i = 0; else i = G*v; end if; x = y + i; der(x) = 6 - v; der(y) = v;"
    text = model("parameter Real G = 0; Real x(start = 0, fixed = true), y, i, v;", losses)
    (tmp_path / "a.mo").write_text(text)
    built = build(load(tmp_path / "a.mo"))
    check_message(
        SingularAtStart,
        lambda: simulate(built.with_parameters({"G": 0.5}), 1.0),
        "A was built for other parameters, for which other equations hold.\n"
        "  in a.mo:5 `if G <= 0 then i = 0; else i = G*v; end if; x = y + i; der(x) = 6 - v; der(y) = v;`\n"
        "Build it with these parameters.",
    )


def test_what_python_cannot_go_down_into(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, check_message) -> None:
    from modelica_like.netlist.modelica import read

    def deep(*_: object) -> None:
        raise RecursionError  # as Python does

    monkeypatch.setattr(read, "build_component", deep)
    (tmp_path / "a.mo").write_text(model())
    told = "Classes, functions or formulas are nested too deeply.\n  in a.mo:2 `model A`"
    check_message(ModelicaTextError, lambda: load(tmp_path / "a.mo"), told)


def test_what_begins_at_zero_refuses_a_drive_that_begins_later(tmp_path: Path, check_message) -> None:
    text = "model A\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -x;\n"
    (tmp_path / "a.mo").write_text(f"{text}  annotation(experiment(StartTime = 2, StopTime = 3));\nend A;\n")
    check_message(
        ExportError, lambda: export_html(load(tmp_path / "a.mo"), tmp_path / "a.html"),
        "A page begins at 0 s, and this drive at 2 s.\nLeave `from` out, or shift the time in the drive.",
    )  # fmt: skip


def test_a_cosimulation_refuses_a_drive_that_begins_later(tmp_path: Path, check_message) -> None:
    parts = 'a = { is = "Inertia", J = 1 }\nb = { is = "Inertia", J = 1 }\nc = { is = "SpringDamper", c = 1, d = 1 }'
    series = '[series]\nshaft = ["a", "c", "b"]\n[start]\n"a.w" = 1\n"a.phi" = 0\n"b.w" = 0\n"b.phi" = 0\n'
    (tmp_path / "a.toml").write_text(f'[parts]\n{parts}\n{series}[simulate]\nfrom = "2 s"\nuntil = "3 s"\n')
    check_message(
        ValueOutOfRange, lambda: split(tmp_path / "a.toml", "a.flange_b", tmp_path / "system"),
        "A co-simulation begins at 0 s, and this drive at 2 s.\nLeave `from` out, or shift the time in the drive.",
    )  # fmt: skip


FLAT: dict[str, tuple[str, str]] = {
    "a mode that holds a motion": (
        f"model A\n{R}.Brake b(fn_max = 1);\n{R}.Inertia m(J = 1);\nequation\nconnect(b.flange_a, m.flange_a);\n"
        "b.f_normalized = 1;\nend A;\n",
        "b has the mode mode, which holds a motion, so it is not written flat.\n"
        f"  in a.mo:2 `{R}.Brake b(fn_max = 1);`\n"
        "Impacts, shared loads and states that modes take away are no equations of Modelica text.",
    ),
    "an elsewhen beside a condition of several": (
        "model A\ndiscrete Real n;\nequation\nwhen {time > 1, time > 2} then\nn = 1;\nelsewhen time > 3 then\nn = 2;\n"
        "end when;\nend A;\n",
        "A has an 'elsewhen' and several conditions in a branch, which is not written.\n"
        "  in a.mo:4 `when {time > 1, time > 2} then`\n"
        "Join the conditions by a Boolean variable.",
    ),
    "elements of an array with different ends": (
        f"model A\n{R}.IdealGear g[2](each ratio = 2, useSupport = {{true, false}});\n{R}.Inertia m(J = 1);\n"
        f"{R}.Fixed f;\nequation\nconnect(f.flange, g[1].support);\nconnect(m.flange_b, g[1].flange_a);\nend A;\n",
        "g is an array of different parts, which Modelica does not have.\nGive each part a name of its own.",
    ),
}


@pytest.mark.parametrize("case", FLAT)
def test_what_is_not_written_flat(case: str, tmp_path: Path, check_message) -> None:
    text, told = FLAT[case]
    (tmp_path / "a.mo").write_text(text)
    check_message(ModelicaTextError, lambda: flat_text(load(tmp_path / "a.mo")), told)
