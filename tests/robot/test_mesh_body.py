"""Bodies out of meshes, against formulas of plain bodies, and what is shared among links."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.robot.description import Robot
from identify.robot.mesh import Mesh, box, cylinder
from identify.robot.mesh_body import Shape, Wanted, made_bodies, surface, unknown, volume
from identify.robot.pose import pose
from identify.robot.urdf import read_urdf

SIDES = np.array([0.2, 0.3, 0.5])


def solid_box(mass: float, sides: Array) -> Array:
    """Moments of inertia of a box about its centre."""
    return mass / 12 * (np.sum(sides**2) - sides**2)


def shell_box(sides: Array) -> tuple[float, Array]:
    """Area, and moments of inertia per kg of the six sides of a box."""
    area, second = 0.0, np.zeros(3)
    for axis in range(3):
        others = [other for other in range(3) if other != axis]
        face = 2 * sides[others[0]] * sides[others[1]]
        area += face
        second[axis] += face * sides[axis] ** 2 / 4
        for other in others:
            second[other] += face * sides[other] ** 2 / 12
    return area, (second.sum() - second) / area


@settings(max_examples=30, deadline=None)
@given(
    shift=st.tuples(*[st.floats(-2, 2)] * 3),
    turn=st.tuples(*[st.floats(-3, 3)] * 3),
    sides=st.tuples(*[st.floats(0.05, 1)] * 3),
    inside_out=st.booleans(),
)
def test_a_box_anywhere_has_the_moments_of_a_box(
    shift: tuple[float, ...], turn: tuple[float, ...], sides: tuple[float, ...], inside_out: bool
) -> None:
    at, size = pose(shift, turn), np.array(sides)
    mesh = box(sides).placed(at)
    mesh = Mesh(mesh.vertices, mesh.triangles[:, ::-1]) if inside_out else mesh
    solid, shell = volume(mesh), surface(mesh)
    area, per_kg = shell_box(size)
    assert (solid.size, shell.size) == pytest.approx((size.prod(), area))
    for found, expected in ((solid, solid_box(1.0, size)), (shell, per_kg)):
        assert found.centre == pytest.approx(np.array(shift), abs=1e-9)
        turned = at[:3, :3] @ np.diag(expected) @ at[:3, :3].T
        assert found.inertia == pytest.approx(turned, abs=1e-9)


def test_holes_matter_little_wherever_the_mesh_is() -> None:
    whole = cylinder(0.1, 0.4)
    torn = Mesh(whole.vertices, whole.triangles[:-6])
    here, there = Shape(torn).solid, Shape(torn.placed(pose([2.0, -1.0, 3.0]))).solid
    assert here.size == pytest.approx(volume(whole).size, rel=0.1)
    assert there.size == pytest.approx(here.size)
    assert there.centre == pytest.approx(here.centre + np.array([2.0, -1.0, 3.0]))
    assert there.inertia == pytest.approx(here.inertia)


def test_a_surface_that_is_turned_both_ways_has_the_volume_of_its_hull() -> None:
    whole = box(SIDES)
    turned = np.concatenate([whole.triangles[:6], whole.triangles[6:, ::-1]])
    assert Shape(Mesh(whole.vertices, turned)).solid.size == pytest.approx(SIDES.prod())


def test_a_flat_mesh_is_no_body() -> None:
    flat = Mesh(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    with pytest.raises(InputError, match="lie in a plane"):
        _ = Shape(flat).solid


def arm(folder: Path, bodies: dict[str, str] | None = None, shapes: str = "base one two") -> Robot:
    """Boxes of the same kind, twice and four times as long; bodies: `<inertial>` by link."""
    size = {"base": 1.0, "one": 2.0, "two": 4.0}
    parts = []
    for name, length in size.items():
        look = f'<visual><geometry><box size="0.1 0.1 {0.1 * length}"/></geometry></visual>'
        parts.append(
            f'<link name="{name}">{(bodies or {}).get(name, "")}{look if name in shapes else ""}</link>'
        )
    for parent, child in (("base", "one"), ("one", "two")):
        parts.append(
            f'<joint name="to_{child}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
            '<origin xyz="0 0 0.2"/><axis xyz="0 1 0"/></joint>'
        )
    path = folder / "arm.urdf"
    path.write_text(f'<robot name="arm">{"".join(parts)}</robot>')
    return read_urdf(path, any_bodies=True)


def inertial(mass: float, moment: float) -> str:
    return (
        f'<inertial><origin xyz="0 0 0.05"/><mass value="{mass}"/><inertia ixx="{moment}" iyy="{moment}"'
        f' izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def test_the_data_sheet_is_shared_by_volume_and_surface(tmp_path: Path) -> None:
    """The hand calculation of docs/mesh_bodies.md."""
    found = {body.name: body for body in made_bodies(arm(tmp_path), Wanted(100.0))}
    volumes, areas = np.array([1, 2, 4.0]), np.array([6, 10, 18.0])
    expected = 50 * volumes / 7 + 50 * areas / 34
    assert [found[name].mass for name in ("base", "one", "two")] == pytest.approx(expected)
    solid = solid_box(1.0, np.array([0.1, 0.1, 0.4]))
    _, shell = shell_box(np.array([0.1, 0.1, 0.4]))
    own = np.diag(found["two"].inertia)
    assert (found["two"].mass, own[0]) == (pytest.approx(55.04, abs=0.01), pytest.approx(0.878, abs=1e-3))
    assert own == pytest.approx(50 * 4 / 7 * solid + 50 * 18 / 34 * shell)


def test_a_base_that_is_told_or_known_does_not_share(tmp_path: Path) -> None:
    told = made_bodies(arm(tmp_path), Wanted(100.0, base_kg=40.0))
    assert [body.name for body in told] == ["one", "two"]
    assert sum(body.mass for body in told) == pytest.approx(60)
    known = made_bodies(arm(tmp_path, {"base": inertial(30, 1.0)}), Wanted(100.0))
    assert sum(body.mass for body in known) == pytest.approx(70)


def test_what_the_file_knows_is_kept(tmp_path: Path) -> None:
    robot = arm(tmp_path, {"one": inertial(10, 0.1)})
    assert unknown(robot) == ["two"]
    assert sum(body.mass for body in made_bodies(robot, Wanted(100.0))) == pytest.approx(90)
    everything = made_bodies(robot, Wanted(100.0, everything=True))
    assert [body.name for body in everything] == ["base", "one", "two"]


def test_a_body_with_a_mass_only_gets_an_inertia_of_its_mesh(tmp_path: Path) -> None:
    """As of makers who give the one moment that matters to a controller; no data sheet is needed."""
    robot = arm(tmp_path, {"one": inertial(10, 0.1), "two": inertial(8, 0.0)})
    (body,) = made_bodies(robot, Wanted())
    assert (body.name, body.mass, body.centre[2]) == ("two", 8, 0.05)
    assert np.linalg.eigvalsh(body.inertia)[0] > 0


def test_motors_are_points_at_their_joints(tmp_path: Path) -> None:
    plain = {body.name: body for body in made_bodies(arm(tmp_path), Wanted(100.0, base_kg=40.0))}
    robot = arm(tmp_path)
    found = {b.name: b for b in made_bodies(robot, Wanted(100.0, base_kg=40.0, motors={"to_two": 20.0}))}
    assert sum(body.mass for body in found.values()) == pytest.approx(60)
    own = plain["one"].mass * 40 / 60
    assert found["one"].mass == pytest.approx(own + 20)
    assert found["one"].centre[2] == pytest.approx(20 * 0.2 / (own + 20))
    with pytest.raises(InputError, match="has a mass by the file"):
        made_bodies(robot, Wanted(100.0, base_kg=40.0, motors={"1": 20.0}))


@pytest.mark.parametrize(
    ("bodies", "shapes", "wanted", "sentence"),
    [
        ({}, "base one two", Wanted(), "no mass of one and two; .*--mass-kg"),
        ({}, "base one", Wanted(50.0), r"no mesh for two \(the file names none\)"),
        ({}, "one two", Wanted(50.0), "no mesh of the base 'base'.*--base-kg"),
        ({"one": inertial(60, 1.0)}, "base one two", Wanted(50.0), "exceed by 10 kg"),
    ],
)
def test_what_cannot_be_made_is_refused(
    tmp_path: Path, bodies: dict[str, str], shapes: str, wanted: Wanted, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        made_bodies(arm(tmp_path, bodies, shapes), wanted)


def test_a_cylinder_of_many_sides_is_nearly_round() -> None:
    found = volume(cylinder(0.1, 0.4))
    assert found.inertia[2, 2] == pytest.approx(0.1**2 / 2, rel=0.06)
