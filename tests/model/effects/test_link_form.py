"""What the form of a bending link may be off by: bodies that move with a section, shapes at its sensors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.site import Site
from identify.model.system import build_site
from identify.robot.description import Robot
from identify.robot.points import Point
from tests.arms import arm

LINK = "link2"


def _bent(
    folder: Path, nonuniform: bool = True, back: float = 0.0
) -> tuple[Robot, LinkFlexibility, Site, dict[int, Point]]:
    """An arm with a link that bends, and sensors at its start, in its middle and at its end; its centre goes
    back by a share of its length.
    """
    robot, effect = arm(folder), LinkFlexibility(link=LINK, nonuniform=nonuniform)
    beam = effect.beam(robot)
    heavy = replace(robot.link(LINK), centre=robot.link(LINK).centre - back * (beam.end - beam.start))
    robot = replace(robot, links=tuple(heavy if one.name == LINK else one for one in robot.links))
    along = beam.end - beam.start
    places = {7: 0.0, 8: 0.5, 9: 1.0}
    points = {
        node: Point(node, str(node), LINK, beam.start + share * along + 0.1 * beam.across[0], np.eye(3), "")
        for node, share in places.items()
    }
    posture = np.array([0.1, 0.4, -0.3, 0.5, 0.2, 0.3])
    site = build_site(robot, posture, [effect], points=points)
    return robot, effect, site, points


def _by_name(
    bent: tuple[Robot, LinkFlexibility, Site, dict[int, Point]],
) -> tuple[dict[str, np.ndarray], dict[str, dict[int, np.ndarray]]]:
    robot, effect, site, points = bent
    [form] = effect.forms(robot, points)
    mass, motion = form.changes(site)
    names = [name for name, _ in form.errors]
    assert form.place == LINK
    assert len(set(names)) == len(names) == len(mass)
    of_points = {name: {node: motion[node][n] for node in points} for n, name in enumerate(names)}
    return dict(zip(names, mass, strict=True)), of_points


def test_a_body_at_the_end_is_that_of_a_nonuniform_link(tmp_path: Path) -> None:
    bent = _bent(tmp_path)
    robot, effect, site, _ = bent
    mass, _ = _by_name(bent)
    terms = {term.parameter.name: term for term in effect.terms(robot, site, "effects.0")}
    there = terms[f"{LINK}.end_mass"].mass
    assert there is not None
    assert mass["mass_at_end"] == pytest.approx(robot.link(LINK).mass * there, abs=1e-9)


def test_a_body_between_leaves_the_rigid_link_as_it_was(tmp_path: Path) -> None:
    bent = _bent(tmp_path)
    site = bent[2]
    mass, motion = _by_name(bent)
    rigid = [n for n, name in enumerate(site.coordinates) if not name.startswith(f"{LINK}.")]
    for name in ("mass_at_third", "moment_x_at_third", "moment_z_at_two_thirds"):
        assert np.any(mass[name])
        assert not mass[name][np.ix_(rigid, rigid)].any()
        assert not any(one.any() for one in motion[name].values())
    # A third of the way along, only what is there moves with the first node.
    node = site.number(f"{LINK}.deflection_1_at_1_of_3")
    assert mass["mass_at_third"][node, node] == pytest.approx(bent[0].link(LINK).mass)
    assert mass["mass_at_two_thirds"][node, node] == pytest.approx(0.0, abs=1e-12)


def test_all_mass_may_move_evenly_with_the_sections(tmp_path: Path) -> None:
    """By the twist of its end a link then has a third of its inertia about the beam, wherever its mass is."""
    bent = _bent(tmp_path, nonuniform=False, back=0.3)
    robot, effect, site, _ = bent
    own, more, twist = effect.consistent_mass(robot, site), _by_name(bent)[0], site.number(f"{LINK}.twist")
    link, beam = robot.link(LINK), effect.beam(robot)
    aside = link.centre - beam.start - (link.centre - beam.start) @ beam.axis * beam.axis
    about = beam.axis @ link.inertia @ beam.axis + link.mass * aside @ aside
    assert own is not None
    assert own[twist, twist] != pytest.approx(about / 3, rel=0.01)
    assert own[twist, twist] + more["even_share"][twist, twist] == pytest.approx(about / 3)
    rigid = [n for n, name in enumerate(site.coordinates) if not name.startswith(f"{LINK}.")]
    assert more["even_share"][np.ix_(rigid, rigid)] == pytest.approx(0.0, abs=1e-9)
    assert "even_share" not in _by_name(_bent(tmp_path))[0], "a parameter of a nonuniform link"


@pytest.mark.parametrize("nonuniform", [False, True])
def test_a_sensor_follows_the_end_by_another_shape(nonuniform: bool, tmp_path: Path) -> None:
    bent = _bent(tmp_path, nonuniform)
    robot, effect, site, _ = bent
    beam = effect.beam(robot)
    mass, motion = _by_name(bent)
    slope, twist = (site.number(f"{LINK}.{name}") for name in ("slope_1", "twist"))
    turned = motion["slope_1_by_slope_at_8"]
    assert not mass["slope_1_by_slope_at_8"].any()
    assert turned[8][3:, slope] == pytest.approx(beam.across[0])
    assert turned[8][:3, slope] == pytest.approx(0.0, abs=1e-12), "the sensor lies on the axis of the turn"
    assert np.flatnonzero(turned[8].any(axis=0)).tolist() == [slope]
    about = motion["twist_at_8"][8][:, twist]
    assert about[:3] == pytest.approx(np.cross(beam.axis, 0.1 * beam.across[0]))
    aside = motion["deflection_1_by_slope_at_8"][8][:, slope]
    assert aside[:3] == pytest.approx(np.cross(beam.across[0], beam.axis) * beam.length / 3)
    for node in (7, 9):  # where the beam is held, and where it is its end
        at_ends = [own[node] for name, own in motion.items() if name.endswith(f"_at_{node}")]
        assert len(at_ends) == 9
        assert not any(one.any() for one in at_ends)


def test_a_link_that_was_taken_off_has_no_form(tmp_path: Path) -> None:
    robot, effect, site, points = _bent(tmp_path)
    [form] = effect.forms(robot, points)
    mass, motion = form.changes(replace(site, detached=frozenset([LINK])))
    assert not mass.any()
    assert not any(one.any() for one in motion.values())
