"""Deflections compensated for the reports' tests."""

from __future__ import annotations

import numpy as np

from identify.results.deflection import DeflectionResult, DeflectionRows, DynamicDeflection
from tests.reports.sample import frf_result


def deflection_result() -> DeflectionResult:
    """A path of four places."""
    k = np.arange(4.0)[:, None]
    moved = 1e-4 * np.array([1.25, -0.5, 0.25]) * (1 + 0.5 * k)
    tip = np.array([1.5, 0.25, 0.75]) + 0.1 * k
    hz = np.linspace(0.0, 60.0, 61)
    amplitude = np.abs(1 / (1 - (hz / 24.0) ** 2 + 0.08j * hz / 24.0))[:, None] * np.array(
        [1.25e-4, 5e-5, 2.5e-5]
    )
    principal = np.array([2.5e-6, 1.25e-6, 5e-7]) * np.ones((4, 1))
    posture = np.array([10.0, -35.0]) + 5 * k
    size = np.linalg.norm(moved, axis=1)
    return DeflectionResult(
        name="made_up_path",
        verdict=("A force of 112 N moves the tip by 343 µm.",),
        notes=("stiffness is that of small vibration",),
        seconds=0.5,
        provenance=frf_result(60, 4).provenance,
        model="fit.h5",
        place="tip on link6",
        joints=("joint1", "joint2"),
        draws=400,
        rows=DeflectionRows(
            name=tuple(f"line{n}" for n in range(2, 6)),
            posture_deg=posture,
            tip_m=tip,
            force_n=np.array([100.0, 0.0, -50.0]) * np.ones((4, 1)),
            deflection_m=moved,
            low_95=moved - 1e-5,
            high_95=moved + 1e-5,
            size_m=size,
            size_low_95=0.9 * size,
            size_high_95=1.1 * size,
            compliance=principal,
            compliance_low_95=0.9 * principal,
            compliance_high_95=1.1 * principal,
            directions=np.eye(3) * np.ones((4, 1, 1)),
            target_m=tip - moved,
            target_deg=posture + 0.01,
        ),
        dynamic=DynamicDeflection(hz, amplitude, 0.05 * amplitude),
    )
