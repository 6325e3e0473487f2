"""Start values that nobody gave: each coordinate on its own, all others locked, resonates and is damped as
its description says.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.model.effects.base import parse_effect
from identify.model.modes import complex_modes
from identify.model.system import assemble, build_site, list_parameters
from tests.arms import arm, initial
from tests.robot.random_arm import random_posture

START_HZ, RATIO, ROTOR = 20.0, 110.0, 2e-3


def _alone(folder: Path, effects: list[dict[str, Any]]) -> tuple[float, float, complex]:
    """Mass, damping and stiffness without gravity of the one coordinate that effects release, at start
    values.
    """
    robot, parsed = arm(folder), [parse_effect(effect) for effect in effects]
    site = build_site(robot, random_posture(1), parsed)
    system, parameters = assemble(robot, site, parsed), list_parameters(robot, site, parsed)
    assert len(system.coordinates) == 1
    mass, damping, stiffness = (one[0, 0] for one in system.matrices(initial(parameters)))
    return mass, damping, stiffness - system.stiffness[0, 0]


def _pole(mass: float, damping: float, stiffness: complex) -> tuple[float, float]:
    """Frequency, Hz, and damping ratio of m s^2 + c s + k."""
    pole = np.roots([mass, damping, np.real(stiffness)])[0]
    return float(np.abs(pole) / (2 * np.pi)), float(-pole.real / np.abs(pole))


@pytest.mark.parametrize("ratio", [0.03, 0.11])
def test_a_spring(ratio: float, tmp_path: Path) -> None:
    given = {} if ratio == 0.03 else {"damping": {"damping_ratio": ratio}}
    spring = {"kind": "joint-compliance", "joints": [2], "axes": ["rz"], **given}
    assert _pole(*_alone(tmp_path, [spring])) == pytest.approx((START_HZ, ratio), rel=1e-9)


def test_the_drive_of_a_bare_flange_is_made_for_more_than_it_carries(tmp_path: Path) -> None:
    """A thirtieth of what the drive before it carries; bounds a thousand times either side hold what is
    usual.
    """
    robot, spring = arm(tmp_path), parse_effect({"kind": "joint-compliance"})
    bare = replace(robot.links[-1], mass=1e-3, centre=np.zeros(3), inertia=1e-9 * np.eye(3))
    robot = replace(robot, links=(*robot.links[:-1], bare))
    site = build_site(robot, random_posture(1), [spring])
    found = {p.name: p for p in list_parameters(robot, site, [spring])}
    before, last = (found[f"joint{n}.rz.stiffness"] for n in (5, 6))
    assert before.initial == pytest.approx(site.inertia("joint5.rz") * (2 * np.pi * START_HZ) ** 2, rel=1e-9)
    assert last.initial == pytest.approx(before.initial / 30, rel=1e-9)


@pytest.mark.parametrize("ratio", [0.03, 0.07])
def test_a_rotor_that_is_held(ratio: float, tmp_path: Path) -> None:
    """What the holding spring moves is the arm and, by far the most here, the rotor as the gear output feels
    it.
    """
    rotor: dict[str, Any] = {
        "kind": "rotor-inertia",
        "joints": [2],
        "gear_ratio": [RATIO],
        "inertia": {"initial": ROTOR, "bounds": [1e-6, 1.0]},
        "holding_stiffness": {},
        "holding_damping": {"damping_ratio": ratio},
    }
    mass, damping, stiffness = _alone(tmp_path, [rotor])
    still = _alone(tmp_path, [{"kind": "joint-compliance", "joints": [2], "axes": ["rz"]}])[0]
    assert mass - still == pytest.approx(RATIO**2 * ROTOR, rel=1e-9)
    assert _pole(mass, damping, stiffness) == pytest.approx((START_HZ, ratio), rel=1e-9)


def test_hysteretic_damping(tmp_path: Path) -> None:
    """A loss factor of 0.02: over a cycle 2 pi 0.02 of the stored energy is lost, so that free motion dies
    out like one with a damping ratio of 0.01.
    """
    damping = {"initial": 1e-9, "bounds": [1e-12, 1.0]}
    spring = {"kind": "joint-compliance", "joints": [2], "damping": damping}
    mass, _, stiffness = _alone(tmp_path, [spring, {"kind": "hysteretic-damping", "joints": [2]}])
    pole = np.sqrt(-stiffness / mass + 0j)
    pole = pole if pole.imag > 0 else -pole
    assert np.abs(pole) / (2 * np.pi) == pytest.approx(START_HZ, rel=1e-3)
    assert -pole.real / np.abs(pole) == pytest.approx(0.01, rel=1e-3)


def test_a_flexible_link(tmp_path: Path) -> None:
    """Bending in either plane and torsion, each with the slowest motion that it allows at 20 Hz; the default
    damping ratio of each is 0.03.
    """
    robot, effects = arm(tmp_path), [parse_effect({"kind": "link-flexibility", "link": "link2"})]
    robot = replace(robot, gravity=np.zeros(3))
    site = build_site(robot, random_posture(1), effects)
    system, values = assemble(robot, site, effects), initial(list_parameters(robot, site, effects))
    mass, damping, stiffness = system.matrices(values)
    for way in ("_1", "_2", "twist"):
        own = np.ix_(*[[n for n, name in enumerate(system.coordinates) if name.endswith(way)]] * 2)
        mode = complex_modes(mass[own], damping[own], stiffness[own])
        assert mode.frequency_hz[0] == pytest.approx(START_HZ, rel=1e-3)
        assert mode.damping_ratio[0] == pytest.approx(0.03, rel=1e-3)


def test_a_spring_to_the_ground(tmp_path: Path) -> None:
    """A soft start: all that the link carries would go to and fro at 5 Hz on it, with a damping ratio of
    0.03.
    """
    robot, effect = arm(tmp_path), parse_effect({"kind": "spring-to-ground", "link": "link3", "axes": ["z"]})
    site = build_site(robot, random_posture(1), [effect])
    stiffness, damping = initial(list_parameters(robot, site, [effect]))
    carried = sum(link.mass for link in robot.links[3:])
    assert _pole(carried, damping, stiffness) == pytest.approx((5.0, 0.03), rel=1e-9)


def test_a_resonator(tmp_path: Path) -> None:
    """On the held link it has 20 Hz and a damping ratio of 0.03."""
    robot = arm(tmp_path)
    effect = parse_effect({"kind": "appended-resonator", "link": "link3", "axis": "y"})
    parameters = list_parameters(robot, build_site(robot, random_posture(1), [effect]), [effect])
    named = {p.name.rsplit(".", 1)[1]: p.initial for p in parameters}
    found = _pole(named["mass"], named["damping"], named["stiffness"])
    assert found == pytest.approx((START_HZ, 0.03), rel=1e-9)
