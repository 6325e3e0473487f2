"""Effects of the measurement: what stands between the motion of the robot and the FRFs in the file.

They change no matrix.  For every FRF set, such an effect gives a `Reading`, which turns the FRFs that the
model predicts into those that the instruments would have recorded, with exact derivatives.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Complex, Index
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.model.effects.base import Effect, Term
from identify.model.effects.place import Place, Rows
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.points import Point


class Reading(ABC):
    """What one effect does to the FRFs predicted for one set; linear in them.

    h is (..., lines, channels, inputs), s (lines,) or (..., lines) where the set samples H; own (..., k) are
    the values of the effect's k parameters, for each of a population or for one.
    """

    @abstractmethod
    def apply(self, h: Complex, own: Array, s: Complex) -> Complex:
        """The FRFs as recorded; h itself is left as it is."""

    @abstractmethod
    def slopes(self, h: Complex, own: Array, s: Complex) -> Complex:
        """Derivatives (lines, channels, inputs, k) of what `apply` gives with respect to own (k,)."""

    def along_s(self, h: Complex, own: Array, s: Complex) -> Complex:
        """Derivative (lines, channels, inputs) of what `apply` gives with respect to s, h held; zero by
        default.
        """
        return np.zeros_like(h)

    def decay(self) -> float:
        """What one unit of each parameter adds to the decay of the window, 1/s, that is to the real part of
        s.
        """
        return 0.0

    def shortening(self) -> float:
        """By how much one unit of each parameter shortens what the record has of the response, s."""
        return 0.0


class Unread(Reading):
    """What changes which transform of the motion H is, and nothing that instruments make of it."""

    def apply(self, h: Complex, own: Array, s: Complex) -> Complex:
        """As it is."""
        return h

    def slopes(self, h: Complex, own: Array, s: Complex) -> Complex:
        """None."""
        return np.zeros((*h.shape, own.size), dtype=complex)


class MeasurementEffect(Effect):
    """An effect that acts on FRFs through its `reading`, on no matrix, and frees nothing."""

    of_measurement: ClassVar[bool] = True

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The measurement as a whole; others say at which channels or points."""
        yield cls.model_validate({})

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """None, unless the effect has a size; it adds to no matrix."""
        return []

    def needed(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> tuple[Channel, ...]:
        """Channels that the reading must know besides those of the set: a turned sensor reads along
        directions that were not recorded.
        """
        return ()

    @abstractmethod
    def reading(self, channels: tuple[Channel, ...], points: Mapping[int, Point]) -> Reading:
        """What it does to the FRFs of a set with these response channels."""

    def reading_of(
        self, channels: tuple[Channel, ...], inputs: tuple[Channel, ...], points: Mapping[int, Point]
    ) -> Reading:
        """The same of a set with these responses and forces; by default its forces do not matter."""
        return self.reading(channels, points)


@dataclass(frozen=True)
class Mixing(Reading):
    """Some channels (their numbers, r of them) read combinations of each other.

    matrix gives the combinations (..., r, r) at own (..., k); slope their derivatives (r, r, k) at own (k,).
    """

    channels: Index
    matrix: Callable[[Array], Array]
    slope: Callable[[Array], Array]

    def apply(self, h: Complex, own: Array, s: Complex) -> Complex:
        """h with those channels mixed."""
        mixed = h.copy()
        mixed[..., self.channels, :] = self.matrix(own)[..., None, :, :] @ h[..., self.channels, :]
        return mixed

    def slopes(self, h: Complex, own: Array, s: Complex) -> Complex:
        """Zero but for those channels."""
        slopes = np.zeros((*h.shape, own.size), dtype=complex)
        slopes[:, self.channels] = np.einsum("abk,lbi->laik", self.slope(own), h[:, self.channels])
        return slopes


def constant(channels: Index, matrix: Array) -> Mixing:
    """Channels mixed by a matrix (r, r) that depends on no parameter."""
    return Mixing(channels, lambda own: matrix, lambda own: np.zeros((*matrix.shape, 0)))


def find_point(name: str | int, points: Mapping[int, Point], where: str) -> Point:
    """A measurement point by its node number or its name; an unknown or ambiguous one is an InputError."""
    found = [point for point in points.values() if str(name) in (str(point.node), point.name)]
    if len(found) == 1:
        return found[0]
    known = ", ".join(f"{point.node} ({point.name})" for point in points.values())
    problem = f"{len(found)} points are called {name!r}" if found else f"no measurement point {name!r}"
    raise InputError(
        where,
        problem,
        f"the node number or the name of one of {known or 'the points file, which is missing'}",
    )


OneChannel = Annotated[
    str | int,
    Field(
        description=(
            "channel such as 12:+Z, whichever its sign, or a point by node number or name: all its channels"
        )
    ),
]
"""What an effect on one response channel, or on all of a point."""


def single_channels(points: Mapping[int, Point]) -> Iterator[str]:
    """The three translations of every point."""
    for node in points:
        for direction in (1, 2, 3):
            yield str(Channel(node, direction))


def find_channels(
    name: str | int, channels: tuple[Channel, ...], points: Mapping[int, Point], where: str
) -> Index:
    """Numbers of the response channels meant by a channel such as 12:+Z or elbow:Z, whichever its sign, or by
    a point: all of its own.

    Empty where the set does not have them; InputError for a point that does not exist.
    """
    head, _, direction = str(name).rpartition(":")
    point = find_point(head or name, points, where)
    axes = [abs(Channel.parse(f"{point.node}:{direction}", where).direction)] if head else range(7)
    return np.array(
        [n for n, c in enumerate(channels) if c.node == point.node and abs(c.direction) in axes], dtype=int
    )


def rows_of(name: str | int, points: Mapping[int, Point], where: str) -> Place:
    """The place of a channel such as 12:+Z or elbow:Z, or of a point: its three translations."""
    head, _, direction = str(name).rpartition(":")
    point = find_point(head or name, points, where)
    own = (abs(Channel.parse(f"{point.node}:{direction}", where).direction),) if head else (1, 2, 3)
    return Rows(point.node, own, point.name)


def turned(channels: tuple[Channel, ...], numbers: Index, turn: Array) -> Array:
    """(r, r) matrix by which channels of one point read after their sensor's axes were exchanged or turned.

    Row a of turn (3, 3) says how the instrument's new axis a reads the old ones.  Translations and rotations
    turn alike.
    """
    matrix = np.zeros((len(numbers), len(numbers)))
    chosen = [channels[number] for number in numbers]
    for row, new in enumerate(chosen):
        group = [c for c in chosen if c.axis // 3 == new.axis // 3]
        for column, old in enumerate(chosen):
            if old in group:
                same = sum(c.axis == old.axis for c in group)
                matrix[row, column] = new.sign * old.sign * turn[new.axis % 3, old.axis % 3] / same
    return matrix


def missing_axes(node: int, channels: tuple[Channel, ...], axes: tuple[int, ...]) -> tuple[Channel, ...]:
    """What a set lacks of a point along axes (0, 1, 2), where it has other channels of the same kind
    (translations, rotations) there.
    """
    present = {abs(channel.direction) - 1 for channel in channels if channel.node == node}
    wanted = [3 * group + axis for group in sorted({axis // 3 for axis in present}) for axis in axes]
    return tuple(Channel(node, axis + 1) for axis in wanted if axis not in present)
