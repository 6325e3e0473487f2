"""What a nonlinear torque at a joint is, whichever effect brings it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from identify.core.arrays import Array


class TorqueLaw(ABC):
    """A torque T = f(p) against the motion, p being a sum of the joint's angle, rate and acceleration.

    own (k, ...) are the values of the law's k parameters, positive; `count` is k.
    """

    count: ClassVar[int]

    @abstractmethod
    def probe(self, own: Array) -> Array:
        """(3, ...): the shares of angle (rad), rate (rad/s) and acceleration (rad/s^2) in p."""

    @abstractmethod
    def torque(self, free: Array, compliance: Array, own: Array) -> Array:
        """T (...), N m, that solves T = f(free - compliance T): free (...) is p without T, compliance (...)
        what a unit of T takes off.
        """
