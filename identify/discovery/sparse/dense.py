"""The dense model: what a study has and, at amplitude zero, every spring, sensor matrix, gain, delay and
body that may be missing from it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from identify.core.parameters import DampingValues, Values
from identify.core.plugin import left_out_where_broken
from identify.measured.channel import Channel
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.base import EFFECTS, Effect
from identify.model.effects.frf_gain import FrfGain
from identify.model.effects.geared import RATIO, RotorInertia
from identify.model.effects.joint_relaxation import JointRelaxation
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.place import Column, Place
from identify.model.effects.sensor_mass import SensorMass
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.vibration.all_springs import all_springs
from identify.vibration.problem import Problem, with_effects

_RELAXES, _ROTOR, _LOSSY = 0.5, 0.3, 0.5
"""Of the compliance of a drive at most; of the inertia that its joint moves, and the damping ratio of what
holds it, to begin with.
"""


def instruments(problem: Problem) -> list[Effect]:
    """Every sensor with its mass, force and the delay."""
    return [*_of_measurement(problem), *_of_sensors(problem)]


def relaxations(problem: Problem) -> list[Effect]:
    """Of every drive that the study has a stiffness of; what relaxes is at most half as compliant as the
    drive was to begin with: more would be a drive of its own.
    """
    found = list[Effect]()
    for number, stiffness in _drives(problem):
        most = Values(initial=0.01 / stiffness, bounds=(0.0, _RELAXES / stiffness))
        found.append(JointRelaxation(joints=[number], compliance=most))
    return found


def rotors(problem: Problem) -> list[Effect]:
    """Of every drive that the study has a stiffness of and no rotor, held fast to begin with: what a servo
    loop or a brake gives way is at most as compliant as the drive was.
    """
    site, known = problem.measurements[0].system.site, {one.name for one in problem.parameters}
    found = list[Effect]()
    for number, stiffness in _drives(problem):
        if f"joint{number}.rotor.inertia" not in known:
            inertia = site.carried(f"joint{number}.rz") * _ROTOR / RATIO**2
            found.append(
                RotorInertia(
                    joints=[number],
                    gear_ratio=[RATIO],
                    inertia=Values(initial=float(f"{inertia:.3g}")),
                    holding_stiffness=Values(bounds=(stiffness, 1e6 * stiffness)),
                    holding_damping=DampingValues(damping_ratio=_LOSSY),
                    shrink=True,
                )
            )
    return found


def _drives(problem: Problem) -> Iterator[tuple[int, float]]:
    """Joints that the study has a drive stiffness of, from 1, and what that was to begin with."""
    starts = problem.starts
    for number in range(1, len(problem.robot.joints) + 1):
        stiffness = starts.get(f"joint{number}.rz.stiffness")
        if stiffness is not None:
            yield number, stiffness


def in_parts(effects: Sequence[Effect], bent: set[str]) -> list[Effect]:
    """The same with links that bend in parts of their own."""
    return [
        one.model_copy(update={"nonuniform": True})
        if isinstance(one, LinkFlexibility) and one.link in bent
        else one
        for one in effects
    ]


def exchanged(effects: Sequence[Effect], pairs: Sequence[tuple[Effect, Effect]]) -> tuple[Effect, ...]:
    """The effects with others in the places of some."""
    return tuple(next((new for old, new in pairs if old == one), one) for one in effects)


def with_more(problem: Problem, effects: Sequence[Effect]) -> Problem:
    """The problem with effects beyond those of its study."""
    return with_effects(problem, [*problem.file.study.effects, *effects], {})


def _of_measurement(problem: Problem) -> list[Effect]:
    """A matrix of every sensor, a gain of every force, and what is nothing at zero for all FRFs alike, such
    as a delay, where the study has none.
    """
    data = [m.given for m in problem.measurements]
    nodes = sorted({channel.node for one in data for channel in one.outputs if abs(channel.direction) <= 3})
    forces = sorted(
        {str(Channel(channel.node, abs(channel.direction))) for one in data for channel in one.inputs}
    )
    kinds = {effect.kind for effect in problem.file.study.effects}
    wanted: list[Effect] = [SensorMatrix(points=list(nodes))] if nodes else []
    wanted += [FrfGain(force=force) for force in forces]
    return [*(effect for effect in wanted if effect.kind not in kinds), *of_all(problem)]


def of_all(problem: Problem) -> Iterator[Effect]:
    """What may be wrong with all FRFs alike, and is nothing where its parameters are zero; not what a study
    has.
    """
    present = {effect.kind for effect in problem.file.study.effects}
    for name, kind in EFFECTS.usable().items():
        if not kind.of_measurement or name in present:
            continue
        with left_out_where_broken():
            instances = kind.instances(problem.robot, problem.points)
            every = [one for one in instances if _at_no_place(one.places(problem.robot, problem.points))]
            site = problem.measurements[0].system.site
            terms = [term for one in every for term in one.terms(problem.robot, site, "")]
            if terms and all(term.parameter.initial == 0 for term in terms):
                yield from every


def _at_no_place(places: Sequence[Place]) -> bool:
    """Whether something concerns all FRFs alike."""
    return all(place == Column() for place in places)


def _of_sensors(problem: Problem) -> list[Effect]:
    """The mass of the sensors, nothing to begin with."""
    if not problem.points or any(isinstance(one, SensorMass) for one in problem.file.study.effects):
        return []
    mass = SensorMass().mass
    return [SensorMass(mass=mass.model_copy(update={"initial": 0.0}))]


def links(problem: Problem) -> list[Effect]:
    """Every link that may bend and twist, and that the study does not bend."""
    return [one for one in all_springs(problem, shrink=True) if isinstance(one, LinkFlexibility)]


def bodies(problem: Problem) -> list[Effect]:
    """A body on every moving link that the study adds none to, of nothing to begin with."""
    taken = {getattr(effect, "link", "") for effect in problem.file.study.effects}
    bodies = [one for one in AddedMass.instances(problem.robot, problem.points) if one.link not in taken]
    return [one.model_copy(update={"mass": one.mass.model_copy(update={"initial": 0.0})}) for one in bodies]
