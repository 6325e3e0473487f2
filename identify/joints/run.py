"""What `identify fit` does on a study of joints, without the terminal: runs in, curves with their intervals
out.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from identify.core.interruption import check
from identify.fitting.resume import held
from identify.joints.data import JointTestData
from identify.joints.intervals import BLIND, WEAK, ZERO
from identify.joints.study import JointFile, bench_of, read_joint_study
from identify.results import file as result_file
from identify.results.joints import CurveResult, JointsResult
from identify.results.provenance import provenance, sha256


def run_joints(config: Path, out: Path | None = None) -> tuple[JointsResult, Path]:
    """Identify every curve of a study, write the result and return it with its path.

    InputError or InputErrors for whatever cannot be read, cannot give the curve or cannot be written.
    """
    begun = time.perf_counter()
    file = read_joint_study(config)
    path = out or Path("reports") / f"{file.study.name}.h5"
    with threadpool_limits(1), held(path):
        bench = bench_of(file)
        result = _result(file, bench, _identified(file, bench), begun)
        result_file.write(result, path)
    return result, path


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
        notes=tuple(f"{label}: {note}" for label, found in curves.items() for note in found.notes),
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
    for what in (WEAK, ZERO, BLIND):
        names = [name for name, state in zip(found.values.name, status, strict=True) if state == what]
        if names:
            said += f"; {what}: {', '.join(names)}" if len(names) <= 8 else f"; {what}: {len(names)}"
    return f"{said}."
