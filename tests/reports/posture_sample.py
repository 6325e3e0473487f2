"""Results over many postures compensated for the reports' tests: a batch of fits, one of which failed, and a
map of a model.
"""

from __future__ import annotations

import numpy as np

from identify.results.batch import (
    BatchResult,
    DependenceTable,
    JobTable,
    ModesByPosture,
    ParametersByPosture,
    PopulationTable,
)
from identify.results.file import LAYOUT
from identify.results.map import (
    CorrectionRows,
    Learnt,
    LeftOutTable,
    MapResult,
    PostureRows,
    ProcessTable,
)
from tests.reports.sample import frf_result

_FITS = 6
_FAILED = 4
HZ = np.array([11.5, 24.25, 52.125])


def _postures() -> tuple[np.ndarray, np.ndarray]:
    q = np.stack(
        [np.linspace(-60, 60, _FITS), np.linspace(20, 70, _FITS)[::-1], 15.0 * np.arange(_FITS) % 40], axis=1
    )
    a, b = np.radians(q[:, 0]), np.radians(q[:, 1])
    reach = 0.8 + 0.9 * np.cos(b)
    return q, np.stack([reach * np.cos(a), reach * np.sin(a), 0.6 + 0.9 * np.sin(b)], axis=1)


def batch_result() -> BatchResult:
    """Two parameters, of which the second follows joint 2."""
    ok = np.arange(_FITS) != _FAILED
    known = np.where(ok, 1.0, np.nan)
    q, tool = _postures()
    wave = 1 + 0.1 * np.sin(np.radians(q[:, 1]))
    value = np.stack([2.0e6 * known, 410.0 * wave * known], axis=1)
    names = tuple(f"posture{i + 1}" for i in range(_FITS))
    return BatchResult(
        layout=LAYOUT,
        kind="batch",
        name="made_up_batch",
        verdict=(
            "5 of 6 fits succeeded.",
            "One parameter depends on the posture.",
            "The gap is 1.02 to 1.10.",
        ),
        notes=("the fit of posture5 failed",),
        workers="2 local processes",
        seconds=12.5,
        joint_file="joint.h5",
        joint_gap=1.31,
        jobs=JobTable(
            name=names,
            state=tuple("done" if fine else "failed" for fine in ok),
            error=tuple("" if fine else "posture5.uff: cannot be read" for fine in ok),
            file=tuple(f"{name}.h5" for name in names),
            attempts=np.ones(_FITS, dtype=int),
            seconds=2.0 * known,
            converged=ok,
            gap=np.linspace(1.02, 1.10, _FITS) * known,
            cost=np.linspace(1.02, 1.10, _FITS) * known,
            relative_error=0.02 * known,
            posture_deg=q,
            tool_m=tool,
        ),
        parameters=ParametersByPosture(
            name=("joint1.rz.stiffness", "joint1.rz.damping"),
            unit=("N m/rad", "N m s/rad"),
            log=np.array([True, True]),
            value=value,
            std=np.full((_FITS, 2), 0.01) * known[:, None],
            low_95=value * 0.98,
            high_95=value * 1.02,
            usable=np.stack([ok, ok], axis=1),
            joint_value=np.array([2.0e6, 415.0]),
            joint_low_95=np.array([1.99e6, 411.0]),
            joint_high_95=np.array([2.01e6, 419.0]),
        ),
        modes=ModesByPosture(
            frequency_hz=np.outer(wave * known, HZ),
            damping_ratio=np.full((_FITS, 3), 0.04) * known[:, None],
            measured_frequency_hz=np.outer(1.01 * wave * known, HZ),
            measured_damping_ratio=np.full((_FITS, 3), 0.041) * known[:, None],
        ),
        dependence=DependenceTable(
            parameter=("joint1.rz.stiffness", "joint1.rz.damping"),
            count=np.array([5, 5]),
            mean=np.array([2.0e6, 431.5]),
            mean_low_95=np.array([1.98e6, 427.0]),
            mean_high_95=np.array([2.02e6, 436.0]),
            chi_square=np.array([3.2, 61.0]),
            freedom=np.array([4, 4]),
            p_value=np.array([0.53, 1e-11]),
            scatter=np.array([0.0, 0.04]),
            trend_joint=np.array([0, 2]),
            slope_per_rad=np.array([np.nan, 0.11]),
            slope_std=np.array([np.nan, 0.01]),
            slope_p_value=np.array([np.nan, 1e-9]),
            depends=np.array([False, True]),
        ),
        population=PopulationTable(
            parameter=("joint1.rz.stiffness", "joint1.rz.damping"),
            log=np.array([True, True]),
            shared=np.array([True, False]),
            count=np.array([5, 5]),
            mean=np.array([2.0e6, 431.0]),
            mean_low_95=np.array([1.98e6, 410.0]),
            mean_high_95=np.array([2.02e6, 452.0]),
            scatter=np.array([np.nan, 0.04]),
            scatter_low_95=np.array([np.nan, 0.023]),
            scatter_high_95=np.array([np.nan, 0.12]),
            p_value=np.array([0.53, 1e-11]),
            differs=np.array([False, True]),
            value=value * 1.001,
            low_95=value * 0.985,
            high_95=value * 1.015,
            common=0,
        ),
        provenance=frf_result(10, 2).provenance,
    )


def _correction(rows: PostureRows) -> tuple[CorrectionRows, Learnt]:
    """Modes 3 % higher and better damped, peaks lower; known of the first postures alone."""
    known = np.repeat(np.linspace(1, 0, _FITS)[:, None], 3, axis=1)

    def around(values: np.ndarray, factor: float) -> list[np.ndarray]:
        wide = 1.02 + 0.2 * (1 - known)
        return [values * factor, values * factor / wide, values * factor * wide, known]

    sides = around(rows.frequency_hz, 1.03), around(rows.damping_ratio, 1.2), around(rows.peak_m_per_n, 0.9)
    processes = ProcessTable(
        quantity=("frequency", "damping", "peak"),
        numbers=np.array([12, 12, 9]),
        postures=np.array([4, 4, 3]),
        log_odds=np.array([6.2, 2.5, -0.8]),
        amplitude=np.array([0.03, 0.2, np.nan]),
        length_deg=np.array([80.0, 140.0, np.nan]),
        shared=np.array([0.85, 0.7, 0.5]),
        scatter=np.array([0.002, 0.03, 0.1]),
    )
    left = LeftOutTable(
        measurement=("q1", "q1", "q1"),
        quantity=("frequency", "damping", "peak"),
        item=np.array([1, 1, 3]),
        measured=np.array([11.9, 0.048, 2e-6]),
        model=np.array([11.5, 0.04, 2.5e-6]),
        corrected=np.array([11.85, 0.047, 2.2e-6]),
        low_95=np.array([11.6, 0.043, 1.5e-6]),
        high_95=np.array([12.1, 0.051, 3.3e-6]),
    )
    return CorrectionRows(*(one for four in sides for one in four)), Learnt(processes, left, ("other.h5",))


def map_result() -> MapResult:
    """Three modes, forty lines, corrected by measured postures."""
    q, tool = _postures()
    hz = np.outer(1 + 0.1 * np.sin(np.radians(q[:, 1])), HZ)
    lines = np.linspace(5, 60, 40)
    s = 2j * np.pi * lines
    w = 2 * np.pi * hz[:, None, :]
    each = (1e-2 / (w**2 + 0.08 * w * s[None, :, None] + s[None, :, None] ** 2)).sum(axis=2)
    receptance = (each[:, :, None, None] * (np.eye(3) + 0.1)).astype(np.complex64)
    still = (1e-2 / (2 * np.pi * hz) ** 2).sum(axis=1)[:, None, None] * (np.eye(3) + 0.1)
    rows = PostureRows(
        name=tuple(f"q{i + 1}" for i in range(_FITS)),
        posture_deg=q,
        tool_m=tool,
        frequency_hz=hz,
        frequency_low_95=0.99 * hz,
        frequency_high_95=1.01 * hz,
        damping_ratio=np.full((_FITS, 3), 0.04),
        damping_low_95=np.full((_FITS, 3), 0.039),
        damping_high_95=np.full((_FITS, 3), 0.041),
        compliance_m_per_n=still,
        receptance_m_per_n=receptance,
        band_95=(0.05 * np.abs(receptance)).astype(np.float32),
        peak_m_per_n=np.abs(receptance[:, :, [0, 1, 2], [0, 1, 2]]).max(axis=1).astype(float),
    )
    correction, learnt = _correction(rows)
    return MapResult(
        layout=LAYOUT,
        kind="map",
        name="made_up_map",
        verdict=(
            "The first mode is between 11.5 and 12.6 Hz.",
            "The tool is softest at posture3.",
            "Six postures were computed.",
        ),
        notes=(),
        seconds=0.75,
        workers="this process",
        model="made_up_arm.h5",
        tool="6 flange",
        joints=("joint1", "joint2", "joint3"),
        line_hz=lines,
        rows=rows,
        correction=correction,
        learnt=learnt,
        provenance=frf_result(10, 2).provenance,
    )
