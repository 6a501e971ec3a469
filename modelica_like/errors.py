"""One family of errors: what happened, where, why, and what to do about it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from typing import Any

from modelica_like.places import SHOWN
from modelica_like.places import Source as Source

# Raised only by a defect of this package; every expected error is a ModelicaLikeError.
DEFECTS = (
    ArithmeticError, AssertionError, AttributeError, EOFError, LookupError, MemoryError, RuntimeError, StopIteration,
    SyntaxError, TypeError, ValueError,
)  # fmt: skip
_SHORT = 3
"""A part of a name that is not longer does not suggest the name."""
_ENDLESS = re.compile(r"\S{500,}")
"""A word of this length is not repeated in a message."""


class ModelicaLikeError(Exception):
    """Base of all errors of this package.

    Args:
        what: one sentence that says what is wrong and names the component.
        where: source places, most relevant first.
        why: one sentence with the reason, where it is not obvious.
        advice: one sentence that says what to do.
        word: the wrong word, as it stands in the file.
        instead: what is meant by it, if that is clear.
        operation: a change of the file that does what the advice says: `operation` is its kind, the others say what.
    """

    def __init__(
        self, what: str, *, where: Source | Iterable[Source] = (), why: str = "", advice: str = "",
        word: str = "", instead: str = "", operation: Mapping[str, Any] | None = None,
    ) -> None:  # fmt: skip
        what = _ENDLESS.sub(lambda word: f"{word[0][:SHOWN]}…", what)
        super().__init__(what)
        self.what = what
        places = (where,) if isinstance(where, Source) else tuple(where)
        self.where: tuple[Source, ...] = tuple(place for place in places if place.file)
        self.why = why
        self.advice = advice
        self.word = word
        self.instead = instead
        self.operation = operation

    def __str__(self) -> str:
        lines = [self.what]
        lines += [f"  in {source}" for source in self.where]
        lines += [text for text in (self.why, self.advice) if text]
        return "\n".join(lines)

    def problems(self) -> Sequence[ModelicaLikeError]:
        """Return the errors that are told together: this one alone, or several."""
        return (self,)

    def as_json(self) -> dict[str, Any]:
        """Return the error as data for JSON; what is not known is None, or an empty text.

        Returns:
            `kind`, the name of its class; `file`, `line`, `column`, `length` and `path` (of the key) of its first
            place; `what`, `why` and `advice`; `places`, the others with the same keys; `suggestion`, a change of the
            file that does exactly what the advice says: its `operation` is `replace` (the text `old` at a place by
            `new`), `set` (give the parameter or input `path` a value in `unit`), `free` (add `end` to the list `free`),
            `connect` (the ends `first` and `second`) or `insert` (a part `name` of type `kind` between the two ends
            `between`); `modelica_like.edit.apply` takes it.
        """
        first, *others = self.where or (Source(""),)
        place = first.as_json(self.word)
        # Only a file of data can be changed by an operation; a place in Python has no statement.
        suggestion = {**self.operation, "file": first.file} if self.operation and first.statement else None
        if self.instead and first.spot(self.word):
            spot = {key: place[key] for key in ("file", "line", "column", "length")}
            suggestion = {"operation": "replace", **spot, "old": self.word, "new": self.instead}
        texts = {"what": self.what, "why": self.why, "advice": self.advice}
        return {
            "kind": type(self).__name__, **place, **texts,
            "places": [other.as_json(self.word) for other in others], "suggestion": suggestion,
        }  # fmt: skip

    def __reduce__(self) -> tuple[object, ...]:
        further = {"word": self.word, "instead": self.instead, "operation": self.operation}
        return _rebuild, (type(self), self.what, self.where, self.why, self.advice), further


def _rebuild(
    kind: type[ModelicaLikeError], what: str, where: tuple[Source, ...], why: str, advice: str
) -> ModelicaLikeError:
    return kind(what, where=where, why=why, advice=advice)


class LanguageError(ModelicaLikeError):
    """A component class has an invalid declaration."""


class ComponentUnbalanced(LanguageError):
    """A component has more or fewer equations than unknowns of its own."""


class UnitError(ModelicaLikeError):
    """A unit is unknown, or a value has the wrong one."""


class UnitMismatch(UnitError):
    """The two sides of an equation or of a connection differ in dimension."""


class ValueOutOfRange(ModelicaLikeError):
    """A value is not finite, or outside the declared range."""


class NotEnoughMemory(ModelicaLikeError, MemoryError):
    """A model or a run needs more memory than there is."""


class UnknownName(ModelicaLikeError):
    """A name of a component, connector, parameter, variable or type does not exist."""


class DuplicateName(ModelicaLikeError):
    """A name is used twice."""


class MissingValue(ModelicaLikeError):
    """A parameter without default has no value."""


class MissingInput(MissingValue):
    """An input has neither a value nor a connection."""


class NetlistError(ModelicaLikeError):
    """A netlist file cannot be read, or does not have the form of a netlist."""


class UntrustedModule(NetlistError):
    """A netlist uses a Python module in a folder that is not trusted."""


class ModelicaTextError(NetlistError):
    """A Modelica text cannot be read, or uses what is not supported."""


class CyclicAssembly(NetlistError):
    """A netlist contains itself, or parameters depend on each other cyclically."""


class WrongConnection(ModelicaLikeError):
    """Connectors of different kinds, or two outputs, are joined."""


class FreeFlange(ModelicaLikeError):
    """A connector that must be connected is free."""


class WiringErrors(ModelicaLikeError):
    """Several errors of the wiring, reported together."""

    def __init__(
        self, what: str, *, errors: Sequence[ModelicaLikeError] = (), where: Iterable[Source] = (),
        why: str = "", advice: str = "",
    ) -> None:  # fmt: skip
        super().__init__(what, where=where, why=why, advice=advice)
        self.errors = tuple(errors)

    def problems(self) -> Sequence[ModelicaLikeError]:
        """Return the errors."""
        return tuple(inner for error in self.errors for inner in error.problems())

    def as_json(self) -> dict[str, Any]:
        """Return the number of errors as data for JSON, with each of them in `problems`."""
        return {**super().as_json(), "problems": [error.as_json() for error in self.problems()]}

    def __str__(self) -> str:
        return "\n\n".join(str(error) for error in self.errors)

    def __reduce__(self) -> tuple[object, ...]:
        return raise_together_or_one, (self.errors,)


def raise_together_or_one(errors: Sequence[ModelicaLikeError]) -> ModelicaLikeError:
    """Return a single error unchanged, several as one `WiringErrors`."""
    if len(errors) == 1:
        return errors[0]
    return WiringErrors(f"{len(errors)} errors", errors=errors)


class StructureError(ModelicaLikeError):
    """The equations cannot determine the unknowns."""


class Underdetermined(StructureError):
    """There are more unknowns than equations for them."""


class Overdetermined(StructureError):
    """There are more equations than unknowns in them."""


class InitializationError(ModelicaLikeError):
    """Start values are missing, contradict each other, or cannot be found."""


class MissingStart(InitializationError):
    """The initialization lacks an equation."""


class ContradictingStart(InitializationError):
    """Start values contradict each other by the equations of the model."""


class SolveError(ModelicaLikeError):
    """The simulation cannot continue.

    Attributes:
        run: the `Solution` up to the error, if there is one.
    """

    run: Any = None


class Interrupted(KeyboardInterrupt):
    """A simulation was interrupted by the user, or by its progress.

    Attributes:
        run: the `Solution` up to then, if there is one.
    """

    run: Any = None

    @classmethod
    def after(cls, run: Any) -> Interrupted:
        """Return the interrupt of a run."""
        error = cls()
        error.run = run
        return error


class SingularAtStart(SolveError):
    """A block of equations has no unique solution at the start or after an event."""


class Chattering(SolveError):
    """Modes switch without end."""


class NoValidModes(SolveError):
    """No combination of the modes of ideal elements is possible."""


class ContradictingValue(SolveError):
    """An event gives a variable a value that something else determines."""


class LimitPassed(SolveError):
    """A component has ended the run, because a limit was passed."""


class StepFailed(SolveError):
    """The integrator gave up."""


class EnergyDrift(SolveError):
    """The stored energy of a component does not follow its power: the integrator has stepped over something."""


class NoGradient(SolveError):
    """A derivative does not exist: an event grazes zero, two events coincide, or the mode sequence changes."""


class ExportError(ModelicaLikeError):
    """A model cannot be written as an FMU, or its C code cannot be compiled."""


class FmuRefused(ModelicaLikeError):
    """An FMU, or a file that should be one, cannot be run."""


class FmuFailed(SolveError):
    """An FMU reported an error during its run."""


class FmuCrashed(FmuFailed):
    """An FMU crashed its process."""


class FmuTimeout(FmuFailed):
    """An FMU did not finish in time."""


class CalibrationFailed(SolveError):
    """A model could not be solved for any parameters that a calibration tried."""


class WorkersLost(ModelicaLikeError):
    """Processes or machines with runs of a sweep were lost."""


class CheckpointMismatch(ModelicaLikeError):
    """A checkpoint belongs to another sweep."""


class MissingExtra(ModelicaLikeError):
    """An optional package is not installed."""


def missing_extra(package: str, extra: str) -> MissingExtra:
    """Return the error about a missing package of an extra."""
    return MissingExtra(f"{package} is not installed.", advice=f'Install it with: pip install "modelica-like[{extra}]"')


def extra_module(module: str, extra: str, package: str = "") -> Any:
    """Import a module of a package that an extra installs.

    Raises:
        MissingExtra: the package is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        raise missing_extra(package or module.partition(".")[0], extra) from None


def unknown_name(
    what: str, name: object, candidates: Iterable[str], more: str = "", *, advice: str = "",
    where: Source | Iterable[Source] = (),
) -> UnknownName:  # fmt: skip
    """Return the error about a name that does not exist, with the known one that is meant.

    Args:
        what: begin of a sentence that ends in the name.
        name: as it stands in the file.
        candidates: names that exist.
        more: further sentences.
        advice: what to do.
        where: source places.
    """
    near = nearest(name, candidates)
    what = f"{what}{question(near) or '.'}{more}"
    return UnknownName(what, where=where, advice=advice, word=str(name), instead=near)


def did_you_mean(name: object, candidates: Iterable[str]) -> str:
    """Return `; did you mean 'sun'?` for the known name nearest to `name` (of any type), or an empty string."""
    return question(nearest(name, candidates))


def question(name: str) -> str:
    """Return `; did you mean 'sun'?` for a name, or an empty string for none."""
    return f"; did you mean '{name}'?" if name else ""


def nearest(name: object, candidates: Iterable[str]) -> str:
    """Return the known name nearest to `name` (of any type), or an empty string."""
    import difflib  # slow to import

    name, names = str(name), list(candidates)
    within = sorted((other for other in names if len(name) > _SHORT and name.lower() in other.lower()), key=len)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.58 if not within else 0.8)
    near = near or within or [other for other in names if other in name.split("_") or other.lower() == name.lower()]
    return near[0] if near else ""
