"""What hangs on the links of an arm in motion beside gears: bodies that are heavier than described, and
gravity balancers.
"""

from __future__ import annotations

import numpy as np

from identify.core.config import Settings
from identify.motion.numbers import Number, quantity

LIGHTEST = -0.9
"""Share by which a body may be lighter than described."""


class Bodies(Settings):
    """How far the bodies that joints carry are off their description."""

    mass: Number = quantity(
        "", "share by which the body behind each joint is heavier, its inertia as well", 0.0, least=LIGHTEST
    )


class Balancer(Settings):
    """A balancer per joint: a torque on the link, sine sin(q) + cosine cos(q), q the joint's angle, as a
    spring with no slack length has it (`identify.explain.effects.rigid_body`).
    """

    sine: Number = quantity("N m", "on the link, in proportion to the sine of its angle", 0.0, least=-np.inf)
    cosine: Number = quantity("N m", "the same, to the cosine", 0.0, least=-np.inf)
