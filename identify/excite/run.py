"""What `identify excite` does, without the terminal: limits in, a motion with what it promises out."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from identify.core import atomic
from identify.core.arrays import Array
from identify.core.threads import one_thread
from identify.excite.information import Experiment, experiment_of
from identify.excite.limits import limits_of
from identify.excite.rehearsal import Rehearsal, rehearsed
from identify.excite.search import Search, best_motion, random_motions
from identify.excite.series import PeriodicMotion, Series
from identify.excite.study import ExciteFile, ExciteStudy, read_excite_study
from identify.fitting.resume import held
from identify.fitting.selection.workbench import Story
from identify.results import file as result_file
from identify.results.excite import ExcitedTable, ExciteResult
from identify.results.provenance import provenance, sha256
from identify.robot.read import read_robot

_RANDOM = 40
_FEW = 0.85
"""Share of runs whose promised interval holds the truth below which a parameter is pointed out."""


def run_excite(
    config: Path, out: Path | None = None, progress: Story | None = None, *, draws: int | None = None
) -> tuple[ExciteResult, list[Path]]:
    """Find the motion of a study, rehearse it so many times (default 40) and write the result, and the
    motion as a table `.csv` beside it.

    InputError or InputErrors for whatever cannot be read, does not fit the robot, or cannot be written.
    """
    begun, story = time.perf_counter(), progress or Story()
    file = read_excite_study(config)
    path = out or Path("reports") / f"{file.study.name}.h5"
    table = path.with_suffix(".csv")
    robot_file = file.study.robot.urdf or file.study.robot.dh or Path()
    result_file.check_new(path, "a motion", [file.path, file.resolve(robot_file)], [table])
    with held(path), one_thread(), file.located():
        robot = read_robot(file.study.robot, file.path.parent)
        limits = limits_of(file.study, robot)
        experiment = experiment_of(file.study, robot, limits)
        search = Search(file.study, limits, experiment)
        series = best_motion(search, story.done)
        result = _result(file, search, series, begun, draws or 40, story)
        result_file.write(result, path)
        atomic.write_text(table, _csv(result))
    return result, [path, table]


def _result(
    file: ExciteFile, search: Search, series: Series, begun: float, draws: int, story: Story
) -> ExciteResult:
    study, limits, experiment = file.study, search.limits, search.experiment
    motion = series.sampled(round(study.period_s * study.sample_rate_hz))
    promised = _promised(search, motion)
    random = np.median(
        [_promised(search, one.sampled(search.samples)) for one in random_motions(search, _RANDOM)], axis=0
    )
    wanted = experiment.wanted
    ratio = float(np.median((random / promised)[wanted]))
    story.say(f"intervals {ratio:.3g} times narrower than at random; the motion is rehearsed {draws} times")
    seen = rehearsed(study, limits.arm.robot, experiment, series, promised, draws)
    table = _table(experiment, promised, random, seen)
    moves = np.isin(np.arange(len(limits.low)), limits.moving).astype(float)
    robot_file = study.robot.urdf or study.robot.dh or Path()
    true = float(np.median((seen.scatter / promised)[wanted]))
    room = -limits.outside(motion.position, inwards=True).max() if limits.regions else float("nan")
    return ExciteResult(
        name=study.name,
        verdict=_verdict(study, table, ratio, true),
        notes=_notes(table),
        seconds=time.perf_counter() - begun,
        provenance=provenance(
            file.path.name, file.text, [(str(robot_file), sha256(file.resolve(robot_file)))]
        ),
        target=study.target,
        joints=tuple(joint.name for joint in limits.arm.robot.joints),
        time_s=motion.time_s,
        position=motion.position,
        velocity=motion.velocity,
        acceleration=motion.acceleration,
        limits=np.stack([limits.low, limits.high, limits.speed, limits.acceleration, moves]),
        centre=series.centre,
        sine=series.sine,
        cosine=series.cosine,
        period_s=study.period_s,
        periods=study.periods,
        draws=draws,
        room_m=float(room),
        random_ratio=ratio,
        come_true=true,
        promised=table,
    )


def _promised(search: Search, motion: PeriodicMotion) -> Array:
    """(p,): half the 95 % interval of all periods, but for what the filter takes at both ends."""
    study = search.study
    samples = study.periods * study.period_s * study.sample_rate_hz
    ends = 2 * np.ceil(study.sample_rate_hz / study.lowpass_hz)
    [information] = search.experiment.information(motion)
    return search.experiment.half(information, max(samples - ends, 1.0))


def _table(experiment: Experiment, promised: Array, random: Array, seen: Rehearsal) -> ExcitedTable:
    return ExcitedTable(
        experiment.names,
        experiment.units,
        experiment.expected,
        promised,
        random,
        seen.scatter,
        seen.error,
        seen.held,
        seen.kept,
        experiment.wanted.astype(int),
    )


def _verdict(study: ExciteStudy, table: ExcitedTable, ratio: float, true: float) -> tuple[str, ...]:
    wanted = table.wanted == 1
    what = {
        "base-parameters": "base parameters and friction",
        "friction": "values of friction",
        "transmission-error": "amplitudes of transmission errors",
    }[study.target]
    return (
        f"{study.periods} periods of {study.period_s:g} s determine {int(wanted.sum())} {what}: at the"
        f" median, intervals are {ratio:.3g} times narrower than those of random motion within the same"
        " limits.",
        f"In the rehearsal values scatter by {true:.3g} of the promised intervals at the median; the promised"
        f" intervals contain the truth in {100 * float(table.kept[wanted].mean()):.3g} % of all cases.",
    )


def _notes(table: ExcitedTable) -> tuple[str, ...]:
    said = [
        "collisions of the robot with itself, its cables or its surroundings are not checked: run the motion"
        " slowly first",
        "the promise holds for white noise as stated, and for a robot like its model; the rehearsal adds the"
        " noise of positions and the low-pass",
    ]
    few = [name for name, share in zip(table.name, table.kept, strict=True) if share < _FEW]
    if few:
        fix = "do not count on these intervals, or lower the noise of positions, or raise `lowpass_hz`"
        said.append(f"promised intervals that rehearsals often miss: {', '.join(few)}; {fix}")
    return tuple(said)


def _csv(result: ExciteResult) -> str:
    """One period, a line per sample, in degrees."""
    count = len(result.joints)
    kinds = ("deg", "deg_per_s", "deg_per_s2")
    heads = [f"joint{n}_{kind}" for kind in kinds for n in range(1, count + 1)]
    values = np.degrees(np.hstack([result.position, result.velocity, result.acceleration]))
    rows = [
        ",".join([f"{at:.6f}", *(f"{value:.6f}" for value in row)])
        for at, row in zip(result.time_s, values, strict=True)
    ]
    return "\n".join([",".join(["time_s", *heads]), *rows]) + "\n"
