"""A study turned into what a fit works on: the robot read, data loaded and checked, a model assembled at
every posture.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.collect import collect
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.silent import noise_alone
from identify.model.effects.base import Effect
from identify.model.effects.place import Form
from identify.model.effects.pre_trigger import PRE_TRIGGER
from identify.model.nuisances.basis import Basis, basis
from identify.model.system import System
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.read import read_robot
from identify.vibration.costs.make_target import ModalTarget, Targets, Uncertain, channel_rows, frf_target
from identify.vibration.costs.target import FrfTarget
from identify.vibration.given import Given, read_given
from identify.vibration.left_out import without_noise
from identify.vibration.like import as_in_type
from identify.vibration.nuisances.nuisance import NOTHING, Nuisances, list_nuisances
from identify.vibration.nuisances.placed import Placed, basis_points, place
from identify.vibration.nuisances.settings import UncertaintySettings
from identify.vibration.postures import Built, Postures, stand
from identify.vibration.reference import Reference, read_reference
from identify.vibration.study import MeasurementSettings, StudyFile
from identify.vibration.study_points import off_robot, points_and_placing


@dataclass(frozen=True)
class Measurement:
    """One measurement and the model at its posture (rad); `target` is what a cost compares; uncertain: places
    nuisance parameters on a system, where they are stated.
    """

    given: Given
    system: System
    target: FrfTarget | ModalTarget
    uncertain: Uncertain | None = None

    @property
    def name(self) -> str:
        """The given name, or the file's."""
        return self.given.name

    @property
    def settings(self) -> MeasurementSettings:
        """What the config says of it."""
        return self.given.settings

    def at(self, values: Array) -> tuple[System, Array]:
        """The system that nuisance parameters make, at values (unknowns,), and those of the
        parameters.
        """
        if isinstance(self.target, FrfTarget):
            there, own = self.target.at(values)
            return there.system, own
        return self.target.at(values)


@dataclass(frozen=True)
class Problem:
    """Everything a fit works on; parameters are in the order of the effects, then the nuisances."""

    file: StudyFile
    robot: Robot
    points: dict[int, Point]
    parameters: tuple[Parameter, ...]
    measurements: tuple[Measurement, ...]
    reference: Reference | None = None
    nuisances: Nuisances = NOTHING

    def __reduce__(self) -> tuple[Callable[..., Problem], tuple[Any, ...]]:
        """What it was made of: in another process the models are assembled anew."""
        return assembled, (
            self.file,
            self.robot,
            self.points,
            [m.given for m in self.measurements],
            self.starts,
            self.reference,
            None,
            self.nuisances,
        )

    @property
    def initial(self) -> Array:
        """Where the search starts, (parameters,)."""
        return np.array([p.initial for p in self.parameters])

    @property
    def starts(self) -> dict[str, float]:
        """The same by name."""
        return {p.name: p.initial for p in self.parameters}

    @property
    def size(self) -> int:
        """Number of parameters of effects; those after them are nuisances."""
        return len(self.parameters) - len(self.nuisances.entries)

    @property
    def of_effects(self) -> tuple[Parameter, ...]:
        """The parameters of effects alone."""
        return self.parameters[: self.size]

    @property
    def validated(self) -> bool:
        """Whether any measurement is not fitted but predicted."""
        return any(m.settings.use == "validate" for m in self.measurements)

    def at(self, values: Mapping[str, float]) -> Array:
        """Values by name as an array (parameters,)."""
        return np.array([values[p.name] for p in self.parameters])

    def targets(self, use: str = "fit", names: Sequence[str] | None = None) -> Targets:
        """What is to be fitted, or only predicted (`validate`); of these measurements only, if any are named.

        Raises InputError for a name that no measurement of this use has.
        """
        chosen = [
            m.target
            for m in self.measurements
            if m.settings.use == use and (names is None or m.name in names)
        ]
        known = [m.name for m in self.measurements if m.settings.use == use]
        for name in names or ():
            if name not in known:
                raise InputError(
                    "optimizer.measurements",
                    f"no measurement {name!r} is fitted",
                    "one of " + ", ".join(known),
                )
        return Targets(
            tuple(target for target in chosen if isinstance(target, FrfTarget)),
            tuple(target for target in chosen if isinstance(target, ModalTarget)),
            tuple(range(self.size, len(self.parameters))),
            tuple((n, p.std) for n, p in enumerate(self.of_effects) if p.std),
        )


def load_problem(file: StudyFile, known: Mapping[str, FrfSet] | None = None) -> Problem:
    """Read and assemble everything a study names.

    known: FRFs that `read_frfs` has read already, by names of measurements.

    Raises InputError or, where several things are wrong, InputErrors.
    """
    with file.located():
        return _loaded(file, known or {})


def _loaded(file: StudyFile, known: Mapping[str, FrfSet]) -> Problem:
    study = file.study
    robot = read_robot(study.robot, file.path.parent)
    points, placing = points_and_placing(file, robot)
    given = _connected(file, robot, points, read_given(file, robot, known, points, off_robot(placing)))
    nuisances = NOTHING
    if study.uncertainty is not None:
        if study.cost.likelihood:
            _check_uncertain(given)
        nuisances, given = _uncertain(study.uncertainty, robot, points, given)
    problem = assembled(file, robot, points, given, nuisances=nuisances)
    if not any(parameter.free for parameter in problem.of_effects):
        raise InputError(
            "effects", "every parameter is fixed", "at least one to fit", "remove `fixed: true` from one"
        )
    _check_initial(problem)
    if study.reference is None:
        return problem
    reference = read_reference(
        file.resolve(study.reference), [parameter.name for parameter in problem.parameters]
    )
    return replace(problem, reference=reference)


def _connected(
    file: StudyFile, robot: Robot, points: dict[int, Point], given: Sequence[Given]
) -> list[Given]:
    """The measurements without channels that have nothing but noise where the model moves."""
    if not any(isinstance(one.data, FrfSet) and any(noise_alone(one.data)) for one in given):
        return list(given)
    exact = file.model_copy(update={"study": file.study.model_copy(update={"uncertainty": None})})
    trial = assembled(exact, robot, points, given)
    return [
        replace(m.given, data=without_noise(m.target, trial.initial))
        if isinstance(m.target, FrfTarget)
        else m.given
        for m in trial.measurements
    ]


def _uncertain(
    settings: UncertaintySettings, robot: Robot, points: dict[int, Point], given: Sequence[Given]
) -> tuple[Nuisances, list[Given]]:
    """What is uncertain, and the measurements with what that changes of them."""
    nuisances = list_nuisances(settings, robot, points, given)
    return nuisances, [replace(one, basis=_basis(robot, points, nuisances, one)) for one in given]


def _check_uncertain(given: Sequence[Given]) -> None:
    """Raise an InputError unless all measurements are FRFs with known noise, as a likelihood needs them."""
    for one in given:
        if not isinstance(one.data, FrfSet):
            found, fix = (
                f"{one.name} is a modal table",
                "leave one of both out, or set `cost: eigenfrequency`",
            )
            raise InputError("uncertainty", found, "FRFs for the cost frf-least-squares", fix)
        if one.noise is None:
            raise InputError(
                "uncertainty",
                f"the noise of {one.name} is not known, which stated uncertainty is weighed against",
                "coherence with `averages`, or `noise`",
                "give `noise: {relative: 0.02}` in the measurement",
            )


def _basis(robot: Robot, points: Mapping[int, Point], nuisances: Nuisances, one: Given) -> Basis:
    """What nuisance parameters change of a measurement."""
    nominal = basis_points(points)
    angles, lengths = nuisances.has("joint"), nuisances.has("kinematics")
    return basis(robot, one.posture, nominal, one.settings.detached, angles=angles, lengths=lengths)


def _check_initial(problem: Problem) -> None:
    """Raise an InputError for a start value of no parameter, or out of bounds."""
    known = {p.name: p for p in problem.parameters}
    for name, value in problem.file.study.initial.items():
        if name not in known:
            raise InputError("initial", f"no parameter is called {name!r}", "one of " + ", ".join(known))
        if not known[name].lower <= value <= known[name].upper:
            raise InputError(
                f"initial.{name}",
                f"{value:g}",
                f"a value within its bounds, {known[name].lower:g} to {known[name].upper:g}",
            )


def with_effects(problem: Problem, effects: Sequence[Effect], values: Mapping[str, float]) -> Problem:
    """The same robot and data with other effects; parameters named in `values` start there.

    Raises InputError where the effects do not fit the robot or each other.
    """
    study = problem.file.study
    file = problem.file.model_copy(update={"study": study.model_copy(update={"effects": list(effects)})})
    given, known = [m.given for m in problem.measurements], list(effects[: len(study.effects)])
    new = effects[len(study.effects) :]
    same = known == list(study.effects) and not any(effect.changes_site for effect in new)
    return assembled(
        file,
        problem.robot,
        problem.points,
        given,
        values,
        problem.reference,
        already_built(problem, with_sites=same),
        problem.nuisances,
    )


def systems_with(problem: Problem, effects: Sequence[Effect]) -> list[System]:
    """What effects beyond those of the study add to the model at each measurement, and nothing of what is
    there but the coordinates: that needs neither targets nor nuisance parameters.

    Raises InputError where the effects do not fit the robot or each other.
    """
    study, changed = problem.file.study, any(effect.changes_site for effect in effects)
    built, first = already_built(problem, with_sites=not changed), problem.measurements[0].given.posture
    every, known = [*study.effects, *effects], len(study.effects)
    postures = Postures(problem.robot, problem.points, every, first, built, study.joint_angles, known)
    return [_system(postures, m.given) for m in problem.measurements]


def with_uncertainty(problem: Problem, settings: UncertaintySettings) -> Problem:
    """The same robot, data and effects where so much of what was stated is uncertain."""
    study = problem.file.study
    file = problem.file.model_copy(update={"study": study.model_copy(update={"uncertainty": settings})})
    given = [m.given for m in problem.measurements]
    nuisances, given = _uncertain(settings, problem.robot, problem.points, given)
    robot, points, reference = problem.robot, problem.points, problem.reference
    built = _all_built(problem)
    return assembled(file, robot, points, given, problem.starts, reference, built, nuisances)


def uncertain_as(problem: Problem, other: Problem) -> Problem:
    """The problem where as much is uncertain as in another; itself where it states that, or nothing is."""
    stated = other.file.study.uncertainty
    if stated is None or problem.file.study.uncertainty is not None:
        return problem
    return with_uncertainty(problem, stated)


def with_given(problem: Problem, given: Sequence[Given]) -> Problem:
    """The same robot, effects and start values with other data of the same measurements."""
    built, rest = _all_built(problem), (problem.reference, problem.nuisances)
    return assembled(
        problem.file, problem.robot, problem.points, given, problem.starts, rest[0], built, rest[1]
    )


def _all_built(problem: Problem) -> Built:
    """What a problem with the same effects on the same robot and points needs not build again."""
    still = [m for m in problem.measurements if m.settings.speed_deg_per_s is None]
    systems = {(stand(m.given.posture, m.settings.detached), m.given.driven): m.system for m in still}
    return replace(already_built(problem, with_sites=True), systems=systems)


def already_built(problem: Problem, *, with_sites: bool) -> Built:
    """The engines of a problem, with its sites where they stay as they are."""
    sites = {stand(m.given.posture, m.settings.detached): m.system.site for m in problem.measurements}
    engines = {key: site.engine for key, site in sites.items()}
    return (
        Built(engines, sites, problem.measurements[0].system.site.reference) if with_sites else Built(engines)
    )


def assembled(
    file: StudyFile,
    robot: Robot,
    points: dict[int, Point],
    given: Sequence[Given],
    values: Mapping[str, float] | None = None,
    reference: Reference | None = None,
    built: Built | None = None,
    nuisances: Nuisances = NOTHING,
) -> Problem:
    """Measurements with the model at each posture; `values` replace initial values; built: what is there
    already of the same robot and postures.
    """
    study = file.study
    postures = Postures(robot, points, study.effects, given[0].posture, built or Built(), study.joint_angles)
    forms = [form for effect in file.study.effects for form in effect.forms(robot, points)]
    if file.study.uncertainty is not None:
        nonlinear = any(effect.of_amplitude for effect in file.study.effects)
        simulated = [one for one in given if nonlinear and one.impact is not None]
        nuisances = nuisances.of_model(forms, simulated, file.study.uncertainty)
    given_values = {**file.study.initial, **(values or {})}
    measurements = collect(
        [partial(_measurement, points, postures, nuisances, forms, given_values, one) for one in given]
    )
    every = (*measurements[0].system.parameters, *nuisances.parameters)
    if study.like is not None:
        every = as_in_type(every, file.resolve(study.like.result), study.like.spread)
    parameters = tuple(p.at(given_values.get(p.name, p.initial)) for p in every)
    return Problem(file, robot, points, parameters, tuple(measurements), reference, nuisances)


def _system(postures: Postures, given: Given) -> System:
    speed = given.settings.speed_deg_per_s
    rates = None if speed is None else postures.angles.rates(speed)
    return postures.system(given.posture, given.settings.detached, rates, given.driven)


def _measurement(
    points: dict[int, Point],
    postures: Postures,
    nuisances: Nuisances,
    forms: Sequence[Form],
    values: Mapping[str, float],
    given: Given,
) -> Measurement:
    system = _system(postures, given)
    uncertain = None if given.basis is None else partial(_placed, nuisances, forms, given, points)
    if isinstance(given.data, FrfSet):
        impact = given.impact and given.impact.begun(_pre_trigger(system, values))
        known = (given.name, given.data, system, points, given.noise, given.record)
        return Measurement(given, system, frf_target(*known, impact, uncertain), uncertain)
    out = (
        channel_rows(system, points, given.data.channels, given.name)
        if given.data.shapes is not None
        else None
    )
    placed = None if uncertain is None else uncertain(system, (), ())
    return Measurement(given, system, ModalTarget(given.name, given.data, system, out, placed), uncertain)


def _pre_trigger(system: System, values: Mapping[str, float]) -> float:
    """When the impacts are in their records, s, at the start values; where they are simulated it stays
    there.
    """
    own = next((p.initial for p in system.parameters if p.name == PRE_TRIGGER), 0.0)
    return values.get(PRE_TRIGGER, own)


def _placed(
    nuisances: Nuisances,
    forms: Sequence[Form],
    given: Given,
    points: Mapping[int, Point],
    system: System,
    outputs: tuple[Channel, ...],
    inputs: tuple[Channel, ...],
) -> Placed:
    """The nuisances of a measurement."""
    assert given.basis is not None
    channels = outputs, inputs
    return place(nuisances, given.basis, system, points, given.name, given.posture, channels, forms)
