"""Linear models of small motions, and their modes: eigenvalues, shapes, participation, energy shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from modelica_like.analyse.linear.pictures import bode, mode_name, nyquist
from modelica_like.compile.cached import Cached
from modelica_like.compile.compiled import CompiledDae, Vector
from modelica_like.errors import ValueOutOfRange, extra_module
from modelica_like.solve.initialize import Point, variable_slopes
from modelica_like.solve.initialize.memory import listed
from modelica_like.solve.initialize.slopes import implicit_slopes, nodes_of
from modelica_like.style import COLOURS, picture, text_width
from modelica_like.upper import Shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STILL = 1e-9
"""Eigenvalues below this share of the largest are zero: motions without a restoring force."""
_DEFECTIVE = 1e-13
_SHOWN = 12
_ROOM = 7.0
"""Inches for names side by side."""


@dataclass(frozen=True, eq=False)
class LinearModel(Shown):
    """Small motions about a point: der(x) = A x + B u, y = C x + D u, in deviations from x0, u0, y0.

    Attributes:
        model: the compiled model.
        point: where it was linearised.
        A: shape (states, states).
        B: shape (states, inputs).
        C: shape (outputs, states).
        D: shape (outputs, inputs).
        states: names of the states that can move.
        held: names of the states that modes hold: they follow from the others, or are constant.
        inputs: names of inputs and parameters.
        outputs: names of variables.
        units: coherent SI unit of every name.
        shape: deviations of all states of the model by those of `states`, shape (all states, states).
        sampled: names of discrete values that clocks set from the motion, on which motion or outputs depend: they are
            constant here, as if no clock ticked.
    """

    model: CompiledDae = field(repr=False)
    point: Point = field(repr=False)
    A: Vector
    B: Vector
    C: Vector
    D: Vector
    states: tuple[str, ...]
    held: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str] = field(repr=False)
    shape: Vector = field(repr=False)
    sampled: tuple[str, ...] = ()

    @property
    def notices(self) -> tuple[str, ...]:
        """What the linear model leaves out."""
        if not self.sampled:
            return ()
        held = f"{listed(self.sampled)} {'is' if len(self.sampled) == 1 else 'are'} held constant"
        return (f"No clock ticks in these small motions: {held}, and a loop that passes samples is open.",)

    @property
    def time(self) -> float:
        """Time of the point in s."""
        return self.point.t

    def eigenvalues(self) -> Any:
        """Return the eigenvalues of A in rad/s, complex, shape (states,)."""
        return np.linalg.eigvals(self.A)

    def modes(self) -> Modes:
        """Return eigenvalues, damping, shapes, participation and energy shares of each mode."""
        values, right = np.linalg.eig(self.A)
        # Repeated eigenvalues may lack eigenvectors; undetermined parts count as zero.
        left = np.linalg.pinv(right, rcond=_DEFECTIVE).T
        values = np.where(np.abs(values) <= _STILL * np.abs(values).max(initial=0.0), 0.0, values)
        chosen = [k for k, value in enumerate(values) if value.imag >= 0.0]
        chosen.sort(key=lambda k: (values[k].imag == 0.0, abs(values[k].imag), abs(values[k].real)))
        energies = _Energies(self.model, self.point)
        return Modes(self, tuple(_mode(self, complex(values[k]), right[:, k], left[:, k], energies) for k in chosen))

    def response(self, frequencies: Any) -> Any:
        """Return the frequency response, complex, shape (outputs, inputs, frequencies).

        Args:
            frequencies: in Hz.

        Raises:
            ValueOutOfRange: at one of them a motion is free, so that it has no amplitude.
        """
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequencies, float))[:, None, None]
        try:
            motion = np.linalg.solve(s * np.eye(len(self.states)) - self.A, self.B.astype(complex))
        except np.linalg.LinAlgError:
            distances = np.abs(s.ravel()[:, None] - self.eigenvalues()).min(axis=1)
            free = s.ravel()[np.argmin(distances)].imag / (2 * np.pi)
            raise ValueOutOfRange(
                f"{self.model.name} has no response at {free:.4g} Hz: nothing holds or damps a motion there.",
                advice="Leave that frequency out.",
            ) from None
        return np.moveaxis(self.C @ motion + self.D, 0, -1)

    def bode(self, frequencies: Any = None) -> Figure:
        """Draw gain in dB and phase of every output by every input, with the modes by number; of a loop its margins.

        Args:
            frequencies: in Hz; by default around those of the modes and margins.
        """
        return bode(self, None if frequencies is None else np.asarray(frequencies, float))

    def nyquist(self, frequencies: Any = None) -> Figure:
        """Draw the frequency responses in the complex plane, with the unit circle and the point -1.

        Args:
            frequencies: in Hz; by default around those of the modes.
        """
        return nyquist(self, self.around(3.0, 3000) if frequencies is None else np.asarray(frequencies, float))

    def around(self, decades: float = 1.0, points: int = 600) -> Any:
        """Return frequencies around those of the modes in Hz, closer where a mode has little damping.

        Args:
            decades: below the lowest and above the highest mode.
            points: number of those that are evenly spread.
        """
        values = self.eigenvalues()
        sizes = np.abs(values) / (2 * np.pi)
        sizes = sizes[sizes > _STILL * sizes.max(initial=1.0)]
        low, high = (sizes.min(), sizes.max()) if len(sizes) else (0.1, 10.0)
        low, high = low / 10**decades, high * 10**decades
        swings = values[values.imag > 0] / (2 * np.pi)
        near = (swings.imag[:, None] + swings.real[:, None] * np.linspace(-4, 4, 33)).ravel()
        return np.unique([*np.geomspace(low, high, points), *near[(near > low) & (near < high)]])

    def to_scipy(self) -> Any:
        """Return a scipy.signal.StateSpace.

        Raises:
            MissingExtra: scipy is not installed.
        """
        return extra_module("scipy.signal", "analyse").StateSpace(self.A, self.B, self.C, self.D)

    def to_control(self) -> Any:
        """Return a state space of python-control, with the names of its signals.

        Raises:
            MissingExtra: python-control is not installed.
        """
        control = extra_module("control", "analyse")
        # python-control reserves dots for signals of interconnected systems.
        plain = {k: [name.replace(".", "_") for name in getattr(self, k)] for k in ("states", "inputs", "outputs")}
        return control.ss(self.A, self.B, self.C, self.D, name=self.model.name.replace(".", "_"), **plain)

    def __str__(self) -> str:
        lines = [
            f"LinearModel of {self.model.name} at t = {self.time:g} s: {len(self.states)} states, "
            f"{len(self.inputs)} inputs, {len(self.outputs)} outputs"
        ]
        for title in ("states", "held", "inputs", "outputs"):
            names = getattr(self, title)
            shown = [f"{name} [{self.units[name]}]" for name in names[:_SHOWN]]
            lines += [f"  {title}: {', '.join([*shown, '…'] if len(names) > _SHOWN else shown)}"] if names else []
        return "\n".join([*lines, *(f"  {notice}" for notice in self.notices)])


@dataclass(frozen=True, eq=False)
class Mode:
    """One real eigenvalue, or a conjugate pair of complex ones.

    Attributes:
        eigenvalue: in rad/s, that with the positive imaginary part.
        shape: deviations of all states of the model, complex, the largest (in nominal values) equal to one.
        participation: share of each free state, by name; the sum is one.
        stored: share of each component in the stored energy, by path; the sum is one.
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
class Modes(Shown, Sequence[Mode]):
    """All modes of a linear model: oscillations, the slowest first, then real eigenvalues."""

    linear: LinearModel = field(repr=False)
    modes: tuple[Mode, ...]

    def __getitem__(self, index: Any) -> Any:
        return self.modes[index]

    def __len__(self) -> int:
        return len(self.modes)

    def shape(self, mode: int, names: Sequence[str]) -> Any:
        """Return the deviations of variables in a mode, complex, shape (len(names),).

        Raises:
            UnknownName: a name is not a variable of the model.
        """
        model = self.linear.model
        return variable_slopes(model, self.linear.point, nodes_of(model, names)) @ self.modes[mode].shape

    def plot(self, names: Sequence[str], count: int = 4) -> Figure:
        """Draw variables along the drive in the first oscillating modes, at the time of the largest deviation.

        Args:
            names: variables, such as speeds and velocities; the largest of each unit is one.
            count: largest number of modes.
        """
        all_modes = [k for k, mode in enumerate(self.modes) if mode.oscillates]
        chosen, rest = all_modes[:count], all_modes[count:]
        number, units = max(len(chosen), 1), np.array([str(self.linear.model.units[name]) for name in names])
        below = [[f"Not drawn: {len(rest)} faster modes."]] if rest else []
        with picture(f"Modes of {self.linear.model.name}", number, 0.9 + 1.3 * number, below=below) as (figure, rows):
            for row, k in enumerate(chosen):
                shape, axes, mode = self.shape(k, names), rows[row], self.modes[k]
                values = np.real(shape / (shape[np.argmax(np.abs(shape))] or 1.0))
                for unit in dict.fromkeys(units):
                    values[units == unit] /= np.max(np.abs(values[units == unit])) or 1.0
                axes.axhline(0.0, color="#666666", linewidth=0.8)
                axes.plot(range(len(names)), values, "o-", color=COLOURS[row % len(COLOURS)])
                axes.set(ylim=(-1.2, 1.2), ylabel="relative")
                title = f"{mode.frequency:.4g} Hz, damping {mode.damping:.3g}: {mode_name(mode)}"
                axes.set_title(title, loc="left", fontsize=9)
            long = sum(text_width(name, 9.0) + 0.15 for name in names) > _ROOM
            turned = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if long else {}
            rows[-1].set_xticks(range(len(names)), names, **turned)
        return figure

    def __str__(self) -> str:
        head = f"Modes of {self.linear.model.name} at t = {self.linear.time:g} s"
        return "\n".join([head, *(f"  {k + 1}  {mode}" for k, mode in enumerate(self.modes)), *self.linear.notices])


def _mode(linear: LinearModel, value: complex, right: Vector, left: Vector, energies: _Energies) -> Mode:
    model = linear.model
    shape = linear.shape @ right
    relative = shape / model.equations.nominals
    shape = shape / relative[np.argmax(np.abs(relative))]
    shares = np.abs(right) * np.abs(left)
    participation = dict(zip(linear.states, map(float, shares / max(shares.sum(), 1e-300)), strict=True))
    stored, lost = (
        _shares(model.components, column) for column in (energies.of(shape.real) + energies.of(shape.imag)).T
    )
    return Mode(value, shape, participation, stored, lost)


class _Energies:
    """Stored energy and loss of every component for deviations of the states from a point, to second order."""

    def __init__(self, model: CompiledDae, point: Point) -> None:
        self._second = model.once(Cached.CURVATURE, lambda: _curvature(model))
        self._point = point.t, point.x, point.z, model.p, model.u, point.d
        self._z_x = implicit_slopes(model, point)[0]

    def of(self, change: Vector) -> Vector:
        """Return them for a change of the states, shape (components, 2)."""
        return np.asarray(self._second(*self._point, change, self._z_x @ change).full())


def _curvature(model: CompiledDae) -> ca.Function:
    """Second derivative of stored energies and losses along a change of states and implicit unknowns."""
    given = model.arguments
    unknowns = ca.vertcat(given["x"], given["z"])
    dx, dz = ca.SX.sym("dx", len(model.states)), ca.SX.sym("dz", len(model.implicit))
    second = ca.vec(model.energy(*given.values())[:, :2])
    for _ in range(2):
        second = ca.jtimes(second, unknowns, ca.vertcat(dx, dz))
    table = ca.reshape(second, len(model.components), 2)
    return ca.Function("curvature", [*given.values(), dx, dz], [ca.densify(table)])


def _shares(components: Sequence[str], amounts: Any) -> dict[str, float]:
    """Shares of the total, computed from it, so that small values stay small."""
    total = float(np.abs(amounts).sum())
    if not total:
        return {}
    shares = {path: float(amount / total) for path, amount in zip(components, amounts, strict=True)}
    return dict(sorted(((p, s) for p, s in shares.items() if abs(s) > _STILL), key=lambda item: -abs(item[1])))


def _largest(shares: dict[str, float], count: int = 3) -> str:
    return ", ".join(f"{path} {100 * share:.0f} %" for path, share in list(shares.items())[:count])
