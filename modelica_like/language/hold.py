"""Motions that a mode holds: the slip of plates that stick, the overrun of a freewheel that is locked."""

from __future__ import annotations

from dataclasses import dataclass

UNLIMITED = 1e30
"""A capacity from which on nothing limits the reaction."""


@dataclass(frozen=True)
class Hold:
    """A motion that stands still while a mode lasts, with whatever reaction that takes.

    All attributes are names of fields, properties or methods without arguments of the component.

    Attributes:
        motion: the variable that is zero: a speed, such as a slip.
        reaction: the variable that holds it, a torque or force against forward motion (reaction times motion is lost
            power); needed where several elements hold the same motion, or for the energy of an impact.
        capacity: the largest reaction against forward and against backward motion, two positive numbers, or one for
            both; None, or nothing said, means that nothing limits it. A limited reaction passes no impulse on.
        restitution: speed after an impact over the speed before it, from 0 to 1; nothing said means 0.
    """

    motion: str
    reaction: str = ""
    capacity: str = ""
    restitution: str = ""
