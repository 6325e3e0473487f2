"""Units without evidence taken out of a dense fit, and which of the models on the way is kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from typing import NamedTuple

from identify.core.thresholds import CLOSED, CONVINCING, MATERIAL
from identify.discovery.sparse.evidence import inflation, price, supports, weighed
from identify.discovery.sparse.fit import Found, refitted
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.vibration.problem import Problem

SEEN = 1.0
"""Units of what is left that an amplitude must move to be kept for a look at its evidence."""

FEW = 3
"""Units that explain the data, so that no other start can do with much less."""

Say = Callable[[str], None]
Unseen = Callable[[Problem, Sequence[Effect], dict[str, float]], float]
"""The gap on data that are not fitted."""


class Pruned(NamedTuple):
    """A fit of units that have evidence: log odds of each, and how much the residuals' correlation inflates
    variances.
    """

    found: Found
    evidence: dict[str, float]
    inflated: float

    @property
    def closed(self) -> bool:
        """Whether it leaves nothing open."""
        return self.found.gap < CLOSED

    @property
    def simple(self) -> bool:
        """Whether it explains the data with so little that no other start can do with much less; not where a
        link bends whose form is not uncertain.
        """
        bends = any(isinstance(unit.effect, LinkFlexibility) for unit in self.found.unknowns.units)
        forms = any(one.group == "form" for one in self.found.problem.nuisances.entries)
        return self.closed and len(self.evidence) <= FEW and (forms or not bends)


def pruned(found: Found, say: Say, unseen: Unseen | None = None) -> Pruned:
    """The fit without units that the data do not ask for, its prices gone.

    Where a gap stays, units go the least supported first, a quarter of them at most before all others are
    fitted again: what is weak beside another may be strong without it.  Of all models on the way the
    one is then kept that predicts unseen data best.
    """
    asked, least = found.unknowns, SEEN * max(found.gap, 1.0)
    found = refitted(found, [one for one in asked.units if asked.moved(one, found.x, found.product) > least])
    known = bool(found.unknowns.units)
    inflated = inflation(found.problem, found.unknowns.to_values(found.x)) if known else 1.0
    path, needed = [(found, _supports(found, inflated))], dict[str, float]()
    while gone := _gone(*path[-1], needed):
        present, support = path[-1]
        less, odds = _without(present, gone, inflated)
        if len(gone) > 1 and odds > CONVINCING:
            if present.late:
                break  # to look at each takes as long as the search
            gone = {min(gone, key=lambda name: support[name])}
            less, odds = _without(present, gone, inflated)
        if odds > CONVINCING:
            needed |= dict.fromkeys(gone, odds)
        else:
            say(f"Without evidence: {', '.join(sorted(gone))}.")
            path.append((less, _supports(less, inflated)))
    if unseen is not None and path[-1][0].gap >= CLOSED:
        return Pruned(*smallest_that_predicts(path, unseen), inflated)
    found, support = path[-1]
    return Pruned(found, support | {name: odds for name, odds in needed.items() if name in support}, inflated)


def _without(found: Found, gone: Set[str], inflated: float) -> tuple[Found, float]:
    """A fit refitted without some units, and the log odds of the fit with them over that, both at their ends:
    the curvature at one of them does not show how far the FRFs are from linear in what went.
    """
    less = refitted(found, [unit for unit in found.unknowns.units if unit.name not in gone])
    each, more = price(found.unknowns.count, inflated), found.unknowns.size_at(found.x)
    return less, (less.unpriced - found.unpriced) / inflated - each * (more - less.unknowns.size_at(less.x))


def _supports(found: Found, inflated: float) -> dict[str, float]:
    return supports(found.unknowns, found.x, weighed(found.unknowns, found.x, found.product, inflated))


def _gone(found: Found, support: Mapping[str, float], needed: Mapping[str, float]) -> set[str]:
    """Names of the units that go next, by their log odds; not those that proved to be needed."""
    loose = sorted((odds, name) for name, odds in support.items() if odds < CONVINCING and name not in needed)
    if not loose:
        return set()
    at_once = found.gap < CLOSED or found.late
    most = len(loose) if at_once else max(len(support) // 4, 1)
    return {name for odds, name in loose[:most] if odds < 0} or {loose[0][1]}


def smallest_that_predicts(
    path: Sequence[tuple[Found, dict[str, float]]], unseen: Unseen
) -> tuple[Found, dict[str, float]]:
    """Of models from large to small the smallest that predicts unseen data as well as any: what is judged
    against a gap that grows as units go would let all of them go, and against residuals that are all alike,
    as those of a wrong model are, would keep next to none.
    """
    gaps = [unseen(found.study, found.effects, found.values) for found, _ in path]
    last = max(n for n, gap in enumerate(gaps) if gap < min(gaps) * (1 + MATERIAL))
    return path[last]
