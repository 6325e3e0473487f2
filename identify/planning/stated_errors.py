"""Nuisance parameters (`uncertainty:` of the study) as unknowns of a test that is to be done.

Errors of links and lengths go along from the fit, with the covariance that it found; those of sensors, gains,
impacts and joint angles come anew with the test, as they were stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg

from identify.core.arrays import Array, Complex
from identify.model.nuisances.basis import Basis, basis
from identify.model.system import System
from identify.planning.known import Known
from identify.vibration.nuisances.blocks import nuisance_blocks
from identify.vibration.nuisances.nuisance import NOTHING, Nuisances, Tested, list_nuisances
from identify.vibration.nuisances.placed import basis_points, place, state

_LASTING = ("link", "kinematics")
"""Groups of errors that a new test has in common with the fit."""


def nuisances_of(known: Known, planned: Sequence[Tested]) -> Nuisances:
    """All that is uncertain of planned measurements; none where nothing was stated."""
    if known.settings is None:
        return NOTHING
    return list_nuisances(known.settings, known.model.robot, known.model.points, planned)


def prior(nuisances: Nuisances, known: Known, before: Array, anew: bool) -> Array:
    """(u + e, u + e): what is known of unknowns and errors before the test; before (u, u): of the unknowns,
    the parameters first; anew: whether the data of the fit do not count.
    """
    found = scipy.linalg.block_diag(before, np.eye(len(nuisances.entries)))
    fitted, size, unknowns = known.fitted, len(known.names), len(before)
    if fitted is None or anew or not nuisances.entries:
        return np.asarray(found)
    places = {name: size + number for number, name in enumerate(fitted.names)}
    lasting = [
        (unknowns + number, places[one.place, one.change])
        for number, one in enumerate(nuisances.entries)
        if one.group in _LASTING and (one.place, one.change) in places
    ]
    own = [*range(size), *(number for number, _ in lasting)]
    kept = [*range(size), *(row for _, row in lasting)]
    found[np.ix_(own, own)] = np.linalg.inv(fitted.covariance[np.ix_(kept, kept)])
    return np.asarray(found)


@dataclass(frozen=True)
class StatedErrors:
    """What errors do at a posture (joints,), rad, of a system there."""

    known: Known
    system: System
    posture: Array

    @cached_property
    def _basis(self) -> Basis:
        model, stated = self.known.model, self.known.settings
        assert stated is not None
        angles, lengths = stated.std("joints", "angle_deg") > 0, stated.std("kinematics", "position_m") > 0
        points = basis_points(model.points)
        return basis(model.robot, self.posture, points, None, angles=angles, lengths=lengths)

    def slopes(self, nuisances: Nuisances, planned: Tested, h: Complex, s: Complex) -> Complex:
        """(lines, outputs, inputs, e), per standard deviation of each error; h: the FRFs of the measurement,
        s (lines,).
        """
        model, channels = self.known.model, (planned.outputs, planned.inputs)
        name, posture, points = planned.name, planned.posture, model.points
        placed = place(nuisances, self._basis, self.system, points, name, posture, channels)
        at = state(placed, np.zeros(len(nuisances.entries)))
        found = np.zeros((*h.shape, len(nuisances.entries)), dtype=complex)
        for block in nuisance_blocks(placed, at, self.system.matrices(model.values), s, 2, None):
            there = np.ix_(np.arange(len(s)), block.channels, np.arange(h.shape[2]), block.numbers)
            found[there] += block.slopes
        if placed.delay.numbers >= 0:
            found[..., int(placed.delay.numbers)] = -float(placed.delay.std) * s[:, None, None] * h
        return found
