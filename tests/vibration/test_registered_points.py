"""A study without points lays the geometry of its file of FRFs on the robot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.core.yaml_input import yaml_text
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.robot.points import read_points
from identify.setup.apply import write_corrected
from identify.setup.edits import OnLink
from identify.vibration.check import run_checks
from identify.vibration.file_geometry import geometry_notes
from identify.vibration.new_study import new_study
from identify.vibration.problem import Problem, load_problem
from identify.vibration.provenance import description_of, study_inputs
from identify.vibration.study import read_study
from tests.measured.registration.arm import COUNT, Test, simulated, widest
from tests.setup.studies import DATA


def _test(folder: Path, seed: int = 7) -> Test:
    """Its file has FRFs, too, of another robot: only where they are is looked at here."""
    test = simulated(folder, seed, off_deg=1.0)
    both = folder / "both.uff"
    both.write_bytes(test.uff.read_bytes() + (DATA / "posture1.uff").read_bytes())
    return replace(test, uff=both)


def _study(test: Test, folder: Path, **keys: Any) -> Path:
    one = {"file": test.uff.name, "posture_deg": [round(a, 3) for a in test.stated.tolist()], "averages": 4}
    told = {"schema": "identify/1", "robot": {"urdf": test.arm.file.name}, "measurements": [one], **keys}
    (folder / "study.yaml").write_text(yaml_text(told))
    return folder / "study.yaml"


@pytest.fixture(scope="module")
def paired(tmp_path_factory: pytest.TempPathFactory) -> tuple[Test, Path, Problem]:
    """A test, its study with three pairs, and that as it is read."""
    folder = tmp_path_factory.mktemp("paired")
    test = _test(folder)
    study = _study(test, folder, registration=_paired(test, folder))
    return test, study, load_problem(read_study(study))


def _paired(test: Test, folder: Path) -> dict[str, str]:
    """Three rough pairs: the search without them takes four times as long."""
    return {"pairs": test.pairs(folder, widest(test.nodes)).name}


def _right(problem: Problem, test: Test) -> float:
    links = [problem.points[n + 1].link if n + 1 in problem.points else "" for n in range(COUNT)]
    return float(np.mean([link == test.arm.names[k] for link, k in zip(links, test.nodes.link, strict=True)]))


def test_pairs_and_a_geometry_of_its_own_are_found_beside_the_study(tmp_path: Path) -> None:
    test = _test(tmp_path)
    lines = ["node;x_mm;y_mm;z_mm"]
    cloud = 1000 * test.nodes.base @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    lines += [f"{n};{x:.2f};{y:.2f};{z:.2f}" for n, (x, y, z) in enumerate(cloud, start=1)]
    (tmp_path / "nodes.csv").write_text("\n".join(lines) + "\n")
    told = {**_paired(test, tmp_path), "geometry": "nodes.csv"}
    file = read_study(_study(test, tmp_path, registration=told))
    problem = load_problem(file)
    assert _right(problem, test) >= 0.95
    away = [
        np.linalg.norm(problem.points[n + 1].position - place)
        for n, place in enumerate(test.nodes.local)
        if n + 1 in problem.points and problem.points[n + 1].link == test.arm.names[test.nodes.link[n]]
    ]
    assert np.median(away) < 0.005
    assert {"pairs.csv", "nodes.csv"} <= {name for name, _ in study_inputs(file)}
    moved = new_study(file, tmp_path / "deeper", "found", {})
    assert moved["registration"]["geometry"] == "../nodes.csv"
    assert description_of(file, problem.points).points.count("\n") == len(problem.points) + 1


def test_every_key_changes_where_nodes_are(paired: tuple[Test, Path, Problem], tmp_path: Path) -> None:
    test = _test(tmp_path)
    told = _paired(test, tmp_path)
    changes: list[dict[str, Any]] = [
        {"pair_error_m": 0.002},
        {"angle_error_deg": 0.01},
        {"posture_deg": [0.0] * 6},
    ]
    found = [load_problem(read_study(_study(test, tmp_path, registration=told | one))) for one in changes]
    places = [[(p.link, *p.position) for p in one.points.values()] for one in (paired[2], *found)]
    assert all(other != places[0] for other in places[1:])
    with pytest.raises(InputError, match="'mm' although the file says 1 m"):
        load_problem(read_study(_study(test, tmp_path, registration={"length_unit": "mm"})))


def _with_a_node_elsewhere(test: Test) -> int:
    """A node of the FRFs is two metres beside the robot."""
    node = 5
    lines = test.uff.read_bytes().split(b"\n")
    row = lines.index(b"    15") + node
    words = lines[row][40:].decode()
    far = float(words[:13]) + 2.0
    lines[row] = lines[row][:40] + f"{far:13.5E}".encode() + words[13:].encode()
    test.uff.write_bytes(b"\n".join(lines))
    return node


def test_channels_of_a_node_on_no_link_are_left_out_and_said(tmp_path: Path) -> None:
    test = _test(tmp_path)
    node = _with_a_node_elsewhere(test)
    problem = load_problem(read_study(_study(test, tmp_path, registration=_paired(test, tmp_path))))
    data = problem.measurements[0].given.data
    assert isinstance(data, FrfSet)
    assert node not in problem.points
    assert Channel(node, 1) not in data.outputs and Channel(node + 1, 1) in data.outputs
    assert any("lies on no link of the robot" in note for note in data.notes)
    assert any(f"{node} on no link" in note for note in geometry_notes(problem))


def test_check_says_where_the_points_come_from(tmp_path: Path) -> None:
    test = _test(tmp_path)
    found = run_checks(_study(test, tmp_path, registration=_paired(test, tmp_path)))
    said = [one.sentence for one in found.findings["study"] if one.check == "registration"]
    assert said[-1].startswith(f"Points are those of the geometry of both.uff: {COUNT} nodes of {COUNT}")


def test_a_point_on_another_link_gets_a_file_of_points(paired: tuple[Test, Path, Problem]) -> None:
    test, path, problem = paired
    file, here = read_study(path), problem.points[3]
    other = next(name for name in test.arm.names if name != here.link)
    study, _ = write_corrected(file, [OnLink(3, other, replace(here, link=other))], [])
    corrected = read_study(study)
    assert corrected.study.registration is None
    points = read_points(path.with_name("points_corrected.csv"))
    assert points[3].link == other and len(points) == COUNT


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"points": "points.csv", "registration": {}}, "found `points` and `registration`"),
        ({"registration": {"geometry": "none.uff"}}, "no such file"),
        ({"registration": {"posture_deg": [0, 0]}}, "2 angles; expected 6"),
        ({"registration": {"pair_error": 1}}, "pair_error"),
        ({"points_frame": "base", "points_posture_deg": [0] * 6}, "found `base` and no `points`"),
    ],
)
def test_what_is_refused(tmp_path: Path, keys: dict[str, Any], said: str) -> None:
    with pytest.raises((InputError, InputErrors), match=said):
        load_problem(read_study(_study(_test(tmp_path), tmp_path, **keys)))


def test_a_registration_without_a_geometry_is_refused(tmp_path: Path) -> None:
    test = _test(tmp_path)
    test.uff.write_bytes((DATA / "posture1.uff").read_bytes())
    with pytest.raises(InputError, match="no measurement has a geometry"):
        load_problem(read_study(_study(test, tmp_path, registration={})))
