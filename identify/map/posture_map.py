"""A fitted model at any posture: modes, static compliance and FRFs of a point, with intervals.

The model is rebuilt from the result of a fit alone.  Intervals are by the delta method: exact sensitivities
at the fitted values times the covariance of the fit.  They say what the noise of the fitted data leaves open,
not what the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.thresholds import SIGMAS_95
from identify.model.frf import frf_and_gradient
from identify.model.modes import complex_modes, frequency_and_damping_gradient
from identify.model.system import System
from identify.results.map import PostureRows
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel


def map_postures(
    model: FittedModel,
    tool: Point,
    names: Sequence[str],
    postures: Array,
    line_hz: Array,
    modes: int,
    systems: Sequence[System] = (),
) -> PostureRows:
    """The model at postures (n, joints), rad, for a point, at frequencies (lines,), with the first `modes`
    modes; systems: at these postures, where they are known.
    """
    there = systems or map(model.system, postures)
    rows = [
        _at(model, system, tool, posture, line_hz, modes)
        for system, posture in zip(there, postures, strict=True)
    ]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    tool_m, frequency, damping, compliance, receptance, band = columns
    return PostureRows(
        name=tuple(names),
        posture_deg=np.rad2deg(postures),
        tool_m=tool_m,
        frequency_hz=frequency[:, 0],
        frequency_low_95=frequency[:, 1],
        frequency_high_95=frequency[:, 2],
        damping_ratio=damping[:, 0],
        damping_low_95=damping[:, 1],
        damping_high_95=damping[:, 2],
        compliance_m_per_n=compliance,
        receptance_m_per_n=receptance.astype(np.complex64),
        band_95=band.astype(np.float32),
        peak_m_per_n=np.abs(receptance[:, :, range(3), range(3)]).max(axis=1, initial=0.0),
    )


def _at(
    model: FittedModel, system: System, tool: Point, posture: Array, line_hz: Array, modes: int
) -> tuple[NDArray[Any], ...]:
    """Tool position (3,), frequencies and damping with limits (3, modes), compliance (3, 3), receptance and
    half band (lines, 3, 3).
    """
    matrices, (factors, spread) = system.matrices(model.values), model.sensitivity(system, posture)
    number, found = len(spread), complex_modes(*matrices)
    d_frequency, d_damping = frequency_and_damping_gradient(found, factors, number)
    out = system.base_jacobian(tool.link, tool.position)
    s = np.asarray(2j * np.pi * line_hz, dtype=complex)
    h, gradient = frf_and_gradient(matrices, factors, s, out, out.T, 0, np.arange(number))
    return (
        system.site.engine.position(tool.link, tool.position),
        _limits(found.frequency_hz, d_frequency @ spread, modes),
        _limits(found.damping_ratio, d_damping @ spread, modes),
        (out @ np.linalg.solve(matrices[2], out.T)).real,
        h,
        SIGMAS_95 * np.linalg.norm(gradient @ spread, axis=-1),
    )


def _limits(values: Array, change: Array, count: int) -> Array:
    """(3, count): values (m,) and their 95 % limits, on a logarithmic scale as they are positive; change (m,
    f); NaN beyond m.
    """
    table = np.full((3, count), np.nan)
    shown = min(count, len(values))
    values = values[:shown]
    reach = SIGMAS_95 * np.linalg.norm(change[:shown], axis=1) / np.abs(values)
    with np.errstate(over="ignore"):
        table[:, :shown] = values, values * np.exp(-reach), values * np.exp(reach)
    return table
