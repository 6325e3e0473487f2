"""`identify check`: everything that a fit would load is loaded, and what a fit would swallow is looked at.

The findings on one set of FRFs are in `identify.measured.quality`; those on the study as a whole (robot,
points, postures, files beside each other, the model at its start values) are here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.coded import code_of
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.core.text import capital, listed
from identify.fitting.fit import check_moves
from identify.measured.finding import STUDY, Checked, Finding, kept, worst_first
from identify.measured.frf_set import FrfSet
from identify.measured.hits import hit_findings
from identify.measured.quality import check
from identify.measured.quality_robot import check_robot
from identify.measured.silent import LEFT_OUT
from identify.measured.source import read_history
from identify.model.modes import complex_modes
from identify.robot.description import Robot
from identify.robot.plausible import masses
from identify.robot.points import Point, read_points
from identify.robot.visual import looks
from identify.vibration.far_places import far_findings
from identify.vibration.file_geometry import geometry_findings
from identify.vibration.given import measurement_names, read_frfs
from identify.vibration.intervals import intervals, left_open
from identify.vibration.nuisances.stated import kind_of
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.rigid_links import rigid_link_findings
from identify.vibration.study import MeasurementSettings, StudyFile, read_study
from identify.vibration.uncertainty import fitted_information

_OF_NOISE = ("no-coherence", "no-averages", "rounded-coherence")
_ENDS = "the ends of links that bend"
_FAR = 2.0
"""A first resonance this many times above the band, or modes that all lie below it by as much, are
doubtful.
"""


def run_checks(config: Path) -> Checked:
    """Load all that `identify fit` would load of a study and look at it.

    Raises InputError or InputErrors where the config itself cannot be read; other refusals are kept beside
    the findings, so that one run says everything.
    """
    return checks_of(read_study(config))


def checks_of(file: StudyFile) -> Checked:
    """The same of a study that was read."""
    return examined(file)[0]


def examined(file: StudyFile) -> tuple[Checked, Problem | None, dict[str, FrfSet]]:
    """The same, with the problem of a fit, where nothing is refused, and FRFs by names of measurements."""
    refused: list[InputError] = []
    path = file.study.points
    points = None if path is None else kept(lambda: read_points(file.resolve(path)), refused)
    names = measurement_names(file.study.measurements)
    settings = dict(zip(names, file.study.measurements, strict=True))
    sets = {
        name: kept(lambda one=one: read_frfs(file, one), refused)  # type: ignore[misc]
        for name, one in settings.items()
        if one.file is not None
    }
    labels = None if points is None else {node: point.name for node, point in points.items()}
    known = {name: data for name, data in sets.items() if data is not None}
    findings = {
        name: [*_of_set(data, settings[name], labels, file), *_of_hits(settings[name], file)]
        for name, data in known.items()
    }
    problem = None if refused else kept(lambda: _loaded(file, known), refused)
    found = list(_radians(settings))
    if problem is not None:
        found += [
            *_left_out(problem, known),
            *check_robot(problem.robot),
            *far_findings(problem),
            *_one_place(problem.points),
            *_limits(problem),
            *_resonances(problem),
            *_uncertain(problem),
            *_without_body(problem.robot),
            *_masses(problem),
        ]
        for name, finding in (*rigid_link_findings(problem), *geometry_findings(problem)):
            (found if name == STUDY else findings[name]).append(finding)
    ordered = {name: worst_first(some) for name, some in {**findings, STUDY: found}.items()}
    return Checked(ordered, tuple(map(file.at_its_line, refused))), problem, known


def _loaded(file: StudyFile, known: Mapping[str, FrfSet]) -> Problem:
    """The problem of a fit, with everything done that a fit does before its first step."""
    problem = load_problem(file, known)
    plan = fit_plan(problem)
    check_moves(plan.parameters, plan.objective)
    return problem


def _of_set(
    data: FrfSet, settings: MeasurementSettings, labels: Mapping[int, str] | None, file: StudyFile
) -> list[Finding]:
    """The findings on one set, but for what the study says elsewhere: its noise, or (labels is None) that its
    points cannot be read.
    """
    silent = _OF_NOISE if settings.noise != "coherence" else ()
    silent = (*silent, *(("unknown-point",) if labels is None else ()))
    found = check(data, labels or {}, file.study.band_hz)
    return [one for one in found if one.check not in silent]


def _of_hits(settings: MeasurementSettings, file: StudyFile) -> Iterator[Finding]:
    """The findings on the time records of impacts, where the FRFs are estimated from them."""
    if settings.estimate is not None and settings.estimate.excitation == "impacts":
        for path in (settings.source, *settings.repeats):
            yield from hit_findings(read_history(file.resolve(path), settings, settings.estimate))


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


def _left_out(problem: Problem, known: Mapping[str, FrfSet]) -> Iterator[Finding]:
    """What a fit would say that it left out, beyond what is said of the files already."""
    for measurement in problem.measurements:
        data, name = measurement.given.data, measurement.name
        for note in data.notes if isinstance(data, FrfSet) else ():
            if code_of(note) == LEFT_OUT and note not in known[name].notes:
                yield Finding("warn", "left-out", (), f"{name}: {note}.")


def _one_place(points: Mapping[int, Point]) -> Iterator[Finding]:
    """Points at one place of one link, whose sensors look the same way: a line that was copied."""
    for (first, one), (second, other) in combinations(points.items(), 2):
        same = one.link == other.link and np.allclose(one.position, other.position, rtol=0, atol=1e-9)
        if same and np.allclose(one.axes, other.axes):
            sentence = f"Points {first} and {second} are at the same place: was a line copied?"
            yield Finding("warn", "one-place", (), sentence)


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


def _masses(problem: Problem) -> Iterator[Finding]:
    """What is wrong with the masses of the description, and what was assumed when it was read."""
    robot = problem.robot
    found = masses(robot, problem.file.study.robot.mass_kg)
    for doubt in found.doubts:
        yield Finding("warn", "robot-bodies", (), f"{capital(doubt)}.")
    for note in robot.notes:
        yield Finding("info", "robot-read", (), f"{capital(note)}.")


def _uncertain(problem: Problem) -> Iterator[Finding]:
    """Which of what is stated as uncertain makes most of the variance of the parameters, at their start
    values.
    """
    entries = problem.nuisances.entries
    if not entries:
        return
    free = Scale(problem.of_effects).free
    ends = left_open(problem, problem.initial)[free, None] ** 2
    parts, variance = _variances(problem, len(free))
    share = np.mean(np.hstack([parts, ends]) / (variance[:, None] + ends), axis=0)
    kinds = [*(kind_of(one) for one in entries), _ENDS]
    total = {kind: float(share[[one == kind for one in kinds]].sum()) for kind in dict.fromkeys(kinds)}
    most = max(total, key=lambda kind: total[kind])
    sentence = (
        f"Of the stated uncertainty, errors of {most} matter most: at the start values they cause"
        f" {total[most]:.0%} of the parameters' variance, and all stated errors {sum(total.values()):.0%};"
        " the rest is noise."
    )
    yield Finding("info", "stated-uncertainty", (), sentence, total[most])


def _variances(problem: Problem, count: int) -> tuple[Array, Array]:
    """(f, e) and (f,): what each error makes of the variance of each of the free parameters, of which there
    are count, and all of it.
    """
    if not problem.file.study.cost.likelihood:
        found = intervals(problem, problem.initial)
        assert found.joint is not None
        return found.joint.stated**2, found.std**2
    covariance = np.asarray(np.linalg.inv(fitted_information(problem, problem.initial)), dtype=np.float64)
    return covariance[:count, count:] ** 2, np.diag(covariance)[:count]


def _resonances(problem: Problem) -> Iterator[Finding]:
    """A model whose start values put its modes far outside of the band."""
    band = problem.file.study.band_hz
    if band is None:
        return
    system, values = problem.measurements[0].at(problem.initial)
    # A servo's coordinate has a negative inertia, so the mass matrix need not be positive definite.
    frequency = complex_modes(*system.matrices(values)).frequency_hz
    if not frequency.size or (frequency[0] <= _FAR * band[1] and frequency[-1] >= band[0] / _FAR):
        return
    span = f"{frequency[0]:.3g} to {frequency[-1]:.3g} Hz"
    sentence = (
        f"With its start values the model has its modes at {span}, far outside of the band of {band[0]:g} to "
        f"{band[1]:g} Hz: check start values, inertias and their units."
    )
    yield Finding("warn", "first-resonance", (), sentence, float(frequency[0]))
