"""The geometry that a universal file of FRFs brings along, beside the points of the study or in their place.

The study's points, where it has some, are what is used; what the file says of the same nodes may show that
they are wrong, above all which way the channels of a sensor look.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from identify.core.arrays import Array
from identify.core.closest_turn import closest_turn
from identify.core.errors import InputError
from identify.measured.finding import STUDY, Finding, listing
from identify.measured.geometry import MeasuredGeometry
from identify.measured.registration.place import Placing, summary
from identify.measured.uff.geometry import has_geometry, read_geometry
from identify.model.geometry import sensor_geometry, standing
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Measurement, Problem
from identify.vibration.study_points import geometry_source, placing_of

_TURNED = np.radians(5.0)
"""More than a sensor is turned by when it is put on by hand."""
_ELSEWHERE = 0.1
"""Distance over the size of the set of points, beyond which these are others, or at another posture."""


def geometry_findings(problem: Problem) -> Iterator[tuple[str, Finding]]:
    """By the name of the measurement: that its file has a geometry, which is not used, and whether the
    points of the study agree with it; of a study without points, how the geometry lies on the robot.
    """
    placing = placing_of(problem.file, problem.robot)
    if placing is not None:
        yield from ((STUDY, one) for one in _laid(problem, placing))
        return
    for measurement in problem.measurements:
        if isinstance(measurement.target, FrfTarget):
            finding = _finding(problem, measurement)
            if finding is not None:
                yield measurement.name, finding


def geometry_notes(problem: Problem) -> list[str]:
    """What of these findings a fit must say."""
    return [
        one.sentence.rstrip(".") if name == STUDY else f"{name}: {one.sentence.rstrip('.')}"
        for name, one in geometry_findings(problem)
        if one.level == "warn"
    ]


def _laid(problem: Problem, placing: Placing) -> Iterator[Finding]:
    """What is to be known, and looked at, of points that come from the geometry."""
    source = geometry_source(problem.file)
    assert source is not None
    axes = dict[int, set[int]]()
    for one in problem.measurements:
        for channel in (*one.given.outputs, *one.given.inputs):
            axes.setdefault(channel.node, set()).add(abs(channel.direction))
    found = replace(placing, axes=axes)
    said = f"Points are those of the geometry of {source.path.name}: {summary(found)}."
    yield Finding("info", "registration", (), said)
    for note in found.notes:
        yield Finding("warn", "registration", (), f"Of the geometry: {note}.")
    if found.doubts:
        each = "; ".join(f"{node} {text}" for node, text in found.doubts.items())
        yield Finding("warn", "registration", (), f"Nodes that may be elsewhere: {each}.")


def _finding(problem: Problem, measurement: Measurement) -> Finding | None:
    path = problem.file.resolve(measurement.settings.source)
    if not has_geometry(path, measurement.settings.format):
        return None
    said = "The geometry in the file (datasets 15 or 2411) is not used, because the study has points."
    try:
        theirs = read_geometry(path)
    except InputError as error:
        return Finding("info", "file-geometry", (), f"{said} The two cannot be compared: {error}")
    site = measurement.system.site
    ours = sensor_geometry(site.engine, standing(problem.points, site))
    return _compared(ours, theirs, said)


def _compared(ours: MeasuredGeometry, theirs: MeasuredGeometry, said: str) -> Finding:
    """Our geometry beside that of the file, whose frame is laid on ours by the places of the nodes."""
    nodes = [node for node in ours.nodes if node in theirs.nodes]
    (place, axes), (other, others) = (
        (g.position_m[rows], g.axes[rows])
        for g in (ours, theirs)
        for rows in ([g.nodes.index(node) for node in nodes],)
    )
    size = float(np.linalg.norm(place - place.mean(axis=0))) if nodes else 0.0
    turn, left = _laid_on(place, other) if len(nodes) > 2 else (np.eye(3), np.inf)
    if not size or left > _ELSEWHERE * size:
        return Finding(
            "info",
            "file-geometry",
            (),
            f"{said} Its nodes are different ones, or were measured at another posture.",
        )
    cosine = (np.einsum("nij,nij->n", axes, others @ turn) - 1) / 2
    angle = np.arccos(np.clip(cosine, -1, 1))
    if np.max(angle) <= _TURNED:
        return Finding("info", "file-geometry", (), f"{said} Both agree.", float(np.max(angle)))
    wrong = [node for node, one in zip(nodes, angle, strict=True) if one > _TURNED]
    sentence = (
        "The geometry in the file contradicts the points of the study, which are used: it has the channels of"
        f" nodes {listing(wrong)} turned by up to {np.degrees(np.max(angle)):.0f}°. If the file is right,"
        " write rx_deg, ry_deg and rz_deg into the points."
    )
    return Finding("warn", "file-geometry", (), sentence, float(np.degrees(np.max(angle))))


def _laid_on(place: Array, other: Array) -> tuple[Array, float]:
    """The rotation (3, 3) of rows that lays places (n, 3) of the file on ours, and how far apart they stay.

    Where points on a line leave a turn about it open, no turn at all is taken if it does as well.
    """
    own, from_file = place - place.mean(axis=0), other - other.mean(axis=0)
    found = closest_turn(from_file, own).T
    left = [float(np.linalg.norm(from_file @ turn - own)) for turn in (np.eye(3), found)]
    as_it_stands = left[0] <= left[1] + 1e-3 * float(np.linalg.norm(own))
    return (np.eye(3), left[0]) if as_it_stands else (found, left[1])
