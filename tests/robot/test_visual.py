"""What the links of a URDF look like: files of meshes, plain bodies, what cannot be read, how they move."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.geometry import drawn_geometry, drawn_modes, visuals_of
from identify.model.modes import complex_modes
from identify.model.system import System, assemble, build_site
from identify.robot.description import Robot
from identify.robot.mesh import Mesh, box, cylinder, simplified, sphere
from identify.robot.points import Point
from identify.robot.urdf import read_urdf
from identify.robot.visual import Looks, looks, read_mesh
from tests.robot.random_arm import industrial_arm

WEDGE = Mesh(
    np.array([[0.0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.1]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)


def stl(mesh: Mesh, header: bytes = b"solid in name only") -> bytes:
    """As a binary file; its header need not be honest."""
    facets = [
        struct.pack("<12fH", 0, 0, 0, *mesh.vertices[rows].ravel(), 0) for rows in mesh.triangles.tolist()
    ]
    return header.ljust(80) + struct.pack("<I", len(facets)) + b"".join(facets)


def stl_text(mesh: Mesh) -> bytes:
    """As a text file."""
    loops = "".join(
        "facet normal 0 0 0\n outer loop\n"
        + "".join(f"  vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in mesh.vertices[rows])
        + " endloop\nendfacet\n"
        for rows in mesh.triangles.tolist()
    )
    return f"solid wedge\n{loops}endsolid\n".encode()


def obj(mesh: Mesh) -> bytes:
    """As an OBJ file, whose corners count from 1, or from behind."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    lines += [f"f {a + 1}/1/1 {b - len(mesh.vertices)} {c + 1}//2" for a, b, c in mesh.triangles.tolist()]
    return "\n".join(["# wedge", *lines]).encode()


def volume(mesh: Mesh) -> float:
    """That a closed surface encloses."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6)


@pytest.mark.parametrize(("name", "write"), [("a.stl", stl), ("b.STL", stl_text), ("c.obj", obj)])
def test_a_wedge_from_every_kind_of_file(name: str, write: object, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(write(WEDGE))  # type: ignore[operator]
    found = read_mesh(tmp_path / name)
    assert len(found.triangles) == 4
    assert volume(found) == pytest.approx(0.3 * 0.2 * 0.1 / 6, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("cut.stl", stl(WEDGE)[:-20], "no triangles"),
        ("empty.stl", b"", "no triangles"),
        ("nan.stl", stl(Mesh(WEDGE.vertices * np.nan, WEDGE.triangles)), "no numbers"),
        ("word.obj", b"v 0 0 zero\nf 1 1 1", "damaged"),
        ("far.obj", b"v 0 0 0\nf 1 2 3", "not there"),
        ("arm.dae", b"<COLLADA/>", "no triangles"),
        ("arm.ply", b"ply", ".ply are not read"),
        ("gone.stl", None, "cannot be read"),
    ],
)
def test_what_cannot_be_read_is_refused(name: str, content: bytes | None, said: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=said):
        read_mesh(tmp_path / name)


def test_plain_bodies_enclose_what_they_should() -> None:
    assert volume(box((0.2, 0.3, 0.5))) == pytest.approx(0.03)
    sides = 16 / np.pi * np.sin(np.pi / 16) * np.cos(np.pi / 16)
    assert volume(cylinder(0.1, 0.4)) == pytest.approx(sides * np.pi * 0.01 * 0.4)
    assert volume(sphere(0.2)) == pytest.approx(4 / 3 * np.pi * 0.008, rel=0.1)


def test_fewer_triangles_look_like_many() -> None:
    turn, up = np.meshgrid(2 * np.pi * np.arange(200) / 200, np.linspace(-1, 1, 101))
    places = np.stack([np.cos(turn), np.sin(turn), up], axis=-1).reshape(-1, 3)
    row = np.arange(100 * 200)
    beside = row - row % 200 + (row + 1) % 200
    lower, upper = np.stack([row, beside, row + 200], 1), np.stack([beside, beside + 200, row + 200], 1)
    fine = Mesh(places, np.concatenate([lower, upper]))
    found = simplified(fine, 400)
    assert 100 < len(found.triangles) <= 400
    assert np.linalg.norm(found.vertices[:, :2], axis=1) == pytest.approx(1.0, abs=0.15)
    assert np.ptp(found.vertices, axis=0) == pytest.approx([2, 2, 2], abs=0.3)
    assert len(simplified(fine, 10**6).triangles) == len(fine.triangles)


def arm(folder: Path, bodies: dict[str, str]) -> Robot:
    """A six-axis arm whose links say what they look like."""
    text = industrial_arm(3)
    for link, body in bodies.items():
        assert f'<link name="{link}">' in text
        text = text.replace(f'<link name="{link}">', f'<link name="{link}">{body}')
    path = folder / "urdf" / "arm.urdf"
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return read_urdf(path)


def visual(inside: str, tag: str = "visual", origin: str = "") -> str:
    return f"<{tag}>{origin}<geometry>{inside}</geometry></{tag}>"


def test_bodies_of_a_urdf(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "wedge.stl").write_bytes(stl(WEDGE))
    wedge = '<mesh filename="package://arm_description/meshes/wedge.stl" scale="1 1 -2"/>'
    shifted = '<origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/>'
    both = visual('<box size="0.1 0.1 0.1"/>') + visual('<sphere radius="0.2"/>')
    found = looks(
        arm(
            tmp_path,
            {
                "base_link": both,
                "link1": visual(wedge, origin=shifted),
                "link2": visual('<mesh filename="no.dae"/>') + visual(wedge, "collision"),
            },
        )
    )
    assert (list(found.meshes), found.missing) == (["base_link", "link1", "link2"], ())
    assert np.ptp(found.meshes["base_link"].vertices[:, 2]) == pytest.approx(0.4)
    low, high = found.meshes["link1"].vertices.min(axis=0), found.meshes["link1"].vertices.max(axis=0)
    assert low == pytest.approx([-0.2, 0, 0.3])
    assert high == pytest.approx([0, 0.3, 0.5])
    assert found.meshes["link2"].vertices.min(axis=0) == pytest.approx([0, 0, -0.2])


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ('<mesh filename="meshes/none.stl"/>', "none.stl: the file cannot be read"),
        ('<mesh filename="http://example.org/none.stl"/>', "none.stl: the file cannot be read"),
        ('<box size="1 2"/>', 'size="1 2"'),
        ("<capsule/>", "capsule in <geometry>"),
        ('<box size="300 300 900"/>', "in mm without a `scale`"),
    ],
)
def test_a_link_without_a_body_costs_a_sentence_only(body: str, said: str, tmp_path: Path) -> None:
    robot = arm(tmp_path, {"link1": visual(body), "link2": visual('<sphere radius="0.1"/>')})
    found = looks(robot)
    assert list(found.meshes) == ["link2"]
    assert len(found.missing) == 1
    assert found.missing[0].startswith("link link1 is drawn as a line")
    assert said in found.missing[0]


def test_several_links_without_a_body_are_one_sentence(tmp_path: Path) -> None:
    bodies = {f"link{n}": visual(f'<mesh filename="meshes/{n}.stl"/>') for n in (1, 2, 3)}
    [said] = looks(arm(tmp_path, bodies)).missing
    assert said.startswith(
        "3 links are drawn as lines, not as their bodies: link1, link2 and link3 (link1: 1.stl"
    )


def moving(robot: Robot) -> System:
    """The arm at a posture, with springs in its joints."""
    effects = [JointCompliance(kind="joint-compliance", axes=["rz", "rx"])]
    return assemble(robot, build_site(robot, np.array([0.3, 0.5, -0.4, 0.2, 0.9, 0.1]), effects), effects)


def test_bodies_stand_and_move_as_points_of_their_links_do(tmp_path: Path) -> None:
    robot = arm(
        tmp_path, {"link2": visual('<box size="0.2 0.1 0.6"/>'), "link5": visual('<sphere radius="0.1"/>')}
    )
    system = moving(robot)
    values = np.array([p.initial for p in system.parameters])
    modes = complex_modes(*system.matrices(values))
    corner = np.array([0.1, 0.05, 0.3])
    point = Point(1, "corner", "link2", corner, np.eye(3), "points.csv")
    geometry = drawn_geometry(system.site.engine, [point], looks(robot))
    bodies = geometry.bodies
    assert bodies is not None
    row = int(np.argmin(np.linalg.norm(bodies.vertices - corner, axis=1)))
    assert bodies.links[bodies.of_link[row]] == "link2"
    assert bodies.placed[row] == pytest.approx(geometry.points[0])
    assert bodies.bare.tolist() == [True, True, True, False, True, True, False, True]
    drawn = drawn_modes(system, [point], modes, bodies)
    assert drawn.body_shapes is not None
    shift, turn = drawn.body_shapes[:, 0, :3], drawn.body_shapes[:, 0, 3:]
    moved = shift + np.cross(turn, geometry.points[0] - bodies.middle[0])
    np.testing.assert_allclose(moved, drawn.point_shapes[:, 0], atol=1e-9 * np.abs(moved).max())
    assert np.abs(shift - drawn.point_shapes[:, 0]).max() > 0.01 * np.abs(moved).max()
    again = looks(Robot("again", robot.links, robot.joints, visuals=visuals_of(geometry)))
    for link, mesh in looks(robot).meshes.items():
        np.testing.assert_allclose(again.meshes[link].vertices, mesh.vertices, atol=1e-12)


def test_without_bodies_nothing_is_drawn(tmp_path: Path) -> None:
    robot = arm(tmp_path, {})
    engine = moving(robot).site.engine
    assert looks(robot) == Looks({}, ())
    assert drawn_geometry(engine, [], looks(robot)).bodies is None
