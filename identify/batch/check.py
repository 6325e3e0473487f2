"""`identify check` of a batch: every study that it fits is looked at as `identify check` does by itself."""

from __future__ import annotations

from pathlib import Path

from identify.batch.settings import read_batch
from identify.batch.work import derived
from identify.core.errors import InputError
from identify.measured.finding import STUDY, Checked, Finding, kept
from identify.vibration.check import checks_of


def run_checks(config: Path) -> Checked:
    """Load all that the fits of a batch would load and look at it.

    Raises InputError or InputErrors where the batch itself cannot be read; other refusals are kept.
    """
    batch, refused = read_batch(config), list[InputError]()
    sentence = f"{len(batch.items)} fits{', and one of all together' if batch.joint else ''}."
    found: dict[str, list[Finding]] = {STUDY: [Finding("info", "fits", (), sentence, len(batch.items))]}
    for item in batch.items:
        checked = kept(lambda one=item: checks_of(derived(one.study, one.name, one.measurements)), refused)  # type: ignore[misc]
        if checked is not None:
            refused += checked.refused
            for name, findings in checked.findings.items():
                label = item.name if name in (STUDY, item.name) else f"{item.name}, {name}"
                found.setdefault(label, []).extend(findings)
    return Checked(found, tuple(refused), "batch")
