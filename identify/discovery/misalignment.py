"""A measured law on a single coordinate may act about an axis that is turned a little from it.

As that of a strut (`identify.discovery.strut`), its direction does not enter the model linearly: it is fitted
here, with the dynamic stiffness of the place without a law, and is a setting of the effect from then on.
"""

from __future__ import annotations

from identify.core.thresholds import QUIET
from identify.discovery.places.curve import misalignment_of, seen
from identify.discovery.places.settled import settled
from identify.discovery.places.weighted import weighted_fit
from identify.discovery.task import Task, Trial
from identify.model.effects.base import Effect
from identify.model.effects.measured_impedance import MeasuredImpedance
from identify.model.effects.place import Release
from identify.vibration.problem import Problem, with_effects


def may_be_misaligned(effect: Effect) -> bool:
    """Whether it is a law on one coordinate that it releases, and has no direction yet."""
    single = isinstance(effect, MeasuredImpedance) and effect.released and len(effect.at) == 1
    return single and not getattr(effect, "misalignment", None)


def misaligned_task(problem: Problem, trial: Trial) -> Task | None:
    """The law of a trial about the axis that its curve has, to be refitted; None where it has none, no other
    direction is seen, or where without a law more than noise is left: what else is missing would turn it.
    """
    [law] = trial.task.new
    if not may_be_misaligned(law):
        return None
    [place] = law.places(problem.robot, problem.points)
    known = with_effects(problem, trial.task.known, trial.values)
    found = settled(known, place, law, trial.values)
    if found is None:
        return None
    towards = found.model.place.towards if isinstance(found.model.place, Release) else ()
    if not towards or found.fit.gap > QUIET:
        return None
    end = weighted_fit(found.model, found.fit, found.scale)
    misalignment = misalignment_of(found.model, end, found.scale)
    if not seen(misalignment).any():
        return None
    by = {name: round(float(one), 6) for name, (one, _) in zip(towards, misalignment, strict=True)}
    return Task(trial.task.known, (law.model_copy(update={"misalignment": by}),), trial.values, whole=True)
