"""Synthetic targets for tests of effects, costs and optimizers: data from the model itself, so that the truth
is known exactly.

Only for contracts (zero at the truth, gradients, bounds): what a fit is worth is tested on data of another
origin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.parameters import Parameter
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.measured.record_length import record_length
from identify.model.effects.base import Effect, parse_effect
from identify.model.modes import complex_modes
from identify.model.system import System, assemble, build_site, list_parameters
from identify.model.transient import Impact
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.vibration.costs.make_target import ModalTarget, Targets, frf_target
from identify.vibration.costs.target import FrfTarget
from tests.arms import arm, initial
from tests.robot.random_arm import random_posture

NODES = {1: ("link3", [0.0, 0.1, 0.2]), 2: ("link5", [0.1, 0.0, 0.1]), 3: ("link6", [0.0, 0.05, 0.15])}
POINTS = {
    node: Point(node, f"{link}_a", link, np.array(at), np.eye(3), f"points.csv line {node + 1}")
    for node, (link, at) in NODES.items()
}
IMPACT = Impact(180.0, 6.5e-3, 1.0)
CHANNELS = tuple(Channel(node, axis) for node in NODES for axis in (1, 2, 3))


def model(
    robot: Robot, effects: Sequence[Effect], seed: int = 1, detached: str | None = None
) -> tuple[System, list[Parameter]]:
    """The arm with effects and with measurement points, at a random posture; parameters are those of the
    whole arm.
    """
    posture = random_posture(seed)
    parameters = list_parameters(robot, build_site(robot, posture, effects, points=POINTS), effects)
    return assemble(robot, build_site(robot, posture, effects, detached, POINTS), effects), parameters


def predictor(
    system: System,
    lines: int = 60,
    band: tuple[float, float] = (3, 80),
    channels: tuple[Channel, ...] = CHANNELS,
) -> FrfTarget:
    """A target without data for these response channels and forces at the last point, with all that effects
    do to the measurement.
    """
    f, forces = np.linspace(*band, lines), CHANNELS[-3:]
    empty = FrfSet(
        f,
        np.zeros((lines, len(channels), 3), complex),
        channels,
        forces,
        "accelerance",
        window_decay_per_s=0.7,
    )
    return frf_target("synthetic", empty, system, POINTS, record=record_length(empty), impact=IMPACT)


def targets(
    folder: Path,
    effects: list[dict[str, Any]] | None = None,
    *,
    noise: float = 0.0,
    seed: int = 1,
    band: tuple[float, float] = (3, 80),
) -> tuple[Targets, list[Parameter]]:
    """FRFs of three points from forces at the last one, and the modes with shapes, both at the parameters'
    initial values.

    noise: standard deviation of the complex values over the RMS of each FRF.
    """
    parsed = [parse_effect(effect) for effect in effects or [{"kind": "joint-compliance"}]]
    system, parameters = model(arm(folder, seed), parsed, seed)
    values, empty = initial(parameters), predictor(system, band=band)
    h = empty.predict(values)
    level = np.sqrt(np.mean(np.abs(h) ** 2, axis=0)) * (noise or 0.01) / np.sqrt(2)
    rng = np.random.default_rng(seed)
    disturbed = h + (noise > 0) * level * (rng.normal(size=h.shape) + 1j * rng.normal(size=h.shape))
    frf = replace(
        empty, data=replace(empty.data, frf=disturbed), noise=np.broadcast_to(level, h.shape).copy()
    )
    modes, rows = complex_modes(*system.matrices(values)), empty.out[: len(CHANNELS)]
    table = ModalTable(modes.frequency_hz[:4], modes.damping_ratio[:4], CHANNELS, modes.shapes[:4] @ rows.T)
    return Targets((frf,), (ModalTarget("synthetic", table, system, rows),)), parameters
