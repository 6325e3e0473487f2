"""A node that was taken for one of a neighbouring link, at the place where it is, is named and put right."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.robot.points import new_points_text, read_points
from identify.robot.points_frame import on_link
from identify.robot.read import read_robot
from identify.robot.settings import RobotSettings
from identify.setup.apply import write_corrected
from identify.setup.edits import OnLink
from identify.setup.kinds.channels import links
from identify.setup.score import scored
from tests.setup import studies


def test_a_node_of_another_surface_is_found_at_its_place(tmp_path: Path) -> None:
    told = read_points(studies.DATA / "points.csv")
    robot = read_robot(RobotSettings(urdf=studies.DATA / "robot.urdf"), Path())
    names = [link.name for link in robot.links]
    node = next(n for n, point in told.items() if names.index(point.link) == 3)
    wrong = on_link(told[node], names[1], robot, np.radians(studies.POSTURES[0]))
    (tmp_path / "points.csv").write_text(new_points_text({**told, node: wrong}))
    study = studies.of(tmp_path, studies.config(points=str(tmp_path / "points.csv")))
    plain = scored(study.problem())
    found = [one.edits[0] for one in links(study, plain) if one.code == "wrong-link"]
    right = [one for one in found if isinstance(one, OnLink) and one.node == node and one.link == names[3]]
    assert right and right[0].point is not None
    np.testing.assert_allclose(right[0].point.position, told[node].position, atol=1e-4)
    assert scored(study.changed(right[:1]).problem()).cost < 0.9 * plain.cost
    written = write_corrected(study.file, right[:1], [])
    corrected = read_points(written[1])[node]
    assert corrected.link == names[3]
    np.testing.assert_allclose(corrected.position, told[node].position, atol=1e-4)
