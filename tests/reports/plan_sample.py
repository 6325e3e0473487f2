"""A planned test compensated for the reports' tests."""

from __future__ import annotations

import numpy as np

from identify.results.plan import PlanResult, PromisedTable
from tests.reports.sample import frf_result


def plan_result() -> PlanResult:
    """Two postures, two impacts, three sensors, four parameters."""
    promised = np.array([0.011, 0.0125, 0.034, 0.05])
    return PlanResult(
        name="made_up_plan",
        verdict=("2 postures, 2 impacts and 3 sensors determine all parameters.",),
        notes=("the promise holds for the model",),
        seconds=1.5,
        provenance=frf_result(60, 4).provenance,
        criterion="all parameters (D-optimal)",
        joints=("joint1", "joint2"),
        posture_deg=np.array([[10.0, -35.5], [25.25, 40.0]]),
        impacts=("14:+X", "8:+Z"),
        sensors=np.array([8, 12, 14]),
        sensor_names=("link3_2", "link5_2", "link6_2"),
        sensor_links=("link3", "link5", "link6"),
        sensor_m=np.array([[0.25, 0.125, 0.5], [0.0, 0.1, 0.2], [0.3, 0.0, -0.25]]),
        sensor_axes=np.eye(3) * np.ones((3, 1, 1)),
        level=0.01 * np.arange(1.0, 13.0).reshape(2, 2, 3),
        noise_floor=0.003,
        band_hz=np.array([3.0, 80.0]),
        resolution_hz=0.625,
        candidates=np.array([40, 27, 9]),
        random_ratio=3.25,
        promised=PromisedTable(
            name=tuple(f"joint{n}.rz.{what}" for n in (1, 2) for what in ("stiffness", "damping")),
            unit=("N m/rad", "N m s/rad") * 2,
            value=np.array([2.0e6, 410.0, 1.5e6, 300.0]),
            now=5 * promised,
            promised=promised,
            random=2.5 * promised,
        ),
        study="schema: identify/1\nname: made_up_plan\n",
    )
