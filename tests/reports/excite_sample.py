"""A motion that excites, compensated for the reports' tests."""

from __future__ import annotations

import numpy as np

from identify.results.excite import ExcitedTable, ExciteResult
from tests.reports.sample import frf_result


def excite_result() -> ExciteResult:
    """Two joints, of which the second stands; three parameters."""
    time_s = np.arange(200) / 20.0
    wave = 2 * np.pi * time_s / 10
    position, velocity, acceleration = (
        np.stack([values, np.full(200, constant)], axis=1)
        for values, constant in (
            (0.5 * np.sin(wave), 0.25),
            (0.5 * 0.628 * np.cos(wave), 0.0),
            (-0.5 * 0.395 * np.sin(wave), 0.0),
        )
    )
    promised = np.array([0.0125, 2.5, 0.75])
    return ExciteResult(
        name="made_up_motion",
        verdict=("4 periods of 10 s determine 2 values of friction.",),
        notes=("run it slowly first",),
        seconds=1.5,
        provenance=frf_result(60, 4).provenance,
        target="friction",
        joints=("joint1", "joint2"),
        time_s=time_s,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        limits=np.array([[-1.0, -1.5], [1.0, 1.5], [1.0, 1.0], [2.0, 2.0], [1.0, 0.0]]),
        centre=np.array([0.0, 0.25]),
        sine=np.array([[0.5, 0.0], [0.0, 0.0]]),
        cosine=np.zeros((2, 2)),
        period_s=10.0,
        periods=4,
        draws=40,
        room_m=0.125,
        random_ratio=3.25,
        come_true=0.95,
        promised=ExcitedTable(
            name=("link1.zz", "joint1.fc", "joint1.fv"),
            unit=("kg m^2", "N m", "N m s/rad"),
            expected=np.array([2.5, 350.0, 120.0]),
            promised=promised,
            random=3 * promised,
            scatter=0.9 * promised,
            error=0.125 * promised,
            held=np.array([0.95, 0.925, 0.975]),
            kept=np.array([0.95, 0.9, 1.0]),
            wanted=np.array([0, 1, 1]),
        ),
    )
