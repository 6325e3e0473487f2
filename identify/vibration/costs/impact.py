"""Impacts on systems with nonlinear joint torques: what is simulated for an FRF set, together with those of
other sets, and remembered.

Simulating takes about as long for many models as for one, so all sets of a cost share an `ImpactSimulator`,
and the models with parameters moved a little, from which derivatives come, run along.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.model.effects.torque_law import TorqueLaw
from identify.model.impact import Impact
from identify.model.impacted import ImpactedFrf
from identify.model.system import System
from identify.model.transient import AttachedTorque, Models, Response, simulate
from identify.model.truncation import EndOfRecord

_STEPS_PER_PERIOD = 16
"""Time steps in a period of the highest line."""
_MOVED = 1e-4
"""Relative change of a parameter, or of what it contributes to, for derivatives of the torques."""


@dataclass(frozen=True, eq=False)
class SimulatedImpact:
    """What is simulated for one set.

    force (n, inputs); laws: each with the coordinate (n,) that it turns and the numbers of its parameters;
    the record is cut in `steps`.
    """

    system: System
    force: Array
    impact: Impact
    laws: tuple[tuple[TorqueLaw, Array, Index], ...]
    steps: int

    @property
    def alike(self) -> tuple[object, ...]:
        """Impacts for which this is the same can be simulated side by side."""
        laws = tuple((law, *numbers) for law, _, numbers in self.laws)
        return (len(self.system.coordinates), self.force.shape[1], self.impact.record, self.steps, laws)

    @property
    def coordinates(self) -> Array:
        """(n, J): what the laws turn."""
        return np.stack([coordinate for _, coordinate, _ in self.laws], axis=1)

    def shares(self, values: Array) -> Array:
        """(parameters,): the largest share of a coordinate's mass, damping or stiffness that a unit of the
        parameter contributes.
        """
        totals = dict(zip(("mass", "damping", "stiffness"), self.system.matrices(values), strict=True))
        result = np.zeros(len(values))
        for role, whole in totals.items():
            size = np.abs(np.diagonal(whole))
            parts = np.abs(np.diagonal(self.system.terms[role], axis1=1, axis2=2))
            result = np.maximum(result, np.max(parts / np.where(size > 0, size, np.inf), axis=1))
        return result


def simulated_impact(
    name: str, data: FrfSet, system: System, force: Array, impact: Impact | None
) -> SimulatedImpact | None:
    """What to simulate for a set (force (n, inputs)); None for a linear system.

    Raises InputError where a law acts on what no compliance releases, or the measurement does not say its
    impact.
    """
    if not system.laws:
        return None
    for placed in system.laws:
        if placed.coordinate not in system.coordinates and placed.coordinate not in system.site.detached:
            found = f"a nonlinear torque at {placed.coordinate}, which is locked"
            raise InputError("effects", found, "a joint-compliance that releases it")
    if impact is None:
        found = "no `impact`, on which a nonlinear effect depends"
        raise InputError(
            name,
            found,
            "the mean peak force of the impacts",
            "add `impact: {peak_n: 180}` to the measurement",
        )
    laws = tuple(
        (one.law, system.site.vector(one.coordinate)[system.free], one.numbers) for one in system.laws
    )
    return SimulatedImpact(
        system,
        force,
        impact,
        laws,
        int(np.ceil(impact.record * _STEPS_PER_PERIOD * float(data.frequency_hz[-1]))),
    )


class ImpactSimulator:
    """Simulates impacts that are alike side by side, and remembers the last values that it was asked for."""

    def __init__(self, simulations: Sequence[SimulatedImpact]) -> None:
        self._simulations = tuple(simulations)
        self._last = np.zeros((0, len(simulations[0].system.terms["stiffness"])))
        self._known: dict[SimulatedImpact, Response] = {}

    def responses(self, simulated: SimulatedImpact, values: Array) -> Response:
        """What follows the impact at values (S, parameters), S models."""
        count = len(values)
        if not np.array_equal(self._last[:count], values):
            self._last, self._known = values.copy(), {}
        known = self._known
        if simulated not in known:
            group = [one for one in self._simulations if one.alike == simulated.alike]
            side_by_side = _simulate(group, self._last)
            size = len(self._last)
            known.update(
                (one, side_by_side.of(slice(n * size, (n + 1) * size))) for n, one in enumerate(group)
            )
        return known[simulated].of(slice(count))

    def impacted(self, simulated: SimulatedImpact, values: Array, s: Complex, free: Index) -> ImpactedFrf:
        """What the torques do to FRFs at s (lines,) and values (parameters,), with derivatives by parameters
        `free`.
        """
        own = np.concatenate([numbers for _, _, numbers in simulated.laws])
        shares = np.max([one.shares(values) for one in self._simulations], axis=0)
        columns = np.flatnonzero((shares[free] > 0) | np.isin(free, own))
        moving, moved = free[columns], np.tile(values, (len(columns) + 1, 1))
        share = shares[moving]
        steps = _MOVED / np.where(
            share > 0, share, 1 / np.maximum(np.abs(values[moving]), np.finfo(float).tiny)
        )
        moved[np.arange(1, len(moved)), moving] += steps
        response = self.responses(simulated, moved)
        force, torque = simulated.impact.transform(s), response.transform(s)
        ends = np.array([response.x, response.v])
        slopes = np.zeros((*torque[:, :, 0].shape, len(free)), dtype=complex)
        slopes[..., columns] = (
            np.moveaxis(torque[:, :, 1:] - torque[:, :, :1], 2, 3) / force[:, None, None, None] / steps
        )
        rates = np.zeros((*ends[:, 0].shape, len(free)))
        rates[..., columns] = np.moveaxis(ends[:, 1:] - ends[:, :1], 1, 3) / steps
        end = EndOfRecord(simulated.impact.record, response.x[0], response.v[0], rates)
        return ImpactedFrf(end, force, simulated.coordinates, torque[:, :, 0] / force[:, None, None], slopes)

    def each(self, simulated: SimulatedImpact, values: Array, s: Complex) -> list[ImpactedFrf]:
        """What the torques do at values (S, parameters), for each of S models, without derivatives; s
        (lines,) or (S, lines).
        """
        response = self.responses(simulated, values)
        result = []
        for number, line in enumerate(np.broadcast_to(s, (len(values), s.shape[-1]))):
            one, force = response.of(slice(number, number + 1)), simulated.impact.transform(line)
            torque = one.transform(line)[:, :, 0] / force[:, None, None]
            end = EndOfRecord(simulated.impact.record, one.x[0], one.v[0], np.zeros((2, *one.x[0].shape, 0)))
            result.append(
                ImpactedFrf(
                    end, force, simulated.coordinates, torque, np.zeros((*torque.shape, 0), dtype=complex)
                )
            )
        return result


def _simulate(simulations: Sequence[SimulatedImpact], values: Array) -> Response:
    """What follows impacts that are alike at values (S, parameters): the models of the first, then those
    of the second, and so on.
    """
    matrices = [simulated.system.matrices(values) for simulated in simulations]
    mass, damping, stiffness = (np.concatenate(parts) for parts in zip(*matrices, strict=True))
    force = np.concatenate(
        [np.broadcast_to(simulated.force, (len(values), *simulated.force.shape)) for simulated in simulations]
    )
    impacts = tuple(simulated.impact for simulated in simulations for _ in values)
    attached = []
    for number, (law, _, numbers) in enumerate(simulations[0].laws):
        turned = np.repeat([simulated.laws[number][1] for simulated in simulations], len(values), axis=0)
        attached.append(AttachedTorque(law, turned, np.tile(values[:, numbers], (len(simulations), 1))))
    with np.errstate(all="ignore"):  # a model that grows without bound ends in NaN, which costs infinity
        return simulate(
            Models(mass, damping, stiffness, force, impacts),
            attached,
            simulations[0].impact.record,
            simulations[0].steps,
        )
