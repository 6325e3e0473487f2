"""What is known after a test: the inverse covariance of all unknowns.

A fit weighs every FRF alike by its noise, whatever these have in common, so that with derivatives J over the
noise its covariance is that of a sandwich (Huber 1967; `identify.vibration.uncertainty` finds it from the
residuals of a fit),

    (P + Q)^-1 (V + Q) (P + Q)^-1,   P = Re sum J'J,   V = variance of the scores Re sum conj(J) e,

Q what bounds and statements say.  What the data of a fit said is added to the inverse.  e over the noise has
two parts: that of each response, and that of the force, which all responses of an impact share.  An
exponential window exp(-d t) correlates both over lines: at a distance of k lines by c / (c + 2 pi i k), c =
2 d T, T the length of the record.

Where things are not quite as stated (`uncertainty:` of the study), their errors are unknowns too.
Errors of links and lengths go along from the fit, with the covariance that it found; those of sensors,
gains, impacts and joint angles come anew with the test, as they were stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.linalg

from identify.core.arrays import Array, Complex, gram
from identify.core.interruption import check
from identify.measured.channel import Channel
from identify.model.nuisances.basis import Basis, basis
from identify.model.system import System
from identify.planning.candidates import Candidates
from identify.planning.design import Chosen
from identify.planning.information import FreeModel, TestNoise, s_of, slopes
from identify.planning.known import Known
from identify.vibration.nuisances.blocks import nuisance_blocks
from identify.vibration.nuisances.nuisance import NOTHING, Nuisances, Tested, list_nuisances
from identify.vibration.nuisances.placed import basis_points, place, state

_MOST_LINES = 400
_LASTING = ("link", "kinematics")
"""Groups of errors that a new test has in common with the fit."""


class Planned(NamedTuple):
    """A measurement that is to be done."""

    name: str
    posture: Array
    outputs: tuple[Channel, ...]
    inputs: tuple[Channel, ...]


@dataclass(frozen=True)
class AfterTest:
    """Tests of candidates; models: that of the fit, and a rival if there is one; before (u, u): what is known
    of their unknowns, weak (u, u): what bounds alone say; anew: whether the data of the fit do not count.
    """

    known: Known
    models: Sequence[FreeModel]
    among: Candidates
    before: Array
    weak: Array
    anew: bool
    _systems: dict[int, list[System]] = field(default_factory=dict)
    _stated: dict[int, StatedErrors] = field(default_factory=dict)

    def precision(self, chosen: Chosen) -> Array:
        """(u + e, u + e): inverse covariance, after a test, of the unknowns and the nuisance parameters."""
        planned = [self._planned(int(number), chosen) for number in chosen[0]]
        nuisances = nuisances_of(self.known, planned)
        weak = prior(nuisances, self.known, self.weak, anew=True)
        product = variance = weak
        for number, one in zip(chosen[0], planned, strict=True):
            check()
            h, g = self._slopes(int(number), one, chosen)
            if nuisances.entries:
                system = self._systems[int(number)][0]
                fitted = self._stated.setdefault(int(number), StatedErrors(self.known, system, one.posture))
                g = np.concatenate([g, fitted.slopes(nuisances, one, h, self._s)], axis=-1)
            g = self.known.noise.over(g, self._s)
            own, spread = scores(h, g, self.known.noise, 1 / self.known.band[2], self._count)
            product, variance = product + own, variance + spread
        of_data = prior(nuisances, self.known, self.before, self.anew) - weak
        return np.asarray(product @ np.linalg.solve(variance, product) + of_data)

    @property
    def _s(self) -> Complex:
        low, high, _ = self.known.band
        return s_of(np.linspace(low, high, min(self._count, _MOST_LINES)), self.known.noise)

    @property
    def _count(self) -> int:
        """Of the lines of the test."""
        low, high, apart = self.known.band
        return max(round(float((high - low) / apart)) + 1, 2)

    def _planned(self, number: int, chosen: Chosen) -> Planned:
        nodes = [self.among.sensors[k] for k in chosen[2]]
        outputs = tuple(Channel(node, direction) for node in nodes for direction in (1, 2, 3))
        inputs = tuple(Channel(node, axis + 1) for node, axis in (self.among.impacts[k] for k in chosen[1]))
        return Planned(f"planned{number}", self.among.postures[number], outputs, inputs)

    def _slopes(self, number: int, planned: Planned, chosen: Chosen) -> tuple[Complex, Complex]:
        if number not in self._systems:
            self._systems[number] = [one.model.system(planned.posture) for one in self.models]
        sensors = [self.among.sensors[k] for k in chosen[2]]
        hit = [self.among.impacts[k] for k in chosen[1]]
        return slopes(self.models, self._systems[number], sensors, hit, self._s)


def scores(h: Complex, g: Complex, noise: TestNoise, record_s: float, count: int) -> tuple[Array, Array]:
    """P and V (u, u) of FRFs (lines, outputs, impacts) with derivatives (..., u); count: of the lines of the
    test, of which those given are all, or some that stand for them and are then taken as independent.
    """
    j, alone, of_force = noise.scaled(h, g)
    product = gram(j, j)
    shared = np.asarray(of_force.sum(axis=1))
    alike = np.eye(len(h), dtype=complex)
    if count == len(h) and noise.decay_per_s > 0:
        turn = 2 * noise.decay_per_s * record_s
        alike = turn / (turn + 2j * np.pi * (np.arange(len(h)) - np.arange(len(h))[:, None]))
    spread = np.zeros_like(product)
    for part in (alone, shared):
        flat = part.reshape(len(h), -1)
        spread += gram(part, (alike @ flat).reshape(part.shape))
    weight = count / len(h)
    return weight * product, weight * spread


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
