"""Motions that a mode holds: the slip of stuck plates, the overrun of a locked freewheel."""

from __future__ import annotations

from dataclasses import dataclass

UNLIMITED = 1e30
"""Smallest capacity that counts as unlimited."""


@dataclass(frozen=True)
class Hold:
    """A motion that is zero in a mode, with whatever reaction that takes.

    All attributes are names of fields, properties or methods without arguments of the component.

    Attributes:
        motion: the variable that is zero: a speed, such as a slip.
        reaction: the variable that holds it, a torque or force against forward motion (reaction times motion is lost
            power); needed if several elements hold the same motion, and for the energy of an impact.
        capacity: the largest reaction against forward and against backward motion, two positive numbers, or one for
            both; None means no limit. A limited reaction transmits no impulse.
        restitution: speed after an impact over the speed before it, from 0 to 1; by default 0.
    """

    motion: str
    reaction: str = ""
    capacity: str = ""
    restitution: str = ""
