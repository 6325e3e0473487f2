"""Measured data side by side with the model that predicts it: what a cost is given."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Mask
from identify.core.errors import InputError
from identify.core.latest import LatestAt
from identify.measured.frf_set import POWER, FrfSet
from identify.model import compliant
from identify.model.effects.measurement import Reading, Unread
from identify.model.frf import frf, frf_slope, gradient_with
from identify.model.impacted import impacted_frf
from identify.model.system import System
from identify.model.truncation import TruncationCorrection, end_of_record
from identify.vibration.costs.impact import MOVED, ImpactSimulator, SimulatedImpact
from identify.vibration.nuisances.blocks import nuisance_blocks, recorded
from identify.vibration.nuisances.placed import Placed, State, state
from identify.vibration.nuisances.sensitivity import Block

_CHANGE = 1e-3
"""Change of s, rad/s, for derivatives of nonlinear FRFs."""
_FEW_COLUMNS = 2
"""Thin columns of a parameter up to which they are differentiated one by one."""
_CHUNK = 200_000
"""Complex numbers worked on at a time for a population: what stays in a processor's cache."""


@dataclass(frozen=True, eq=False)
class FrfTarget:
    """One measured FRF set and its prediction; noise (lines, outputs, inputs) is the standard deviation of
    real or imaginary part, or None.

    out (channels, n), force (n, inputs): the channels in the system's coordinates; those of out are the set's
    outputs, then what readings need besides.  readings: what effects of the measurement do to the FRFs, with
    the numbers of their parameters. record: length of the records behind the FRFs, s, where the response may
    not have died out (`identify.model.truncation`), or None. simulated: what must be simulated of a nonlinear
    system, by a simulator that may serve other sets too.  nuisances: what is uncertain; their values may
    follow those of the parameters.
    """

    name: str
    data: FrfSet
    system: System
    out: Array
    force: Array
    noise: Array | None = None
    readings: tuple[tuple[Reading, NDArray[np.intp]], ...] = ()
    record: float | None = None
    simulated: SimulatedImpact | None = None
    simulator: ImpactSimulator | None = None
    nuisances: Placed | None = None

    @cached_property
    def pairs(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Output and input numbers of the measured FRFs."""
        outputs, inputs = np.nonzero(self.data.measured)
        return outputs, inputs

    @cached_property
    def instruments(self) -> tuple[tuple[Reading, NDArray[np.intp]], ...]:
        """Readings by which instruments record something else than H where they sample it."""
        return tuple(pair for pair in self.readings if not isinstance(pair[0], Unread))

    @property
    def plain(self) -> bool:
        """Whether H is recorded as it is, so that it may be compared in coordinates."""
        return not self.instruments and self.data.simultaneous_inputs is None

    @cached_property
    def observable(self) -> NDArray[np.intp]:
        """Which pairs the model moves at all: a point on a rigid base has no FRF to compare on a logarithmic
        scale.
        """
        outputs, inputs = self.pairs
        return np.flatnonzero(np.any(self.out, axis=1)[outputs] & np.any(self.force, axis=0)[inputs])

    @cached_property
    def measured(self) -> Complex:
        """(lines, pairs): the measured FRFs."""
        outputs, inputs = self.pairs
        return np.asarray(self.data.frf[:, outputs, inputs])

    def at_lines(self, lines: Mask) -> FrfTarget:
        """The same at some of its frequency lines (lines,)."""
        noise = None if self.noise is None else self.noise[lines]
        return replace(self, data=replace(self.data.lines(lines), noise=noise), noise=noise)

    @cached_property
    def sigma(self) -> Array:
        """(lines, pairs): the noise of the measured FRFs; an InputError where it is not known."""
        if self.noise is None:
            fix = "give `noise: {relative: 0.02}` in the measurement, or choose another cost"
            raise InputError(
                self.name,
                "its noise is not known: no coherence and no repeats",
                "coherence with `averages`, or `noise`",
                fix,
            )
        outputs, inputs = self.pairs
        return np.asarray(self.noise[:, outputs, inputs])

    def predict(self, values: Array) -> Complex:
        """(..., lines, outputs, inputs) at parameter values (..., parameters)."""
        if self._errs(values):
            return self._predict_each(values)
        s, h = self.s_at(values), self.of_model(values)
        for reading, numbers in self.instruments:
            h = reading.apply(h, values[..., numbers], s)
        return self._at_once(h[..., : len(self.data.outputs), :])

    def read(self, h: Complex, values: Array) -> Complex:
        """(lines, outputs, inputs, k) as the instruments record k changes of H (lines, channels, inputs, k),
        in which they are linear.
        """
        s, flat = self.s_at(values), h.reshape(*h.shape[:2], -1)
        for reading, numbers in self.instruments:
            flat = reading.apply(flat, values[numbers], s)
        read = flat.reshape(h.shape)[:, : len(self.data.outputs)]
        return np.asarray(np.moveaxis(self._at_once(np.moveaxis(read, 2, 3)), 3, 2))

    def _errs(self, values: Array) -> bool:
        """Whether values (..., unknowns) say more than the parameters."""
        return bool(values.shape[-1] > len(self.system.parameters))

    def _predict_each(self, values: Array) -> Complex:
        """`predict` where values of nuisances follow, the same ones only once."""
        size = len(self.system.parameters)
        own, errors = (
            values.reshape(-1, values.shape[-1])[:, :size],
            values.reshape(-1, values.shape[-1])[:, size:],
        )
        if (errors == errors[:1]).all():  # mostly; to look for several takes as long as a model's FRFs
            unique, which = errors[:1], np.zeros(len(errors), dtype=int)
        else:
            unique, which = np.unique(errors, axis=0, return_inverse=True)
        found: list[Complex] = [np.zeros(0, dtype=complex)] * len(own)
        shared = [np.flatnonzero(which.ravel() == number) for number in range(len(unique))]
        if self.simulated is not None:
            self._simulator.expect(unique, [own[rows] for rows in shared])
        for error, rows in zip(unique, shared, strict=True):
            there, delay = self.realised(error)
            h = there.predict(own[rows])
            late = np.exp(-delay * there.s_at(own[rows]))[..., None, None]
            for row, one in zip(rows, h * late, strict=True):
                found[row] = one
        return np.array(found).reshape(*values.shape[:-1], *found[0].shape)

    def realised(self, errors: Array) -> tuple[FrfTarget, float]:
        """The target with the model, sensors and impacts that nuisances (nuisances,) make, and the delay,
        s.
        """
        there, at = self._realised(errors)
        return there, 0.0 if at is None else at.delay

    def _realised(self, errors: Array) -> tuple[FrfTarget, State | None]:
        """The same, and its state; None where nothing is uncertain."""
        if self.nuisances is None:
            return self, None
        there, at = self._latest.of(errors, self._in_state_of)
        if self.simulated is not None:
            simulator, simulated = self._simulator.off(self.simulated, errors)
            there = replace(there, simulated=simulated, simulator=simulator)
        return there, at

    @cached_property
    def _latest(self) -> LatestAt[tuple[FrfTarget, State]]:
        """Predictions, slopes and blocks are asked for in turn at the same errors."""
        return LatestAt()

    def _in_state_of(self, errors: Array) -> tuple[FrfTarget, State]:
        assert self.nuisances is not None
        at = state(self.nuisances, errors)
        return self.in_state(at), at

    def in_state(self, at: State) -> FrfTarget:
        """With the model, sensors and impacts of a state, but for its delay."""
        system = self.system.with_more(at.mass, at.stiffness)
        return replace(self, system=system, out=at.out, force=at.force, nuisances=None)

    def impact_with_errors(self, errors: Array) -> SimulatedImpact:
        """What is simulated where what was stated is off by errors (nuisances,)."""
        assert self.simulated is not None and self.nuisances is not None
        at = state(self.nuisances, errors)
        return replace(
            self.simulated,
            system=self.system.with_more(at.mass, at.stiffness),
            force=at.force,
            strength=at.strength * self.simulated.strength,
            impact=self.simulated.impact.lasting(at.duration),
        )

    def at(self, values: Array) -> tuple[FrfTarget, Array]:
        """The same at values (unknowns,), but for the delay, and the values of the parameters."""
        size = len(self.system.parameters)
        return (self.realised(values[size:])[0], values[:size]) if self._errs(values) else (self, values)

    def blocks(self, values: Array) -> list[Block]:
        """Derivatives with respect to nuisances at values (unknowns,); their numbers are those among the
        unknowns.
        """
        if self.nuisances is None:
            return []
        size = len(self.system.parameters)
        own, errors = values[:size], values[size:]
        there, at = self._realised(errors)
        assert at is not None
        delay = at.delay
        s, power, matrices = there.s_at(own), POWER[self.data.quantity], there.system.matrices(own)
        end: TruncationCorrection | compliant.Response | float | None = there.end_at(own)
        if self.system.compliances is not None:
            end = there.response(own)
        if there.simulated is not None:
            end = there._simulator.impacted(there.simulated, own, s, np.zeros(0, dtype=int))
        readings = [(reading, own[numbers]) for reading, numbers in self.instruments]
        late = np.exp(-delay * s)[:, None, None, None]
        found, blocks = [], nuisance_blocks(self.nuisances, at, matrices, s, power, end)
        for block in [*blocks, *there.impact_blocks(self.nuisances, own)]:
            one = recorded(block, readings, s, len(self.out), len(self.data.outputs))
            slopes = late * one.slopes if delay else one.slopes
            slopes = np.swapaxes(self._at_once(np.swapaxes(slopes, 2, 3)), 2, 3)
            found.append(Block(one.channels, size + one.numbers, slopes))
        if self.nuisances.delay.numbers >= 0:
            slopes = -float(self.nuisances.delay.std) * (s[:, None, None] * self.predict(values))[..., None]
            every = np.arange(len(self.data.outputs))
            found.append(Block(every, size + self.nuisances.delay.numbers.reshape(1), slopes))
        return found

    def impact_blocks(self, placed: Placed, values: Array) -> Iterator[Block]:
        """Derivatives of what the model itself does with respect to strengths and duration of simulated
        impacts, at values (parameters,).
        """
        if self.simulated is None:
            return
        own = self._simulator
        moves = ((placed.strength, own.stronger), (placed.duration, own.longer))
        uncertain = [(slot, simulator) for slot, simulator in moves if np.any(slot.numbers >= 0)]
        if not uncertain:
            return
        number, here = own.simulations.index(self.simulated), self.of_model(values)
        for slot, simulator in uncertain:
            numbers = np.broadcast_to(slot.numbers, self.force.shape[1])
            unique, which = np.unique(numbers[numbers >= 0], return_inverse=True)
            moved = replace(self, simulated=simulator.simulations[number], simulator=simulator)
            change = (moved.of_model(values) - here) / np.log1p(MOVED)
            slopes = np.zeros((*change.shape, len(unique)), dtype=complex)
            inputs = np.flatnonzero(numbers >= 0)
            slopes[:, :, inputs, which] = (np.broadcast_to(slot.std, numbers.shape) * change)[:, :, inputs]
            yield Block(np.arange(len(self.out)), unique, slopes)

    def of_model(self, values: Array) -> Complex:
        """(..., lines, channels, inputs): what the model itself does at values (..., parameters)."""
        if self.simulated is not None:
            return self._impacted(self.simulated, values)
        return self._linear(values, self.s_at(values))

    def _at_once(self, h: Complex) -> Complex:
        """With forces that act together, their joint response in place of that of the first (..., inputs)."""
        if self.data.simultaneous_inputs is None:
            return h
        mixed = h.copy()
        mixed[..., 0] = h @ np.array(self.data.simultaneous_inputs)
        return mixed

    def _linear(self, values: Array, s: Complex) -> Complex:
        power = POWER[self.data.quantity]
        if self.system.compliances is not None:
            flat = values.reshape(-1, values.shape[-1])
            if len(flat) == 1 and self.system.mass.ndim == 2:
                h = self.response(flat[0]).h()
                return h.reshape(*values.shape[:-1], *h.shape)
            # A population may be as heavy as each of its members is (`System.with_more`).
            matrices = zip(*self.system.bare(flat), strict=True)
            h = np.array([self._response(*one).h() for one in zip(flat, matrices, strict=True)])
            return h.reshape(*values.shape[:-1], *h.shape[1:])
        return frf(*self.system.matrices(values), s, self.out, self.force, power, self._ends(values))

    def response(self, values: Array) -> compliant.Response:
        """The model's response at values (parameters,), whose springs are given by compliance."""
        return self._responses.of(values, lambda own: self._response(own, self.system.bare(own)))

    @cached_property
    def _responses(self) -> LatestAt[compliant.Response]:
        """Slopes by parameters and by nuisances are asked for in turn at the same values."""
        return LatestAt()

    def _response(self, values: Array, matrices: tuple[Array, Array, Array]) -> compliant.Response:
        springs, s, record = self.system.compliances, self.s_at(values), self.end_at(values)
        assert springs is not None
        power = POWER[self.data.quantity]
        return compliant.respond(springs, values, matrices, s, self.out, self.force, power, record)

    def _compliant_gradient(self, values: Array, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """`gradient` of the model itself where springs are given by compliance."""
        model, springs, factors = self.response(values), self.system.compliances, self.system.factors
        assert springs is not None
        place = np.full(len(values), -1)
        place[free] = np.arange(len(free))
        broad = free[np.bincount(factors.owner, minlength=len(values))[free] > _FEW_COLUMNS]
        columns = factors.columns(np.setdiff1d(free, broad))
        slopes = compliant.by_columns(
            model, factors.vectors[:, columns], factors.power[columns], factors.weight[columns]
        )
        h = model.h()
        found = np.zeros((*h.shape, len(free)), dtype=complex)
        owners = factors.owner[columns], springs.compliance[springs.owner], springs.retardation[springs.owner]
        for one, owner in zip((slopes, *compliant.by_springs(model)), owners, strict=True):
            compliant.add_gradient(found, model, one, place[owner])
        if len(broad):
            roles = ("stiffness", "damping", "mass")
            changes = {power: self.system.terms[role][broad] for power, role in enumerate(roles)}
            found[..., place[broad]] += compliant.by_matrices(model, changes)
        if np.any(self._shortening[free]):
            found += compliant.shortened(model)[..., None] * self._shortening[free]
        return h, found

    def _impacted(self, simulated: SimulatedImpact, values: Array) -> Complex:
        """What a hammer impact measures of a nonlinear system."""
        flat = values.reshape(-1, values.shape[-1])
        s = self.s_at(flat)
        impacted = self._simulator.each(simulated, flat, s)
        lines = np.broadcast_to(s, (len(flat), s.shape[-1]))
        models = zip(*self.system.matrices(flat), lines, impacted, strict=True)
        h = [
            impacted_frf((m, c, k), line, self.out, self.force, POWER[self.data.quantity], one)
            for m, c, k, line, one in models
        ]
        return np.array(h).reshape(*values.shape[:-1], *h[0].shape)

    @cached_property
    def _simulator(self) -> ImpactSimulator:
        """The simulator that it shares, or one of its own."""
        return self.simulator or together([self])

    def s_at(self, values: Array) -> Complex:
        """(lines,) or (..., lines): where the model is evaluated; elsewhere than stated where an effect
        corrects the window's decay.
        """
        return self.data.s + (values @ self.decay)[..., None] if np.any(self.decay) else self.data.s

    def end_at(self, values: Array) -> float | None:
        """How long after the impact the record ends at values (parameters,), but not with hysteretic damping,
        which has no free motion in time.
        """
        end = self._ends(values)
        return None if end is None else float(end)

    def _ends(self, values: Array) -> Array | None:
        """The same (...) at each of some values (..., parameters)."""
        if self.record is None or self.system.is_hysteretic:
            return None
        return np.asarray(self.record - values @ self._shortening)

    @cached_property
    def _shortening(self) -> Array:
        """(parameters,): by how much each parameter shortens what the record has of the response."""
        return self._by_readings(lambda reading: reading.shortening())

    @cached_property
    def decay(self) -> Array:
        """(parameters,): what each parameter adds to the decay of the window."""
        return self._by_readings(lambda reading: reading.decay())

    def _by_readings(self, of: Callable[[Reading], float]) -> Array:
        """(parameters,): what a unit of each does by the reading that owns it."""
        found = np.zeros(len(self.system.terms["stiffness"]))
        for reading, numbers in self.readings:
            found[numbers] += of(reading)
        return found

    def predict_pairs(self, values: Array) -> Complex:
        """(..., lines, pairs) at parameter values (..., parameters)."""
        return self.paired(self.predict(values))

    def paired(self, h: Complex) -> Complex:
        """(..., lines, outputs, inputs) as (..., lines, pairs)."""
        outputs, inputs = self.pairs
        if len(outputs) == h.shape[-2] * h.shape[-1]:
            return h.reshape(*h.shape[:-2], -1)
        return np.asarray(h[..., outputs, inputs])

    def gradient(self, values: Array, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """(lines, outputs, inputs) and its derivatives (lines, outputs, inputs, free) at values
        (parameters,).
        """
        if self._errs(values):
            return self._gradient_with_errors(values, free)
        s, decay = self.s_at(values), self.decay[free]
        if self.system.compliances is not None:
            h, gradient = self._compliant_gradient(values, free)
        else:
            h, gradient = self._linear_gradient(values, s, free)
        if np.any(decay):
            gradient = gradient + self._slope(values)[..., None] * decay
        place = np.full(len(values), -1)
        place[free] = np.arange(len(free))
        for reading, numbers in self.instruments:
            own, known = values[numbers], place[numbers] >= 0
            flat = gradient.reshape(*gradient.shape[:2], -1)
            read = reading.apply(flat, own, s).reshape(gradient.shape)
            read[..., place[numbers[known]]] += reading.slopes(h, own, s)[..., known]
            if np.any(decay):
                read += reading.along_s(h, own, s)[..., None] * decay
            gradient = read
            h = reading.apply(h, own, s)
        outputs = len(self.data.outputs)
        turned = self._at_once(np.swapaxes(gradient[:, :outputs], 2, 3))
        return self._at_once(h[:, :outputs]), np.swapaxes(turned, 2, 3)

    def _linear_gradient(self, values: Array, s: Complex, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """`gradient` of the model itself, about the motion that is simulated where it is not linear."""
        matrices, factors = self.system.matrices(values), self.system.factors
        at = (s, self.out, self.force, POWER[self.data.quantity])
        if self.simulated is not None:
            impacted = self._simulator.impacted(self.simulated, values, s, free)
            return gradient_with(impacted, matrices, factors, *at, free)
        record = self.end_at(values)
        end = None if record is None else end_of_record(matrices, factors, s, self.force, record, free)
        h, gradient = gradient_with(end, matrices, factors, *at, free)
        if end is not None and np.any(self._shortening[free]):
            shortened = end.shortened(matrices, s, self.out, at[-1])
            gradient = gradient + shortened[..., None] * self._shortening[free]
        return h, gradient

    def _gradient_with_errors(self, values: Array, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """`gradient` where values of nuisances follow those of the parameters."""
        h, slopes = self.parameter_gradient(values, free)
        gradient = np.zeros((*h.shape, len(free)), dtype=complex)
        gradient[..., free < len(self.system.parameters)] = slopes
        column = {number: position for position, number in enumerate(free.tolist())}
        for block in self.blocks(values) if len(free) > slopes.shape[-1] else ():
            known = [n for n, number in enumerate(block.numbers.tolist()) if number in column]
            columns = [column[int(block.numbers[n])] for n in known]
            for source, position in zip(known, columns, strict=True):
                gradient[..., position][:, block.channels] += block.slopes[..., source]
        return h, gradient

    def parameter_gradient(self, values: Array, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """(lines, outputs, inputs) at values (unknowns,), and its derivatives with respect to those of the
        free unknowns that are parameters.
        """
        size = len(self.system.parameters)
        there, delay = self.realised(values[size:])
        return self.late_gradient(there, delay, values[:size], free[free < size])

    def late_gradient(
        self, there: FrfTarget, delay: float, values: Array, free: NDArray[np.intp]
    ) -> tuple[Complex, Complex]:
        """The same of `there`, of this target with errors, all responses late by a delay; values and free
        are of the parameters alone.
        """
        h, slopes = there.gradient(values, free)
        late = np.exp(-delay * there.s_at(values))[:, None, None]
        if np.any(self.decay[free]):
            slopes = slopes - delay * h[..., None] * self.decay[free]
        return h * late, slopes * late[..., None]

    def _slope(self, values: Array) -> Complex:
        """(lines, outputs, inputs): dH/ds."""
        if self.simulated is None and self.system.compliances is not None:
            return compliant.along_s(self.response(values))
        matrices, power = self.system.matrices(values), POWER[self.data.quantity]
        if self.simulated is None:
            return frf_slope(matrices, self.s_at(values), self.out, self.force, power, self.end_at(values))
        either = [self.s_at(values) + change for change in (_CHANGE, -_CHANGE)]
        impacted = [self._simulator.each(self.simulated, values[None], s)[0] for s in either]
        up, down = (
            impacted_frf(matrices, s, self.out, self.force, power, one)
            for s, one in zip(either, impacted, strict=True)
        )
        return np.asarray((up - down) / (2 * _CHANGE))

    def gradient_pairs(self, values: Array, free: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """(lines, pairs) and its derivatives (lines, pairs, free) at values (parameters,)."""
        h, gradient = self.gradient(values, free)
        outputs, inputs = self.pairs
        if len(outputs) == h[0].size:
            return self.paired(h), gradient.reshape(len(gradient), -1, len(free))
        return self.paired(h), gradient[:, outputs, inputs]

    def chunks(self, candidates: int) -> list[slice]:
        """Slices of a population, of about the same length, small enough to predict at once."""
        size = self.data.frf.size + len(self.data.s) * len(self.system.coordinates)
        step = max(1, _CHUNK // max(1, size))
        count = -(-candidates // step)
        return [slice(n * candidates // count, (n + 1) * candidates // count) for n in range(count)]


def together(targets: Sequence[FrfTarget]) -> ImpactSimulator:
    """Simulates the impacts on nonlinear systems of some targets together."""
    return ImpactSimulator(
        [one.simulated for one in targets if one.simulated is not None],
        [of.impact_with_errors for of in targets if of.simulated is not None and of.nuisances is not None],
    )
