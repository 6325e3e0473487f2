"""Studies of the shared hammer tests with something hidden: config text from their test.json, truth for
scoring only.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identify.fitting.fit import fit
from identify.vibration.plan import fit_plan
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap
from tests.shared import shared


def truth(case: str) -> dict[str, Any]:
    """What was hidden; for scoring, never for fitting."""
    loaded: dict[str, Any] = json.loads(shared("hidden", f"{case}.truth.json").read_text())
    return loaded


@dataclass(frozen=True)
class Fitted:
    """Values by name, and the gap on fitted and on validation data, without all else that a result has."""

    values: dict[str, float]
    gap: float
    gap_validation: float


def fitted(case: str, folder: Path, extra: str = "") -> Fitted:
    """A shared case fitted."""
    problem = load_problem(read_study(write_config(case, folder, extra=extra)))
    found = fit(fit_plan(problem)).values
    values = dict(zip((p.name for p in problem.parameters), map(float, found), strict=True))
    return Fitted(values, gap(problem.targets(), found), gap(problem.targets("validate"), found))


def write_config(case: str, folder: Path, initial: list[float] | None = None, extra: str = "") -> Path:
    """A config for a shared case in `folder`, see `config_of`."""
    return config_of(shared("hidden", case), folder, initial, extra)


def _payload(test: dict[str, Any]) -> str:
    """The payload that a test was told, as a key of its robot."""
    return f", payload: [{json.dumps(test['payload'])}]" if "payload" in test else ""


def config_of(source: Path, folder: Path, initial: list[float] | None = None, extra: str = "") -> Path:
    """A config in `folder` for the case in `source`: posture 3 for validation, the others fitted; first guess
    from its test.json.
    """
    source, case = source.resolve(), source.name
    test = json.loads((source / "test.json").read_text())
    lines = [
        "schema: identify/1",
        f"name: {case}",
        f"robot: {{urdf: '{source / 'robot.urdf'}'{_payload(test)}}}",
        f"points: '{source / 'points.csv'}'",
    ]
    lines.append("measurements:")
    for entry in test["files"]:
        use = "validate" if entry["file"].startswith("posture3") else "fit"
        decay = test["exponential_window_decay_per_s"]
        impact = f"impact: {{peak_n: {entry['level_n']}}}, " if "level_n" in entry else ""
        lines.append(
            f"  - {{file: '{source / entry['file']}', posture_deg: {entry['posture_deg']}, averages:"
            f" {test['averages']}, window_decay_per_s: {decay}, {impact}use: {use}}}"
        )
    guess = initial or test["initial_stiffness_nm_per_rad"]
    lines += ["band_hz: [3, 80]", "effects:", "  - kind: joint-compliance", "    axes: [rz]"]
    lines.append(
        f"    stiffness: {{initial: {[float(k) for k in np.asarray(guess)]}, bounds: [1.0e+2, 1.0e+9]}}"
    )
    lines.append("    damping: {damping_ratio: 0.04, bounds: [1.0e-3, 1.0e+6]}")
    path = folder / f"{case}.yaml"
    path.write_text("\n".join([*lines, extra]) + "\n")
    return path
