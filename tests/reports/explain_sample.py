"""An explained motion compensated for the reports' tests: friction found in the torques of two joints."""

from __future__ import annotations

import dataclasses

import numpy as np

from identify.results.explain import (
    BoundTable,
    Curves,
    EffectTable,
    ExplainResult,
    StepTable,
    TargetResult,
    ValueTable,
)
from tests.reports.sample import frf_result


def explain_result() -> ExplainResult:
    """Two effects found, one bounded."""
    return ExplainResult(
        name="made_up_explained",
        verdict=(
            "Friction explains most of the torque.",
            "The rest is 1.2 times the noise.",
            "One effect was not found.",
        ),
        notes=("the records are short",),
        unknown=("the payload was not moved",),
        conditioning=("low-pass filtered at 20 Hz",),
        seconds=2.25,
        targets={"torque": _target()},
        provenance=dataclasses.replace(frf_result(10, 2).provenance, config="name: made_up_explained\n"),
    )


def _target() -> TargetResult:
    start = np.array([12.0, 8.0])
    return TargetResult(
        target="torque",
        unit="N m",
        joints=np.array([1, 2]),
        rms_fit_start=start,
        rms_fit=0.1 * start,
        rms_judge_start=1.1 * start,
        rms_judge=0.12 * start,
        noise=0.1 * start,
        tried=7,
        effects=EffectTable(
            name=("coulomb", "viscous"),
            kind=("coulomb-friction", "viscous-friction"),
            sentence=("Coulomb friction of all joints", "viscous friction of all joints"),
            evidence=np.array([412.0, 55.0]),
            chance=np.array([1e-9, 1e-4]),
            share=np.array([[0.9, 0.8], [0.3, np.nan]]),
            rivals=("", "Stribeck friction"),
            reading=("about 5 N m", "about 0.2 N m s/rad"),
        ),
        steps=StepTable(
            name=("coulomb", "viscous"),
            evidence=np.array([400.0, 55.0]),
            share=np.array([[0.8, 0.7], [0.5, 0.4]]),
            rms_fit=np.array([[4.0, 3.0], [1.2, 0.8]]),
            rms_judge=np.array([[4.2, 3.1], [1.4, 0.96]]),
        ),
        values=ValueTable(
            effect=("coulomb", "viscous"),
            name=("joint1.coulomb", "joint1.viscous"),
            unit=("N m", "N m s/rad"),
            value=np.array([5.125, 0.2125]),
            low_95=np.array([5.0, 0.19]),
            high_95=np.array([5.25, 0.235]),
            other=np.array([5.2, 0.21]),
            other_low_95=np.array([5.05, 0.18]),
            other_high_95=np.array([5.35, 0.24]),
            at_edge=np.array([False, True]),
        ),
        bounds=BoundTable(("backlash",), ("rad",), np.array([1e-5]), np.array([-1e-5]), np.array([3e-5])),
        curves={name: _curves(name, use) for name, use in (("a", "fit"), ("b", "validate"))},
    )


def _curves(name: str, use: str) -> Curves:
    t = np.linspace(0, 2, 201)
    known = np.stack([40 * np.cos(2 * np.pi * t), 15 * np.sin(4 * np.pi * t)], axis=1)
    explained = known + 5.0 * np.sign(np.sin(2 * np.pi * t))[:, None]
    return Curves(
        name,
        use,
        t,
        explained + 0.1 * np.sin(50 * t)[:, None],
        known,
        explained,
        np.ones(known.shape, dtype=bool),
    )
