"""`identify check` of a study of vibration: what was stated, and whether the set-up explains the data."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from identify.measured.finding import STUDY, Checked, Finding
from identify.setup.apply import write_corrected
from identify.setup.bounds import findings
from identify.setup.diagnosis import look
from identify.setup.sentences import sentences
from identify.vibration.check import examined
from identify.vibration.study import StudyFile, read_study


def run_checks(config: Path) -> Checked:
    """Load all that `identify fit` would load of a study and look at it, and at its set-up.

    Raises InputError or InputErrors where the config itself cannot be read; other refusals are kept beside
    the findings, so that one run says everything.
    """
    return _checked(read_study(config))


def _checked(file: StudyFile) -> Checked:
    checked, problem, known = examined(file)
    if problem is None:
        return checked
    found = {name: list(some) for name, some in checked.findings.items()}
    for name, finding in findings(problem.robot, known):
        found[name or STUDY].append(finding)
    diagnosis = None
    if not any(one.check in _NO_FIT and one.level == "fail" for some in found.values() for one in some):
        diagnosis = look(problem).diagnosis
    if diagnosis is not None:
        text = " ".join(sentences(diagnosis, file.path.name))
        found[STUDY].append(Finding("fail", "set-up", (), text, diagnosis.probability))
        correct = partial(
            write_corrected, file, diagnosis.edits, [one.sentence for one in diagnosis.mistakes]
        )
        return replace(checked, findings=found, correct=correct)
    return replace(checked, findings=found)


_NO_FIT = ("magnitude", "decibels", "real-part", "far-point", "far-place")
"""Findings beside which a fit says nothing."""
