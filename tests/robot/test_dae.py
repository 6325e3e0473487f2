"""COLLADA: units, scenes, polygons of every kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.robot.mesh_body import volume
from identify.robot.visual import read_mesh

CORNERS = "0 0 0  1 0 0  1 1 0  0 1 0  0 0 1  1 0 1  1 1 1  0 1 1"
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (0, 4, 7, 3), (1, 2, 6, 5)]
"""A cube of one unit."""


def polylist() -> str:
    """With a normal beside each corner."""
    corners = " ".join(f"{corner} 0" for side in SIDES for corner in side)
    return f"<polylist count='6'>{INPUTS}<vcount>{'4 ' * 6}</vcount><p>{corners}</p></polylist>"


def polygons() -> str:
    return "<polygons>" + INPUTS + "".join(f"<p>{_beside(side)}</p>" for side in SIDES) + "</polygons>"


def triangles() -> str:
    halves = [half for a, b, c, d in SIDES for half in ((a, b, c), (a, c, d))]
    return f"<triangles>{INPUTS}<p>{' '.join(map(_beside, halves))}</p></triangles>"


def _beside(corners: tuple[int, ...]) -> str:
    return " ".join(f"{corner} 0" for corner in corners)


INPUTS = '<input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#n" offset="1"/>'
NODE = (
    '<node><scale>2 1 1</scale><node><translate>5 0 0</translate><instance_geometry url="#g"/></node></node>'
)


def written(folder: Path, faces: str, scene: str = NODE, unit: str = "0.001") -> Path:
    path = folder / "cube.dae"
    path.write_text(
        f"""<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema">
        <asset><unit name="x" meter="{unit}"/><up_axis>Y_UP</up_axis></asset>
        <library_geometries><geometry id="g"><mesh>
        <source id="p"><float_array id="a">{CORNERS}</float_array><technique_common>
        <accessor source="#a" stride="3"/></technique_common></source>
        <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{faces}</mesh></geometry>
        </library_geometries><library_visual_scenes><visual_scene id="s">{scene}</visual_scene>
        </library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
    )
    return path


@pytest.mark.parametrize("faces", [polylist(), polygons(), triangles()])
def test_a_cube_in_millimetres_where_its_scene_puts_it(tmp_path: Path, faces: str) -> None:
    mesh = read_mesh(written(tmp_path, faces))
    assert len(mesh.triangles) == 12
    found = volume(mesh)
    assert found.size == pytest.approx(2e-9)
    assert found.centre == pytest.approx(np.array([11.0, 0.5, 0.5]) / 1000)


def test_a_node_is_used_twice(tmp_path: Path) -> None:
    scene = '<node id="n"><instance_geometry url="#g"/></node><node><matrix>1 0 0 3 0 1 0 0 0 0 1 0 0 0 0 1'
    mesh = read_mesh(written(tmp_path, triangles(), scene + '</matrix><instance_node url="#n"/></node>', "1"))
    assert volume(mesh).size == pytest.approx(2)
    assert volume(mesh).centre[0] == pytest.approx(2)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('url="#g"', 'url="#h"'),
        (CORNERS, "0 0 0 1"),
        (CORNERS, "a b c"),
        ("<translate>5 0 0</translate>", '<instance_node url="#r"/>'),
        ('source="#v"', 'source="#w"'),
        ("<scale>2 1 1</scale>", "<scale>2</scale>"),
    ],
)
def test_what_is_damaged_is_refused(tmp_path: Path, old: str, new: str) -> None:
    path = written(tmp_path, triangles(), NODE.replace("<node>", '<node id="r">', 1))
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError, match="damaged mesh"):
        read_mesh(path)
