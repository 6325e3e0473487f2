"""Kinds of effects on the structure against physics by hand, and what is refused; the contract of all kinds is in test_contract."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from identify.effects.base import parse_effect
from identify.errors import InputError
from identify.model.modes import undamped_modes
from identify.model.system import assemble, build_site, list_parameters
from identify.robot.urdf import read_urdf
from tests.arms import arm, initial, system

PENDULUM = """<robot name="pendulum">
<link name="ground"><inertial><origin xyz="0 0 0"/><mass value="50"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="3"/><inertia ixx="0.2" iyy="0.2" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="ground"/><child link="rod"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint>
</robot>"""
DRIVE = {"kind": "joint-compliance", "stiffness": {"initial": 400.0}, "damping": {"initial": 1.0}}


def _frequency(folder: Path, effects: list[dict[str, object]]) -> np.ndarray:
    path = folder / "pendulum.urdf"
    path.write_text(PENDULUM)
    robot, parsed = read_urdf(path), [parse_effect(effect) for effect in effects]
    site = build_site(robot, np.zeros(1), parsed)
    values = initial(list_parameters(robot, site, parsed))
    mass, _, stiffness = assemble(robot, site, parsed).matrices(values)
    return undamped_modes(mass, stiffness)[0]


def test_pendulum_with_a_spring_has_its_textbook_frequency(tmp_path: Path) -> None:
    inertia = 0.2 + 3 * 0.5**2
    expected = np.sqrt((400.0 + 3 * 9.81 * 0.5) / inertia) / (2 * np.pi)
    assert _frequency(tmp_path, [DRIVE]) == pytest.approx([expected], rel=1e-6)


def test_added_mass_brings_inertia_and_weight(tmp_path: Path) -> None:
    mass = {"kind": "added-mass", "link": "rod", "at_m": [0, 0, -1.2], "mass": {"initial": 2.0}}
    inertia = 0.2 + 3 * 0.5**2 + 2 * 1.2**2
    expected = np.sqrt((400.0 + 9.81 * (3 * 0.5 + 2 * 1.2)) / inertia) / (2 * np.pi)
    assert _frequency(tmp_path, [DRIVE, mass]) == pytest.approx([expected], rel=1e-6)


def test_rotor_behind_a_rigid_gear_adds_n_squared_j(tmp_path: Path) -> None:
    rotor = {"kind": "rotor-inertia", "joints": [1], "gear_ratio": [50], "inertia": {"initial": 1e-4, "bounds": [1e-6, 1]}}
    inertia = 0.2 + 3 * 0.5**2 + 50**2 * 1e-4
    expected = np.sqrt((400.0 + 3 * 9.81 * 0.5) / inertia) / (2 * np.pi)
    assert _frequency(tmp_path, [DRIVE, rotor]) == pytest.approx([expected], rel=1e-6)


def test_held_rotor_is_a_second_spring_in_series(tmp_path: Path) -> None:
    rotor = {"kind": "rotor-inertia", "joints": [1], "gear_ratio": [50], "inertia": {"initial": 1e-4, "bounds": [1e-6, 1]}}
    held = _frequency(tmp_path, [DRIVE, {**rotor, "holding_stiffness": {"initial": 700.0}}])
    link, n2j, gravity = 0.2 + 3 * 0.5**2, 50**2 * 1e-4, 3 * 9.81 * 0.5
    # Coordinates: windup and rotor; the link turns by their sum.
    mass = np.array([[link, link], [link, link + n2j]])
    stiffness = np.array([[400.0 + gravity, gravity], [gravity, 700.0 + gravity]])
    assert held == pytest.approx(undamped_modes(mass, stiffness)[0], rel=1e-6)
    stiff = _frequency(tmp_path, [DRIVE, {**rotor, "holding_stiffness": {"initial": 1e13}}])
    assert stiff[0] == pytest.approx(_frequency(tmp_path, [DRIVE])[0], rel=1e-5)


def test_base_compliance_is_a_rigid_body_on_springs(tmp_path: Path) -> None:
    found = _frequency(tmp_path, [{"kind": "base-compliance", "axes": ["tz"], "stiffness": {"initial": 1e6}}])
    assert found == pytest.approx([np.sqrt(1e6 / 53.0) / (2 * np.pi)], rel=1e-6)


def test_default_start_puts_each_coordinate_alone_at_twenty_hertz(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), [{"kind": "joint-compliance", "joints": [2]}])
    k = initial(parameters)[0]
    assert np.sqrt(k / model.mass[0, 0]) / (2 * np.pi) == pytest.approx(20.0)


def test_one_gear_ratio_per_joint() -> None:
    with pytest.raises(ValidationError, match="1 ratios for 2 joints"):
        parse_effect({"kind": "rotor-inertia", "joints": [1, 2], "gear_ratio": [100], "inertia": {"initial": 1e-3}})


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        ({"kind": "joint-compliance", "joints": [9]}, "unknown joint 9"),
        ({"kind": "joint-compliance", "stiffness": {"initial": [1e6, 2e6]}}, "2 values; expected one, or 6"),
        ({"kind": "joint-compliance", "stiffness": {"bounds": [1e6, 1e4]}}, "the smaller bound first"),
        ({"kind": "joint-compliance", "stiffness": {"initial": 1e9, "bounds": [1e4, 1e8]}}, "start value 1e"),
        ({"kind": "joint-compliance", "stiffness": {"bounds": [0, 1e8]}}, "scale is logarithmic"),
        ({"kind": "added-mass", "link": "link9"}, "unknown link 'link9'"),
        ({"kind": "rotor-inertia", "joints": [1], "gear_ratio": [100]}, "no `initial`"),
    ],
)
def test_faults_are_named(effect: dict[str, object], message: str, tmp_path: Path) -> None:
    effects = [effect] if effect["kind"] == "joint-compliance" else [{"kind": "joint-compliance"}, effect]
    with pytest.raises(InputError, match=message):
        system(arm(tmp_path), effects)
