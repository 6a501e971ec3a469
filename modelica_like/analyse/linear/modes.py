"""Modes of small motions: eigenvalues, damping, shapes, participation, and where their energy is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from modelica_like.compile.compiled import CompiledDae
from modelica_like.errors import UnknownName, did_you_mean
from modelica_like.initialize import variable_slopes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from modelica_like.analyse.linear.linearize import LinearModel

_STILL = 1e-9
"""Eigenvalues below this share of the largest are zero: motions that nothing brings back."""
_DEFECTIVE = 1e-13


@dataclass(frozen=True, eq=False)
class Mode:
    """One real eigenvalue, or a conjugate pair of complex ones.

    Attributes:
        eigenvalue: in rad/s, that with the positive imaginary part.
        shape: deviations of all states of the model, complex, the largest (in nominal values) equal to one.
        participation: share of each state that is free, by name; they add up to one.
        stored: share of each component in the stored energy, by path; they add up to one.
        lost: share of each component in the lost power, by path.
    """

    eigenvalue: complex
    shape: Any = field(repr=False)
    participation: dict[str, float] = field(repr=False)
    stored: dict[str, float] = field(repr=False)
    lost: dict[str, float] = field(repr=False)

    @property
    def oscillates(self) -> bool:
        """Whether it is a complex pair."""
        return self.eigenvalue.imag != 0.0

    @property
    def frequency(self) -> float:
        """Frequency of the damped oscillation in Hz; zero if it does not oscillate."""
        return self.eigenvalue.imag / (2 * np.pi)

    @property
    def natural_frequency(self) -> float:
        """Magnitude of the eigenvalue in Hz: the frequency it would have without damping."""
        return abs(self.eigenvalue) / (2 * np.pi)

    @property
    def damping(self) -> float:
        """Damping ratio: 0 undamped, 1 and more not oscillating; nan for an eigenvalue of zero."""
        size = abs(self.eigenvalue)
        return -self.eigenvalue.real / size if size else float("nan")

    @property
    def time_constant(self) -> float:
        """Time in s in which the motion falls to 1/e; negative if it grows, infinite if it stays."""
        return -1.0 / self.eigenvalue.real if self.eigenvalue.real else float("inf")

    def __str__(self) -> str:
        value = self.eigenvalue
        text = f"{value.real:.5g} ± {value.imag:.5g}j" if self.oscillates else f"{value.real:.5g}"
        parts = [f"{text} rad/s"]
        if self.oscillates:
            parts.append(f"{self.frequency:.4g} Hz, damping {self.damping:.3g}")
        elif value:
            parts.append(f"time constant {self.time_constant:.4g} s")
        for title, shares in (("energy in", self.stored), ("lost in", self.lost)):
            if shares:
                parts.append(f"{title} {_largest(shares)}")
        return "; ".join(parts)


@dataclass(frozen=True, eq=False)
class Modes(Sequence[Mode]):
    """All modes of a linear model, the slowest oscillation first, then what does not oscillate."""

    linear: LinearModel = field(repr=False)
    modes: tuple[Mode, ...]

    def __getitem__(self, index: Any) -> Any:
        return self.modes[index]

    def __len__(self) -> int:
        return len(self.modes)

    def __iter__(self) -> Iterator[Mode]:
        return iter(self.modes)

    def shape(self, mode: int, names: Sequence[str]) -> Any:
        """Return the deviations of variables in a mode, complex, shape (len(names),).

        Raises:
            UnknownName: a name is not a variable of the model.
        """
        model = self.linear.model
        for name in names:
            if name not in model.position:
                hint = did_you_mean(name, model.position) or "."
                raise UnknownName(f"{model.name} has no variable '{name}'{hint}")
        slopes = variable_slopes(model, self.linear.point, [model.position[name] for name in names])
        return slopes @ self.modes[mode].shape

    def plot(self, names: Sequence[str], count: int = 4) -> Figure:
        """Draw the deviations of variables of one unit, such as speeds along the drive, in the first `count` modes."""
        from modelica_like.analyse.linear.pictures import draw_shapes

        return draw_shapes(self, names, count)

    def __str__(self) -> str:
        head = f"Modes of {self.linear.model.name} at t = {self.linear.time:g} s"
        return "\n".join([head, *(f"  {k + 1}  {mode}" for k, mode in enumerate(self.modes))])


def find_modes(linear: LinearModel) -> Modes:
    """Return the modes of a linear model."""
    values, right = np.linalg.eig(linear.A)
    # Repeated eigenvalues may lack eigenvectors: what is not determined counts as absent.
    left = np.linalg.pinv(right, rcond=_DEFECTIVE).T
    values = np.where(np.abs(values) <= _STILL * np.abs(values).max(initial=0.0), 0.0, values)
    chosen = [k for k, value in enumerate(values) if value.imag >= 0.0]
    chosen.sort(key=lambda k: (values[k].imag == 0.0, abs(values[k].imag), abs(values[k].real)))
    curvature = _curvature(linear.model)
    found = [_mode(linear, complex(values[k]), right[:, k], left[:, k], curvature) for k in chosen]
    return Modes(linear, tuple(found))


def _mode(linear: LinearModel, value: complex, right: Any, left: Any, curvature: ca.Function) -> Mode:
    model = linear.model
    shape = linear.shape @ right
    relative = shape / model.nominals
    shape = shape / relative[np.argmax(np.abs(relative))]
    shares = np.abs(right) * np.abs(left)
    participation = dict(zip(linear.states, shares / max(shares.sum(), 1e-300), strict=True))
    energies = sum(_terms(linear, curvature, part) for part in (shape.real, shape.imag))
    stored, lost = (_shares(model.components, column) for column in np.asarray(energies).T)
    return Mode(value, shape, {k: float(v) for k, v in participation.items()}, stored, lost)


def _terms(linear: LinearModel, curvature: ca.Function, change: Any) -> Any:
    """Stored energy and loss of every component for a deviation of the states, to second order."""
    model, point = linear.model, linear.point
    follow = np.zeros(len(model.implicit))
    if model.implicit:
        arguments = point.t, point.x, point.z, model.p, model.u, point.d
        slopes = model._cache["alg_by_x"](*arguments) @ change
        follow = -np.linalg.solve(np.asarray(model.alg_jacobian(*arguments).full()), np.asarray(slopes).ravel())
    return np.asarray(curvature(point.t, point.x, point.z, model.p, model.u, point.d, change, follow).full())


def _curvature(model: CompiledDae) -> ca.Function:
    """Second derivative of stored energies and losses along a change of states and implicit unknowns."""
    if "curvature" not in model._cache:
        symbols = model.arguments
        arguments = list(symbols.values())
        unknowns = ca.vertcat(symbols["x"], symbols["z"])
        dx, dz = ca.SX.sym("dx", len(model.states)), ca.SX.sym("dz", len(model.implicit))
        change = ca.vertcat(dx, dz)
        terms = ca.vec(model.energy(*arguments)[:, :2])
        second = ca.jtimes(ca.jtimes(terms, unknowns, change), unknowns, change)
        table = ca.reshape(second, len(model.components), 2)
        model._cache["curvature"] = ca.Function("curvature", [*arguments, dx, dz], [ca.densify(table)])
        slopes = ca.densify(ca.jacobian(model.alg(*arguments), symbols["x"]))
        model._cache["alg_by_x"] = ca.Function("alg_by_x", arguments, [slopes])
    return model._cache["curvature"]


def _shares(components: Sequence[str], amounts: Any) -> dict[str, float]:
    """Shares of what is there; the whole first, so that small ones are seen as small."""
    total = float(np.abs(amounts).sum())
    if not total:
        return {}
    shares = {path: float(amount / total) for path, amount in zip(components, amounts, strict=True)}
    return dict(sorted(((p, s) for p, s in shares.items() if abs(s) > _STILL), key=lambda item: -abs(item[1])))


def _largest(shares: dict[str, float], count: int = 3) -> str:
    return ", ".join(f"{path} {100 * share:.0f} %" for path, share in list(shares.items())[:count])
