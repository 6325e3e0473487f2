"""The measured curves of a discovery: at every place that got an effect, and where something is left, the
dynamic stiffness without a law, and the law through it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import QUIET, SIGMAS_95
from identify.discovery.amplitude import acting_at
from identify.discovery.loop import Discovery
from identify.discovery.places.curve import measured_curve, seen
from identify.discovery.places.laws import rank_laws
from identify.discovery.places.predict import StructuralModel, model_of
from identify.discovery.places.screen import PlaceFit
from identify.discovery.places.settled import settled
from identify.discovery.places.update import triangle
from identify.discovery.places.views import views_of
from identify.discovery.task import Trial
from identify.model.effects.base import Effect
from identify.model.effects.measured_impedance import turned
from identify.model.effects.place import Beside, Column, Place, Release, Rows
from identify.results.curves import CurveTable, PlaceTable
from identify.vibration.problem import Measurement, Problem, with_effects

_LISTED, _MEASURED = 15, 6
"""Places of a step that are reported; added effects whose curves are measured."""


def acting(problem: Problem, found: Discovery) -> str:
    """The coordinate at which something is left that depends on amplitude (`acting_at`); empty where nothing
    is.
    """
    present = with_effects(problem, found.final.task.effects, found.final.values)
    return acting_at(present, found.final.gap)


@dataclass(frozen=True)
class Wanted:
    """A curve to be measured: beside known effects with the values of the final model, at a place of the
    structure, where an effect was added or, with None, something is left; peak_n: strength of the impacts,
    where several were used.
    """

    known: tuple[Effect, ...]
    final: Trial
    place: Place
    effect: Effect | None
    peak_n: float = float("nan")


def wanted(problem: Problem, found: Discovery, at: str = "") -> list[Wanted]:
    """One for each of the first few added effects at a place of the structure; where the gap stays open, one
    for the coordinate `at`, or without it for the place that explains most of the rest.  Errors of what was
    stated are held where the final fit ended.
    """
    every: list[Wanted] = []
    for option in found.added[:_MEASURED]:
        every += _of_effect(problem, found.final, option.effect)
    if found.final.gap > QUIET:
        place = Beside((at,)) if at else next((one.place for one in _of_the_rest(found)), None)
        if place is not None and not isinstance(place, (Rows, Column)):
            every += _by_strength(problem, Wanted(found.final.task.effects, found.final, place, None))
    return every


def _of_the_rest(found: Discovery) -> list[PlaceFit]:
    """The places that were looked at beside the effects of the final model, best first: those beside another
    may be where it has an effect already.
    """
    steps = zip(reversed(found.steps), reversed(found.places), strict=True)
    effects = found.final.task.effects
    return next((places for step, places in steps if step.before.task.effects == effects), [])


def place_table(ranked: Sequence[PlaceFit]) -> PlaceTable:
    """The best of the places that a step looked at."""
    best = ranked[:_LISTED]
    return PlaceTable(
        tuple(one.place.sentence() for one in best),
        np.array([one.fit.gap for one in best]),
        np.array([one.fit.unknowns for one in best], dtype=int),
    )


def _of_effect(problem: Problem, final: Trial, effect: Effect) -> list[Wanted]:
    known = tuple(other for other in final.task.effects if other != effect)
    places = [
        place
        for place in effect.places(problem.robot, problem.points)
        if not isinstance(place, (Rows, Column))
    ]
    return _by_strength(problem, Wanted(known, final, places[0], effect)) if places else []


def _by_strength(problem: Problem, one: Wanted) -> list[Wanted]:
    """The curve for each strength of impacts where several were used; none where the known model depends on
    amplitude, whose FRFs are not linear in what is missing.
    """
    if any(effect.of_amplitude for effect in one.known):
        return []
    hit = [m for m in problem.measurements if m.given.impact is not None]
    peaks = sorted({_peak(m) for m in hit})
    if len(peaks) < 2:
        return [one]
    fitted = {_peak(m) for m in hit if m.settings.use == "fit"}
    return [replace(one, peak_n=peak) for peak in peaks if peak in fitted]


def _peak(measurement: Measurement) -> float:
    """Strength of its impacts, N; NaN where it is not known."""
    impact = measurement.given.impact
    return float("nan") if impact is None else impact.peak


def curve_of(problem: Problem, one: Wanted) -> CurveTable | None:
    """The curve of a place of the structure; None where there is none without its effect, as in a load cell
    or in a link that is not uniform.
    """
    model = with_effects(problem, one.known, one.final.values)
    if not np.isnan(one.peak_n):
        own = tuple(m for m in model.measurements if _peak(m) == one.peak_n)
        model = replace(model, measurements=own)
    return _table(model, one.final, one.place, one.effect, one.peak_n)


def _table(
    problem: Problem, final: Trial, place: Place, effect: Effect | None, peak_n: float
) -> CurveTable | None:
    found, held = settled(problem, place, effect, final.values), bool(problem.nuisances.entries)
    if found is None:
        return None
    others = [] if held else views_of(problem, "validate")  # whose own errors nothing was fitted to
    model, fit, said = found.model, found.fit, found.law
    beyond = model_of(model.place, others) if others else None
    curve = measured_curve(model, fit, found.scale, beyond if isinstance(beyond, StructuralModel) else None)
    s = model.lines(fit.values)
    law = np.full(curve.pooled.values.shape, np.nan + 0j)
    if said is not None:
        law = triangle(said)[np.argsort(s.imag, kind="stable")]
    ranked = rank_laws(fit, model.stiffness(fit.unknown), s, model.sign)
    return CurveTable(
        place=place.sentence() + ("" if np.isnan(peak_n) else f", impacts of {peak_n:.0f} N"),
        effect="" if effect is None else effect.sentence(),
        unit=_unit(place),
        gap=fit.gap,
        entries=curve.entries,
        frequency_hz=curve.pooled.frequency_hz,
        value=curve.pooled.values,
        std_real=curve.pooled.std_real,
        std_imag=curve.pooled.std_imag,
        law=law,
        sets=tuple(one.name for one in curve.postures),
        agreement=curve.agreement,
        fitted=np.arange(len(curve.postures)) < len(model.views),
        laws=tuple(one.law.name for one in ranked),
        law_gap=np.array([one.gap for one in ranked]),
        law_log_odds=np.array([one.log_odds for one in ranked]),
        peak_n=peak_n,
        axis=_axis(model.place, curve.misalignment),
        errors_held=held,
        site=place.sentence(),
    )


def _axis(place: Place, misalignment: Array) -> str:
    """How its direction was found to differ from its coordinate, and how surely; empty where that is not
    seen.
    """
    if not isinstance(place, Release):
        return ""
    turns = ", ".join(
        turned(name, by, f" ± {SIGMAS_95 * np.degrees(np.arctan(std)):.2f}")
        for name, (by, std), clear in zip(place.towards, misalignment, seen(misalignment), strict=True)
        if clear
    )
    return f"the axis is turned from {place.coordinates[0]} by {turns}" if turns else ""


def _unit(place: Place) -> str:
    """Of the entries along one coordinate; those between translations and rotations differ by a length."""
    names = place.coordinates if isinstance(place, (Release, Beside)) else ()
    turns = [name.rsplit(".", 1)[-1].startswith("r") for name in names]
    if turns and all(turns):
        return "N m/rad"
    return "N/m" if not any(turns) else "N/m, N m/rad"
