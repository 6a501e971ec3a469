"""The closed form of examples/two_mass.toml."""

from math import sqrt

import numpy as np

M, J1, J2, C, D = 5.0, 0.02, 0.08, 400.0, 0.2


def closed_form(time: np.ndarray) -> dict[str, np.ndarray]:
    """A damped oscillation of the twist around its mean, on top of a constant acceleration of the centre of mass."""
    total, reduced = J1 + J2, J1 * J2 / (J1 + J2)
    mean, decay = -M * J2 / (total * C), D / (2 * reduced)
    w = sqrt(C / reduced - decay**2)
    swing = np.exp(-decay * time)
    twist = mean - mean * swing * (np.cos(w * time) + decay / w * np.sin(w * time))
    rate = mean * swing * (w + decay**2 / w) * np.sin(w * time)
    return {"J2.w": M / total * time + J1 / total * rate, "shaft.tau": C * twist + D * rate}
