"""What a fit found of nuisance parameters, as corrections: of links, places of joints, points and their
sensors, and joint angles; and what it left uncertain of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.collect import collect
from identify.core.errors import InputError
from identify.core.thresholds import SIGMAS_95
from identify.model.nuisances.inertia import CHANGES
from identify.results.fit import FitResult, StatedUncertainty
from identify.robot.description import Link, Robot
from identify.robot.points import Point, new_points_text, points_text
from identify.robot.pseudo_inertia import body_of, consistent, pseudo_inertia
from identify.robot.read import read_robot
from identify.robot.rewrite import with_bodies
from identify.vibration.fitted_errors import corrected
from identify.vibration.nuisances.nuisance import FORCE, posture_name
from identify.vibration.study import StudyFile
from identify.vibration.study_points import points_of

_ZERO = 1e-6
"""Errors, in units of what was stated, that are none: of what the data say nothing about."""
_DEGREES = 180 / np.pi
COLUMNS = ("error_of", "where", "what", "unit", "stated_std", "correction", "low_95", "high_95", "std_left")
_KEYS = {
    "masses": ("links", "mass", 1.0),
    "centres of mass": ("links", "centre_m", 1.0),
    "inertias": ("links", "inertia", 1.0),
    "places of points": ("points", "position_m", 1.0),
    "directions of sensors": ("points", "direction_deg", _DEGREES),
    "sensitivities": ("channels", "gain", 1.0),
}
"""Where `uncertainty:` states what a kind of errors is; factor from SI units."""
Left = dict[str, dict[str | int, dict[str, float]]]


@dataclass(frozen=True)
class Corrections:
    """The robot and points of a study as stated, and what a fit found of them."""

    file: StudyFile
    stated: StatedUncertainty
    nominal: Robot
    robot: Robot
    points: Mapping[int, Point]

    @classmethod
    def of(cls, file: StudyFile, result: FitResult) -> Corrections:
        """Of the result of a fit with stated uncertainty."""
        stated, study = result.uncertainty, file.study
        assert stated is not None
        nominal = read_robot(study.robot, file.path.parent)
        return cls(
            file, stated, nominal, corrected(nominal, stated, result.name)[0], points_of(file, nominal)
        )

    def rows(self) -> Iterator[tuple[str, ...]]:
        """The cells of each error, by `COLUMNS`: of masses, moments and sensitivities relative ones, with the
        intervals of their logarithms.
        """
        stated = self.stated
        for n, change in enumerate(stated.change):
            std, unit = float(stated.stated[n]), stated.unit[n]
            factor, unit = (_DEGREES, "deg") if unit == "rad" else (1.0, unit)
            shift = stated.shift[n] if abs(stated.shift[n]) > _ZERO else 0.0
            middle, half = std * shift, SIGMAS_95 * std * stated.spread[n]
            ends = np.array([middle, middle - half, middle + half])
            relative = change in ("mass", "gain") or change.startswith("inertia_")
            ends = np.expm1(ends) if relative else factor * ends
            numbers = (factor * std, *ends, factor * std * stated.spread[n])
            yield stated.kind[n], stated.place[n], change, unit, *(f"{x:.6g}" for x in numbers)

    @cached_property
    def bodies(self) -> Mapping[str, tuple[Link, bool]]:
        """Links that were found to be otherwise, without payloads, by name; whether their inertia had to be
        changed to one that a body can have.
        """
        settings = self.file.study.robot.model_copy(update={"payload": []})
        own = read_robot(settings, self.file.path.parent)
        rows = zip(self.stated.place, self.stated.change, self.stated.shift, strict=True)
        moved = {place for place, change, shift in rows if change in CHANGES and abs(shift) > _ZERO}
        names = [one.name for one in own.links if one.name in moved]
        robots = self.robot, self.nominal, own
        found = collect([partial(_body, *(robot.link(name) for robot in robots)) for name in names])
        return dict(zip(names, found, strict=True))

    def robot_text(self, folder: Path) -> str:
        """The robot's file with what was found, for a folder."""
        shifts = {
            new.name: new.origin[:3, 3] - old.origin[:3, 3]
            for new, old in zip(self.robot.joints, self.nominal.joints, strict=True)
            if np.any(new.origin != old.origin)
        }
        bodies = [body for body, _ in self.bodies.values()]
        settings, here = self.file.study.robot, self.file.path.parent
        return with_bodies(settings, here, self.nominal, bodies, shifts, folder)

    def points_text(self) -> str:
        """The file of points with those that were found elsewhere or turned; those of
        a geometry as a new file.
        """
        path, found = self.file.study.points, {}
        for node, point in self.points.items():
            shift, turn = self._vector(str(node), ""), self._vector(str(node), "r")
            if np.any(shift) or np.any(turn):
                back = scipy.spatial.transform.Rotation.from_rotvec(-turn).as_matrix()
                found[node] = replace(point, position=point.position + shift, axes=back @ point.axes)
        if path is None or self.file.study.points_frame == "base":
            return new_points_text({**self.points, **found})
        return points_text(self.file.resolve(path), found)

    def posture(self, told_deg: list[float]) -> list[float]:
        """Joint angles, degrees, as found."""
        counted = self.file.study.joint_angles
        name = posture_name(counted.posture(told_deg))
        errors = np.array([self._errors.get((name, f"joint{n}"), 0.0) for n in range(1, len(told_deg) + 1)])
        if not errors.any():
            return told_deg
        return [round(float(a), 6) for a in np.array(told_deg) + counted.stated(errors)]

    def left(self) -> Left:
        """Standard deviations that are left of links, points and channels, as `uncertainty:` states them; of
        several that one number states, their RMS.
        """
        found: dict[tuple[str, str | int, str], list[float]] = {}
        for n, (kind, place) in enumerate(zip(self.stated.kind, self.stated.place, strict=True)):
            if kind in _KEYS and place != FORCE:
                group, key, factor = _KEYS[kind]
                twice = 2.0 if self.stated.change[n].startswith("product") else 1.0
                std = twice * factor * self.stated.stated[n] * self.stated.spread[n]
                found.setdefault((group, int(place) if group == "points" else place, key), []).append(std)
        left: Left = {}
        for (group, name, key), stds in found.items():
            value = float(f"{np.sqrt(np.mean(np.square(stds))):.4g}")
            left.setdefault(group, {}).setdefault(name, {})[key] = value
        return left

    @cached_property
    def _errors(self) -> Mapping[tuple[str, str], float]:
        """In SI units, by place and change."""
        s = self.stated
        return {(s.place[n], s.change[n]): float(s.stated[n] * s.shift[n]) for n in range(len(s.shift))}

    def _vector(self, place: str, changes: str) -> Array:
        return np.array([self._errors.get((place, f"{changes}{axis}"), 0.0) for axis in "xyz"])


def _body(found: Link, nominal: Link, own: Link) -> tuple[Link, bool]:
    """What was found of a link without its payload; own: the same link as stated, without it.

    Where the largest moment exceeds the sum of the others, the nearest body that can be, and True.
    """
    matrix = pseudo_inertia(found) - pseudo_inertia(nominal) + pseudo_inertia(own)
    body = body_of(matrix, own.name)
    if body.mass <= 0 or np.linalg.eigvalsh(body.inertia)[0] <= 0:
        raise InputError(
            f"robot.payload on {own.name}",
            "its payload is heavier than what the fit found of both together",
            "a payload as it was tested",
            "correct the payload, or state the link's own mass as uncertain",
        )
    possible, changed = consistent(body)
    return body_of(possible, own.name), changed
