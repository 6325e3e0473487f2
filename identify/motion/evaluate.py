"""A simulated or fitted motion from all sides: what the result file keeps of it."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.fitting.tables import parameter_table, start_table
from identify.fitting.uncertainty import Uncertainty, at_bounds
from identify.measured.finding import as_notes
from identify.measured.quality_robot import robot_notes
from identify.motion.closed_loop import closed_loops
from identify.motion.glitches import glitches
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem
from identify.motion.recording import TOOL, PreparedRecord
from identify.motion.simulate import SimulatedMotion
from identify.motion.step_error import step_error
from identify.motion.tool import COMMAND, far_tool, recorded_paths, tool_paths
from identify.motion.trajectory import (
    TrajectoryObjective,
    all_signals,
    beside,
    phase_rms,
    simulated,
    trajectory_trust,
)
from identify.motion.trajectory_fit import MotionFit
from identify.results import motion as results
from identify.results.circular import circular_test
from identify.results.provenance import provenance, sha256
from identify.results.tables import Provenance

UNITS = {"position": "rad", "velocity": "rad/s", "torque": "N m", "current": "A"}
WHOLE = "whole"
Begun = tuple[MotionProblem, SimulatedMotion]
"""A start model and its motion."""


def evaluate_simulation(problem: MotionProblem) -> results.MotionResult:
    """The motion with every number at its start value."""
    began = time.perf_counter()
    motion = problem.run(problem.initial[None], problem.records)
    seconds = time.perf_counter() - began
    records = _records(problem, problem.initial, motion, None)
    return _result(problem, records, seconds, _gaps(problem, motion, None), None, None)


def evaluate_fit(started: MotionProblem, found: MotionFit) -> results.MotionResult:
    """The motion as fitted, beside that of the study's start values."""
    problem = found.problem
    began = time.perf_counter()
    motion = problem.run(found.fit.values[None], problem.records)
    seconds = time.perf_counter() - began
    first = started, started.run(started.initial[None], started.records)
    scale = Scale(problem.parameters)
    records, gaps = _records(problem, found.fit.values, motion, first), _gaps(problem, motion, found)
    if not len(scale.free):
        return _result(problem, records, seconds, gaps, found, None)
    objective = found.objective or fitted_objective(problem)
    seen = objective.residuals(found.fit.values, scale.free)
    trusted = trajectory_trust(objective, scale, found.fit.values, seen)
    step = step_error(objective, scale, found.fit.values, seen, trusted)
    result = _result(problem, records, seconds, gaps, found, trusted)
    if step.good:
        return replace(result, verdict=(*result.verdict, f"{step.sentence().capitalize()}."))
    return replace(result, notes=(*result.notes, step.sentence()))


def unit(quantity: str) -> str:
    """SI unit of a quantity such as motor_position."""
    return "m" if quantity == TOOL else UNITS[quantity.rsplit("_", 1)[1]]


def provenance_of_motion(problem: MotionProblem) -> Provenance:
    """Provenance of a run of a study of motion."""
    file = problem.file
    robot = file.study.robot.urdf or file.study.robot.dh
    given = [(str(robot), sha256(file.resolve(robot)))] if robot else []
    recorded = [
        (str(r.settings.measured.file), r.measured.sha256)
        for r in problem.records
        if r.settings.measured and r.measured
    ]
    return provenance(file.path.name, file.text, [*given, *recorded])


def _result(
    problem: MotionProblem,
    records: dict[str, results.RecordResult],
    seconds: float,
    gaps: list[float],
    found: MotionFit | None,
    trusted: Uncertainty | None,
) -> results.MotionResult:
    study, file = problem.file.study, problem.file
    scale = Scale(problem.parameters)
    runs = sum(record.time_s[-1] for record in records.values())
    judged = gaps[0] if np.isnan(gaps[1]) else gaps[1]
    frfs, without = closed_loops(problem.robot, [r.settings for r in problem.records], records)
    p = None
    if found is not None and trusted is not None:
        p = parameter_table(problem.parameters, found.fit.values, trusted, scale)
    return results.MotionResult(
        key=file.sha256,
        name=study.name,
        seed=study.seed,
        verdict=_verdict(problem, found, trusted, judged, runs / seconds),
        notes=(
            *robot_notes(problem.robot),
            *as_notes(far_tool(problem)),
            *_notes(records),
            *without,
            *(
                r.registration.sentence(r.settings.name)
                for r in problem.records
                if r.registration is not None
            ),
            *([] if found is None else found.fit.end_note),
            *rivals_said(found),
        ),
        effects=_sentences(problem),
        joints=tuple(joint.name for joint in problem.robot.joints),
        step_s=problem.step_s,
        period_s=study.servo.period_s,
        seconds=seconds if found is None else found.fit.seconds,
        realtime_factor=runs / seconds,
        gap=gaps[0],
        gap_validation=gaps[1],
        converged=True if found is None else found.fit.best.converged,
        parameters=p,
        correlation=None if trusted is None else trusted.correlation,
        starts=None if found is None else start_table(found.fit),
        history=None if found is None else found.fit.history,
        trials=None if found is None else _trials(found),
        records=records,
        provenance=provenance_of_motion(problem),
        free=sum(parameter.free for parameter in problem.parameters),
        frfs=frfs,
    )


def _gaps(problem: MotionProblem, motion: SimulatedMotion, found: MotionFit | None) -> list[float]:
    """Of the records to fit and of those that judge, in the motion of all; NaN where there are none."""
    fitted = _gap(problem, motion, "fit") if found is None else found.fit.cost
    return [fitted, _gap(problem, motion, "validate")]


def _gap(problem: MotionProblem, motion: SimulatedMotion, use: str) -> float:
    records = [r for r in problem.records if r.settings.use == use and r.measured is not None]
    if not records or not problem.file.study.noise:
        return float("nan")
    objective = TrajectoryObjective(problem, records, problem.file.study.noise)
    with np.errstate(all="ignore"):  # of what runs away
        return float(objective.costs_of(objective.of_motion(motion, problem.records))[0])


def _records(
    problem: MotionProblem, values: Array, motion: SimulatedMotion, first: Begun | None
) -> dict[str, results.RecordResult]:
    rows = enumerate(problem.records)
    found = {record.settings.name: _record(problem, record, number, motion, first) for number, record in rows}
    for record in problem.records:
        name = record.settings.name
        if record.settings.path is not None and record.settings.path.glitches:
            found[name] = replace(found[name], glitches=glitches(problem, values, record))
    for name, fed in _fed(problem, values, first).items():
        found[name] = replace(found[name], fed=fed)
    return found


def _fed(
    problem: MotionProblem, values: Array, first: Begun | None
) -> dict[str, dict[str, results.TrajectoryComparison]]:
    """By record, torques and currents that its recorded motion takes."""
    hz = problem.file.study.inverse_dynamics_hz
    if hz is None:
        return {}
    period = problem.file.study.servo.period_s
    records = [
        one for one in (record.fed_in(hz, period) for record in problem.records) if one.recorded and one.fed
    ]
    motion = problem.run(values[None], records)
    begun = None if first is None else (first[0], first[0].run(first[0].initial[None], records))
    return {
        one.settings.name: _comparisons(problem, one, number, motion, begun, len(records))
        for number, one in enumerate(records)
    }


def _record(
    problem: MotionProblem,
    record: PreparedRecord,
    number: int,
    motion: SimulatedMotion,
    first: Begun | None,
) -> results.RecordResult:
    ticks, settings = len(record.command.position), record.settings
    begun = None if first is None else (first[0], first[1].coordinates[number, :ticks])
    signals = {name: values[number, :ticks] for name, values in all_signals(problem, motion).items()}
    commanded = {"command_position": record.command.position, "command_velocity": record.command.velocity}
    comparisons = _comparisons(problem, record, number, motion, first, len(problem.records))
    noise = problem.file.study.noise
    every = [c.rms[0] ** 2 / np.square(noise[q]) for q, c in comparisons.items() if q in noise]
    gaps = np.concatenate([one[~np.isnan(one)] for one in every]) if every else np.zeros(0)
    return results.RecordResult(
        name=settings.name,
        use=settings.use if record.measured else "",
        file=str(settings.measured.file) if settings.measured else "",
        sha256=record.measured.sha256 if record.measured else "",
        start_deg=np.array(settings.start_deg),
        time_s=problem.file.study.servo.period_s * np.arange(ticks, dtype=float),
        signals={
            name: results.Trace(unit(name), values)
            for name, values in {**commanded, **signals}.items()
            if np.isfinite(values).any()
        },
        comparisons=comparisons,
        phases=(WHOLE, *settings.phases_s),
        phase_s=np.array([(0.0, settings.duration_s), *settings.phases_s.values()]),
        gap=float(np.sqrt(gaps.mean())) if gaps.size else float("nan"),
        **_tool(problem, record, motion.coordinates[number, :ticks], begun),
    )


def _tool(
    problem: MotionProblem,
    record: PreparedRecord,
    coordinates: Array,
    begun: tuple[MotionProblem, Array] | None,
) -> dict[str, Any]:
    """Paths of a tool that is led, and their circular tests; begun: the start model, and its coordinates."""
    circle = record.settings.path
    if circle is None:
        return {}
    paths = tool_paths(problem, record, coordinates)
    turn = circle.judged(problem.file.study.servo.period_s * np.arange(len(coordinates), dtype=float))
    tests = {name: circular_test(circle.flat(places)[turn]) for name, places in paths.items()}
    for name, places in ({} if begun is None else tool_paths(begun[0], record, begun[1])).items():
        if name != COMMAND:
            tests[f"{name}, start model"] = circular_test(circle.flat(places)[turn])
    for name, (time_s, places) in recorded_paths(problem, record).items():
        tests[name] = circular_test(circle.flat(places)[circle.judged(time_s)])
    return {"paths": {name: results.Trace("m", places) for name, places in paths.items()}, "circles": tests}


def _comparisons(
    problem: MotionProblem,
    record: PreparedRecord,
    number: int,
    motion: SimulatedMotion,
    first: Begun | None,
    count: int,
) -> dict[str, results.TrajectoryComparison]:
    """Of the number-th of `count` records that moved together."""
    if record.measured is None:
        return {}
    noise, phases, time_s = problem.file.study.noise, record.settings.phases_s, record.measured.time_s
    now = simulated(problem, motion, record, number, count)
    before = simulated(*first, record, number, count) if first is not None else {}
    found = {}
    for quantity, values in now.items():
        measured, begun = (
            record.recorded[quantity],
            before[quantity][0] if quantity in before else None,
        )
        rms = [
            phase_rms(beside(quantity, model, record, np.array(noise.get(quantity, 0.0))), time_s, phases)
            for model in (values[0], begun)
            if model is not None
        ]
        found[quantity] = results.TrajectoryComparison(
            unit=unit(quantity),
            time_s=time_s,
            measured=measured,
            initial=begun,
            simulated=values[0],
            noise=float(np.sqrt(np.mean(np.square(noise.get(quantity, np.nan))))),
            rms=rms[0],
            rms_initial=rms[1] if len(rms) > 1 else None,
        )
    return found


def _trials(found: MotionFit) -> results.TrialTable:
    t = found.trials
    return results.TrialTable(
        name=tuple(trial.name for trial in t),
        round=np.array([trial.round for trial in t], dtype=float),
        gap=np.array([trial.gap for trial in t]),
        gap_validation=np.array([trial.gap_judged for trial in t]),
        kept=np.array([trial.kept for trial in t], dtype=float),
        log_odds=np.array([trial.log_odds for trial in t]),
    )


def _sentences(problem: MotionProblem) -> tuple[str, ...]:
    study = problem.file.study
    elastic = tuple(effect.sentence() for effect in study.effects) or ("rigid joints and links",)
    return (*elastic, f"motors of kind {study.motor.kind}", f"controller of kind {study.servo.kind}")


def _verdict(
    problem: MotionProblem,
    found: MotionFit | None,
    trusted: Uncertainty | None,
    judged: float,
    realtime: float,
) -> tuple[str, ...]:
    speed = (
        f"{len(problem.records)} motions simulated at {realtime:.3g} times real time, in steps of"
        f" {problem.step_s:.3g} s."
    )
    if found is None:
        return (speed,)
    kept = [trial.name for trial in found.trials[1:] if trial.kept]
    first = (
        f"The gap is {found.fit.cost:.2f} times the noise on the fitted records and {judged:.2f} on the"
        " validation records."
    )
    added = (
        f"Added because they improve the fit of the validation records: {', '.join(kept)}." if kept else ""
    )
    known = ""
    if trusted is not None:
        determined = sum(status == "determined" for status in trusted.status)
        known = f"{determined} of {len(trusted.status)} free parameters are determined."
    bounds = at_bounds(trusted, Scale(problem.parameters)) if trusted is not None else ""
    return tuple(line for line in (first, added, known, bounds, speed) if line)


def rivals_said(found: MotionFit | None) -> tuple[str, ...]:
    """Effects that the records cannot tell from one that stayed, as sentences."""
    return tuple(
        f"the records cannot tell {name} from {rival}, which explains about as much in its place"
        for name, rival in (found.rivals if found is not None else ())
    )


def _notes(records: dict[str, results.RecordResult]) -> tuple[str, ...]:
    lost = [
        name
        for name, record in records.items()
        if not all(np.isfinite(trace.values).all() for trace in record.signals.values())
    ]
    return (
        (f"the motion diverges in {', '.join(lost)}: the controller is unstable with this arm",)
        if lost
        else ()
    )
