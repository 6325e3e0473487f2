"""Intervals hold the truth about as often as they say, for every kind of curve, on runs of a simulator that
shares no code.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.joints.base import parse_curve
from tests.generator import joint_runs
from tests.joints.memory import bench, covered, noisy, value

JOINT2, JOINT3 = joint_runs.JOINTS[1], joint_runs.JOINTS[2]
FRICTION = {name: getattr(JOINT2, name) for name in ("coulomb", "viscous", "stribeck", "stribeck_velocity")}
SEEDS = range(20)


@pytest.fixture(scope="module")
def second() -> Any:
    """Noise-free runs of joint 2."""
    return joint_runs.clean_runs([f"speed{n:02d}" for n in range(1, 12)] + ["slow"])


@pytest.fixture(scope="module")
def third() -> Any:
    """Noise-free runs of joint 3."""
    return joint_runs.clean_runs(["sine1", "sine2"])


def test_friction_from_constant_velocities(second: Any) -> None:
    files = [name for name in second if name != "slow"]
    curve = parse_curve({"kind": "friction-constant-velocity", "joint": 2, "files": files})
    found = [curve.identify(bench(noisy(second, seed))) for seed in SEEDS]
    assert covered(found, FRICTION) > 0.85
    assert covered(found, FRICTION, shrink=0.1) < 0.6
    assert all(value(one, "coulomb")[3] == "determined" for one in found)


def test_slow_velocities_are_needed_for_stribeck(second: Any) -> None:
    files = [f"speed{n:02d}" for n in range(6, 12)]
    curve = parse_curve({"kind": "friction-constant-velocity", "joint": 2, "files": files})
    found = curve.identify(bench(noisy(second, 1)))
    assert value(found, "stribeck_velocity")[3] == "not determined"
    assert value(found, "stribeck")[3] in ("not told from zero", "not determined")


def test_transmission_error(second: Any) -> None:
    curve = parse_curve({"kind": "transmission-error", "joint": 2, "files": ["slow"], "orders": [1, 2]})
    found = [curve.identify(bench(noisy(second, seed))) for seed in SEEDS]
    truth = {
        f"{what}.{n}": wave[k]
        for n, wave in enumerate(JOINT2.error, 1)
        for k, what in ((1, "amplitude"), (2, "phase"))
    }
    assert covered(found, truth) > 0.85
    assert covered(found, truth, shrink=0.3) < 0.75


def test_orders_are_found_and_no_others(second: Any) -> None:
    curve = parse_curve({"kind": "transmission-error", "joint": 2, "files": ["slow"]})
    found = curve.identify(bench(noisy(second, 3)))
    orders = [value(found, name)[0] for name in found.values.name if name.startswith("order")]
    assert orders == [1.0, 2.0]


def test_noise_alone_has_no_order(second: Any) -> None:
    joint, signals = second["slow"]
    plain = {"slow": (joint, {**signals, "link_rad": signals["motor_rad"]})}
    found = parse_curve({"kind": "transmission-error", "joint": 2, "files": ["slow"]}).identify(
        bench(noisy(plain, 4))
    )
    assert found.values.name == ()
    assert found.notes


def test_friction_from_sinusoidal_motion(third: Any) -> None:
    curve = parse_curve({"kind": "friction-sinusoidal", "joint": 3, "files": ["sine1", "sine2"]})
    found = [curve.identify(bench(noisy(third, seed))) for seed in SEEDS]
    truth = {"coulomb": JOINT3.coulomb, "viscous": JOINT3.viscous}
    assert covered(found, truth) > 0.85
    assert covered(found, truth, shrink=0.2) < 0.75


def test_stiffness_from_static_loads(tmp_path: Path) -> None:
    found = []
    clean = joint_runs.static_loads()
    for seed in SEEDS:
        rng = np.random.default_rng([13, seed])
        read = {
            k: v + rng.normal(scale=joint_runs.LINK_NOISE, size=v.shape) if "link" in k else v
            for k, v in clean.items()
        }
        joint_runs.write(tmp_path / "loads.csv", read, time=False)
        curve = parse_curve(
            {
                "kind": "stiffness-static",
                "joint": 2,
                "files": ["loads.csv"],
                "torque": {"at": "joint2.torque_N_m", "unit": "N m"},
            }
        )
        found.append(curve.identify(bench(folder=tmp_path)))
    truth = {
        "stiffness": JOINT2.stiffness,
        "cubic_stiffness": JOINT2.cubic,
        "hysteresis_width": joint_runs.HYSTERESIS_N_M,
        "zero": 0.0,
    }
    assert covered(found, truth) > 0.85
    assert covered(found, truth, shrink=0.3) < 0.75
