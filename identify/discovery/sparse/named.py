"""What stayed of a fit, as effects of the catalogue."""

from __future__ import annotations

from collections.abc import Mapping

from identify.discovery.sparse import names
from identify.discovery.sparse.evidence import fault_of, weighed
from identify.discovery.sparse.fit import Found
from identify.discovery.sparse.names import Named
from identify.model.effects.added_mass import AddedMass
from identify.model.effects.geared import RotorInertia
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_mass import SensorMass
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.model.effects.springs import Springs
from identify.vibration.problem import Problem


def named(found: Found, evidence: Mapping[str, float], inflated: float) -> list[Named]:
    """The units that stayed as effects of the catalogue, the best supported first."""
    values, result = found.values, list[Named]()
    known = weighed(found.unknowns, found.x, found.product, inflated)
    for unit in found.unknowns.units:
        if not found.unknowns.away(found.x)[unit.amplitudes].any():
            continue  # of a model that is kept although a smaller one has more evidence
        mine = {found.unknowns.names[n] for n in unit.all}
        effect, own = unit.effect, {name: value for name, value in values.items() if name in mine}
        if isinstance(effect, Springs | LinkFlexibility):
            effect, own = names.of_springs(effect, unit.name, own)
        elif isinstance(effect, RotorInertia):
            effect, own = names.of_rotor(effect, own)
        elif isinstance(effect, AddedMass):
            effect, own = names.of_body(effect, values)
        elif isinstance(effect, SensorMass):
            effect = SensorMass()
        elif isinstance(effect, SensorMatrix):
            effect, own, _ = fault_of(unit, found.unknowns, found.x, known)
        result.append(Named(effect, own, evidence[unit.name]))
    found_all = names.of_all_forces(result, _forces(found.problem))
    return sorted(found_all, key=lambda one: -one.evidence)


def _forces(problem: Problem) -> int:
    """How many forces the measurements have."""
    return len({(c.node, abs(c.direction)) for m in problem.measurements for c in m.given.inputs})
