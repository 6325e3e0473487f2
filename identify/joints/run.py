"""What `identify fit` does on a study of joints, without the terminal: runs in, curves with their intervals
out.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from identify.core import atomic
from identify.core.interruption import check
from identify.core.threads import one_thread
from identify.fitting.resume import held
from identify.joints.data import JointTestData
from identify.joints.intervals import AS_DESCRIBED, BLIND, IMPOSSIBLE, WEAK, ZERO
from identify.joints.study import JointFile, bench_of, read_joint_study
from identify.measured.quality_robot import robot_notes
from identify.results import file as result_file
from identify.results.joints import CurveResult, JointsResult
from identify.results.provenance import provenance, sha256


def run_joints(config: Path, out: Path | None = None) -> tuple[JointsResult, list[Path]]:
    """Identify every curve of a study, write the result and return it with what was written: the result,
    and of each curve of rigid bodies the robot's description with them.

    InputError or InputErrors for whatever cannot be read, cannot give the curve or cannot be written.
    """
    begun = time.perf_counter()
    file = read_joint_study(config)
    path = out or Path("reports") / f"{file.study.name}.h5"
    robots = _robots(file, path)
    with one_thread(), held(path):
        bench = bench_of(file)
        result = _result(file, bench, _identified(file, bench), begun)
        result_file.write(result, path)
        for label, robot in robots.items():
            atomic.write_text(robot, result.curves[label].robot)
    return result, [path, *robots.values()]


def _robots(file: JointFile, path: Path) -> dict[str, Path]:
    """Where the descriptions of robots with identified bodies go, by label; InputError where one would take
    the place of an input.
    """
    labels = [curve.label for curve in file.study.curves if curve.kind == "rigid-bodies"]
    settings = file.study.robot
    if not labels or settings is None:
        return {}
    described = settings.urdf or settings.dh or Path()
    found = {
        label: path.with_name(f"{path.stem}_{label.replace(' ', '_')}{described.suffix}") for label in labels
    }
    result_file.check_new(path, "a result", [file.path, file.resolve(described)], found.values())
    return found


def _identified(file: JointFile, bench: JointTestData) -> dict[str, CurveResult]:
    """Every curve of the study by its label."""
    found: dict[str, CurveResult] = {}
    for curve in file.study.curves:
        check()
        found[curve.label] = curve.identify(bench)
    return found


def _result(
    file: JointFile, bench: JointTestData, curves: dict[str, CurveResult], begun: float
) -> JointsResult:
    settings = file.study.robot
    described = [] if settings is None else [settings.urdf or settings.dh or Path()]
    return JointsResult(
        name=file.study.name,
        verdict=tuple(_sentence(label, found) for label, found in curves.items()),
        notes=(
            *([] if bench.robot is None else robot_notes(bench.robot)),
            *(f"{label}: {note}" for label, found in curves.items() for note in found.notes),
        ),
        seconds=time.perf_counter() - begun,
        curves=curves,
        provenance=provenance(
            file.path.name,
            file.text,
            [*((str(one), sha256(file.path.parent / one)) for one in described), *bench.inputs.items()],
        ),
    )


def _sentence(label: str, found: CurveResult) -> str:
    """How many values the runs determine, and the names of those they do not."""
    status = np.array(found.values.status)
    count = len(status)
    said = f"{label}: {int((status == 'determined').sum())} of {count} values determined"
    for what in (IMPOSSIBLE, WEAK, ZERO, BLIND, AS_DESCRIBED):
        names = [name for name, state in zip(found.values.name, status, strict=True) if state == what]
        if names:
            said += f"; {what}: {', '.join(names)}" if len(names) <= 8 else f"; {what}: {len(names)}"
    return f"{said}."
