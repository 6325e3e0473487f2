"""A fitted model at a posture as real matrices M, C, K with channels, which is what all exports begin with.

Channels are those of all points of the study, three directions each, as responses and as forces.  What real
matrices cannot say is approximated or left out, and `notes` says which.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.text import listed
from identify.core.thresholds import QUIET
from identify.core.yaml_input import parse_yaml
from identify.measured.channel import Channel
from identify.model.frf import frf
from identify.model.geometry import standing
from identify.model.modes import ComplexModes, complex_modes
from identify.model.system import System
from identify.results.fit import FitResult
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel, tool_point

_LINES = 400


@dataclass(frozen=True)
class LinearModel:
    """M, C, K (n, n) over the coordinates of a system at posture (joints,), rad; channels (p): of out (p, n)
    and its transpose, translations of points along their sensors' axes, m, and forces, N.

    fit: the result it is of; model: as the fit found it; values (parameters,): of the system.
    """

    name: str
    fit: FitResult
    model: FittedModel
    posture: Array
    system: System
    mass: Array
    damping: Array
    stiffness: Array
    points: tuple[Point, ...]
    channels: tuple[Channel, ...]
    out: Array
    notes: tuple[str, ...] = ()

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the n coordinates."""
        return self.system.coordinates

    @property
    def units(self) -> tuple[str, ...]:
        """Of each coordinate, m or rad."""
        return tuple("rad" if turns(name) else "m" for name in self.coordinates)

    @cached_property
    def modes(self) -> ComplexModes:
        """Its oscillating modes."""
        return complex_modes(self.mass, self.damping, self.stiffness)

    @cached_property
    def state_space(self) -> tuple[Array, Array, Array, Array]:
        """A, B, C, D with states [x, dx/dt]: y = C x + D u are displacements of the channels under forces u
        on them.
        """
        size = len(self.mass)
        lower = -np.linalg.solve(self.mass, np.hstack([self.stiffness, self.damping]))
        a = np.vstack([np.hstack([np.zeros((size, size)), np.eye(size)]), lower])
        b = np.vstack([np.zeros((size, len(self.out))), np.linalg.solve(self.mass, self.out.T)])
        c = np.hstack([self.out, np.zeros((len(self.out), size))])
        return a, b, c, np.zeros((len(self.out), len(self.out)))

    def receptance(self, line_hz: Array, stiffness: Array | None = None) -> Complex:
        """(l, p, p), m/N, at lines (l,), Hz."""
        k = self.stiffness if stiffness is None else stiffness
        s = np.asarray(2j * np.pi * line_hz, dtype=np.complex128)
        return frf(self.mass, self.damping, k, s, self.out, self.out.T, 0)


def turns(coordinate: str) -> bool:
    """Whether a coordinate is an angle: rx, ry, rz of a body, and those of rotors, twists and slopes."""
    last = coordinate.rpartition(".")[2]
    return last.startswith(("r", "twist", "slope", "servo", "drive")) and not last.startswith("resonator")


def lines_of(band_hz: tuple[float, float]) -> Array:
    """Frequencies over a band, Hz, at which exports are compared."""
    return np.linspace(*band_hz, _LINES)


def linear_model(
    name: str, fit: FitResult, model: FittedModel, posture: Array, band_hz: tuple[float, float]
) -> LinearModel:
    """The model at a posture (joints,), rad; band_hz: where damping that real matrices cannot say is made
    like it.
    """
    system = model.system(posture)
    mass, damping, stiffness = system.matrices(model.values)
    notes = [*_left_out(fit, model), *_taken_off(fit, posture)]
    points = standing(model.points, system.site) or [tool_point(model, None)]
    out = np.vstack([p.axes @ system.jacobian(p.link, p.position)[:3] for p in points])
    channels = tuple(Channel(point.node, axis) for point in points for axis in (1, 2, 3))
    made = LinearModel(
        name, fit, model, posture, system, mass, damping, stiffness.real, tuple(points), channels, out
    )
    if np.iscomplexobj(stiffness) and np.any(stiffness.imag):
        centre = 2 * np.pi * np.sqrt(max(band_hz[0], band_hz[1] / 100) * band_hz[1])
        right = made.receptance(lines_of(band_hz), stiffness)
        made = replace(made, damping=damping + stiffness.imag / centre)
        error = largest_error(made.receptance(lines_of(band_hz)), right)
        notes.append(
            "hysteretic damping is made viscous, the same at"
            f" {centre / (2 * np.pi):.3g} Hz: FRFs change by up to {error:.2g} of their RMS between"
            f" {band_hz[0]:.4g} and {band_hz[1]:.4g} Hz"
        )
    return replace(made, notes=tuple(notes))


def largest_error(found: Complex, right: Complex) -> float:
    """The largest difference of FRFs (lines, p, q) over the RMS of each over the lines; those that are a
    millionth of the largest do not count.
    """
    level = np.sqrt(np.mean(np.abs(right) ** 2, axis=0))
    kept = level > 1e-6 * level.max(initial=0.0)
    return float((np.abs(found - right).max(axis=0)[kept] / level[kept]).max(initial=0.0))


def _taken_off(fit: FitResult, posture: Array) -> list[str]:
    """That what was measured at this posture had links taken off, which the model has."""
    said = parse_yaml(fit.provenance.config, fit.name)["measurements"]
    off = {
        str(entry["detached"])
        for entry, one in zip(said, fit.measurements.values(), strict=True)
        if entry.get("detached") and np.allclose(np.deg2rad(one.posture_deg), posture)
    }
    if not off:
        return []
    return [
        f"the model is of the whole robot; {listed(sorted(off))} and all beyond were off when it was measured"
    ]


def _left_out(fit: FitResult, model: FittedModel) -> list[str]:
    """What of the model the matrices do not have."""
    there = {effect.sentence() for effect in model.effects}
    measured = [sentence for sentence in fit.effects if sentence not in there]
    notes = [f"left out, because it belongs to the measurement: {listed(measured)}"] if measured else []
    amplitude = [effect.sentence() for effect in model.effects if effect.of_amplitude]
    if amplitude:
        notes.append(f"left out, because it depends on the amplitude: {listed(amplitude)}")
    if fit.gap > QUIET:
        notes.append(f"the model leaves a gap of {fit.gap:.3g} to the data it was fitted to")
    return notes
