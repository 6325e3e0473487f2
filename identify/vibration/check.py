"""`identify check`: everything that a fit would load is loaded, and what a fit would swallow is looked at.

The findings on one set of FRFs are in `identify.measured.quality`; those on the study as a whole (robot,
points, postures, files beside each other, the model at its start values) are here.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from identify.core.errors import InputError, InputErrors
from identify.core.parameters import Scale
from identify.core.text import capital, listed
from identify.fitting.fit import check_moves
from identify.measured.finding import Finding, listing
from identify.measured.frf_set import FrfSet
from identify.measured.quality import check
from identify.model.modes import undamped_modes
from identify.robot.description import Robot
from identify.robot.points import Point, read_points
from identify.robot.visual import looks
from identify.vibration.file_geometry import geometry_findings
from identify.vibration.link_ends import left_open
from identify.vibration.nuisances.sentences import kind_of
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem, measurement_names, read_frfs
from identify.vibration.study import MeasurementSettings, StudyFile, read_study
from identify.vibration.uncertainty import fitted_information

T = TypeVar("T")
STUDY = "study"
"""The name under which findings on the study as a whole are listed."""
_BEYOND, _SLACK_M = 2.0, 0.3
"""A point farther from its link than this many times the link's own extent plus a tool's length is
doubtful; one farther than the whole arm is long cannot be right."""
_ENDS = "the ends of links that bend"
_FAR = 2.0
"""A first resonance this many times above the band, or modes that all lie below it by as much, are
doubtful.
"""


@dataclass(frozen=True)
class Checked:
    """The findings by measurement, those on the study itself under `STUDY`; refused: what a fit would
    refuse.
    """

    findings: dict[str, list[Finding]]
    refused: tuple[InputError, ...] = ()

    @property
    def failed(self) -> bool:
        """Whether the data should not be fitted as they are."""
        return any(finding.level == "fail" for found in self.findings.values() for finding in found)


def run_checks(config: Path) -> Checked:
    """Load all that `identify fit` would load of a study and look at it.

    Raises InputError or InputErrors where the config itself cannot be read; other refusals are kept beside
    the findings, so that one run says everything.
    """
    file = read_study(config)
    refused: list[InputError] = []
    points = _kept(lambda: read_points(file.resolve(file.study.points)) if file.study.points else {}, refused)
    names = measurement_names(file.study.measurements)
    settings = dict(zip(names, file.study.measurements, strict=True))
    sets = {
        name: _kept(lambda one=one: read_frfs(file, one), refused)  # type: ignore[misc]
        for name, one in settings.items()
        if one.file is not None
    }
    labels = {node: point.name for node, point in (points or {}).items()}
    known = {name: data for name, data in sets.items() if data is not None}
    findings = {name: _of_set(data, settings[name], labels, file) for name, data in known.items()}
    problem = None if refused else _kept(lambda: _loaded(file, known), refused)
    found = list(_radians(settings))
    if problem is not None:
        found += [
            *_duplicates(problem),
            *_far_points(problem.robot, problem.points),
            *_limits(problem),
            *_resonances(problem),
            *_uncertain(problem),
            *_without_body(problem.robot),
        ]
        for name, finding in geometry_findings(problem):
            findings[name].append(finding)
    return Checked({**findings, STUDY: found}, tuple(map(file.at_its_line, refused)))


def _kept(read: Callable[[], T], refused: list[InputError]) -> T | None:
    """What is read, or None with the refusal kept."""
    try:
        return read()
    except InputErrors as errors:
        refused.extend(errors.errors)
    except InputError as error:
        refused.append(error)
    return None


def _loaded(file: StudyFile, known: Mapping[str, FrfSet]) -> Problem:
    """The problem of a fit, with everything done that a fit does before its first step."""
    problem = load_problem(file, known)
    plan = fit_plan(problem)
    check_moves(plan.parameters, plan.objective)
    return problem


def _of_set(
    data: FrfSet, settings: MeasurementSettings, labels: Mapping[int, str], file: StudyFile
) -> list[Finding]:
    """The findings on one set; that its noise is not known is none where the study states it."""
    stated = settings.noise != "coherence"
    found = check(data, labels, file.study.band_hz)
    return [one for one in found if not (stated and one.check in ("no-coherence", "no-averages"))]


def _radians(settings: Mapping[str, MeasurementSettings]) -> Iterator[Finding]:
    """Angles that are all within a full turn of radians, and not whole numbers."""
    angles = np.concatenate([np.asarray(one.posture_deg, dtype=float) for one in settings.values()])
    moved = angles[angles != 0]
    if len(moved) > 2 and np.abs(angles).max() <= 2 * np.pi and np.any(moved != np.round(moved)):
        sentence = (
            f"No angle of any posture is larger than {np.abs(angles).max():.3g} degrees: are they radians?  "
            "`posture_deg` is in degrees."
        )
        yield Finding("warn", "radians", (), sentence, float(np.abs(angles).max()))


def _duplicates(problem: Problem) -> Iterator[Finding]:
    """The same FRFs, as they are chosen for the fit, under several names."""
    same = defaultdict(list)
    for measurement in problem.measurements:
        data = measurement.given.data
        if isinstance(data, FrfSet):
            same[data.outputs, data.inputs, data.frf.tobytes()].append(measurement.name)
    for names in same.values():
        if len(names) > 1:
            sentence = f"Measurements {listed(names)} hold the same data: is one file named twice?"
            yield Finding("fail", "duplicate-data", (), sentence, len(names))


def _far_points(robot: Robot, points: Mapping[int, Point]) -> Iterator[Finding]:
    """Points that are not on their link, such as those given in mm."""
    extent = _extents(robot)
    reach = sum(extent.values())
    impossible, doubtful = [], []
    for node, point in points.items():
        link, position = point.link, point.position
        if link in robot.frames:
            link, pose = robot.frames[link]
            position = pose[:3, :3] @ position + pose[:3, 3]
        distance = float(np.linalg.norm(position))
        if distance > max(reach, _SLACK_M):
            impossible.append((distance, node))
        elif distance > _BEYOND * extent[link] + _SLACK_M:
            doubtful.append((distance, node))
    if impossible:
        farthest = max(impossible)[0]
        sentence = (
            f"Point {listing([node for _, node in impossible])} lies up to {farthest:.4g} m from its "
            f"link, but the whole robot is only {reach:.3g} m long: are the positions in mm?"
        )
        yield Finding("fail", "far-point", (), sentence, farthest)
    if doubtful:
        farthest = max(doubtful)[0]
        sentence = (
            f"Point {listing([node for _, node in doubtful])} lies up to {farthest:.3g} m from the frame "
            "of its link, far outside of the link: is it the right link, and its frame?"
        )
        yield Finding("warn", "far-point", (), sentence, farthest)


def _extents(robot: Robot) -> dict[str, float]:
    """How far each link reaches from its frame, m: to the next joint, and to the edge of a body of its
    inertia.
    """
    extents = {}
    for number, link in enumerate(robot.links):
        reach = [0.0]
        if link.mass > 0:
            gyration = np.sqrt(max(float(np.trace(link.inertia)), 0.0) / (2 * link.mass))
            reach.append(float(np.linalg.norm(link.centre)) + 2 * gyration)
        if number < len(robot.joints):
            reach.append(float(np.linalg.norm(robot.joints[number].origin[:3, 3])))
        if number:
            reach.append(float(np.linalg.norm(robot.joints[number - 1].mount[:3, 3])))
        extents[link.name] = max(reach)
    return extents


def _limits(problem: Problem) -> Iterator[Finding]:
    """Postures that the robot cannot take up."""
    lower, upper = (np.array([getattr(j, side) for j in problem.robot.joints]) for side in ("lower", "upper"))
    for measurement in problem.measurements:
        posture = measurement.given.posture
        outside = np.flatnonzero((posture < lower - 1e-6) | (posture > upper + 1e-6))
        if len(outside):
            joints = listed([problem.robot.joints[number].name for number in outside])
            sentence = f"{measurement.name}: the posture is outside of the limits of {joints}."
            yield Finding("warn", "joint-limit", (), sentence, len(outside))


def _without_body(robot: Robot) -> Iterator[Finding]:
    """Links whose mesh cannot be drawn."""
    for sentence in looks(robot).missing:
        yield Finding("info", "no-mesh", (), f"{capital(sentence)}.")


def _uncertain(problem: Problem) -> Iterator[Finding]:
    """Which of what is stated as uncertain makes most of the variance of the parameters, at their start
    values.
    """
    entries = problem.nuisances.entries
    if not entries:
        return
    scale = Scale(problem.parameters)
    covariance = np.linalg.inv(fitted_information(problem, problem.initial))
    own = np.flatnonzero(scale.free < problem.size)
    ends = left_open(problem, problem.initial)[scale.free[own], None] ** 2
    parts = covariance[np.ix_(own, np.arange(len(own), len(scale.free)))] ** 2
    share = np.mean(np.hstack([parts, ends]) / (np.diag(covariance)[own, None] + ends), axis=0)
    kinds = [*(kind_of(one) for one in entries), _ENDS]
    total = {kind: float(share[[one == kind for one in kinds]].sum()) for kind in dict.fromkeys(kinds)}
    most = max(total, key=lambda kind: total[kind])
    sentence = (
        f"Of what is stated as uncertain, errors of {most} matter most for the parameters at their start"
        f" values: {total[most]:.0%} of their variance, of all {sum(total.values()):.0%}; the rest is"
        " noise."
    )
    yield Finding("info", "stated-uncertainty", (), sentence, total[most])


def _resonances(problem: Problem) -> Iterator[Finding]:
    """A model whose start values put its modes far outside of the band."""
    band = problem.file.study.band_hz
    if band is None:
        return
    system, values = problem.measurements[0].at(problem.initial)
    mass, _, stiffness = system.matrices(values)
    frequency, _ = undamped_modes(mass, stiffness.real)
    if frequency[0] <= _FAR * band[1] and frequency[-1] >= band[0] / _FAR:
        return
    span = f"{frequency[0]:.3g} to {frequency[-1]:.3g} Hz"
    sentence = (
        f"With its start values the model has its modes at {span}, far outside of the band of {band[0]:g} to "
        f"{band[1]:g} Hz: check start values, inertias and their units."
    )
    yield Finding("warn", "first-resonance", (), sentence, float(frequency[0]))
