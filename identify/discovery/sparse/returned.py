"""What has evidence once nothing is rigid: a spring that was taken out, or never entered, because others made
up for it on the way.
"""

from __future__ import annotations

from identify.core.parameters import DampingValues
from identify.core.thresholds import CONVINCING
from identify.discovery.sparse.dense import with_more
from identify.discovery.sparse.evidence import supports, weighed
from identify.discovery.sparse.fit import beside, gone_on, of_units
from identify.discovery.sparse.prune import Pruned, Say, Unseen, pruned
from identify.model.effects.base import Effect
from identify.model.effects.springs import Springs
from identify.vibration.all_springs import usual_springs


def returned(model: Pruned, say: Say, unseen: Unseen | None) -> Pruned:
    """The model with springs that have evidence beside all others, none of which is rigid; itself where there
    are none, or it is not likelier with them.
    """
    found = model.found
    springs = usual_springs(with_more(found.study, found.effects), found.values)
    every = beside(found, springs)
    odds = supports(every.unknowns, every.x, weighed(every.unknowns, every.product, model.inflated))
    new = [unit for unit in every.unknowns.units if unit.effect in springs and odds[unit.name] > CONVINCING]
    if not new:
        return model
    say(f"With evidence where nothing is rigid: {', '.join(sorted(unit.name for unit in new))}.")
    effects = (*found.effects, *(_of_unknown_size(one) for one in of_units(every, new)))
    again = pruned(gone_on(found, effects, every.values), say, unseen)
    return max(model, again, key=lambda one: one.found.log_evidence)


def _of_unknown_size(effect: Effect) -> Effect:
    """A spring of which nothing is known before the data."""
    dampers = ("damping",) if isinstance(effect, Springs) else ("bending_damping", "torsion_damping")
    damped = dict.fromkeys(dampers, DampingValues())
    return effect.model_copy(update={"compliance_std": None, **damped})
