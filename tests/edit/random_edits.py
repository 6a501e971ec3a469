"""Random operations on a netlist: plausible ones, and now and then nonsense."""

import random
import tomllib
from typing import Any

import components
from modelica_like.edit import Document
from modelica_like.errors import ModelicaLikeError
from modelica_like.language import Input, Output, Parameter, Variable
from modelica_like.language.inside import declarations
from modelica_like.netlist import find_type

HOSTILE = ["a b", "é", "x.y", '"', "", "]", "motor = 1", "\n", "is", "\ud800", "#", "pi", "equations", "_x", "w" * 300]
VALUES: list[Any] = [
    1, 0.25, -1, True, "2 N.m", "3 kg.m2", "5 rad/s", "2 * ratio", "rubbish +", [[0, 1], [1, 2]], {"is": "Inertia"},
]  # fmt: skip
KINDS = [
    "Inertia", "SpringDamper", "IdealGear", "Damper", "Mass", "Resistor", "Gain", "ConstantTorque", "Constant", "Sum",
    "Fixed", "BallScrew",
]  # fmt: skip
SECTIONS = ["simulate", "display", "series", "connect", "start", "guess", "expose", "parameters", "", "rubbish"]


class Chooser:
    """Chooses operations for the present text of a document."""

    def __init__(self, document: Document, seed: int) -> None:
        self.document, self.random = document, random.Random(seed)
        self.number = 0

    def request(self) -> dict[str, Any]:
        """Return one operation with its arguments."""
        self.data = tomllib.loads(self.document.text.removeprefix("\ufeff"))
        self.number += 1
        name = self.random.choice(
            ["add", "insert", "insert", "connect", "connect", "disconnect", "disconnect", "remove", "rename", "rename",
             "replace", "set", "set", "unset", "duplicate", "group"]
        )  # fmt: skip
        request = {"op": name, **getattr(self, f"_{name}")()}
        if self.random.random() < 0.06:
            key = self.random.choice([*request, "further"])
            request[key] = self.random.choice([None, 3, *HOSTILE, [], ["a"]])
        return request

    def part(self) -> str:
        """Return the name of a part, or nonsense."""
        parts = list(self.data.get("parts", {}))
        return self.random.choice(HOSTILE) if not parts or self.random.random() < 0.03 else self.random.choice(parts)

    def new(self) -> str:
        """Return a new name, or nonsense."""
        return self.random.choice(HOSTILE) if self.random.random() < 0.05 else f"new_{self.number}"

    def end(self) -> str:
        """Return an end: as it stands in a line, or of any part."""
        lines = [end for line in self.data.get("connect", {}).values() for end in line if isinstance(end, str)]
        if lines and self.random.random() < 0.5:
            return self.random.choice(lines)
        return f"{self.part()}.{self.field((Input, Output))}"

    def field(self, kinds: Any) -> str:
        """Return a connector or field of any part."""
        table = self.data.get("parts", {}).get(self.part())
        try:
            kind = find_type(table["is"])
        except (ModelicaLikeError, TypeError, KeyError):
            return "flange_a"
        names = [key for key, field in declarations(kind).fields.items() if isinstance(field, kinds)]
        return self.random.choice([*declarations(kind).connectors, *names, "y"])

    def pair(self) -> list[str]:
        """Return two neighbours of a line in [series] or [connect]."""
        section = self.random.choice(["series", "connect"])
        lines = [line for line in self.data.get(section, {}).values() if isinstance(line, list) and len(line) > 1]
        line = self.random.choice(lines) if lines else ["a", "b"]
        place = self.random.randrange(len(line) - 1)
        return [str(end) for end in line[place : place + 2]]

    def kind(self) -> str:
        """Return a type."""
        return self.random.choice([*KINDS * 3, *components.__all__, "Rubbish", "mine:Hub", "./missing.toml"])

    def value(self) -> Any:
        """Return a value."""
        return self.random.choice(VALUES)

    def path(self) -> str:
        """Return the path of a value."""
        known = [*self.data.get("parameters", {}), *self.data.get("start", {})]
        path = f"{self.part()}.{self.field((Parameter, Variable, Input))}"
        return self.random.choice([path, path, *known, self.new()])

    def _add(self) -> dict[str, Any]:
        return {"name": self.new(), "kind": self.kind(), "values": self._values()}

    def _values(self) -> dict[str, Any]:
        return {self.field(Parameter): self.value()} if self.random.random() < 0.3 else {}

    def _insert(self) -> dict[str, Any]:
        where = self.random.choice([{"between": self.pair()}, {"after": self.part()}, {"before": self.part()}])
        return {"name": self.new(), "kind": self.kind(), "values": self._values(), **where}

    def _connect(self) -> dict[str, Any]:
        return {"first": self.end(), "second": self.end()}

    def _disconnect(self) -> dict[str, Any]:
        first, second = self.pair()
        return {"first": first, "second": second} if self.random.random() < 0.7 else {"first": self.end()}

    def _remove(self) -> dict[str, Any]:
        return {"name": self.part()}

    def _rename(self) -> dict[str, Any]:
        old = self.random.choice([self.part(), self.part(), *self.data.get("parameters", {})])
        return {"old": old, "new": self.new()}

    def _replace(self) -> dict[str, Any]:
        return {"name": self.part(), "kind": self.kind()}

    def _set(self) -> dict[str, Any]:
        if self.random.random() < 0.3:
            section = self.random.choice(SECTIONS)
            keys = list(self.data.get(section, {})) if section else ["name", "description"]
            return {"path": self.random.choice([*keys, self.new()]), "value": self.value(), "section": section}
        return {"path": self.path(), "value": self.value()}

    def _unset(self) -> dict[str, Any]:
        return {"path": self.path()}

    def _duplicate(self) -> dict[str, Any]:
        return {"name": self.part(), "new": self.new()}

    def _group(self) -> dict[str, Any]:
        return {"names": [self.part() for _ in range(self.random.choice([1, 2, 3]))], "name": self.new()}
