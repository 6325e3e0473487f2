"""A tool in its cut: what carries it, and a fitted model at a posture that does."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from identify.core.arrays import Array, Complex
from identify.machining.coupled import CoupledTip, substructure
from identify.machining.engagement import Engagement
from identify.machining.exact_limit import ExactLimit
from identify.machining.structure import Structure, on_both_sides
from identify.machining.tool import Tool
from identify.machining.uncertain import UncertainTip, motion_of, uncertain_tip
from identify.model.frf import frf_by_solve
from identify.model.modes import complex_modes
from identify.model.system import System
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel


class Uncertain(Protocol):
    """A tip with what is uncertain of it."""

    def relative(self, limit: ExactLimit) -> tuple[Array, float]:
        """What a limit changes, relative to it: per unit of each independent number (c,) that limits share,
        and RMS of what each has of its own.
        """

    def half_band(self, line_hz: Array) -> Array:
        """(l, 3, 3), m/N: half the 95 % band of the receptance, of the size of its error."""


@dataclass(frozen=True, kw_only=True)
class Cutting(ABC):
    """A tool in its cut, whatever carries it; axes (3, 3): as `Tool.axes` has them."""

    tool: Tool
    where: str
    axes: Array
    speeds: int
    draws: int

    @property
    @abstractmethod
    def uncertain(self) -> Uncertain:
        """The tip with all that is uncertain of it."""

    @property
    @abstractmethod
    def in_time(self) -> Structure | None:
        """Matrices that hold in time, where there are any."""

    @property
    @abstractmethod
    def highest_hz(self) -> float:
        """Highest frequency that is known to matter."""

    @abstractmethod
    def lines_hz(self, count: int) -> Array:
        """(lines,), Hz, that follow every resonance, so many of them evenly."""

    @abstractmethod
    def tip(self, line_hz: Array) -> Complex:
        """Receptance (lines, 3, 3), m/N, at lines of any sign, along the tool's axes."""

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
        cutting, pitches = self.tool.cutting(self.where), self.tool.pitches
        return Engagement(self.tool.teeth, entry, leave, lead, cutting, float(lag), pitches)

    @property
    def coefficients(self) -> float:
        """Relative standard deviation of the cutting coefficients."""
        return self.tool.uncertainty.coefficients


@dataclass(frozen=True, kw_only=True)
class Mounted(Cutting):
    """A tool on a fitted model at a posture (joints,), rad.

    errors (p,): what the model does not explain, as `identify.vibration.misfit` has it.
    """

    model: FittedModel
    system: System
    point: Point
    posture: Array
    tip_m: Array
    errors: Array

    @cached_property
    def here(self) -> Structure:
        """The structure at the fitted values, at its own posture."""
        return self.structure(self.model.values)

    def structure(self, values: Array) -> Structure:
        """The structure at parameters (..., p)."""
        out = motion_of(self.system, self.point, self.axes)
        return Structure(*self.system.matrices(values), out).with_modes(self.tool.modes)

    @cached_property
    def uncertain(self) -> UncertainTip:
        """The tip with all that is uncertain of it."""
        std = float(np.radians(self.tool.uncertainty.posture_deg))
        there = self.point, self.axes, self.posture, self.errors
        return uncertain_tip(self.model, self.system, *there, std, self.coupled)

    @cached_property
    def coupled(self) -> CoupledTip | None:
        """What is coupled to the arm, if anything."""
        if self.tool.coupling is None:
            return None
        on = substructure(self.tool.coupling)
        out = motion_of(self.system, self.point, self.axes, on.degrees)
        matrices = self.system.matrices(self.model.values)

        def arm(line_hz: Array) -> Complex:
            return frf_by_solve(*matrices, np.asarray(2j * np.pi * line_hz), out, out.T, 0)

        return CoupledTip(on, arm, self.axes @ self.system.site.engine.axes(self.point.link))

    @property
    def in_time(self) -> Structure | None:
        """None with a tool that is coupled by FRFs, or hysteretic damping."""
        return self.here if self.coupled is None and self.here.real else None

    @property
    def highest_hz(self) -> float:
        """That of the modes."""
        here = self.here
        return float(complex_modes(here.mass, here.damping, here.stiffness).frequency_hz.max())

    def lines_hz(self, count: int) -> Array:
        """(lines,), Hz, that follow every resonance, as `Structure.lines_hz`, and those of the coupling."""
        own = self.here.lines_hz(count)
        return own if self.coupled is None else np.union1d(own, self.coupled.on.line_hz)

    def tip(self, line_hz: Array) -> Complex:
        """Receptance (lines, 3, 3), m/N, at lines of any sign."""
        if self.coupled is not None:
            return self.coupled.receptance(line_hz)
        here = self.here
        matrices = here.mass, here.damping, here.stiffness
        return on_both_sides(lambda s: frf_by_solve(*matrices, s, here.out, here.out.T, 0), line_hz)


def mounted(
    model: FittedModel,
    tool: Tool,
    posture: Array,
    where: str,
    speeds: int = 61,
    draws: int = 2000,
    errors: Array | None = None,
) -> Mounted:
    """The tool on the model; InputError where it does not fit the robot."""
    wrong = np.zeros(len(model.values)) if errors is None else errors
    point = tool.point(model, where)
    system = model.system(posture)
    engine = system.site.engine
    axes = tool.axes(engine.axes(point.link), where=where)
    tip_m = engine.position(point.link, point.position)
    return Mounted(
        model=model,
        system=system,
        tool=tool,
        where=where,
        point=point,
        posture=posture,
        axes=axes,
        tip_m=tip_m,
        speeds=speeds,
        draws=draws,
        errors=wrong,
    )
