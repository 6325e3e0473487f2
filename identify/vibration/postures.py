"""The robot at every measured posture, built once however many measurements were made there, and with other
effects on the engines that are there already.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from identify.core.arrays import Array
from identify.model.effects.base import Effect
from identify.model.effects.site import Site
from identify.model.system import System, assemble, build_site
from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.joint_angles import AS_THE_ROBOT, JointAngles
from identify.robot.points import Point

Stand = tuple[bytes, str | None]
"""A posture, and the first link that was taken off."""
Standing = tuple[Stand, frozenset[int]]
"""That, and the joints whose motors are driven."""


@dataclass(frozen=True)
class Built:
    """What is there already: engines; where the effects change no site, sites and the first of them; where
    they are the same, systems of a robot that stands still.
    """

    engines: Mapping[Stand, Engine] = field(default_factory=dict)
    sites: Mapping[Stand, Site] = field(default_factory=dict)
    first: Site | None = None
    systems: Mapping[Standing, System] = field(default_factory=dict)


class Postures:
    """Systems of a robot with some effects; first: the site of the whole robot at the first posture; angles:
    how stated ones count; since: number of the first effect whose terms they have.
    """

    def __init__(
        self,
        robot: Robot,
        points: Mapping[int, Point],
        effects: Sequence[Effect],
        first: Array,
        built: Built,
        angles: JointAngles = AS_THE_ROBOT,
        since: int = 0,
    ) -> None:
        self.angles, self._since = angles, since
        self._robot, self._points, self._effects = robot, points, effects
        self._engines, self._sites = dict(built.engines), dict(built.sites)
        self._systems = {(*key, b""): system for key, system in built.systems.items()}
        self.first = built.first or self._site(first, None, None)

    def system(
        self, posture: Array, detached: str | None, rates: Array | None, driven: frozenset[int] = frozenset()
    ) -> System:
        """At a posture (joints,), rad, with links from `detached` on taken off, moving at rates (joints,),
        rad/s, with the torques of the motors of some joints, from 1, as inputs.
        """
        key = stand(posture, detached), driven, b"" if rates is None else rates.tobytes()
        if key not in self._systems:
            site = self._site(posture, detached, self.first)
            self._systems[key] = assemble(self._robot, site, self._effects, rates, driven, self._since)
        return self._systems[key]

    def _site(self, posture: Array, detached: str | None, first: Site | None) -> Site:
        key = stand(posture, detached)
        if key not in self._sites:
            engine = self._engines.get(key)
            site = build_site(self._robot, posture, self._effects, detached, self._points, first, engine)
            self._sites[key], self._engines[key] = site, site.engine
        return self._sites[key]


def stand(posture: Array, detached: str | None) -> Stand:
    """By what a site is known."""
    return np.asarray(posture, dtype=float).tobytes(), detached
