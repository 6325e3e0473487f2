"""Joints identified from runs of their own, compensated for the reports' tests: a stiffness and a friction
curve.
"""

from __future__ import annotations

import numpy as np

from identify.results.file import LAYOUT
from identify.results.joints import CurveResult, JointsResult, JointValues, Panel, Series
from tests.reports.sample import frf_result


def joints_result() -> JointsResult:
    """Two curves, of which the second has a value that may be zero."""
    windup, speed = np.linspace(-1e-3, 1e-3, 21), np.linspace(0.02, 0.8, 30)
    torque, friction = 2e6 * windup + 3e11 * windup**3, 400 + 300 * speed
    stiffness = JointValues(
        name=("stiffness", "cubic_stiffness"),
        unit=("N m/rad", "N m/rad^3"),
        value=np.array([2.004e6, 2.95e11]),
        low_95=np.array([1.99e6, 2.7e11]),
        high_95=np.array([2.02e6, 3.2e11]),
        status=("determined", "determined"),
        expected=np.array([2.0e6, np.nan]),
        meaning=("A_1 of Eq. 8", "A_3 of Eq. 8"),
    )
    coulomb = JointValues(
        name=("coulomb", "offset"),
        unit=("N m", "N m"),
        value=np.array([401.5, -0.4]),
        low_95=np.array([399.0, -1.5]),
        high_95=np.array([404.0, 0.7]),
        status=("determined", "not told from zero"),
        expected=np.full(2, np.nan),
        meaning=("F_c of Eq. 11", "the same both ways"),
    )
    panels = (
        Panel(
            "windup",
            "rad",
            "torque",
            "N m",
            {"measured": Series("points", windup, torque + 5), "identified": Series("line", windup, torque)},
        ),
        Panel(
            "velocity",
            "rad/s",
            "friction",
            "N m",
            {"measured": Series("noisy", speed, friction), "identified": Series("line", speed, friction)},
        ),
    )
    rows = (
        ("joint1 stiffness", "stiffness-static", "rad", stiffness),
        ("joint1 friction", "friction-constant-velocity", "N m", coulomb),
    )
    curves = {
        title: CurveResult(
            title,
            kind,
            unit,
            1.5e-6,
            21,
            values,
            {"curve": panel},
            ("21 loads used.",),
            ("one load was left out",),
        )
        for (title, kind, unit, values), panel in zip(rows, panels, strict=True)
    }
    return JointsResult(
        layout=LAYOUT,
        kind="joints",
        name="made_up_joints",
        verdict=("joint1 stiffness: 2 of 2 values determined.", "joint1 friction: 1 of 2 values determined."),
        notes=("one load was left out",),
        seconds=1.5,
        curves=curves,
        provenance=frf_result(8, 2).provenance,
    )
