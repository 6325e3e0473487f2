"""`identify discover`, without the terminal: read a study, run the loop, write the result and the new
config.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.atomic import ELSEWHERE, write_text
from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.core.text import capital
from identify.core.threads import one_thread
from identify.discovery import sentences
from identify.discovery.advise import advise
from identify.discovery.curves import acting, curve_of, place_table, wanted
from identify.discovery.localise import band_limits, gap_map, in_words, parts
from identify.discovery.loop import Discovery, check_data, discover, with_likelihood
from identify.discovery.marks import marks
from identify.discovery.new_config import config_text, entry_of
from identify.discovery.task import Step, Trial
from identify.discovery.workers import NEEDED, Workers
from identify.fitting.fit import Fit, Start
from identify.fitting.memory import Memory
from identify.fitting.processes import several
from identify.fitting.resume import override, resumable, run_key
from identify.fitting.selection.workbench import Story
from identify.results import fit as results
from identify.results.discovery import (
    AddedEffects,
    DiscoveryResult,
    OptionTable,
    PartTable,
    StepResult,
)
from identify.results.file import check_alone
from identify.setup.fit import check_set_up
from identify.vibration.evaluate import evaluate
from identify.vibration.measured_modes import MeasuredModes, modes_of
from identify.vibration.nuisances.settings import FORMS_ALONE, IMPACTS_ALONE
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.provenance import provenance_of
from identify.vibration.study import read_study

_SHORT = "the time limit was reached before the search had ended: the result is what was found until then"


def run_discover(
    config: Path,
    out: Path | None,
    overrides: dict[str, Any],
    progress: Story,
    *,
    workers: int | None = None,
    resume: bool = False,
    as_stated: bool = False,
    time_s: float | None = None,
) -> tuple[DiscoveryResult, list[Path]]:
    """Find what is missing from the study in `config`; the result and the paths written: result file, then
    the new config, if any; workers: processes, by default one per core; as_stated: whether it goes on where
    a mistake of the set-up explains the gap, which else is an InputError; time_s: after which no further
    stage is begun, so that the best model so far is the result.

    While it runs, the part file beside the result keeps what `resume` needs; a finished run of the same study
    is not run again by it.
    """
    began = time.perf_counter()
    progress.until = math.inf if time_s is None else time.monotonic() + time_s
    file, note = with_likelihood(override(read_study(config), overrides))
    path = out or Path("reports") / f"{file.study.name}_discovery.h5"
    study = path.with_suffix(".yaml")
    if config.resolve() == study.resolve():
        raise InputError(str(config), "would be overwritten by the new study", fix=ELSEWHERE)
    check_alone(path, [study])
    if note:
        progress.say(f"{capital(note)}.")
    count = workers or os.cpu_count() or 1
    # A run that is resumed may have come to its end.
    with one_thread(), nullcontext() if resume else several(count, *NEEDED) as begun:
        problem = load_problem(file)
        check_data(problem)
        key = run_key(provenance_of(file), file, () if time_s is None else (f"time {time_s}",))

        def compute(part: PartFile) -> DiscoveryResult:
            if not as_stated:
                check_set_up(problem)
            with Workers(problem, count, Memory(part), begun) as at_work:
                at_work.seconds["reading"] = time.perf_counter() - began
                found = discover(problem, at_work, progress)
                ended = _SHORT if progress.late else ""
                searched = time.perf_counter()
                result = _result(at_work, found, key, path, began)
                result = replace(result, notes=(*filter(None, [note, ended]), *result.notes))
                at_work.seconds["measured curves and result"] = time.perf_counter() - searched
            progress.say(spent(at_work.seconds, time.perf_counter() - began))
            return result

        result = resumable(path, key, DiscoveryResult, compute, resume=resume)
    if not result.added.sentence:
        return result, [path]
    write_text(study, result.after.provenance.config)
    return result, [path, study]


def spent(seconds: Mapping[str, float], total: float) -> str:
    """Where the time went, s, longest first, with what none of it was."""
    named = {name: time for name, time in seconds.items() if name}
    named["all else"] = max(total - sum(named.values()), 0.0)
    parts = sorted(named.items(), key=lambda item: -item[1])
    return f"Time: {total:.1f} s: " + ", ".join(f"{name} {time:.1f} s" for name, time in parts) + "."


def _remarks(found: Discovery) -> list[tuple[Any, str]]:
    before, remarks = found.first.gap, []
    for option in found.added:
        remarks.append((option.effect, sentences.remark(option, before)))
        before = option.model.gap
    return remarks


def _result(at_work: Workers, found: Discovery, key: str, path: Path, began: float) -> DiscoveryResult:
    """Curves, measured modes and the present model's results are found in other processes beside all else."""
    problem, first, final = found.problem, found.first, found.final
    at = acting(problem, found)
    curves = at_work.each(curve_of, wanted(problem, found, at))
    modes = at_work.each(modes_of, [m.name for m in problem.measurements])
    after = with_effects(problem, final.task.effects, {})
    values = {p.name: final.values[p.name] for p in after.of_effects}
    text = config_text(problem.file, _remarks(found), values, path.parent)
    bands = band_limits(problem)
    map_before = gap_map(problem, problem.at(first.values), bands)
    map_after = gap_map(after, after.at(final.values), bands)
    steps = {str(number): _step(problem, found, number, bands) for number in range(len(found.steps))}
    measured = dict(zip((m.name for m in problem.measurements), modes, strict=True))
    evaluated = partial(_evaluated, key=key, measured=measured)
    before = at_work.each(evaluated, [first])
    told = replace(after, file=after.file.model_copy(update={"text": text}))
    fitted = evaluated(told, final, unnamed=found.unnamed)
    return DiscoveryResult(
        key=key,
        name=problem.file.study.name,
        verdict=(
            *sentences.verdict(found),
            *filter(None, [sentences.of_amplitude(at), sentences.assumed(problem, found)]),
        ),
        notes=fitted.notes,
        seconds=time.perf_counter() - began,
        elsewhere="measurements for validation"
        if problem.validated
        else "a third of the response channels, held out of one more fit",
        added=_added(after, found, fitted),
        steps=steps,
        map_before=map_before,
        map_after=map_after,
        before=next(before),
        after=fitted,
        provenance=provenance_of(problem.file),
        curves={str(number): table for number, table in enumerate(filter(None, curves))},
        marks=marks(after, [option.effect for option in found.added]),
        written=path.with_suffix(".yaml").name if found.added else "",
    )


def _evaluated(
    problem: Problem,
    trial: Trial,
    *,
    key: str,
    measured: Mapping[str, MeasuredModes | None],
    unnamed: Mapping[str, float] | None = None,
) -> results.FitResult:
    """The result of a trial; what it says of data that were not fitted is known already where nuisance
    parameters were fitted along in it.
    """
    known = problem.validated and problem.file.study.uncertainty not in (None, FORMS_ALONE, IMPACTS_ALONE)
    elsewhere = trial.gap_validation if known else None
    fit = _as_fit(problem, trial)
    return evaluate(problem, fit, key, measured=measured, elsewhere=elsewhere, unnamed=unnamed)


def _as_fit(problem: Problem, trial: Trial) -> Fit:
    """A trial as the fit of its model, which began where the study says."""
    values = problem.at(trial.values)
    start = Start(
        problem.initial, values, trial.gap, 0, 0.0, True, "refitted in the search for missing effects"
    )
    return Fit(values, trial.gap, (start,), np.zeros((0, 5)), 0.0)


def _added(after: Problem, found: Discovery, fitted: results.FitResult) -> AddedEffects:
    names, owners = [p.name for p in after.parameters], after.measurements[0].system.effects
    by_effect = [
        next(numbers for effect, numbers in owners if effect == option.effect) for option in found.added
    ]
    return AddedEffects(
        sentence=tuple(option.effect.sentence() for option in found.added),
        kind=tuple(option.effect.kind for option in found.added),
        config=tuple(json.dumps(entry_of(option.effect)) for option in found.added),
        named=tuple(
            sentences.named(o.effect, [names[n] for n in numbers], fitted.parameters)
            for o, numbers in zip(found.added, by_effect, strict=True)
        ),
        parameters=tuple(", ".join(names[n] for n in numbers) for numbers in by_effect),
        log_odds=np.array([option.gain.log_odds for option in found.added]),
        gap=np.array([option.model.gap for option in found.added]),
        gap_validation=np.array([option.model.gap_validation for option in found.added]),
        probability=np.array(found.probabilities),
        gap_without=np.array(found.gaps_without),
    )


def _step(problem: Problem, found: Discovery, number: int, bands: Array) -> StepResult:
    step = found.steps[number]
    model = with_effects(problem, step.before.task.effects, step.before.values)
    by_part = parts(model, model.initial, bands)
    known = len(problem.file.study.effects)
    return StepResult(
        model=tuple(effect.sentence() for effect in step.before.task.effects[known:]),
        gap=step.before.gap,
        gap_validation=step.before.gap_validation,
        where=in_words(by_part, step.before.gap),
        parts=PartTable(
            tuple(p.kind for p in by_part),
            tuple(p.name for p in by_part),
            np.array([p.gap for p in by_part]),
            np.array([p.share for p in by_part]),
            np.array([p.frequency_hz for p in by_part]),
        ),
        options=_options(step),
        best=step.best.effect.sentence() if step.best else "",
        kept=found.kept[number],
        alike=sentences.alike(step),
        advice=_advice(problem, step),
        decision=sentences.decision(step, found.kept[number]),
        places=place_table(found.places[number]),
    )


def _options(step: Step) -> OptionTable:
    options = step.options
    return OptionTable(
        sentence=tuple(option.effect.sentence() for option in options),
        kind=tuple(option.effect.kind for option in options),
        gap=np.array([option.model.gap for option in options]),
        gap_validation=np.array([option.model.gap_validation for option in options]),
        parameters=np.array([option.model.free - step.before.free for option in options], dtype=int),
        log_odds=np.array([option.gain.log_odds for option in options]),
        verdict=tuple(sentences.verdict_of(option, step) for option in options),
    )


def _advice(problem: Problem, step: Step) -> str:
    """What would tell the best candidate from the first that is alike; empty where nothing is."""
    if step.best is None or not step.rivals:
        return ""
    one, other = ((option.model.task.effects, option.model.values) for option in (step.best, step.rivals[0]))
    return advise(problem, one, other)
