"""What `check` says of recorded motion: each finding on a record made to have it, and none on a sound one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identify.core.arrays import Array
from identify.measured.finding import STUDY, Finding
from identify.measured.quality_records import check_records
from identify.measured.records import MotionRecord

TIME = np.linspace(0, 2, 401)
LIMITS = np.radians([[-60.0, -60.0], [60.0, 60.0]])
Change = Callable[[dict[str, Array]], None]


def record(change: Change = lambda signals: None) -> MotionRecord:
    """Two joints that swing by 20 degrees, with a little noise; joint 2 has no link encoder."""
    rng, swing = np.random.default_rng(1), np.radians(20.0)
    position = swing * np.sin(2 * np.pi * TIME[:, None] * [1.0, 1.5])
    velocity = 2 * np.pi * swing * np.cos(2 * np.pi * TIME[:, None] * [1.0, 1.5]) * [1.0, 1.5]
    link = position.copy()
    link[:, 1] = np.nan
    signals = {
        "motor_position": position,
        "motor_velocity": velocity,
        "link_position": link,
        "motor_torque": 100 * velocity,
    }
    noisy = {name: values + 1e-4 * rng.normal(size=values.shape) for name, values in signals.items()}
    change(noisy)
    return MotionRecord("swing", 200.0, TIME, noisy, "swing.csv", "1")


def scaled(name: str, factor: float) -> Change:
    return lambda signals: signals.update({name: factor * signals[name]})


def dead_torque(signals: dict[str, Array]) -> None:
    signals["motor_torque"][:, 1] = 0.0


def in_degrees(signals: dict[str, Array]) -> None:
    """Angles, as if all were read in degrees and said to be rad, where nothing else is recorded."""
    for name in ("motor_velocity", "link_position", "motor_torque"):
        del signals[name]
    signals["motor_position"] = 7.5 * np.degrees(signals["motor_position"])


def gap(signals: dict[str, Array]) -> None:
    signals["motor_torque"][7:9, 0] = np.nan


def checks(found: list[Finding]) -> dict[str, str]:
    return {one.check: one.level for one in found if one.check != "record"}


def test_a_sound_record_has_no_finding() -> None:
    found = check_records([record()], LIMITS)
    assert not found[STUDY] and not checks(found["swing"])
    assert "401 samples, 2 s at 200 Hz" in found["swing"][-1].sentence
    assert "link_position of joint 1." not in found["swing"][-1].sentence, "the torque is behind it"


@pytest.mark.parametrize(
    ("change", "check", "level", "said"),
    [
        (
            gap,
            "not-a-number",
            "fail",
            "motor_torque of joint 1 is no number at 2 of 401 samples, the first at 0.035",
        ),
        (in_degrees, "many-turns", "warn", "motor_position of joints 1 and 2 goes to 23.9 turns"),
        (dead_torque, "never-changes", "warn", "motor_torque of joint 2 never changes"),
        (scaled("motor_velocity", 57.3), "slope", "warn", "motor_velocity of joint 1 times 0.0174 is"),
        (scaled("motor_velocity", -1.0), "slope", "warn", "times -1 is the positions' own"),
        (
            scaled("link_position", 12.0),
            "slope",
            "warn",
            "link_position of joint 1 times 0.0833 is motor_position",
        ),
    ],
)
def test_what_is_wrong_with_a_record_is_named(change: Change, check: str, level: str, said: str) -> None:
    found = check_records([record(change)])["swing"]
    assert checks(found) == {check: level}
    assert any(said in one.sentence for one in found), found


def test_joints_beyond_their_limits_are_named_where_limits_are_known() -> None:
    assert checks(check_records([record()], LIMITS / 6)["swing"]) == {"joint-limit": "warn"}
    assert not checks(check_records([record()], None)["swing"])


def test_joints_that_are_not_in_use_are_not_looked_at() -> None:
    assert not checks(check_records([record(dead_torque)], joints=[0])["swing"])


def test_one_record_under_two_names_fails() -> None:
    found = check_records([record(), replace(record(), name="other")])
    assert checks(found[STUDY]) == {"duplicate-data": "fail"}
