"""Impacts on systems with nonlinear joint torques: what is simulated for an FRF set, together with those of
other sets, and remembered.

Simulating takes about as long for many models as for one, so all sets of a cost share an `ImpactSimulator`,
and the models with parameters moved a little, from which derivatives come, run along.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.model.effects.torque_law import TorqueLaw
from identify.model.impacted import ImpactedFrf
from identify.model.system import System
from identify.model.transient import AttachedTorque, Impact, Models, Response, simulate
from identify.model.truncation import EndOfRecord

_STEPS_PER_PERIOD = 16
"""Time steps in a period of the highest line."""
MOVED = 1e-4
"""Relative change of a parameter, or of what it contributes to, or of the impacts, for derivatives of the
torques.
"""


@dataclass(frozen=True, eq=False)
class SimulatedImpact:
    """What is simulated for one set.

    force (n, inputs); laws: each with the coordinate (n,) that it turns and the numbers of its parameters;
    the record is cut in `steps`.  strength (inputs,): of each impact over that of `impact`.
    """

    system: System
    force: Array
    impact: Impact
    laws: tuple[tuple[TorqueLaw, Array, Index], ...]
    steps: int
    strength: Array

    def changed(self, stronger: float = 1.0, longer: float = 1.0) -> SimulatedImpact:
        """With impacts so many times as strong and as long."""
        return replace(self, strength=stronger * self.strength, impact=self.impact.lasting(longer))

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
            parts = np.abs(np.diagonal(self.system.terms[role][:], axis1=1, axis2=2))
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
        np.ones(force.shape[1]),
    )


class ImpactSimulator:
    """Simulates impacts that are alike side by side, and remembers the last values that it was asked for.

    simulations: all that it simulates; with_errors: what the impacts are where what was stated is off by
    errors (nuisances,).
    """

    def __init__(
        self,
        simulations: Sequence[SimulatedImpact],
        with_errors: Sequence[Callable[[Array], SimulatedImpact]] = (),
    ) -> None:
        self.simulations, self._with_errors = tuple(simulations), with_errors
        self._off: dict[bytes, ImpactSimulator] = {}
        self._last = np.zeros((0, len(simulations[0].system.terms["stiffness"])))
        self._known: dict[SimulatedImpact, Response] = {}

    def off(self, simulated: SimulatedImpact, errors: Array) -> tuple[ImpactSimulator, SimulatedImpact]:
        """What simulates all of them, and one of them, where what was stated is off by errors
        (nuisances,).
        """
        [there] = self._all_off(errors[None])
        return there, there.simulations[self.simulations.index(simulated)]

    def expect(self, errors: Array, values: Sequence[Array]) -> None:
        """Simulate side by side what will be asked for: off by each of errors (E, nuisances), models at
        values (S, parameters) of its own.
        """
        _simulate_all(self._all_off(errors), values)

    def _all_off(self, errors: Array) -> list[ImpactSimulator]:
        keys = [one.tobytes() for one in errors]
        if any(key not in self._off for key in keys):
            known = self._off
            self._off = {
                key: known.get(key) or ImpactSimulator([one(error) for one in self._with_errors])
                for key, error in zip(keys, errors, strict=True)
            }
        return [self._off[key] for key in keys]

    @cached_property
    def stronger(self) -> ImpactSimulator:
        """Of impacts that are a little stronger."""
        return ImpactSimulator([one.changed(stronger=1 + MOVED) for one in self.simulations])

    @cached_property
    def longer(self) -> ImpactSimulator:
        """Of impacts that last a little longer."""
        return ImpactSimulator([one.changed(longer=1 + MOVED) for one in self.simulations])

    def responses(self, simulated: SimulatedImpact, values: Array) -> Response:
        """What follows the impact at values (S, parameters), S models."""
        _simulate_all([self], [values])
        return self._known[simulated].of(slice(len(values)))

    def impacted(self, simulated: SimulatedImpact, values: Array, s: Complex, free: Index) -> ImpactedFrf:
        """What the torques do to FRFs at s (lines,) and values (parameters,), with derivatives by parameters
        `free`.
        """
        own = np.concatenate([numbers for _, _, numbers in simulated.laws])
        shares = np.max([one.shares(values) for one in self.simulations], axis=0)
        columns = np.flatnonzero((shares[free] > 0) | np.isin(free, own))
        moving, moved = free[columns], np.tile(values, (len(columns) + 1, 1))
        share = shares[moving]
        steps = MOVED / np.where(
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


def _simulate_all(simulators: Sequence[ImpactSimulator], values: Sequence[Array]) -> None:
    """Let simulators remember what follows at values (S, parameters) of each, if they do not know it yet."""
    new = [
        (one, at)
        for one, at in zip(simulators, values, strict=True)
        if not np.array_equal(one._last[: len(at)], at)
    ]
    groups: dict[tuple[object, ...], list[tuple[ImpactSimulator, SimulatedImpact]]] = {}
    for simulator, at in new:
        simulator._last, simulator._known = at.copy(), {}
        for simulated in simulator.simulations:
            groups.setdefault(simulated.alike, []).append((simulator, simulated))
    for group in groups.values():
        side_by_side = _simulate([(simulated, simulator._last) for simulator, simulated in group])
        begin = 0
        for simulator, simulated in group:
            end = begin + len(simulator._last)
            simulator._known[simulated] = side_by_side.of(slice(begin, end))
            begin = end


def _simulate(models: Sequence[tuple[SimulatedImpact, Array]]) -> Response:
    """What follows impacts that are alike, each at values (S, parameters) of its own: the models of the
    first, then those of the second, and so on.
    """
    matrices = [simulated.system.matrices(values) for simulated, values in models]
    mass, damping, stiffness = (np.concatenate(parts) for parts in zip(*matrices, strict=True))
    each = [simulated for simulated, values in models for _ in values]
    strength = np.array([one.strength for one in each])
    force = np.array([one.strength * one.force for one in each])
    first, attached = each[0], []
    for number, (law, _, _) in enumerate(first.laws):
        turned = np.array([one.laws[number][1] for one in each])
        own = np.concatenate([values[:, simulated.laws[number][2]] for simulated, values in models])
        attached.append(AttachedTorque(law, turned, own))
    impacts = tuple(one.impact for one in each)
    with np.errstate(all="ignore"):  # a model that grows without bound ends in NaN, which costs infinity
        response = simulate(
            Models(mass, damping, stiffness, force, impacts), attached, first.impact.record, first.steps
        )
    return response.over(strength)
