"""From Modelica text to its syntax tree, by recursive descent over the grammar of Modelica 3.6."""

from __future__ import annotations

from typing import Any

from modelica_like.errors import ModelicaTextError
from modelica_like.netlist.modelica.expressions import Expressions
from modelica_like.netlist.modelica.tokens import KINDS, SECTIONS, Token
from modelica_like.netlist.modelica.tree import (
    Argument,
    ClassText,
    Declaration,
    Expr,
    Extends,
    Import,
    Modification,
    Statement,
)

_BEFORE_KIND = {"partial", "encapsulated", "expandable", "pure", "impure", "final", "replaceable", "inner", "outer"}
_PREFIXES = {"flow", "stream", "parameter", "constant", "discrete", "input", "output"}
_BEFORE = {"redeclare", "final", "inner", "outer", "replaceable"}


def parse_modelica(text: str, file: str) -> list[ClassText]:
    """Read the classes of a Modelica text.

    Args:
        text: of a `.mo` file.
        file: its path, for messages.

    Raises:
        ModelicaTextError: the text is not Modelica.
    """
    parser = _Parser(text, file)
    try:
        return parser.stored()
    except ModelicaTextError as error:
        located = error if error.where else parser.error(error.what, parser.line)
        raise located.with_traceback(None) from None  # hundreds of frames are no help, and too many for pickle


def parse_tokens(tokens: list[Token]) -> Expr:
    """Read one expression of tokens: what a part of an annotation says, as a call.

    Raises:
        ModelicaTextError: they are no expression.
    """
    parser = _Parser("", "")
    parser.tokens = [*tokens, ("end of file", "", 0)]
    return parser.expression()


def parse_expression(text: str) -> Expr:
    """Read one expression, from the tables of this package.

    Raises:
        ModelicaTextError: the text is not an expression.
    """
    return _Parser(text, "").expression()


class _Parser(Expressions):
    current: ClassText | None = None
    """The class whose text is read."""

    def stored(self) -> list[ClassText]:
        within = ""
        if self.take("within"):
            within = self.dotted() if self.kind == "name" else ""
            self.need(";")
        classes = []
        while self.kind != "end of file":
            self.take("final")
            classes.append(self.class_text(None, within))
            self.need(";")
        if not classes:
            self.refuse("The file has no class.", 1)
        return classes

    def is_class(self) -> bool:
        at = self.at
        while self.tokens[at][1] in _BEFORE_KIND:
            at += 1
        return self.tokens[at][0] in KINDS

    def class_text(self, owner: ClassText | None, within: str = "") -> ClassText:
        line, partial, expandable, unsupported = self.line, False, False, []
        self.deeper()
        while self.text in _BEFORE_KIND:
            word = self.take(self.kind)
            partial, expandable = partial or word == "partial", expandable or word == "expandable"
            if word in ("inner", "outer"):
                unsupported.append((f"'{word}'", line))
        kind = self.take(*KINDS) or self.refuse(f"Expected a class before '{self.text}'.", self.line)
        if kind == "operator":
            kind = self.take("function", "record") or kind
            unsupported.append(("overloaded operators", line))
        inherits = bool(self.take("extends"))
        name = self.need("name")
        class_text = ClassText(
            name, kind, line, self.file, owner, within, partial, redeclares=inherits, inherits=inherits,
            expandable=expandable, unsupported=unsupported, lines=self.lines,
        )  # fmt: skip
        around, self.current = self.current, class_text
        if self.take("="):
            self._short(class_text)
            self.depth -= 1
            self.current = around
            return class_text
        if inherits:
            class_text.elements.append(Extends(name, self.modification(), line))
        class_text.description = self.strings()
        self._composition(class_text)
        bases = [element for element in class_text.elements if isinstance(element, Extends)]
        if kind == "type" and bases:  # the long form of `type A = B`
            class_text.short, class_text.elements = bases[0], []
        self.current = around
        self.need("end")
        if self.text != name:
            self.refuse(f"{kind} {name} of line {line} ends with 'end {self.text}'.", self.line)
        self.take("name")
        self.depth -= 1
        return class_text

    def _short(self, class_text: ClassText) -> None:
        if self.take("enumeration"):
            self.need("(")
            literals = []
            while self.kind == "name":
                literals.append(self.take("name"))
                self.strings()
                self.annotation()
                self.take(",")
            if self.take(":"):
                class_text.unsupported.append(("an enumeration that is open", self.line))
            class_text.literals = tuple(literals)
            self.need(")")
        else:
            while word := self.take("input", "output", "flow"):
                class_text.prefixes |= {word}
            line = self.line
            if self.take("der"):  # the derivative of a function by some of its arguments
                class_text.unsupported.append(("a function that is a derivative of another", line))
                self._given()
                return
            base = self.dotted()
            class_text.dimensions = self.subscripts() if self.kind == "[" else ()
            class_text.short = Extends(base, self.modification(), line)
        class_text.description = self.strings()
        self._about(class_text)

    def _composition(self, class_text: ClassText) -> None:
        hidden = False
        while self.kind != "end":
            line = self.line
            if word := self.take("public", "protected"):
                hidden = word == "protected"
            elif self.kind == "annotation":
                self._about(class_text)
                self.need(";")
            elif self.kind in ("initial", "equation", "algorithm"):
                initial = bool(self.take("initial"))
                if self.take("algorithm"):
                    section = Statement("algorithm", (self.statements(),), line)
                    if class_text.kind == "function":
                        class_text.algorithm += section.parts[0]
                    else:
                        (class_text.initial_equations if initial else class_text.equations).append(section)
                else:
                    self.need("equation")
                    (class_text.initial_equations if initial else class_text.equations).extend(self.statements())
            elif self.take("external"):
                self._external(class_text, line)
            elif self.kind == "end of file":
                self.refuse(
                    f"{class_text.kind} {class_text.name} of line {class_text.line} has no 'end {class_text.name};'.",
                    line,
                )
            else:
                self._element(class_text, hidden)
                self.need(";")

    def _external(self, class_text: ClassText, line: int) -> None:
        self.take("string")
        left = self.simple() if self.kind == "name" else Expr("all", (), line)
        right = self.expression() if self.take("=") else left
        class_text.external = right.args[0] if right.kind == "call" else class_text.name
        self.annotation()
        self.need(";")
        if self.kind == "annotation":
            self._about(class_text)
            self.need(";")

    def _element(self, class_text: ClassText, hidden: bool) -> None:
        line = self.line
        if self.take("import"):
            class_text.elements.append(self._import())
        elif self.take("extends"):
            class_text.elements.append(Extends(self.dotted(), self.modification(), line))
        elif self._is_element_class():
            inner = self._element_class(class_text)
            class_text.classes[inner.name] = inner
            return
        else:
            class_text.elements += self.declarations(hidden)
        self.annotation()

    def _is_element_class(self) -> bool:
        at = self.at
        while self.tokens[at][1] in _BEFORE:
            at += 1
        start, self.at = self.at, at
        result = self.is_class()
        self.at = start
        return result

    def _element_class(self, owner: ClassText | None) -> ClassText:
        redeclares = bool(self.take("redeclare"))
        inner = self.class_text(owner)
        inner.redeclares = inner.redeclares or redeclares
        inner.constrained = self._constrained()
        return inner

    def _constrained(self) -> Modification | None:
        """Return the modification of a constraining type, which holds for all that takes the place."""
        if not self.take("constrainedby"):
            return None
        self.dotted()
        modification = self.modification()
        self.strings()
        self.annotation()
        return modification

    def _import(self) -> Import:
        alias = ""
        if self.kind == "name" and self.tokens[self.at + 1][0] == "=":
            alias = self.need("name")
            self.need("=")
        path, names = self.dotted(), ()
        if self.take(".*"):
            names = ("*",)
        elif self.take("."):
            if self.take("*"):
                names = ("*",)
            else:
                self.need("{")
                names = self._names()
        self.strings()
        return Import(path.lstrip("."), alias or path.rpartition(".")[2], names)

    def _names(self) -> tuple[str, ...]:
        names = [self.need("name")]
        while self.take(","):
            names.append(self.need("name"))
        self.need("}")
        return tuple(names)

    def declarations(self, hidden: bool = False, single: bool = False) -> list[Declaration]:
        """Read one clause of declarations, `parameter Real a = 1, b = 2`; in a modification it has a single one."""
        prefixes = {"protected"} if hidden else set[str]()
        while self.text in _PREFIXES or self.text in _BEFORE:
            prefixes.add(self.take(self.kind))
        type_name = self.dotted()
        common = self.subscripts() if self.kind == "[" else ()
        declarations = [self._declared(frozenset(prefixes), type_name, common)]
        while not single and self.take(","):
            declarations.append(self._declared(frozenset(prefixes), type_name, common))
        constrained = self._constrained()
        for declared in declarations:
            declared.constrained = constrained
        return declarations

    def _declared(self, prefixes: frozenset[str], type_name: str, common: tuple[Expr, ...]) -> Declaration:
        line, name = self.line, self.need("name")
        dimensions = (self.subscripts() if self.kind == "[" else ()) + common
        modification = self.modification()
        condition = self.expression() if self.take("if") else None
        declaration = Declaration(prefixes, type_name, name, dimensions, modification, condition, self.strings(), line)
        declaration.placement = self.part(self.annotation(), "Placement")
        return declaration

    # -- modifications -----------------------------------------------------------------------------------------------

    def modification(self) -> Modification:
        modification = Modification()
        if self.take("("):
            self.deeper()
            while not self.take(")"):
                modification.arguments.append(self._argument())
                if self.kind != ")":
                    self.need(",")
            self.depth -= 1
        if self.take("=", ":="):
            modification.value = self.expression()
        return modification

    def _argument(self) -> Argument:
        line, redeclare, each, final = self.line, False, False, False
        while word := self.take("each", "final", "redeclare", "replaceable"):
            each, redeclare = each or word == "each", redeclare or word in ("redeclare", "replaceable")
            final = final or word == "final"
        if not redeclare:
            name = self.dotted()
            argument = Argument(name, self.modification(), line, each, None, final)
            self.strings()
            return argument
        redeclared = self._element_class(self.current) if self.is_class() else self.declarations(single=True)[0]
        return Argument(redeclared.name, Modification(), line, each, redeclared, final)

    def _about(self, class_text: ClassText) -> None:
        """Read what the annotation of a class says about its picture, and how long to simulate."""
        parts = self.annotation()
        class_text.icon = self.part(parts, "Icon") or class_text.icon
        if "experiment" in parts:
            end, self.at = self.at, parts["experiment"].start
            experiment = self.expression()
            for name, value in experiment.args[2] if experiment.kind == "call" else ():
                number, sign = (value.args[0], -1.0) if value.kind == "neg" else (value, 1.0)
                if number.kind == "number":
                    class_text.experiment[name] = sign * number.args[0]
            self.at = end

    # -- equations and statements ------------------------------------------------------------------------------------

    def statements(self) -> list[Statement]:
        statements = []
        while self.kind not in ("else", "elseif", "elsewhen") and self.kind not in SECTIONS:
            statements.append(self._statement())
            self.strings()
            self.annotation()
            self.need(";")
        return statements

    def _statement(self) -> Statement:
        self.deeper()
        statement = self._one_statement(self.line)
        self.depth -= 1
        return statement

    def _one_statement(self, line: int) -> Statement:
        if word := self.take("if", "when"):
            return Statement(word, self._branches(word), line)
        if self.take("for"):
            iterators = self.iterators()
            self.need("loop")
            statement = Statement("for", (iterators, self.statements()), line)
            self._ends("for")
            return statement
        if self.take("while"):
            condition = self.expression()
            self.need("loop")
            statement = Statement("while", (condition, self.statements()), line)
            self._ends("while")
            return statement
        if self.take("connect"):
            self.need("(")
            left = self.expression()
            self.need(",")
            right = self.expression()
            self.need(")")
            return Statement("connect", (left, right), line)
        if self.kind == "name" and self.text in ("return", "break"):
            return Statement(self.take("name"), (), line)
        left = self.simple()
        if sign := self.take("=", ":="):
            return Statement(sign, (left, self.expression()), line)
        if left.kind != "call":
            self.refuse(f"Expected '=' before '{self.text}'.", self.line)
        return Statement("call", (left,), line)

    def _branches(self, word: str) -> tuple[Any, ...]:
        branches: list[tuple[Expr | None, list[Statement]]] = []
        condition: Expr | None = self.expression()
        while True:
            if condition is not None:
                self.need("then")
            branches.append((condition, self.statements()))
            if self.take(f"else{word}"):
                condition = self.expression()
            elif self.take("else"):
                condition = None
            else:
                self._ends(word)
                return tuple(branches)

    def _ends(self, word: str) -> None:
        self.need("end")
        self.need(word)
