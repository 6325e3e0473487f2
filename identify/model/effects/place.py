"""Where on a robot, or in its measurement, something can be missing: what an effect says of itself so that
discovery can look there before it knows what is missing.

Its `Form` is what it may be off by: a model of a part is never quite the part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from identify.core.arrays import Array
from identify.model.effects.site import Site

Axes = Literal["link", "base"]
What = Literal["shape", "mass", "spread"]


@dataclass(frozen=True)
class Release:
    """A constraint that may have compliance: coordinates, such as joint2.rx, that nothing in the model frees.

    towards: of a single one, those that may move along with it, in proportions that are fitted: the axis may
    have a direction of its own.
    """

    coordinates: tuple[str, ...]
    towards: tuple[str, ...] = ()

    def sentence(self) -> str:
        """For example: compliance of joint2 (rx, ry); link3 bending or twisting."""
        bodies = {name.partition(".")[0] for name in self.coordinates}
        if len(bodies) > 1:
            return f"compliance of {', '.join(self.coordinates)}"
        if any("deflection" in name for name in self.coordinates):
            return f"{min(bodies)} bending or twisting"
        axes = ", ".join(name.partition(".")[2] for name in self.coordinates)
        return f"compliance of {min(bodies)} ({axes})"


@dataclass(frozen=True)
class Beside:
    """Something that acts beside what the model has on coordinates that are free, such as the drive
    joint2.rz.
    """

    coordinates: tuple[str, ...]

    def sentence(self) -> str:
        """For example: something beside the spring of joint2.rz."""
        return f"something beside the spring of {', '.join(self.coordinates)}"


@dataclass(frozen=True)
class Attachment:
    """Something fixed to a point of a link: forces along axes (x, y, z), then moments about axes (rx, ry,
    rz), of the link or of the base.

    at_m: the point in the link's frame.  along: of a single force, its direction, of unit length, in place of
    axes.
    """

    link: str
    at_m: tuple[float, float, float]
    axes: tuple[str, ...] = ("x", "y", "z")
    frame: Axes = "link"
    name: str = field(default="", compare=False)
    along: tuple[float, float, float] | None = None

    @property
    def directions(self) -> tuple[str, ...]:
        """In words, of each of its forces and moments."""
        if self.along is None:
            return self.axes
        return ("along [" + ", ".join(f"{x:.2f}" for x in self.along) + "]",)

    def sentence(self) -> str:
        """For example: something on link3 at its centre of mass (x, y, z of the link)."""
        point = self.name or "at [" + ", ".join(f"{x:.3f}" for x in self.at_m) + "] m"
        return f"something on {self.link} {point} ({', '.join(self.directions)} of the {self.frame})"


@dataclass(frozen=True)
class Rows:
    """Response channels that read something else: each a combination of those of one point, or a factor."""

    node: int
    directions: tuple[int, ...]
    name: str = field(default="", compare=False)

    def sentence(self) -> str:
        """For example: the reading of the sensor at elbow (x, y, z)."""
        axes = ", ".join(("x", "y", "z", "rx", "ry", "rz")[d - 1] for d in self.directions)
        return f"the reading of the sensor at {self.name or self.node} ({axes})"


@dataclass(frozen=True)
class Column:
    """The force channel of one impact position and direction, such as 12:+X; empty: of all, which is a factor
    of all FRFs.
    """

    channel: str = ""
    name: str = field(default="", compare=False)

    def sentence(self) -> str:
        """For example: the reading of the force at link6_2:+X."""
        return (
            f"the reading of the force {self.name or self.channel}"
            if self.channel
            else "a factor of all FRFs"
        )


Place = Release | Beside | Attachment | Rows | Column


@dataclass(frozen=True)
class Form:
    """Errors of the form of the effect at a place, each by its name, and what it is an error of: the shape in
    which a part deforms, or where its mass is.

    changes: at a site, per unit of each error: M (k, n, n) and, by node, the motion of points (k, 6, n) in
    the axes of their link.
    """

    place: str
    errors: tuple[tuple[str, What], ...]
    changes: Callable[[Site], tuple[Array, Mapping[int, Array]]]
