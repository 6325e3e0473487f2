"""The unknowns of a dense model: which are amplitudes, in which groups, and what is known of them before
any data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np

from identify.core.arrays import Array, Index, Mask
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import Effect
from identify.model.effects.coupling import SHARE, first_of, is_between
from identify.model.effects.measurement import MeasurementEffect
from identify.robot.posture import AXES
from identify.vibration.problem import Problem

_GUESS_STD = 1.0
"""Of the logarithm of a study's own parameters about its first guesses: what flat directions and trials on
part of the band must not carry away.
"""
_MEASURED_STD = 1.0
"""Of an entry of a sensor's matrix, the logarithm of a gain: errors of more than a factor of three are
rare.
"""
_OF_BOUND = 2.5
_NOTHING = 1e-12
"""An amplitude that is none."""


@dataclass(frozen=True)
class Unit:
    """What is present or absent as a whole: numbers of its amplitudes among the free unknowns, and of all
    that goes with it, such as retardation times; priced: shrunk, unless it entered by itself; sized: with a
    size that is never nothing, such as the mass of a resonator.
    """

    effect: Effect
    name: str
    amplitudes: Index
    all: Index
    priced: bool = True
    sized: bool = False


@dataclass(frozen=True)
class Unknowns:
    """Free unknowns (f,) of a problem; known: how many effects the study itself has, which are not asked
    for; entered: effects that entered by themselves, which no price takes away.
    """

    problem: Problem
    known: int
    entered: tuple[Effect, ...] = ()

    @cached_property
    def count(self) -> int:
        """Real numbers measured."""
        return sum(2 * target.sigma.size for target in self.problem.targets().frf)

    @cached_property
    def free(self) -> Index:
        """Their numbers among all."""
        return np.array([n for n, p in enumerate(self.problem.parameters) if p.free], dtype=int)

    @cached_property
    def names(self) -> list[str]:
        """Of the free ones."""
        return [self.problem.parameters[n].name for n in self.free]

    @cached_property
    def log(self) -> Mask:
        """Searched by logarithm."""
        return np.array([self.problem.parameters[n].log for n in self.free], dtype=bool)

    @cached_property
    def springs(self) -> Mask:
        """Compliances."""
        return np.array([name.endswith(".compliance") for name in self.names], dtype=bool)

    @cached_property
    def times(self) -> Mask:
        """Retardation times."""
        return np.array([name.endswith(".retardation_time") for name in self.names], dtype=bool)

    @cached_property
    def nuisances(self) -> Mask:
        """Nuisance parameters, in their standard deviations."""
        return np.array([self.problem.parameters[n].nuisance for n in self.free], dtype=bool)

    @cached_property
    def counts(self) -> Array:
        """(f,): how many parameters each counts as when it is priced."""
        places = (name.rpartition(".")[0] for name in self.names)
        return np.array([SHARE if is_between(place) else 1.0 for place in places])

    @cached_property
    def size(self) -> float:
        """How many parameters all of them are, but for nuisance parameters, and settings that were found."""
        return float(self.counts[~self.nuisances].sum()) + self._settings

    def size_at(self, x: Array) -> float:
        """The same without compliances that are absent at x (f,)."""
        return float(self.counted(x)[~self.nuisances].sum()) + self._settings

    @cached_property
    def _settings(self) -> int:
        return sum(one.settings_found for one in self.problem.file.study.effects[self.known :])

    @cached_property
    def coupled(self) -> Mask:
        """All of coupled bearings: their directions are one matrix, and stand for each other."""
        found = np.zeros(len(self.free), dtype=bool)
        for unit in self.units:
            found[unit.all] = np.any(self.counts[unit.amplitudes] < 1)
        return found

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """Lower and upper bounds, on the search scale; nuisance parameters have none."""
        own = [self.problem.parameters[n] for n in self.free]
        lower, upper = (np.array([getattr(p, side) for p in own]) for side in ("lower", "upper"))
        with np.errstate(all="ignore"):
            scaled = [np.where(self.log, np.log(side), side) for side in (lower, upper)]
        error = self.nuisances
        return np.where(error, -np.inf, scaled[0]), np.where(error, np.inf, scaled[1])

    @cached_property
    def units(self) -> list[Unit]:
        """What may be missing: axes of springs by what carries them, sensors, forces, the delay, bodies."""
        place = {number: position for position, number in enumerate(self.free.tolist())}
        found: list[Unit] = []
        for effect, numbers in self.problem.measurements[0].system.effects[self.known :]:
            own = np.array([place[n] for n in numbers.tolist() if n in place], dtype=int)
            if not effect.of_measurement and self._entered(own):
                found.append(Unit(effect, effect.sentence(), own, own, priced=False, sized=True))
                continue
            pairs = [(_unit_of(effect, self.names[n]), n) for n in own]
            for name, some in groupby(sorted(pairs), key=lambda pair: pair[0]):
                every = np.array([n for _, n in some], dtype=int)
                carried = self.springs[every] if self.springs[own].any() else np.full(len(every), True)
                found.append(Unit(effect, name, every[carried], every, effect not in self.entered))
        return found

    def _entered(self, own: Index) -> bool:
        """Whether unknowns are those of an effect that has a size, which no price takes away; what springs
        carry, as they do a rotor, goes with them.
        """
        return bool(np.any(self.log[own] & ~self.times[own]) and not self.springs[own].any())

    def away(self, x: Array) -> Array:
        """(f,): how far x is from where nothing is added, on the search scale; all that an effect with a
        size of its own multiplies its matrices by counts as one.
        """
        found = x - self.reference
        for unit in self.units:
            if unit.sized:
                found[unit.amplitudes] = np.where(self.log[unit.amplitudes], 1.0, found[unit.amplitudes])
        return found

    @cached_property
    def reference(self) -> Array:
        """(f,) on the search scale: where priors are centred; zero for compliances and nuisances."""
        return np.where(self.springs | self.nuisances, 0.0, self.to_x(self.problem.initial))

    @cached_property
    def _own(self) -> Mask:
        """Of the study's own effects."""
        own = [n for _, numbers in self.problem.measurements[0].system.effects[: self.known] for n in numbers]
        return np.isin(self.free, own)

    @cached_property
    def with_prior(self) -> Mask:
        """(f,): of what something is known before any data, which is not priced once more."""
        return self._prior_std > 0

    @cached_property
    def _prior_std(self) -> Array:
        return np.array([self.problem.parameters[n].prior_std for n in self.free], dtype=float)

    @cached_property
    def usual_compliance(self) -> Array:
        """(f,): of bearings, base and mounts that may be missing, what is usual, where that is known; zero
        else.
        """
        along_axes = np.array([name.partition(".")[2].partition(".")[0] in AXES for name in self.names])
        return np.where(self.springs & ~self._own & along_axes, self._prior_std, 0.0)

    @cached_property
    def precision(self) -> Array:
        """(f,) of normal priors about the reference; zero where nothing is known before, and where a prior is
        not normal.
        """
        found = np.where(self.log & self._own, _GUESS_STD**-2, 0.0)
        normal = self.with_prior & (self.usual_compliance == 0)
        found[normal] = self._prior_std[normal] ** -2
        found[self.nuisances] = 1.0
        for unit in self.units:
            if isinstance(unit.effect, MeasurementEffect):
                found[unit.amplitudes] = self.usual(unit) ** -2
        return found

    def precision_at(self, x: Array) -> Array:
        """(f,): the same, with half Cauchy priors of compliances by the normal ones that touch them at x."""
        usual = self.usual_compliance
        heavy = 2 / np.where(usual > 0, usual**2 + x**2, 1.0)
        return np.where(usual > 0, heavy, self.precision)

    def unlikely(self, x: Array) -> float:
        """Minus the logarithm of all priors at x (f,) but for a constant: most bearings give way about as
        usual, and a few far more.
        """
        usual, away = self.usual_compliance, x - self.reference
        heavy = np.log1p((x[usual > 0] / usual[usual > 0]) ** 2)
        return float(0.5 * self.precision @ away**2 + heavy.sum())

    def usual(self, unit: Unit) -> float:
        """By how much a fault of the measurement is off where there is one: standard deviation on the search
        scale; what has bounds of its own and is no matrix, such as a delay, by 40 % of that.
        """
        [first, *_] = unit.amplitudes
        bounded = not self.log[first] and "matrix_" not in self.names[first]
        return self.limits[1][first] / _OF_BOUND if bounded else _MEASURED_STD

    def present(self, x: Array) -> Mask:
        """(f,): all but compliances of zero with their retardation times, and groups that move next to
        nothing.
        """
        moving = np.ones(len(x), dtype=bool)
        for unit in self.units:
            away = self.away(x)[unit.amplitudes]
            if not np.any(np.abs(away) > _NOTHING):
                moving[unit.all] = False
        absent = self.springs & (x == 0)
        moving[absent] = False
        names = {self.names[n].removesuffix(".compliance") for n in np.flatnonzero(absent)}
        late = [name.removesuffix(".retardation_time") in names for name in self.names]
        return moving & ~(np.array(late) & ~self.springs)

    def counted(self, x: Array) -> Array:
        """(f,): how many parameters each counts as at x (f,); compliances that are absent do not."""
        absent = (self.springs | self.times) & ~self.coupled & ~self.present(x)
        return np.where(absent, 0.0, self.counts)

    def moved(self, unit: Unit, x: Array, product: Array) -> float:
        """Units of noise by which a unit moves the FRFs at x (f,); product (f + 1, f + 1) of [J r]."""
        away = self.away(x)[unit.amplitudes]
        squares = float(away @ product[np.ix_(unit.amplitudes, unit.amplitudes)] @ away)
        return float(np.sqrt(max(squares, 0.0)))

    def soft(self, units: Sequence[Unit], x: Array) -> list[str]:
        """Places that give way at x (f,), such as rx, of units of springs."""
        return [self.names[n].split(".")[1] for unit in units for n in unit.amplitudes if x[n] > 0]

    def by_name(self, x: Array) -> dict[str, float]:
        """Values of all unknowns at x (f,), by name."""
        every = self.to_values(x)
        return {p.name: float(value) for p, value in zip(self.problem.parameters, every, strict=True)}

    def at(self, values: Mapping[str, float]) -> Array:
        """(f,): values by name; bearings are rigid and all else where it begins where there is none."""
        rigid = {p.name: 0.0 for p in self.problem.parameters if p.name.endswith(".compliance")}
        known = {**rigid, **values}
        return self.to_x(np.array([known.get(p.name, p.initial) for p in self.problem.parameters]))

    def to_x(self, values: Array) -> Array:
        """(f,) on the search scale, of values of all unknowns."""
        own = values[self.free]
        return np.where(self.log, np.log(np.where(self.log, own, 1.0)), own)

    def to_values(self, x: Array) -> Array:
        """Values of all unknowns; those that are not free keep theirs."""
        values = self.problem.initial.copy()
        values[self.free] = np.where(self.log, np.exp(np.where(self.log, x, 0.0)), x)
        return values


_CLASSES = {"rx": "tilt", "ry": "tilt", "tx": "radial", "ty": "radial", "tz": "axial", "rz": "turning"}


def _unit_of(effect: Effect, name: str) -> str:
    """The name of the unit that an unknown of an effect belongs to."""
    body, _, rest = name.partition(".")
    axis = first_of(rest.partition(".")[0])
    if axis in ("relaxation", "rotor"):
        return f"{body}.{axis}"
    if axis in _CLASSES and not body.startswith("payload"):
        return f"{body}.{_CLASSES[axis]}"
    if isinstance(effect, AddedMass):
        return f"{body}.body"  # the link may bend, too
    if isinstance(effect, MeasurementEffect) or "matrix_" in name:
        return name.rpartition(".")[0] if effect.kind != "sensor-matrix" else body
    return body
