"""The geometry in a file of FRFs is compared with the points of the study, and what contradicts is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.measured.geometry import MeasuredGeometry
from identify.measured.uff.geometry import geometry_text
from identify.model.geometry import sensor_geometry, standing
from identify.robot.pose import pose
from identify.vibration.check import run_checks
from identify.vibration.file_geometry import geometry_findings, geometry_notes
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from tests.shared import shared

CONFIG = Path(__file__).parents[2] / "configs/hidden_effects.yaml"


@pytest.fixture(scope="module")
def problem() -> Problem:
    return load_problem(read_study(CONFIG))


def said(problem: Problem, folder: Path, geometry: MeasuredGeometry | None) -> tuple[str, str]:
    """Level and sentence of the first measurement, whose file gets a geometry."""
    first = problem.measurements[0]
    text = "" if geometry is None else geometry_text(geometry)
    source = problem.file.resolve(first.settings.source)
    (folder / "p.uff").write_bytes(text.encode() + source.read_bytes())
    settings = first.settings.model_copy(update={"file": folder / "p.uff"})
    given = type(first.given)(**{**vars(first.given), "settings": settings})
    one = type(first)(**{**vars(first), "given": given})
    changed = type(problem)(**{**vars(problem), "measurements": (one, *problem.measurements[1:])})
    found = dict(geometry_findings(changed))
    if not found:
        return "", ""
    (finding,) = found.values()
    assert geometry_notes(changed) == (
        [f"{one.name}: {finding.sentence.rstrip('.')}"] if finding.level == "warn" else []
    )
    return finding.level, finding.sentence


def moved(geometry: MeasuredGeometry, at: np.ndarray) -> MeasuredGeometry:
    """The same seen from another frame."""
    turn = at[:3, :3]
    return MeasuredGeometry(geometry.nodes, geometry.position_m @ turn.T + at[:3, 3], geometry.axes @ turn.T)


def test_turned_channels_are_said_whatever_the_frame_of_the_file(problem: Problem, tmp_path: Path) -> None:
    site = problem.measurements[0].system.site
    ours = sensor_geometry(site.engine, standing(problem.points, site))
    right = MeasuredGeometry(ours.nodes, ours.position_m, ours.axes)
    quarter = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    axes = right.axes.copy()
    axes[[0, 2]] = quarter @ axes[[0, 2]]
    wrong = MeasuredGeometry(right.nodes, right.position_m, axes)
    nodes = f"nodes {right.nodes[0]}, {right.nodes[2]} turned by up to 90°"
    for frame in (np.eye(4), pose((1, 2, 3), (0.4, -1.2, 2.0))):
        level, sentence = said(problem, tmp_path, moved(right, frame))
        assert level == "info" and "is not used, because the study has points. Both agree." in sentence
        level, sentence = said(problem, tmp_path, moved(wrong, frame))
        assert level == "warn" and nodes in sentence


def test_another_posture_or_no_geometry(problem: Problem, tmp_path: Path) -> None:
    site = problem.measurements[0].system.site
    ours = sensor_geometry(site.engine, standing(problem.points, site))
    other = ours.position_m[::-1] * [1, 1, 2]
    level, sentence = said(problem, tmp_path, MeasuredGeometry(ours.nodes, other, ours.axes))
    assert level == "info" and "were measured at another posture" in sentence
    far = MeasuredGeometry(tuple(range(1001, 1001 + len(other))), other, ours.axes)
    assert said(problem, tmp_path, far)[0] == "info"
    assert said(problem, tmp_path, None) == ("", "")


@pytest.mark.parametrize(("study", "level"), [("study_points", "warn"), ("study_points_right", "info")])
def test_the_reported_cubes_are_named(study: str, level: str) -> None:
    path = shared("reported", "robots", "geometry_in_data", f"{study}.yaml")
    (found,) = (one for one in run_checks(path).findings["p1"] if one.check == "file-geometry")
    assert found.level == level
    assert ("nodes 1, 2, 3 turned by up to 90°" in found.sentence) == (level == "warn")
    assert len(geometry_notes(load_problem(read_study(path)))) == (level == "warn")
