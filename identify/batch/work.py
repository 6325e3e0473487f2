"""What the workers of a batch do: one fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from identify.core.config import read_yaml, validated
from identify.core.yaml_input import yaml_text
from identify.results.fit import FitResult
from identify.vibration.run import finished_before, fit_study
from identify.vibration.study import Study, StudyFile, read_study


def fit(
    study: str, name: str, measurements: Sequence[dict[str, Any]] | None, out: str, resume: bool, attempt: int
) -> dict[str, float | bool]:
    """Fit a study, or a base study to other measurements, and write the result to `out`; returns what the
    index and the bar show of it.

    resume, or a later attempt: a finished result of the very same fit is kept, and an interrupted one is gone
    on with.
    """
    path, file = Path(out), derived(Path(study), name, measurements)
    again = resume or attempt > 1
    kept: FitResult | None = finished_before(file, path) if again else None
    result = kept or fit_study(file, path, resume=again, replace=True)
    return {"kept": kept is not None, "converged": result.converged, "gap": result.gap}


def derived(study: Path, name: str, measurements: Sequence[dict[str, Any]] | None) -> StudyFile:
    """The study with other measurements and another name; its text is written anew, its paths stay relative
    to the same folder.
    """
    if measurements is None:
        return read_study(study)
    data, _ = read_yaml(study)
    if not isinstance(data, dict):
        return read_study(study)  # says what is wrong with it
    data["name"], data["measurements"] = name, list(measurements)
    text = yaml_text(data)
    settings = validated(
        Path(name), dict(data), Study
    )  # without lines: those of the base study would mislead
    return StudyFile.of(study.with_name(f"{name}.yaml"), settings, text)
