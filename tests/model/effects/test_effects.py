"""Compliances, rotors and hysteretic damping against physics by hand, and what is refused; the contract of
all is in test_contract.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from identify.core.errors import InputError
from identify.model.effects.base import EFFECTS, parse_effect
from identify.model.frf import frf, frf_by_solve
from identify.model.modes import complex_modes
from identify.model.system import build_site, list_parameters
from identify.robot.urdf import read_urdf
from tests.arms import arm, initial, system
from tests.model.effects.pendulum import DRIVE, PENDULUM, frequency, pendulum
from tests.model.undamped import undamped_modes
from tests.robot.random_arm import random_posture


def test_pendulum_with_a_spring_has_its_textbook_frequency(tmp_path: Path) -> None:
    inertia = 0.2 + 3 * 0.5**2
    expected = np.sqrt((400.0 + 3 * 9.81 * 0.5) / inertia) / (2 * np.pi)
    assert frequency(tmp_path, [DRIVE]) == pytest.approx([expected], rel=1e-6)


def test_rotor_behind_a_rigid_gear_adds_n_squared_j(tmp_path: Path) -> None:
    rotor = {
        "kind": "rotor-inertia",
        "joints": [1],
        "gear_ratio": [50],
        "inertia": {"initial": 1e-4, "bounds": [1e-6, 1]},
    }
    inertia = 0.2 + 3 * 0.5**2 + 50**2 * 1e-4
    expected = np.sqrt((400.0 + 3 * 9.81 * 0.5) / inertia) / (2 * np.pi)
    assert frequency(tmp_path, [DRIVE, rotor]) == pytest.approx([expected], rel=1e-6)


def test_held_rotor_is_a_second_spring_in_series(tmp_path: Path) -> None:
    rotor = {
        "kind": "rotor-inertia",
        "joints": [1],
        "gear_ratio": [50],
        "inertia": {"initial": 1e-4, "bounds": [1e-6, 1]},
    }
    held = frequency(tmp_path, [DRIVE, {**rotor, "holding_stiffness": {"initial": 700.0}}])
    link, n2j, gravity = 0.2 + 3 * 0.5**2, 50**2 * 1e-4, 3 * 9.81 * 0.5
    # Coordinates: windup and rotor; the link turns by their sum.
    mass = np.array([[link, link], [link, link + n2j]])
    stiffness = np.array([[400.0 + gravity, gravity], [gravity, 700.0 + gravity]])
    assert held == pytest.approx(undamped_modes(mass, stiffness)[0], rel=1e-6)
    stiff = frequency(tmp_path, [DRIVE, {**rotor, "holding_stiffness": {"initial": 1e13}}])
    assert stiff[0] == pytest.approx(frequency(tmp_path, [DRIVE])[0], rel=1e-5)


def test_hysteretic_damping_is_a_complex_stiffness(tmp_path: Path) -> None:
    model, values = pendulum(
        tmp_path, [DRIVE, {"kind": "hysteretic-damping", "loss_stiffness": {"initial": 20.0}}]
    )
    inertia, k, s = 0.2 + 3 * 0.5**2, 400.0 + 3 * 9.81 * 0.5, 0.7 + 2j * np.pi * np.linspace(0.5, 20, 30)
    h = frf(*model.matrices(values), s, np.ones((1, 1)), np.ones((1, 1)), 0)[:, 0, 0]
    assert h == pytest.approx(1 / (k + 20j + 1.0 * s + inertia * s**2), rel=1e-6)
    without_viscous = np.where(np.arange(3) == 1, 0.0, values)
    modes = complex_modes(*model.matrices(without_viscous))
    assert modes.eigenvalues == pytest.approx([1j * np.sqrt((k + 20j) / inertia)], rel=1e-6)
    assert modes.damping_ratio == pytest.approx([20 / k / 2], rel=2e-3), "half the loss factor"
    assert not np.iscomplexobj(pendulum(tmp_path, [DRIVE])[0].matrices(values[:2])[2]), (
        "real where there is none"
    )


def test_hysteretic_loss_does_not_grow_with_frequency_as_a_damper_s_does(tmp_path: Path) -> None:
    def ratio(kind: str, stiffness: float) -> float:
        drive = {
            "kind": "joint-compliance",
            "stiffness": {"initial": stiffness},
            "damping": {"initial": 1e-6, "bounds": [1e-9, 1e6]},
        }
        extra: dict[str, object] = {
            "kind": "hysteretic-damping",
            "loss_stiffness": {"initial": 0.02 * stiffness},
        }
        if kind == "viscous":
            drive["damping"], extra = (
                {"initial": 1.0},
                {"kind": "hysteretic-damping", "loss_stiffness": {"initial": 1e-9}},
            )
        model, values = pendulum(tmp_path, [drive, extra])
        return float(complex_modes(*model.matrices(values)).damping_ratio[0])

    assert ratio("hysteretic", 9e5) == pytest.approx(ratio("hysteretic", 1e5), rel=1e-3)
    assert ratio("viscous", 9e5) == pytest.approx(ratio("viscous", 1e5) / 3, rel=1e-3)


def test_frfs_with_hysteretic_damping_by_eigenvalues_and_by_solves(tmp_path: Path) -> None:
    effects = [
        {"kind": "joint-compliance", "axes": ["rz", "rx"]},
        {"kind": "hysteretic-damping", "axes": ["rz", "rx"]},
    ]
    model, parameters, _ = system(arm(tmp_path), effects)
    population = initial(parameters) * np.exp(
        0.2 * np.random.default_rng(0).normal(size=(3, len(parameters)))
    )
    s, out = 1.0 + 2j * np.pi * np.linspace(2, 80, 25), model.jacobian("link6", np.zeros(3))
    one, other = (route(*model.matrices(population), s, out, out.T, 2) for route in (frf, frf_by_solve))
    assert one == pytest.approx(other, rel=1e-8, abs=1e-9 * np.abs(other).max())


def test_base_compliance_is_a_rigid_body_on_springs(tmp_path: Path) -> None:
    found = frequency(tmp_path, [{"kind": "base-compliance", "axes": ["tz"], "stiffness": {"initial": 1e6}}])
    assert found == pytest.approx([np.sqrt(1e6 / 53.0) / (2 * np.pi)], rel=1e-6)


def test_default_start_puts_each_coordinate_alone_at_twenty_hertz(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), [{"kind": "joint-compliance", "joints": [2]}])
    k = initial(parameters)[0]
    assert np.sqrt(k / model.mass[0, 0]) / (2 * np.pi) == pytest.approx(20.0)


def test_one_gear_ratio_per_joint() -> None:
    with pytest.raises(ValidationError, match="1 ratios for 2 joints"):
        parse_effect(
            {"kind": "rotor-inertia", "joints": [1, 2], "gear_ratio": [100], "inertia": {"initial": 1e-3}}
        )


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
        ({"kind": "appended-resonator", "link": "link9", "axis": "x"}, "unknown link 'link9'"),
        ({"kind": "spring-to-ground", "link": "link9", "at_m": [0, 0, 0]}, "unknown link 'link9'"),
        ({"kind": "hysteretic-damping", "joints": ["elbow"]}, "unknown joint 'elbow'"),
        ({"kind": "link-flexibility", "link": "link9"}, "unknown link 'link9'"),
        ({"kind": "link-flexibility", "link": "link6"}, "link6 carries no further joint"),
    ],
)
def test_faults_are_named(effect: dict[str, object], message: str, tmp_path: Path) -> None:
    effects = [effect] if effect["kind"] == "joint-compliance" else [{"kind": "joint-compliance"}, effect]
    with pytest.raises(InputError, match=message):
        system(arm(tmp_path), effects)


def test_a_base_without_inertia_has_no_place_for_compliance(tmp_path: Path) -> None:
    path = tmp_path / "pendulum.urdf"
    nothing = PENDULUM.replace('<mass value="50"/>', '<mass value="0"/>').replace(
        'ixx="1" iyy="1" izz="1"', 'ixx="0" iyy="0" izz="0"'
    )
    path.write_text(nothing)
    robot = read_urdf(path)
    assert list(EFFECTS.get("base-compliance").instances(robot, {})) == []
    parsed = [parse_effect({"kind": "base-compliance"})]
    with pytest.raises(
        InputError, match=r"'base.rx' moves the base, which has no inertia; give the base link its mass"
    ):
        list_parameters(robot, build_site(robot, np.zeros(1), parsed), parsed)


def test_a_coordinate_that_never_existed_is_no_zero(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    site = build_site(robot, random_posture(1), [], "link4")
    assert not site.unit("joint5.rx").any()
    with pytest.raises(InputError, match=r"unknown coordinate 'joint9\.rx'"):
        site.unit("joint9.rx")
