"""The page of points in a real browser: clicks and keys put nodes on surfaces, and what it saves is read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.api import commands as api
from identify.reports.points.page import planned_page
from identify.robot.points import Point, new_points_text, read_points
from identify.robot.posture import z_to
from identify.robot.urdf import read_urdf
from tests.reports.browser import Page, browser
from tests.reports.plan_sample import plan_result

_URDF = """<robot name="two">
<link name="foot"><visual><origin xyz="0 0 0.25"/><geometry>
<box size="0.4 0.4 0.5"/></geometry></visual></link>
<link name="arm"><inertial><mass value="5"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="0.4 0 0"/><geometry><box size="0.8 0.2 0.2"/></geometry></visual></link>
<joint name="j" type="revolute"><parent link="foot"/><child link="arm"/><origin xyz="0 0 0.6"/>
<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with browser() as opened:
        yield opened


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The page of an arm that is turned by 90 degrees."""
    (tmp_path / "two.urdf").write_text(_URDF)
    api.points(tmp_path / "two.urdf", posture="90", page=tmp_path / "points.html")
    return tmp_path / "points.html"


def _add(page: Page, numbers: list[int]) -> None:
    for number in numbers:
        page.run(f"$('number').value = '{number}'; $('add').click()")
    page.run("choose(0)")


def _click(page: Page, place: tuple[float, float, float]) -> None:
    """Click where a place of the base's frame is drawn."""
    x, y, _ = page.run(f"projector()({list(place)})")
    left, top, _, _ = page.box("#robot")
    page.mouse("mouseMoved", left + x, top + y)
    for kind in ("mousePressed", "mouseReleased"):
        page.mouse(kind, left + x, top + y, button="left", buttons=1, clickCount=1)


def _key(page: Page, key: str) -> None:
    for kind in ("keyDown", "keyUp"):
        page.call("Input.dispatchKeyEvent", type=kind, key=key)


def _saved(page: Page, folder: Path) -> dict[int, Point]:
    """What `Save points.csv` writes, through the reader of a study."""
    page.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
    page.run("$('save').click()")
    page.wait("$('status').textContent.startsWith('Saved')")
    for _ in range(100):
        if (folder / "points.csv").exists() and (folder / "points.csv").stat().st_size:
            break
        page.run("new Promise(r => setTimeout(r, 50))")
    return read_points(folder / "points.csv")


def test_clicks_put_nodes_on_links_in_order(page: Page, file: Path, tmp_path: Path) -> None:
    page.console.clear()
    page.requests.clear()
    page.open(file)
    page.run("view.azimuth = -0.5; view.elevation = 0.6; painted()")
    _add(page, [7, 8])
    _click(page, (0.03, 0.5, 0.7))
    _click(page, (0.2, 0.05, 0.2))
    found = _saved(page, tmp_path)
    assert [found[n].link for n in (7, 8)] == ["arm", "foot"]
    # The arm is turned by 90 degrees: y of the base is its x, and x of the base its -y.
    np.testing.assert_allclose(found[7].position, [0.5, -0.03, 0.1], atol=1e-4)
    np.testing.assert_allclose(found[8].position, [0.2, 0.05, 0.2], atol=1e-4)
    np.testing.assert_allclose(page.run("nodes[0].normal"), [0, 0, 1], atol=1e-9)
    assert page.console == []
    assert [one for one in page.requests if not one.startswith(("file:", "blob:", "data:"))] == []


def test_a_planned_test_is_shown_on_the_robot(page: Page, file: Path, tmp_path: Path) -> None:
    """Sensors and impacts of the plan, and no other of the points, where they are at its first posture."""
    robot = read_urdf(file.with_name("two.urdf"))
    places = {8: (0.5, 0.1, 0.0), 12: (0.8, 0.0, 0.1), 14: (0.2, -0.1, 0.05), 20: (0.6, 0.0, 0.1)}
    points = {n: Point(n, "", "arm", np.array(place), np.eye(3), "") for n, place in places.items()}
    plan = replace(plan_result(), posture_deg=np.array([[90.0], [20.0]]), sensors=np.array([8, 12]))
    (tmp_path / "plan.html").write_text(planned_page(plan, robot, points))
    page.console.clear()
    page.open(tmp_path / "plan.html")
    assert page.run("nodes.map(node => [node.node, node.link, node.about])") == [
        [8, "arm", "sensor and impacts along +Z"],
        [12, "arm", "sensor"],
        [14, "arm", "impacts along +X"],
    ]
    np.testing.assert_allclose(page.run("inBase(nodes[0])"), [-0.1, 0.5, 0.6], atol=1e-9)
    assert "90.0; 20.0 degrees" in page.run("document.body.innerText")
    assert page.console == []


def test_a_click_beside_the_robot_puts_nothing(page: Page, file: Path) -> None:
    page.open(file)
    _add(page, [1])
    left, top, _, _ = page.box("#robot")
    for kind in ("mousePressed", "mouseReleased"):
        page.mouse(kind, left + 5, top + 5, button="left", buttons=1, clickCount=1)
    assert page.run("$('status').textContent") == "Nothing is there."
    assert page.run("nodes[0].position") is None


def test_keys_alone_put_a_node_and_turn_its_sensor(page: Page, file: Path, tmp_path: Path) -> None:
    page.open(file)
    _add(page, [1, 2])
    page.run("view.azimuth = 0; view.elevation = 1.57; painted(); $('robot').focus()")
    place = page.run("projector()([0, 0.3, 0.7])")
    middle = page.run("[canvas.clientWidth / 2, canvas.clientHeight / 2]")
    steps = [round((a - b) / 4) for a, b in zip(place, middle, strict=False)]
    for count, (back, forth) in zip(steps, (("a", "d"), ("w", "s")), strict=True):
        for _ in range(abs(count)):
            _key(page, forth if count > 0 else back)
    _key(page, "Enter")
    assert page.run("nodes[0].link") == "arm"
    _key(page, "p")
    _key(page, "z")
    found = _saved(page, tmp_path)
    assert np.linalg.norm(found[1].position[:2] - [0.3, 0.0]) < 0.02
    np.testing.assert_allclose(found[1].axes, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-6)


def test_z_goes_along_the_normal_and_another_link_holds_the_place(
    page: Page, file: Path, tmp_path: Path
) -> None:
    page.open(file)
    page.run("view.azimuth = -0.5; view.elevation = 0.6; painted()")
    _add(page, [1])
    _click(page, (0.1, 0.5, 0.62))
    page.run("$('normal').click()")
    before = page.run("inBase(nodes[0])")
    np.testing.assert_allclose(
        page.run("times(linkOf(nodes[0].link).turn, nodes[0].axes[2])"), [1, 0, 0], atol=1e-9
    )
    page.run("$('link').value = 'foot'; $('link').dispatchEvent(new Event('change'))")
    np.testing.assert_allclose(page.run("inBase(nodes[0])"), before, atol=1e-12)
    found = _saved(page, tmp_path)
    assert found[1].link == "foot"
    np.testing.assert_allclose(found[1].axes[2], [1, 0, 0], atol=1e-5)


def test_a_points_file_that_is_opened_is_saved_as_it_was(page: Page, file: Path, tmp_path: Path) -> None:
    chance = np.random.default_rng(3)
    axes = [np.linalg.qr(chance.normal(size=(3, 3)))[0] for _ in range(3)]
    told = {
        n: Point(n, 'a "b", c', "arm", np.round(chance.normal(size=3), 4), a * np.sign(np.linalg.det(a)), "")
        for n, a in enumerate(axes, 1)
    }
    page.open(file)
    page.run(f"read({new_points_text(told)!r})")
    found = _saved(page, tmp_path)
    for node, point in told.items():
        assert (found[node].name, found[node].link) == (point.name, "arm")
        np.testing.assert_allclose(found[node].position, point.position, atol=1e-5)
        np.testing.assert_allclose(found[node].axes, point.axes, atol=1e-4)


def test_links_without_bodies_are_tubes_that_can_be_clicked(page: Page, tmp_path: Path) -> None:
    urdf = Path(__file__).parents[2] / "data" / "arm_hammer_test" / "robot.urdf"
    found = api.points(urdf, [urdf.parent / "posture1.uff"], page=tmp_path / "points.html")
    page.console.clear()
    page.open(tmp_path / "points.html")
    assert page.run("nodes.map(node => node.node)") == list(found.nodes)
    _click(page, tuple(page.run("links[3].corners[0]")))
    assert page.run("nodes[0].position") is not None
    assert page.run("chosen") == 1
    assert page.console == []


def test_what_is_remembered_of_axes_cannot_be_changed() -> None:
    """A page that moved a remembered pose would move every robot after it."""
    with pytest.raises(ValueError, match="read-only"):
        z_to(np.array([0.0, 0.0, 1.0]))[:3, 3] = 1.0
