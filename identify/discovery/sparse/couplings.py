"""Bearings whose softest directions are not those of their joint's frame."""

from __future__ import annotations

from collections.abc import Iterator

from identify.discovery.sparse.dense import exchanged
from identify.discovery.sparse.fit import Found
from identify.discovery.sparse.quadratic import Quadratic
from identify.model.effects.springs import Springs


def couplings(
    found: Found, *, together: bool = False
) -> Iterator[tuple[float, list[tuple[Springs, Springs]]]]:
    """What it gains to couple the springs across z of each body where any of these gives way, with these
    springs as they are and coupled; together: of all of them, too.
    """
    turned_any_way = {"coupled": True, "compliance_std": None}  # their directions have one price
    pairs = [(one, one.model_copy(update=turned_any_way)) for one in _uncoupled(found)]
    if not pairs:
        return
    local = Quadratic.about(found, exchanged(found.effects, pairs), {})
    for some in [*([pair] for pair in pairs), *([pairs] if together and len(pairs) > 1 else [])]:
        turned = [one for _, one in some]
        yield local.gain([unit for unit in local.units if unit.effect in turned]), some


def _uncoupled(found: Found) -> Iterator[Springs]:
    """Effects whose springs across z give way and are not coupled."""
    for one in found.effects:
        if isinstance(one, Springs) and one.pairs and not one.coupled:
            soft = found.unknowns.soft([unit for unit in found.unknowns.units if unit.effect == one], found.x)
            if any(set(pair) & set(soft) for pair in one.pairs):
                yield one
