"""A fitted model at any posture: modes, static compliance and FRFs of a point, with intervals.

The model is rebuilt from the result of a fit alone.  Intervals are by the delta method: exact sensitivities
at the fitted values times the covariance of the fit.  They say what the noise of the fitted data leaves open,
not what the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Index
from identify.core.thresholds import SIGMAS_95
from identify.model.frf import frf_and_gradient
from identify.model.modes import ComplexModes, complex_modes, frequency_and_damping_gradient
from identify.model.system import System
from identify.results.map import PostureRows
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel


@dataclass(frozen=True)
class Looked:
    """The model at one posture: its modes; tool position (3,), frequencies and damping with limits (3,
    modes), compliance (3, 3), receptance and half band (lines, 3, 3), as `PostureRows` keeps them; and at the
    peak of each direct receptance, along the base's axes, its slope (3, p) over it by the parameters.
    """

    modes: ComplexModes
    tool_m: Array
    frequency: Array
    damping: Array
    compliance: Array
    receptance: Complex
    band: Array
    peak_slope: Complex


def map_postures(
    model: FittedModel, tool: Point, names: Sequence[str], postures: Array, line_hz: Array, modes: int
) -> PostureRows:
    """The model at postures (n, joints), rad, for a point, at frequencies (lines,), with the first `modes`
    modes.
    """
    there = (look(model, model.system(one), tool, one, line_hz, modes) for one in postures)
    return rows_of(list(there), names, postures)


def rows_of(looked: Sequence[Looked], names: Sequence[str], postures: Array) -> PostureRows:
    """What a map keeps of postures (n, joints), rad."""
    receptance = np.array([one.receptance for one in looked])
    frequency, damping = (np.array([getattr(one, key) for one in looked]) for key in ("frequency", "damping"))
    return PostureRows(
        name=tuple(names),
        posture_deg=np.rad2deg(postures),
        tool_m=np.array([one.tool_m for one in looked]),
        frequency_hz=frequency[:, 0],
        frequency_low_95=frequency[:, 1],
        frequency_high_95=frequency[:, 2],
        damping_ratio=damping[:, 0],
        damping_low_95=damping[:, 1],
        damping_high_95=damping[:, 2],
        compliance_m_per_n=np.array([one.compliance for one in looked]),
        receptance_m_per_n=receptance.astype(np.complex64),
        band_95=np.array([one.band for one in looked]).astype(np.float32),
        peak_m_per_n=np.abs(receptance[:, :, range(3), range(3)]).max(axis=1, initial=0.0),
    )


def look(
    model: FittedModel, system: System, tool: Point, posture: Array, line_hz: Array, modes: int
) -> Looked:
    """The model at a posture (joints,), rad, at which the system is."""
    matrices, (factors, spread) = system.matrices(model.values), model.sensitivity(system, posture)
    number, found = len(spread), complex_modes(*matrices)
    d_frequency, d_damping = frequency_and_damping_gradient(found, factors, number)
    out = system.base_jacobian(tool.link, tool.position)
    s = np.asarray(2j * np.pi * line_hz, dtype=complex)
    h, gradient = frf_and_gradient(matrices, factors, s, out, out.T, 0, np.arange(number))
    return Looked(
        found,
        system.site.engine.position(tool.link, tool.position),
        _limits(found.frequency_hz, d_frequency @ spread, modes),
        _limits(found.damping_ratio, d_damping @ spread, modes),
        (out @ np.linalg.solve(matrices[2], out.T)).real,
        h,
        SIGMAS_95 * np.linalg.norm(gradient @ spread, axis=-1),
        _at_peaks(h, gradient[..., : len(model.values)]),
    )


def peak_lines(receptance: NDArray[np.complexfloating]) -> Index:
    """(..., 3): numbers of the lines at which direct receptances (..., lines, 3, 3) are largest, as far as a
    map keeps digits.
    """
    direct = receptance[..., range(3), range(3)].astype(np.complex64)
    return np.asarray(np.abs(direct).argmax(axis=-2), dtype=int)


def _at_peaks(h: Complex, gradient: Complex) -> Complex:
    """(3, p) from receptances (lines, 3, 3) and gradients (lines, 3, 3, p)."""
    if not len(h):
        return np.zeros((3, gradient.shape[-1]), dtype=complex)
    line, axis = peak_lines(h), np.arange(3)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(gradient[line, axis, axis] / h[line, axis, axis][:, None])


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
