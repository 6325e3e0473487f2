"""What `identify explain` does, without the terminal: records in, named effects with their evidence out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.core.threads import one_thread
from identify.explain.body_errors import with_body_errors
from identify.explain.effects.base import MotionEffect, Target
from identify.explain.evaluate import evaluated
from identify.explain.loop import Explanation, conclude, grow
from identify.explain.problem import (
    Known,
    curved,
    deflection_problem,
    loaded,
    torque_problem,
    tracking_problem,
)
from identify.explain.recorded_motion import RecordedMotion, StatedUncertainty, of_joints
from identify.explain.regression import Fit, RegressionProblem
from identify.explain.sentences import notes, unknown, verdict
from identify.explain.stages import (
    Problems,
    Recorded,
    Tools,
    candidates,
    scenes_of,
    story_of,
    torque_effects,
    was_recorded,
)
from identify.explain.study import (
    USES,
    BodyUncertainty,
    ExplainFile,
    ExplainStudy,
    Record,
    Use,
    read_explain_study,
)
from identify.explain.workbench import RecordWorkbench
from identify.fitting.memory import Memory
from identify.fitting.processes import Processes, several
from identify.fitting.resume import resumable, run_key
from identify.fitting.selection.workbench import Story
from identify.measured.conditioning import ConditionedMotion, condition, in_a_row
from identify.measured.records import MotionRecord, check_different, read_record
from identify.results.explain import ExplainResult, TargetResult
from identify.results.provenance import provenance, sha256
from identify.results.tables import Provenance
from identify.robot.coupling import checked_coupling
from identify.robot.description import Robot
from identify.robot.read import read_robot

_ROUNDS = 4
"""How often loads are taken anew: an error of theirs is a small share of them, and falls by that share each
time.
"""
Records = dict[Use, list[MotionRecord]]
_PREPARE: dict[Target, Callable[[ConditionedMotion, RecordedMotion, Known], RegressionProblem]] = {
    "deflection": deflection_problem,
    "tracking": tracking_problem,
}


def run_explain(
    config: Path,
    out: Path | None = None,
    progress: Story | None = None,
    *,
    workers: int | None = None,
    resume: bool = False,
) -> tuple[ExplainResult, Path]:
    """Explain the records of a study, write the result and return it with its path; progress: called with
    what was just found; workers: processes, by default one, with the same result to the last bit.

    While it runs, the part file beside the result keeps what `resume` needs; a finished run of the same study
    is not run again by it.  InputError or InputErrors for whatever cannot be read, does not fit together or
    cannot be written.
    """
    begun = time.perf_counter()
    file = read_explain_study(config)
    path = out or Path("reports") / f"{file.study.name}.h5"
    with one_thread():
        robot = read_robot(file.study.robot, file.path.parent)
        known = known_of(file.study, robot)
        records = read_records(file, robot)
        each = {use: [conditioned(r, file.study, known) for r in records[use]] for use in USES}
        motions = Recorded(in_a_row(each["fit"]), in_a_row(each["validate"]), tuple(each["test"]))
        treated = [motion for use in USES for motion in each[use]]
        origin = _provenance(file, records)
        key = run_key(origin, file)

        def compute(part: PartFile) -> ExplainResult:
            with several(workers or 1, RecordWorkbench.__module__) as at_work:
                targets = explained(file.study, motions, known, progress, Memory(part), at_work)
            return _result(file.study.name, treated, motions.judge.name, targets, begun, origin, key)

        return resumable(path, key, ExplainResult, compute, resume=resume), path


def _result(
    name: str,
    motions: Sequence[ConditionedMotion],
    judge: str,
    targets: dict[str, TargetResult],
    begun: float,
    origin: Provenance,
    key: str,
) -> ExplainResult:
    return ExplainResult(
        name=name,
        key=key,
        verdict=tuple(sentence for found in targets.values() for sentence in verdict(found, judge)),
        notes=tuple(sentence for found in targets.values() for sentence in notes(found)),
        unknown=tuple(sentence for found in targets.values() for sentence in unknown(found)),
        conditioning=tuple(
            f"record {motion.name}: {sentence}" for motion in motions for sentence in motion.said
        ),
        seconds=time.perf_counter() - begun,
        targets=targets,
        provenance=origin,
    )


def _provenance(file: ExplainFile, records: Records) -> Provenance:
    robot = file.study.robot.urdf or file.study.robot.dh or Path()
    sources = [(record.source, record.sha256) for use in USES for record in records[use]]
    inputs = [(str(robot), sha256(file.resolve(robot))), *sources]
    return provenance(file.path.name, file.text, inputs)


def known_of(study: ExplainStudy, robot: Robot) -> Known:
    """What the study says of robot and drives; InputError where it does not fit the robot."""
    count = len(robot.joints)
    inertia = study.drives.rotor_inertia_kg_m2 or [0.0] * count
    per_joint = {
        "drives.gear_ratio": study.drives.gear_ratio,
        "drives.rotor_inertia_kg_m2": inertia,
        "drives.torque_constant_nm_per_a": study.drives.torque_constant_nm_per_a,
        "joint_zero_deg": study.joint_zero_deg,
    }
    for key, values in per_joint.items():
        if values is not None and len(values) != count:
            raise InputError(key, f"{len(values)} numbers", f"{count}, one per joint of {robot.name!r}")
    joints = tuple(study.joints or range(1, count + 1))
    for joint in joints:
        robot.joint_number(joint, "joints")
    if study.payload_at is not None:
        payload = robot.link(study.payload_at.link, "payload_at.link").name, study.payload_at.centre_m
    elif study.robot.payload:
        payload = study.robot.payload[0].link, study.robot.payload[0].centre_m
    else:
        payload = robot.links[-1].name, (0.0, 0.0, 0.0)
    slow = float(np.radians(study.stationary_below_deg_per_s))
    return Known(
        robot,
        np.array(study.drives.gear_ratio),
        np.array(inertia),
        joints,
        slow,
        payload,
        study.positions == "relative",
        _stated(study.uncertainty),
        None if study.drives.coupling is None else checked_coupling(study.drives.coupling, robot),
    )


def _stated(given: BodyUncertainty) -> StatedUncertainty:
    percent = np.array([given.mass_percent, given.centre_percent, given.inertia_percent])
    return StatedUncertainty(*(percent / 100).tolist())


def read_records(file: ExplainFile, robot: Robot) -> Records:
    """The records to fit, to judge by, and to report, in the order of the study."""
    study, count = file.study, len(robot.joints)
    zero = np.radians(study.joint_zero_deg or [0.0] * count)
    axis = study.time if study.time is not None else float(study.sample_rate_hz or 0)
    even = study.resample_hz is None

    def read(record: Record) -> MotionRecord:
        path, name = file.resolve(record.file), record.name or record.file.stem
        return read_record(path, name, study.signals, axis, count, zero, even=even)

    read_all = [(record.use, read(record)) for record in study.records]
    check_different([(record.name, record.signals) for _, record in read_all])
    return {use: [record for its, record in read_all if its == use] for use in USES}


def explained(
    study: ExplainStudy,
    motions: Recorded,
    known: Known,
    story: Story | None = None,
    memory: Memory | None = None,
    workers: Processes | None = None,
) -> dict[str, TargetResult]:
    """Every target that the records have: torque, then deflection with the torques found, then tracking."""
    story, tools = story or Story(), Tools(Memory() if memory is None else memory, workers)
    scenes = scenes_of(motions, known, study, story, tools)
    tried = torque_effects(candidates("torque", scenes[0], study.effects), scenes[0])
    torque = motions.problems(torque_problem, scenes, known)
    torque = Problems.of(with_body_errors((torque.fitted, torque.judge, *torque.tests)))
    torque, found = _torque_explained(torque, tried, story_of(story, "torque"), tools)
    done = {
        "torque": evaluated(
            "torque", torque.fitted, torque.judge, torque.tests, found, tried, study.lowpass_hz
        )
    }
    for target, prepare in _PREPARE.items():
        if all(was_recorded(motion, target) for motion in motions.all):
            problems = motions.problems(prepare, torque.scenes, known)
            done[target] = _explained(target, problems, study, story_of(story, target), tools)
    return done


def _torque_explained(
    pair: Problems, tried: list[MotionEffect], story: Story, tools: Tools
) -> tuple[Problems, Explanation]:
    """Torques with the loads of the gears as they are known at the end, and their explanation.

    What passes through the gears changes the loads of which other effects are made: a wrong torque constant
    first looks like a balancer, whose torque is then taken for load.  So they are looked for in turn, until
    no effect depends on loads that have changed.
    """
    first = [effect for effect in tried if not effect.of_load]
    fit, steps = grow(tools.bench(pair, first, "torque"), story)
    examined = frozenset[str]()
    for number in range(1, _ROUNDS + 1):
        before, pair = fit, _with_loads(pair, fit)
        label = f"torque, loads {number}"
        bench = tools.bench(pair, tried, label, before, examined)
        fit, more = grow(bench, story)
        steps, examined = steps + more, frozenset(effect.name for effect in fit.effects)
        moved = any(effect.in_gear for effect in before.effects + fit.effects)
        if not (moved and any(effect.of_load for effect in fit.effects)):
            break
    pair = _with_loads(pair, fit)
    bench = tools.bench(pair, tried, "torque, final loads", fit)
    return pair, conclude(bench, fit, steps)


def _explained(
    target: Target, pair: Problems, study: ExplainStudy, story: Story, tools: Tools
) -> TargetResult:
    """A target that is linear in what the torque's explanation left behind; latencies to second order."""
    tried = candidates(target, pair.fitted.scene, study.effects)
    first, steps = grow(tools.bench(pair, tried, target), story)
    pair = pair.each(partial(curved, fit=first))
    label, examined = f"{target}, second order", frozenset(effect.name for effect in first.effects)
    bench = tools.bench(pair, tried, label, first, examined)
    fit, more = grow(bench, story)
    found = conclude(bench, fit, [*steps, *more])
    return evaluated(target, pair.fitted, pair.judge, pair.tests, found, tried, study.lowpass_hz)


def _with_loads(pair: Problems, fit: Fit) -> Problems:
    """With the loads of a fit; of links whose accelerations were recorded, as the stated bodies have them, so
    that no stiffness hangs on what else was found in torques.
    """
    if pair.fitted.scene.links is not None:
        return pair
    return pair.each(partial(loaded, fit=fit))


def conditioned(record: MotionRecord, study: ExplainStudy, known: Known) -> ConditionedMotion:
    """A record's motion; positions that count from where it began are zero there, whatever encoders said."""
    constant: Array | None = None
    if study.drives.torque_constant_nm_per_a is not None:
        constant = np.array(study.drives.torque_constant_nm_per_a)
    motion = condition(record, study.lowpass_hz, study.resample_hz, constant)
    if study.drives.positions_of == "motors":
        motion = _of_joints(motion, known)
    if not known.relative:
        return motion
    zero = np.radians(study.joint_zero_deg or np.zeros(len(known.gear_ratio)))
    return replace(motion, position=motion.position - motion.position[0] + zero)


def _of_joints(motion: ConditionedMotion, known: Known) -> ConditionedMotion:
    """The joints' motion out of that of the motors."""
    command = motion.command_position
    return replace(
        motion,
        position=of_joints(motion.position, known.coupling),
        velocity=of_joints(motion.velocity, known.coupling),
        turning=None if motion.turning is None else of_joints(motion.turning, known.coupling),
        acceleration=of_joints(motion.acceleration, known.coupling),
        command_position=None if command is None else of_joints(command, known.coupling),
    )
