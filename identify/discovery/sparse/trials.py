"""What a dense fit may lack that is not among its springs, each with what it would gain at first order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from identify.core.thresholds import CLOSED
from identify.discovery.sparse.couplings import couplings
from identify.discovery.sparse.dense import (
    bodies,
    exchanged,
    in_parts,
    instruments,
    links,
    relaxations,
    rotors,
)
from identify.discovery.sparse.dictionary import Beside, candidates
from identify.discovery.sparse.fit import Found
from identify.discovery.sparse.prune import SEEN
from identify.discovery.sparse.quadratic import Quadratic
from identify.discovery.sparse.spring_places import moved_springs
from identify.discovery.sparse.unknowns import Unit
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_matrix import SensorMatrix


class Trial(NamedTuple):
    """What may go on: what it would gain at first order, its effects, the values that new ones begin with,
    and how many unknowns it adds.
    """

    gain: float
    effects: tuple[Effect, ...]
    values: Mapping[str, float]
    size: int


def trials(found: Found) -> Iterator[Trial]:
    """Everything that may go on."""
    yield from _linear(found)
    for effects, values in by_parts(found):
        yield Trial(_foreseen(found, effects, values), effects, values, len(values))
    yield from _coupled(found)
    beside = Beside.of(found.unknowns, found.x, found.product)
    for gain, effects, size in moved_springs(found.study, found.effects, beside):
        yield Trial(gain, effects, {}, size)
    for one in candidates(found.problem, beside):
        yield Trial(one.gain, (*found.effects, one.effect), one.values, len(one.values))


def _linear(found: Found) -> Iterator[Trial]:
    """Instruments, relaxations, rotors, bodies, links that bend: all of a family at once, and each of them
    alone.
    """
    study = found.study
    families = instruments(study), relaxations(study), rotors(found.problem), _bodies(found), links(study)
    absent = [new for some in families if (new := _absent(found, some))]
    if not absent:
        return
    local = Quadratic.about(found, (*found.effects, *(one for some in absent for one in some)), {})
    for some in absent:
        own = [unit for unit in local.units if unit.effect in some]
        yield Trial(local.gain(own), (*found.effects, *some), {}, sum(len(unit.all) for unit in own))
        if len(own) > 1:
            for unit in own:
                values = local.there([unit]) if found.gap < CLOSED else {}
                yield Trial(local.gain([unit]), (*found.effects, _alone(unit)), values, len(unit.all))


def _absent(found: Found, some: Sequence[Effect]) -> list[Effect]:
    """Those that a fit does not have; of sensors those that are not free."""
    free = {point for one in found.effects if isinstance(one, SensorMatrix) for point in one.points}
    bent = {one.link for one in found.effects if isinstance(one, LinkFlexibility)}
    present = {one.sentence() for one in found.effects}
    rest = list[Effect]()
    for one in some:
        if isinstance(one, SensorMatrix):
            points = [point for point in one.points if point not in free]
            rest += [one.model_copy(update={"points": points})] if points else []
        elif one.sentence() not in present and not (isinstance(one, LinkFlexibility) and one.link in bent):
            rest.append(one)
    return rest


def _alone(unit: Unit) -> Effect:
    """The effect with that unit alone."""
    if not isinstance(unit.effect, SensorMatrix):
        return unit.effect
    points = [point for point in unit.effect.points if str(point) == unit.name]
    return unit.effect.model_copy(update={"points": points})


def _bodies(found: Found) -> Sequence[Effect]:
    """Not beside free sensors, which take up any scale of the masses."""
    free = any(isinstance(one, SensorMatrix) for one in found.effects)
    return () if free else bodies(found.study)


def _foreseen(found: Found, effects: tuple[Effect, ...], values: Mapping[str, float]) -> float:
    """What other effects would gain where they begin."""
    local = Quadratic.about(found, effects, values)
    return local.gain([unit for unit in local.units if unit.effect not in found.effects])


def bent_links(found: Found) -> set[str]:
    """Names of the links whose bending moves more than what is left."""
    unknowns = found.unknowns
    return {
        unit.effect.link
        for unit in unknowns.units
        if isinstance(unit.effect, LinkFlexibility)
        and not unit.effect.nonuniform
        and unknowns.moved(unit, found.x, found.product) > SEEN * found.gap
    }


def by_parts(found: Found) -> Iterator[tuple[tuple[Effect, ...], dict[str, float]]]:
    """The effects with all links by parts that bend, and the values of these; nothing where none does."""
    if bent := bent_links(found):
        yield tuple(in_parts(found.effects, bent)), _parts(found, bent)


def _coupled(found: Found) -> Iterator[Trial]:
    """The springs across z of one body coupled, where any of these gives way, and of all of them."""
    for gain, pairs in couplings(found, together=True):
        size = sum(2 * len(turned.pairs) for _, turned in pairs)
        yield Trial(gain, exchanged(found.effects, pairs), {}, size)


def _parts(found: Found, bent: set[str]) -> dict[str, float]:
    """Values of parts that are as stiff as the whole."""
    values, more = found.values, dict[str, float]()
    for link in bent:
        for what in ("bending_1", "bending_2", "torsion"):
            for role in ("compliance", "retardation_time"):
                own = values[f"{link}.{what}.{role}"]
                more |= {f"{link}.{what}.part_{n}.{role}": own for n in (1, 2, 3)}
    return more
