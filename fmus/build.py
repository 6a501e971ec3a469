"""Build the reference FMUs: python fmus/build.py [--output FOLDER] [NAME ...].

Each folder with a `model.toml` (what the variables are) and a `model.c` (what they do) becomes two FMUs, of FMI 2.0 and
of FMI 3.0. A C compiler is needed: `cc`, or zig from the package ziglang.
"""

from __future__ import annotations

import argparse
import importlib.util
import platform
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from modelica_like.writing import replacing

HERE = Path(__file__).parent
TARGET = HERE.parent / "build" / "fmus"
VERSIONS = ("2.0", "3.0")
FLAGS = ("-std=c11", "-D_GNU_SOURCE", "-O2", "-Wall", "-Werror", "-fPIC", "-shared", "-fvisibility=hidden")

# Exponents of the SI base units.
UNITS: dict[str, dict[str, int]] = {
    "1": {}, "s": {"s": 1}, "m": {"m": 1}, "m/s": {"m": 1, "s": -1}, "m/s2": {"m": 1, "s": -2}, "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1}, "rad/s2": {"rad": 1, "s": -2}, "kg": {"kg": 1}, "kg.m2": {"kg": 1, "m": 2},
    "N": {"kg": 1, "m": 1, "s": -2}, "N/m": {"kg": 1, "s": -2}, "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1}, "N.m.s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1},
    "W": {"kg": 1, "m": 2, "s": -3}, "V": {"kg": 1, "m": 2, "s": -3, "A": -1}, "A": {"A": 1},
    "V.s/rad": {"kg": 1, "m": 2, "s": -2, "A": -1, "rad": -1}, "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
}  # fmt: skip


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU; its value reference is its position.

    Attributes:
        derivative_of: value reference of the state of which it is the derivative.
        items: names of the values 0, 1, ... of a mode.
    """

    name: str
    causality: str
    start: float | None
    unit: str = ""
    description: str = ""
    derivative_of: int | None = None
    items: tuple[str, ...] = ()

    @property
    def identifier(self) -> str:
        """Name in C: der(a.b) becomes der_a_b."""
        # `time` alone would hide the C function of that name.
        return "run_time" if self.name == "time" else self.name.replace("(", "_").replace(")", "").replace(".", "_")

    @property
    def calculated(self) -> bool:
        """The FMU works out the start value."""
        return (self.causality in ("output", "local") and self.start is None) or bool(self.items)


@dataclass(frozen=True)
class Description:
    """What a model.toml says."""

    name: str
    description: str
    until: float
    step: float
    variables: tuple[Variable, ...]
    states: int
    indicators: int

    @property
    def token(self) -> str:
        """What tells an FMU that binary and description belong together."""
        return f"{{{self.name}}}"

    def references(self, causality: str) -> list[int]:
        """Return the value references of the variables of a kind."""
        return [k for k, variable in enumerate(self.variables) if variable.causality == causality]

    @property
    def derivatives(self) -> list[int]:
        """Value references of the derivatives."""
        return [k for k, variable in enumerate(self.variables) if variable.derivative_of is not None]

    @property
    def unknowns(self) -> list[int]:
        """Value references of what initialization works out: outputs without start value, and derivatives."""
        outputs = [k for k in self.references("output") if self.variables[k].calculated]
        return sorted(outputs + self.derivatives)


def read(folder: Path) -> Description:
    """Read the model.toml of a folder."""
    text = tomllib.loads((folder / "model.toml").read_text(encoding="utf-8"))
    states: Mapping[str, Any] = text.get("states", {})
    indicators: Mapping[str, Any] = text.get("indicators", {})
    variables = [
        Variable(name, causality, value["start"], value["unit"], value["description"])
        for section, causality in (("parameters", "parameter"), ("inputs", "input"), ("states", "output"))
        for name, value in text.get(section, {}).items()
    ]
    first = len(variables) - len(states)
    for k, (name, value) in enumerate(states.items()):
        variables.append(Variable(f"der({name})", "local", None, value["rate"], f"derivative of {name}", first + k))
    for name, value in indicators.items():
        variables.append(Variable(name, "local", None, "1", value["description"]))
    for name, value in text["outputs"].items():
        items = tuple(value.get("items", ()))
        variables.append(
            Variable(
                name, "output", value.get("start"), value.get("unit", ""), value.get("description", "mode"), items=items
            )
        )
    variables.append(Variable("time", "independent", None, "s", "time"))
    return Description(
        text["name"], text["description"], text["until"], text["step"], tuple(variables), len(states), len(indicators)
    )


def header(model: Description) -> str:
    """Return variables.h."""
    variables = model.variables
    first = next((v.derivative_of for v in variables if v.derivative_of is not None), 0)
    names = ", ".join(v.identifier for v in variables)
    starts = ", ".join(repr(float(v.start or 0)) for v in variables)
    integers = ", ".join("1" if v.items else "0" for v in variables)
    return f"""#include <stdint.h>
enum {{ {names}, VARIABLES }};
#define STATES {model.states}
#define INDICATORS {model.indicators}
#define FIRST_STATE {first}
#define FIRST_DERIVATIVE {first + model.states}
#define FIRST_INDICATOR {first + 2 * model.states}
#define MODEL_TOKEN "{model.token}"
static const double start_value[VARIABLES] = {{{starts}}};
static const unsigned char is_integer[VARIABLES] = {{{integers}}};
"""


def attributes(**values: Any) -> str:
    """Return XML attributes of what is not None."""
    return "".join(f" {key}={quoteattr(str(value))}" for key, value in values.items() if value is not None)


def units(model: Description) -> Iterator[str]:
    """Yield the unit definitions."""
    yield "  <UnitDefinitions>"
    for unit in dict.fromkeys(v.unit for v in model.variables if v.unit):
        yield f'    <Unit name="{unit}"><BaseUnit{attributes(**UNITS[unit])}/></Unit>'
    yield "  </UnitDefinitions>"


def modes(model: Description) -> dict[tuple[str, ...], str]:
    """Return a type name for each set of mode names."""
    kinds = dict.fromkeys(v.items for v in model.variables if v.items)
    return {items: f"Mode{k}" for k, items in enumerate(kinds, 1)}


def types(model: Description, element: str) -> Iterator[str]:
    """Yield the enumeration types of the modes."""
    if not modes(model):
        return
    fmi3 = element.endswith("Type")
    yield "  <TypeDefinitions>"
    for items, name in modes(model).items():
        if not fmi3:
            yield f'    <SimpleType name="{name}">'
        yield f'    <{element} name="{name}">' if fmi3 else f"    <{element}>"
        yield from (f'      <Item name="{item}" value="{k}"/>' for k, item in enumerate(items))
        yield f"    </{element}>" + ("" if fmi3 else "</SimpleType>")
    yield "  </TypeDefinitions>"


def roles(variable: Variable) -> dict[str, str]:
    """Return causality, variability and kind of the start value."""
    variability = "fixed" if variable.causality == "parameter" else "discrete" if variable.items else "continuous"
    known = {"causality": variable.causality, "variability": variability}
    if variable.causality in ("input", "independent"):
        return known
    return {**known, "initial": "calculated" if variable.calculated else "exact"}


def start(variable: Variable) -> float | None:
    """Return the start value that the description states."""
    return None if variable.calculated else variable.start


def fmi2_xml(model: Description) -> str:
    """Return modelDescription.xml of FMI 2.0."""
    mode, can = modes(model), ' canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    names = attributes(modelName=model.name, description=model.description, guid=model.token)
    lines.append(f'<fmiModelDescription fmiVersion="2.0"{names} numberOfEventIndicators="{model.indicators}">')
    if model.states:
        lines.append(f'  <ModelExchange modelIdentifier="{model.name}"{can} completedIntegratorStepNotNeeded="true"/>')
    lines.append(f'  <CoSimulation modelIdentifier="{model.name}" canHandleVariableCommunicationStepSize="true"{can}/>')
    lines += [*units(model), *types(model, "Enumeration")]
    lines.append(
        f'  <DefaultExperiment startTime="0" stopTime="{model.until}" tolerance="1e-8" stepSize="{model.step}"/>'
    )
    lines.append("  <ModelVariables>")
    # FMI 2.0 can do without the independent variable, and one importer asks for its start value.
    for k, v in enumerate(v for v in model.variables if v.causality != "independent"):
        derivative = None if v.derivative_of is None else v.derivative_of + 1
        if v.items:
            value = f"<Enumeration{attributes(declaredType=mode[v.items])}/>"
        else:
            value = f"<Real{attributes(unit=v.unit, start=start(v), derivative=derivative)}/>"
        head = attributes(name=v.name, valueReference=k, description=v.description, **roles(v))
        lines.append(f"    <ScalarVariable{head}>{value}</ScalarVariable>")
    lines += ["  </ModelVariables>", "  <ModelStructure>"]
    groups = {
        "Outputs": model.references("output"), "Derivatives": model.derivatives, "InitialUnknowns": model.unknowns,
    }  # fmt: skip
    for group, members in groups.items():
        if members:
            body = "".join(f'\n      <Unknown index="{k + 1}"/>' for k in members)
            lines.append(f"    <{group}>{body}\n    </{group}>")
    lines += ["  </ModelStructure>", "</fmiModelDescription>", ""]
    return "\n".join(lines)


def fmi3_xml(model: Description) -> str:
    """Return modelDescription.xml of FMI 3.0."""
    mode, can = modes(model), ' canGetAndSetFMUState="true" canSerializeFMUState="true"'
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    names = attributes(modelName=model.name, description=model.description, instantiationToken=model.token)
    lines.append(f'<fmiModelDescription fmiVersion="3.0"{names}>')
    if model.states:
        lines.append(f'  <ModelExchange modelIdentifier="{model.name}"{can}/>')
    lines.append(f'  <CoSimulation modelIdentifier="{model.name}"{can} canHandleVariableCommunicationStepSize="true"/>')
    lines += [*units(model), *types(model, "EnumerationType")]
    lines.append(
        f'  <DefaultExperiment startTime="0" stopTime="{model.until}" tolerance="1e-8" stepSize="{model.step}"/>'
    )
    lines.append("  <ModelVariables>")
    for k, v in enumerate(model.variables):
        head = attributes(name=v.name, valueReference=k, description=v.description, **roles(v))
        if v.items:
            lines.append(f"    <Enumeration{head}{attributes(declaredType=mode[v.items])}/>")
        else:
            lines.append(f"    <Float64{head}{attributes(unit=v.unit, start=start(v), derivative=v.derivative_of)}/>")
    lines += ["  </ModelVariables>", "  <ModelStructure>"]
    first = next(iter(model.derivatives), 0) + model.states
    groups = {
        "Output": model.references("output"), "ContinuousStateDerivative": model.derivatives,
        "InitialUnknown": model.unknowns,
        "EventIndicator": range(first, first + model.indicators),
    }  # fmt: skip
    for element, members in groups.items():
        lines += [f'    <{element} valueReference="{k}"/>' for k in members]
    lines += ["  </ModelStructure>", "</fmiModelDescription>", ""]
    return "\n".join(lines)


def compiler() -> list[str]:
    """Return the command of the C compiler; leave with a sentence if there is none."""
    if found := shutil.which("cc"):
        return [found]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    sys.exit('The reference FMUs need a C compiler. Install one, or zig: pip install "modelica-like[cross]"')


def binary_folder(version: str) -> tuple[str, str]:
    """Return folder and ending of this machine's binaries."""
    bits = platform.machine().lower().replace("amd64", "x86_64").replace("arm64", "aarch64")
    ending = {"Linux": ".so", "Windows": ".dll", "Darwin": ".dylib"}[platform.system()]
    if version == "3.0":
        return f"{bits}-{ {'Linux': 'linux', 'Windows': 'windows', 'Darwin': 'darwin'}[platform.system()] }", ending
    return {"Linux": "linux64", "Windows": "win64", "Darwin": "darwin64"}[platform.system()], ending


def compile_model(folder: Path, model: Description, version: str, work: Path) -> Path:
    """Compile a model for one version of the standard."""
    (work / "variables.h").write_text(header(model))
    library = work / f"{model.name}{binary_folder(version)[1]}"
    spec = importlib.util.find_spec("fmpy")
    headers = Path(str(spec.origin)).parent / "c-code" if spec else HERE
    sources = [folder / "model.c", HERE / "common" / f"fmi{version[0]}.c"]
    includes = [f"-I{path}" for path in (work, HERE / "common", headers)]
    subprocess.run([*compiler(), *FLAGS, *includes, *map(str, sources), "-lm", "-o", str(library)], check=True)
    return library


def build_one(folder: Path, version: str, target: Path) -> Path:
    """Build one FMU and return its path."""
    model = read(folder)
    path = target / f"{model.name}_fmi{version[0]}.fmu"
    with tempfile.TemporaryDirectory() as work:
        library = compile_model(folder, model, version, Path(work))
        with replacing(path) as draft, zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", fmi2_xml(model) if version == "2.0" else fmi3_xml(model))
            archive.write(library, f"binaries/{binary_folder(version)[0]}/{library.name}")
    return path


def build(names: Iterable[str] = (), target: Path = TARGET) -> list[Path]:
    """Build the named reference FMUs, or all, and return their paths."""
    folders = [HERE / name for name in names] or sorted(path.parent for path in HERE.glob("*/model.toml"))
    return [build_one(folder, version, target) for folder in folders for version in VERSIONS]


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Build the reference FMUs.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="folders to build; by default all")
    parser.add_argument("--output", type=Path, default=TARGET, metavar="FOLDER", help="where to put the FMUs")
    chosen = parser.parse_args()
    for path in build(chosen.names, chosen.output):
        sys.stdout.write(f"{path}\n")


if __name__ == "__main__":
    main()
