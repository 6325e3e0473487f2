"""Effects of the measurement: each reading against another way to the same FRFs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.model.effects.base import parse_effect
from identify.model.system import System
from identify.robot.points import Point, read_points
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.make_target import Targets, frf_target
from identify.vibration.costs.target import FrfTarget
from tests.arms import arm, initial
from tests.targets import CHANNELS, POINTS, model, predictor, targets

DRIVE: dict[str, Any] = {"kind": "joint-compliance", "axes": ["rz", "rx"]}


def _system(folder: Path, *effects: dict[str, Any]) -> tuple[System, np.ndarray]:
    system, parameters = model(arm(folder), [parse_effect(effect) for effect in (DRIVE, *effects)])
    return system, initial(parameters)


def _frfs(folder: Path, *effects: dict[str, Any], channels: tuple[Channel, ...] = CHANNELS) -> np.ndarray:
    """(lines, channels, inputs) at the start values, with effects on top of compliant joints."""
    system, values = _system(folder, *effects)
    return predictor(system, lines=12, channels=channels).predict(values)


def _row(text: str) -> int:
    return CHANNELS.index(Channel.parse(text))


def test_delay_is_that_of_the_recorded_signal(tmp_path: Path) -> None:
    """A decaying tone, sampled finely, delayed and windowed, transformed by a plain sum."""
    system, values = _system(tmp_path, {"kind": "time-delay", "delay": {"initial": 0.004}})
    reading, numbers = predictor(system).readings[0]
    pole, s, delay = -3.0 + 2j * np.pi * 12, 0.7 + 2j * np.pi * np.array([4.0, 11.0, 25.0]), 0.004
    t = np.arange(0, 6, 2e-5) + 1e-5
    late = np.where(t > delay, np.exp(pole * (t - delay)), 0)
    recorded = np.array([np.sum(late * np.exp(-one * t)) * 2e-5 for one in s])
    read = reading.apply((1 / (s - pole))[:, None, None], values[numbers], s)[:, 0, 0]
    assert read == pytest.approx(recorded, rel=1e-4)


def test_a_late_response_under_a_window_of_another_decay(tmp_path: Path) -> None:
    """The delay acts at the decay that the window had, not at the stated one, in value and derivatives."""
    effects = (
        {"kind": "time-delay", "delay": {"initial": 0.004}},
        {"kind": "window-decay", "error": {"initial": 5.0}},
    )
    system, values = _system(tmp_path, *effects)
    target = predictor(system, lines=12)
    late, plain = target.predict(values), _frfs(tmp_path, effects[1])
    assert late / plain == pytest.approx(
        np.broadcast_to(np.exp(-(5.0 + target.data.s) * 0.004)[:, None, None], late.shape), rel=1e-9
    )
    number, step = len(values) - 1, 1e-5
    up, down = (target.predict(values + sign * step * np.eye(len(values))[number]) for sign in (1, -1))
    found = target.gradient(values, np.array([number]))[1][..., 0]
    assert found == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-9 * np.abs(found).max())


def test_delay_leaves_magnitudes_without_a_window_alone(tmp_path: Path) -> None:
    late, plain = _frfs(tmp_path, {"kind": "time-delay", "delay": {"initial": 1e-3}}), _frfs(tmp_path)
    ratio = late / plain
    f = np.linspace(3, 80, 12)
    assert ratio == pytest.approx(
        np.broadcast_to(np.exp(-(0.7 + 2j * np.pi * f) * 1e-3)[:, None, None], ratio.shape), rel=1e-9
    )


def test_window_error_is_another_decay_in_the_data(tmp_path: Path) -> None:
    wrong, values = _system(tmp_path, {"kind": "window-decay", "error": {"initial": 2.5}})
    right, right_values = _system(tmp_path)
    target = predictor(right, lines=12)
    stated = replace(target, data=replace(target.data, window_decay_per_s=0.7 + 2.5))
    found = predictor(wrong, lines=12).predict(values)
    assert found == pytest.approx(stated.predict(right_values), rel=1e-8)
    assert np.abs(found - target.predict(right_values)).max() > 0.05 * np.abs(found).max()


@pytest.mark.parametrize("name", ["2:+Y", "2:-Y", "link5_a:Y", "link5_a:-y"])
def test_gain_and_polarity_change_one_channel(name: str, tmp_path: Path) -> None:
    plain, row = _frfs(tmp_path), _row("2:+Y")
    factor = np.ones(9)
    for effect, size in (
        ({"kind": "channel-gain", "gain": {"initial": 1.3}}, 1.3),
        ({"kind": "channel-polarity"}, -1.0),
    ):
        factor[row] = size
        assert _frfs(tmp_path, {**effect, "channel": name}) == pytest.approx(
            plain * factor[:, None], rel=1e-12
        )


@pytest.mark.parametrize("name", [2, "2", "link5_a"])
def test_a_point_means_all_of_its_channels(name: str | int, tmp_path: Path) -> None:
    factor = np.where(np.isin(np.arange(9), (3, 4, 5)), -1.0, 1.0)
    assert _frfs(tmp_path, {"kind": "channel-polarity", "channel": name}) == pytest.approx(
        _frfs(tmp_path) * factor[:, None], rel=1e-12
    )


def test_channels_that_a_set_does_not_have_are_left_alone(tmp_path: Path) -> None:
    few = CHANNELS[:3]
    for effect in ({"kind": "channel-gain", "gain": {"initial": 3.0}}, {"kind": "channel-polarity"}):
        found = _frfs(tmp_path, {**effect, "channel": "2:+Y"}, channels=few)
        assert np.array_equal(found, _frfs(tmp_path, channels=few))


def test_swapped_axes_are_exchanged_with_their_signs(tmp_path: Path) -> None:
    swap = {"kind": "channel-swap", "point": "link5_a", "axes": ["x", "z"]}
    plain, swapped = _frfs(tmp_path), _frfs(tmp_path, swap)
    order = np.arange(9)
    order[[3, 5]] = 5, 3
    assert np.array_equal(swapped, plain[:, order])
    reversed_x = (*CHANNELS[:3], Channel(2, -1), *CHANNELS[4:])
    assert _frfs(tmp_path, swap, channels=reversed_x)[:, 3] == pytest.approx(-plain[:, 5])
    assert _frfs(tmp_path, swap, channels=reversed_x)[:, 5] == pytest.approx(plain[:, 3])


def test_a_swapped_or_turned_sensor_reads_what_was_not_recorded(tmp_path: Path) -> None:
    plain, only_x = _frfs(tmp_path), (*CHANNELS[:3], Channel(2, 1))
    swapped = _frfs(tmp_path, {"kind": "channel-swap", "point": 2, "axes": ["x", "y"]}, channels=only_x)
    assert swapped.shape == (12, 4, 3)
    assert swapped[:, 3] == pytest.approx(plain[:, 4], rel=1e-8)
    turned = _frfs(
        tmp_path,
        {"kind": "sensor-rotation", "point": 2, "axis": "z", "angle": {"initial": 0.4}},
        channels=only_x,
    )
    assert turned[:, 3] == pytest.approx(np.cos(0.4) * plain[:, 3] + np.sin(0.4) * plain[:, 4], rel=1e-8)
    assert turned[:, :3] == pytest.approx(plain[:, :3], rel=1e-8)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_turned_sensor_is_one_that_the_points_file_turns(axis: str, tmp_path: Path) -> None:
    turn = {"kind": "sensor-rotation", "point": 2, "axis": axis, "angle": {"initial": np.radians(25.0)}}
    angles = ",".join("25" if axis == one else "0" for one in "xyz")
    lines = ["node,name,link,x_m,y_m,z_m,rx_deg,ry_deg,rz_deg"]
    for point in POINTS.values():
        place = ",".join(map(str, point.position))
        lines.append(
            f"{point.node},{point.name},{point.link},{place},{angles if point.node == 2 else '0,0,0'}"
        )
    (tmp_path / "points.csv").write_text("\n".join(lines))
    system, values = _system(tmp_path)
    straight = predictor(system, lines=12)
    mounted = frf_target(
        "turned", straight.data, system, read_points(tmp_path / "points.csv"), record=straight.record
    )
    found, plain = _frfs(tmp_path, turn), _frfs(tmp_path)
    assert found == pytest.approx(mounted.predict(values), rel=1e-8, abs=1e-10 * np.abs(plain).max())
    assert np.abs(found - plain).max() > 0.1 * np.abs(plain[:, 3:6]).max()


def test_rotational_channels_turn_with_their_sensor(tmp_path: Path) -> None:
    rates = (*CHANNELS, Channel(2, 4), Channel(2, -5))
    turn = {"kind": "sensor-rotation", "point": 2, "axis": "z", "angle": {"initial": np.pi / 2}}
    plain, turned = _frfs(tmp_path, channels=rates), _frfs(tmp_path, turn, channels=rates)
    assert turned[:, 9] == pytest.approx(-plain[:, 10], rel=1e-8)
    assert turned[:, 10] == pytest.approx(plain[:, 9], rel=1e-8)


def test_effects_act_in_the_order_of_the_config(tmp_path: Path) -> None:
    swap, flip = (
        {"kind": "channel-swap", "point": 2, "axes": ["x", "y"]},
        {"kind": "channel-polarity", "channel": "2:+X"},
    )
    plain = _frfs(tmp_path)
    assert _frfs(tmp_path, swap, flip)[:, 3] == pytest.approx(-plain[:, 4])
    assert _frfs(tmp_path, flip, swap)[:, 4] == pytest.approx(-plain[:, 3])


def test_without_effects_of_the_measurement_nothing_is_done(tmp_path: Path) -> None:
    target: FrfTarget = predictor(_system(tmp_path)[0])
    assert target.readings == ()
    assert target.out.shape[0] == 9


def test_data_with_a_fault_fit_only_with_its_effect(tmp_path: Path) -> None:
    """Effects without parameters work in costs; the truth costs nothing with them and something without."""
    faults = [
        {"kind": "channel-polarity", "channel": "2:+Y"},
        {"kind": "time-delay", "delay": {"initial": 1e-3}},
    ]
    data, parameters = targets(tmp_path, [DRIVE, *faults])
    plain, _ = targets(tmp_path, [DRIVE])
    values = initial(parameters)
    blind = replace(plain.frf[0], data=data.frf[0].data, noise=data.frf[0].noise)
    cost = parse_cost("frf-least-squares")
    assert cost.objective(data).costs(values[None])[0] < 1e-6
    assert cost.objective(Targets(frf=(blind,))).costs(values[None, :-1])[0] > 1


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        (
            {"kind": "channel-polarity", "channel": "9:+X"},
            r"no measurement point '9'; expected .* 1 \(link3_a\)",
        ),
        ({"kind": "channel-gain", "channel": "elbow"}, "no measurement point 'elbow'"),
        ({"kind": "channel-gain", "channel": "2:W"}, "channel '2:W'"),
        (
            {"kind": "sensor-rotation", "point": 7, "axis": "x"},
            "effects.sensor-rotation.point: no measurement point 7",
        ),
    ],
)
def test_unknown_points_are_named(effect: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        _frfs(tmp_path, effect)


def test_two_points_of_one_name_need_the_node(tmp_path: Path) -> None:
    system, _ = _system(tmp_path, {"kind": "channel-polarity", "channel": "tip"})
    twins: dict[int, Point] = {node: replace(point, name="tip") for node, point in POINTS.items()}
    with pytest.raises(InputError, match="3 points are called 'tip'"):
        frf_target("twins", predictor(_system(tmp_path)[0]).data, system, twins)


def test_swapping_an_axis_with_itself_is_refused() -> None:
    with pytest.raises(ValidationError, match="two different axes"):
        parse_effect({"kind": "channel-swap", "point": 1, "axes": ["x", "x"]})
