"""Depth limits compensated for the reports' tests."""

from __future__ import annotations

import numpy as np

from identify.results.stability import DepthLimits, LimitChecks, StabilityResult, TipReceptance
from tests.reports.sample import frf_result


def stability_result() -> StabilityResult:
    """Seven speeds."""
    rpm = np.linspace(1000.0, 7000.0, 7)
    depth = np.array([1.1e-3, 1.25e-3, 1.5e-3, 1.3e-3, 2.125e-3, 2.75e-3, 3.5e-3])
    hz = np.linspace(0.0, 60.0, 61)
    peak = 1e-6 / (1 - (hz / 24.0) ** 2 + 0.08j * hz / 24.0)
    tip = peak[:, None, None] * (np.eye(3) + 0.25)
    chatter = np.array([24.5, 25.25, 26.0, 24.75, 25.5, 25.75, 25.0])
    return StabilityResult(
        name="made_up_cut",
        verdict=("The cut is stable up to 1.1 mm.", "Mode coupling begins from 4.2 mm."),
        notes=("the cut is linear",),
        seconds=3.5,
        provenance=frf_result(60, 4).provenance,
        model="fit.h5",
        tool="end mill",
        place="tip on link6",
        source="given with the tool",
        joints=("joint1", "joint2"),
        posture_deg=np.array([10.0, -35.0]),
        tip_m=np.array([1.25, 0.5, 0.75]),
        axes=np.eye(3),
        engagement_deg=np.array([0.0, 90.0]),
        cutting=np.array([6e8, 2e8, 0.0]),
        max_depth_m=0.02,
        draws=200,
        limits=DepthLimits(rpm, depth, 0.9 * depth, 1.125 * depth, chatter, 1.0625 * depth),
        checks=LimitChecks(rpm[::3], 1.0625 * depth[::3], 1.001 * depth[::3], depth[::3]),
        coupling=np.array([4.2e-3, 4.0e-3, 4.5e-3, 18.5]),
        feed_deg=np.arange(0.0, 360.0, 45.0),
        feed_depth_m=1e-3 * (1.5 + 0.5 * np.cos(np.arange(8.0))),
        mode_hz=np.array([11.5, 24.0]),
        mode_damping=np.array([0.03, 0.04]),
        tip=TipReceptance(hz, tip.astype(np.complex64), (0.05 * np.abs(tip)).astype(np.float32)),
    )
