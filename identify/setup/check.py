"""`identify check` of a study of vibration: what was stated, and whether the set-up explains the data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from identify.core.errors import InputError
from identify.core.text import capital
from identify.measured.finding import STUDY, Checked, Finding
from identify.setup.apply import write_corrected
from identify.setup.bounds import findings
from identify.setup.diagnosis import Diagnosis, look
from identify.setup.sentences import sentences
from identify.vibration.check import examined
from identify.vibration.study import StudyFile, read_study


def run_checks(config: Path) -> Checked:
    """Load all that `identify fit` would load of a study and look at it, and at its set-up.

    Raises InputError or InputErrors where the config itself cannot be read; other refusals are kept beside
    the findings, so that one run says everything.
    """
    return _checked(read_study(config))[0]


def apply(config: Path) -> list[Path]:
    """Write the corrected study beside the one in `config`; InputError where nothing is to be corrected."""
    file = read_study(config)
    _, found = _checked(file)
    if found is None:
        expected = "a mistake of the set-up that a change of the study puts right"
        raise InputError("--apply", "nothing to correct", expected, "leave `--apply` out")
    return write_corrected(file, found.edits, [capital(one.sentence) for one in found.mistakes])


def _checked(file: StudyFile) -> tuple[Checked, Diagnosis | None]:
    checked, problem, known = examined(file)
    if problem is None:
        return checked, None
    found = {name: list(some) for name, some in checked.findings.items()}
    for name, finding in findings(problem.robot, known):
        found[name or STUDY].append(finding)
    diagnosis = None
    if not any(one.check in _NO_FRFS for some in found.values() for one in some):
        diagnosis = look(problem).diagnosis
    if diagnosis is not None:
        text = " ".join(sentences(diagnosis, file.path.name))
        found[STUDY].append(Finding("fail", "set-up", (), text, diagnosis.probability))
    return replace(checked, findings=found), diagnosis


_NO_FRFS = ("magnitude", "decibels", "real-part")
"""Findings beside which a fit says nothing."""
