"""`identify check` of a study of joints: every run that a fit would read is read and looked at, and every
curve is tried, which takes seconds: whether a run can give a curve is known when it has given it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from identify.core.errors import InputError
from identify.core.threads import one_thread
from identify.joints.base import Curve
from identify.joints.data import JointTestData
from identify.joints.intervals import DETERMINED
from identify.joints.study import bench_of, read_joint_study
from identify.measured.finding import STUDY, Checked, Finding, kept
from identify.measured.quality_records import check_records
from identify.measured.quality_robot import check_robot
from identify.measured.records import MotionRecord


def run_checks(config: Path) -> Checked:
    """Read all that `identify fit` would read of a study of joints and look at it.

    Raises InputError or InputErrors where the config itself cannot be read; other refusals are kept.
    """
    file, refused = read_joint_study(config), list[InputError]()
    found: dict[str, list[Finding]] = {STUDY: []}
    bench = kept(lambda: bench_of(file), refused)
    if bench is not None:
        found[STUDY] += check_robot(bench.robot) if bench.robot is not None else []
        records: dict[str, MotionRecord] = {}
        watched = replace(bench, watch=lambda record: records.update({record.source: record}))
        with one_thread():
            for curve in file.study.curves:
                found[curve.label] = kept(lambda one=curve: _tried(one, watched), refused) or []  # type: ignore[misc]
        of_records = check_records(list(records.values()))
        found = {**of_records, **found, STUDY: [*of_records[STUDY], *found[STUDY]]}
    return Checked(found, tuple(map(file.at_its_line, refused)))


def _tried(curve: Curve, bench: JointTestData) -> list[Finding]:
    """What a curve promises of its values; InputError where its runs cannot give it."""
    result = curve.identify(bench)
    status = np.array(result.values.status)
    known = int((status == DETERMINED).sum())
    sentence = f"Its runs determine {known} of {len(status)} values."
    told = [Finding("warn", "curve", (), f"{note[:1].upper()}{note[1:]}.") for note in result.notes]
    return [Finding("info" if known else "warn", "determined", (), sentence, known), *told]
