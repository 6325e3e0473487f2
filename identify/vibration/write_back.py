"""What a fit found of nuisance parameters, written back: the robot, the points and a study that uses them
(`identify fit --write-back FOLDER`).

Masses, centres and inertias of links, places of joints, points and their sensors, and joint angles get the
values that were found, so that the same data give the same model with errors near zero.  Sensitivities,
directions of impacts and delays have no place in a robot or its points: the table of corrections has them.
A second file says what the fit left uncertain of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import scipy

from identify.core import atomic
from identify.core.arrays import Array
from identify.core.collect import collect
from identify.core.errors import InputError
from identify.core.text import listed
from identify.core.text_input import csv_text
from identify.core.thresholds import SIGMAS_95
from identify.core.yaml_input import in_one_line, yaml_text
from identify.fitting.uncertainty import BOUNDS
from identify.model.nuisances.inertia import CHANGES
from identify.results.fit import FitResult, StatedUncertainty
from identify.robot.description import Link, Robot
from identify.robot.points import Point, new_points_text, points_text
from identify.robot.pseudo_inertia import body_of, consistent, pseudo_inertia
from identify.robot.read import read_robot
from identify.robot.rewrite import with_bodies
from identify.vibration.fitted_errors import corrected
from identify.vibration.new_study import new_study
from identify.vibration.nuisances.nuisance import FORCE, posture_name
from identify.vibration.study import StudyFile
from identify.vibration.study_points import geometry_source, points_of

CORRECTIONS, LEFT = "corrections.csv", "uncertainty_left.yaml"
_FIX = "choose another folder with `--write-back`"
_NOTE = f"""\
Robot, points and postures are those that a fit found: see {CORRECTIONS}.
The stated uncertainty is as before, because these are the data of that fit. For other tests of this robot,
use the remaining uncertainty in {LEFT}."""
_CHANGED = (
    "the fitted inertia of {} is physically impossible; the robot has the nearest possible one, so a fit"
    " finds part of these errors again"
)
_LEFT_NOTE = """\
# What remains uncertain after a fit, one standard deviation each: for other tests of this robot
# with {} and {}. With the data of that fit, it would count twice.
"""
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
class WriteBack:
    """Where the files of a study go; InputError, before a fit, where there is nothing to write, or a file
    would take the place of an input.
    """

    file: StudyFile
    folder: Path

    def __post_init__(self) -> None:
        study = self.file.study
        if study.uncertainty is None:
            found, expected = "nothing is stated uncertain", "`uncertainty:` in the study"
            raise InputError("--write-back", found, expected, "add `uncertainty: typical`")
        if not study.cost.likelihood:
            found, expected = f"`cost: {study.cost.kind}`, which fits no errors", "the cost frf-least-squares"
            raise InputError("--write-back", found, expected, "leave `cost` out, or `--write-back`")
        read = {self.file.path, self.file.resolve(self._described)}
        read |= {self.file.resolve(path) for path in (study.points,) if path is not None}
        inputs = {path.resolve() for path in read}
        for path in self.paths:
            if path.resolve() in inputs:
                raise InputError(str(path), "an input, which would be overwritten", "a new file", _FIX)
            atomic.check_writable(path, _FIX)

    @property
    def _described(self) -> Path:
        return self.file.study.robot.urdf or self.file.study.robot.dh or Path()

    @property
    def robot(self) -> Path:
        """The robot's description; what was a xacro has no macros any more."""
        name = self._described.name
        expanded = f"{name.removesuffix('.xacro').removesuffix('.urdf')}.urdf"
        return self.folder / (expanded if name.endswith(".xacro") else name)

    @property
    def points(self) -> Path | None:
        """The points; None for a study without any."""
        path = self.file.study.points
        if path is None and geometry_source(self.file) is None:
            return None
        return self.folder / ("points.csv" if path is None else path.name)

    @property
    def study(self) -> Path:
        """The study that uses them."""
        return self.folder / self.file.path.name

    @property
    def paths(self) -> list[Path]:
        """All files, the study first."""
        points = [] if self.points is None else [self.points]
        return [self.study, self.robot, *points, self.folder / CORRECTIONS, self.folder / LEFT]

    def write(self, result: FitResult) -> list[Path]:
        """Write what a fit of the study found; the paths."""
        found = Corrections.of(self.file, result)
        texts = {
            self.study: self._study_text(found, result),
            self.robot: found.robot_text(self.folder),
            self.points: found.points_text(),
            self.folder / CORRECTIONS: self._table(found),
            self.folder / LEFT: self._left(found),
        }
        for path in self.paths:
            atomic.write_text(path, texts[path], _FIX)
        return self.paths

    def _study_text(self, found: Corrections, result: FitResult) -> str:
        data = new_study(self.file, self.folder, "corrected", _inside(result))
        data["robot"]["dh" if self.file.study.robot.urdf is None else "urdf"] = self.robot.name
        data["robot"].pop("arguments", None)  # the file has no macros any more
        if self.points is not None:
            data["points"] = self.points.name
            for key in ("points_frame", "points_posture_deg", "registration"):
                data.pop(key, None)
        for one in data["measurements"]:
            one["posture_deg"][:] = found.posture(list(one["posture_deg"]))
        changed = [name for name, (_, changed) in found.bodies.items() if changed]
        said = f"{_NOTE}\n{_CHANGED.format(listed(changed))}" if changed else _NOTE
        data.yaml_set_comment_before_after_key("robot", before=said)
        return yaml_text(data)

    def _table(self, found: Corrections) -> str:
        home = self._homes()
        rows = ([*row, home.get(row[0], "")] for row in found.rows())
        return csv_text([[*COLUMNS, "written_to"], *rows])

    def _homes(self) -> dict[str, str]:
        """The file that errors of a kind are corrected in, of those that have one."""
        homes = dict.fromkeys(("masses", "centres of mass", "inertias"), self.robot.name)
        if self.file.study.robot.urdf is not None:
            homes["places of joints"] = self.robot.name
        if self.points is not None:
            homes |= dict.fromkeys(("places of points", "directions of sensors"), self.points.name)
        return {**homes, "joint angles": self.study.name}

    def _left(self, found: Corrections) -> str:
        settings = self.file.study.uncertainty
        assert settings is not None
        data = settings.model_dump(exclude_defaults=True)
        for group, entries in found.left().items():
            part = data.get(group, {})
            old = {**part.get("each", {})}
            each = {name: in_one_line({**old.get(name, {}), **own}) for name, own in entries.items()}
            data[group] = {**part, "each": {**old, **each}}
        points = self.points or Path("no points")
        return _LEFT_NOTE.format(self.robot.name, points.name) + yaml_text({"uncertainty": data})


def _inside(result: FitResult) -> dict[str, float]:
    """Fitted values of the parameters, except at bounds, which may lie elsewhere with another inertia."""
    p = result.parameters
    return {
        name: float(p.value[n]) for n, name in enumerate(p.name) if p.free[n] and p.status[n] not in BOUNDS
    }


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
