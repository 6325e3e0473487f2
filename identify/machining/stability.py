"""Depth limits of a cut on a fitted model at one posture, with the bands that fit, cut and posture leave."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.interruption import check
from identify.machining.engagement import Engagement
from identify.machining.lobes import Limits, inverse_eigenvalues, mode_coupling, zeroth_order
from identify.machining.multi_frequency import multi_frequency
from identify.machining.semi_discretization import TimeDomain
from identify.machining.structure import Structure
from identify.machining.tool import Tool
from identify.model.frf import frf_by_solve
from identify.model.modes import complex_modes
from identify.results.stability import DepthLimits, LimitChecks
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel

_SEED = 1
_EVERY, _FEEDS = 6, 24
_FINE, _COARSE = 1600, 300
"""Lines between the modes, of the limits themselves and of their draws."""
_PART = 25
"""Draws computed together; every sixth speed is checked by another method."""
_BAND = (2.5, 97.5)


@dataclass(frozen=True)
class Mounted:
    """A tool on a fitted model at a posture (joints,), rad, with its axes (3, 3), as `Tool.axes` has them."""

    model: FittedModel
    tool: Tool
    where: str
    point: Point
    posture: Array
    axes: Array
    tip_m: Array
    speeds: int
    draws: int

    @property
    def rpm(self) -> Array:
        """Spindle speeds (speeds,), evenly in the logarithm."""
        return np.geomspace(*self.tool.spindle_rpm, self.speeds)

    @property
    def cut(self) -> Engagement:
        """The teeth in their cut."""
        entry, leave = self.tool.engagement
        lag = np.tan(np.radians(self.tool.helix_deg)) / self.tool.radius
        lead = float(np.radians(self.tool.lead_angle_deg))
        return Engagement(self.tool.teeth, entry, leave, lead, self.tool.cutting(self.where), float(lag))

    @cached_property
    def here(self) -> Structure:
        """The structure at the fitted values, at its own posture."""
        return self.structure(self.model.values)

    def structure(self, values: Array, posture: Array | None = None) -> Structure:
        """The structure at parameters (..., p), and at another posture than its own."""
        system = self.model.system(self.posture if posture is None else posture)
        out = self.axes @ system.base_jacobian(self.point.link, self.point.position)
        return Structure(*system.matrices(values), out).with_modes(self.tool.modes)

    def drawn(self, count: int) -> Iterator[tuple[Structure, Array]]:
        """Structures drawn from what is uncertain, some at a time, with factors (draws,) of the cutting
        coefficients.
        """
        rng = np.random.default_rng(_SEED)
        values = self.model.draws(count, rng)
        unsure = self.tool.uncertainty
        factors = np.exp(unsure.coefficients * rng.standard_normal(count))
        turned = np.radians(unsure.posture_deg) * rng.standard_normal((count, len(self.posture)))
        size = _PART if unsure.posture_deg == 0 else 1
        for first in range(0, count, size):
            check()
            part = slice(first, first + size)
            posture = None if size > 1 else self.posture + turned[first]
            yield self.structure(values[part], posture), factors[part]


def mounted(
    model: FittedModel, tool: Tool, posture: Array, where: str, speeds: int = 61, draws: int = 200
) -> Mounted:
    """The tool on the model; InputError where it does not fit the robot."""
    point = tool.point(model, where)
    engine = model.system(posture).site.engine
    axes = tool.axes(engine.axes(point.link), where=where)
    tip_m = engine.position(point.link, point.position)
    return Mounted(model, tool, where, point, posture, axes, tip_m, speeds, draws)


def nominal(on: Mounted) -> tuple[Limits, Limits]:
    """The limits at all speeds, and that of mode coupling, at the fitted values."""
    structure, cut = on.here, on.cut
    line_hz = structure.lines_hz(_FINE)
    inverse = inverse_eigenvalues(cut.mean, structure.receptance(line_hz))
    return zeroth_order(inverse, line_hz, cut.teeth, on.rpm), mode_coupling(inverse, line_hz)


def relative_bands(on: Mounted) -> tuple[tuple[Array, Array], tuple[float, float]]:
    """95 % limits of the depth limit at all speeds, and of that of mode coupling, each over the value at the
    fitted parameters, from draws at zeroth order on the same lines.
    """
    cut, rpm, teeth = on.cut, on.rpm, on.tool.teeth
    line_hz = on.here.lines_hz(_COARSE)

    def both(structure: Structure) -> tuple[Array, Array]:
        inverse = inverse_eigenvalues(cut.mean, structure.receptance(line_hz))
        return zeroth_order(inverse, line_hz, teeth, rpm).depth, mode_coupling(inverse, line_hz).depth

    depth, coupled = both(on.here)
    parts = []
    for structure, factor in on.drawn(on.draws):
        drawn, without = both(structure)
        with np.errstate(invalid="ignore", divide="ignore"):  # neither has a limit, or only one of them
            ratios = np.atleast_2d(drawn / depth), np.atleast_1d(without / coupled)
        parts.append((ratios[0] / factor[:, None], ratios[1] / factor))
    low, high = band(np.concatenate([part for part, _ in parts]))
    least, most = band(np.concatenate([part for _, part in parts]))
    return (np.minimum(low, 1.0), np.maximum(high, 1.0)), (min(float(least), 1.0), max(float(most), 1.0))


def band(values: Array) -> tuple[Array, Array]:
    """95 % limits over the first axis; what is no number (of two infinite limits) counts as no change."""
    ordered = np.sort(np.where(np.isnan(values), 1.0, values), axis=0)
    low, high = (round(part / 100 * (len(ordered) - 1)) for part in _BAND)
    return ordered[low], ordered[high]


def limits(on: Mounted, found: Limits, relative: tuple[Array, Array]) -> tuple[DepthLimits, LimitChecks]:
    """The limits with their bands, and by every method at some of the speeds; found: those of zeroth order;
    relative: the band's limits over the limit (speeds,), two of them.
    """
    structure, cut, most = on.here, on.cut, on.tool.max_depth_mm / 1e3
    rpm, highest = on.rpm, _highest_hz(structure, found)
    some = slice(None, None, _EVERY)
    several = _several(structure, cut, highest, rpm[some] if structure.real else rpm)
    if structure.real:
        depth, chatter = _in_time(TimeDomain(structure, cut, highest), rpm, found.depth, most)
        compared = LimitChecks(rpm[some], found.depth[some], several.depth, depth[some])
    else:
        depth, chatter = several.depth, found.chatter_hz
        compared = LimitChecks(rpm[some], found.depth[some], several.depth[some], None)
    free = depth > most
    chatter = np.where(free, np.nan, chatter)
    at, low, high = (np.where(free, np.inf, depth * part) for part in (1.0, *relative))
    return DepthLimits(rpm, at, low, high, chatter, found.depth), compared


def _highest_hz(structure: Structure, found: Limits) -> float:
    """The highest frequency at which the tool chatters, or of a mode where it does not."""
    chatter = found.chatter_hz[np.isfinite(found.chatter_hz)]
    if chatter.size:
        return float(chatter.max())
    return float(complex_modes(structure.mass, structure.damping, structure.stiffness).frequency_hz.max())


def _several(structure: Structure, cut: Engagement, highest: float, rpm: Array) -> Limits:
    def receptance(line_hz: Array) -> Complex:
        matrices = structure.mass, structure.damping, structure.stiffness
        s = np.asarray(2j * np.pi * np.abs(line_hz), dtype=complex)
        at = frf_by_solve(*matrices, s, structure.out, structure.out.T, 0)
        return np.where(line_hz[:, None, None] < 0, np.conj(at), at)  # hysteresis turns with the sign

    return multi_frequency(cut, receptance, structure.lines_hz(_COARSE), highest, rpm)


def _in_time(domain: TimeDomain, rpm: Array, near: Array, most: float) -> tuple[Array, Array]:
    """Depth limits (speeds,), m, and frequencies of chatter, Hz."""
    depth = np.array([domain.limit(speed, guess, most) for speed, guess in zip(rpm, near, strict=True)])
    chatter = [
        domain.chatter_hz(speed, at) if np.isfinite(at) else np.nan
        for speed, at in zip(rpm, depth, strict=True)
    ]
    return depth, np.array(chatter)


def over_feeds(on: Mounted) -> tuple[Array, Array]:
    """Feeds (f,), degrees about the spindle from the tool's own, and the least depth limit over the speeds
    (f,), m.
    """
    structure, cut, rpm = on.here, on.cut, on.rpm
    line_hz = structure.lines_hz(_COARSE)
    tip = structure.receptance(line_hz)
    angles = np.arange(_FEEDS) * 360.0 / _FEEDS
    sin, cos, zero, one = (
        np.sin(np.radians(angles)),
        np.cos(np.radians(angles)),
        np.zeros(_FEEDS),
        np.ones(_FEEDS),
    )
    turn = np.array([[cos, sin, zero], [-sin, cos, zero], [zero, zero, one]]).transpose(2, 0, 1)[:, None]
    inverse = inverse_eigenvalues(cut.mean, turn @ tip @ np.swapaxes(turn, -1, -2))
    return angles, zeroth_order(inverse, line_hz, cut.teeth, rpm).depth.min(axis=-1)


def tip_receptance(on: Mounted, line_hz: Array) -> tuple[Complex, Array]:
    """Receptance of the tip (lines, 3, 3), m/N, along the tool's axes, and half its 95 % band, as the spread
    of draws.
    """
    spread = np.concatenate(
        [
            structure.receptance(line_hz).reshape(-1, len(line_hz), 3, 3)
            for structure, _ in on.drawn(min(on.draws, 60))
        ]
    )
    here = on.here.receptance(line_hz)
    return here, 1.96 * np.sqrt(np.mean(np.abs(spread - here) ** 2, axis=0))
