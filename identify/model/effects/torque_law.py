"""What a nonlinear torque at a joint is, whichever effect brings it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
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
    def solver(self, compliance: Array, own: Array) -> Callable[[Array], Array]:
        """Of free (...), p without T, it gives T (...), N m, that solves T = f(free - compliance T);
        compliance (...) is what a unit of T takes off.  It is asked at every time step: what does not depend
        on free is done before.
        """
