"""Studies of the shared hammer tests with something hidden: config text from their test.json, truth for
scoring only.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from tests.shared import shared


def truth(case: str) -> dict[str, Any]:
    """What was hidden; for scoring, never for fitting."""
    loaded: dict[str, Any] = json.loads(shared("hidden", f"{case}.truth.json").read_text())
    return loaded


def write_config(case: str, folder: Path, initial: list[float] | None = None, extra: str = "") -> Path:
    """A config for a shared case in `folder`, see `config_of`."""
    return config_of(shared("hidden", case), folder, initial, extra)


def config_of(source: Path, folder: Path, initial: list[float] | None = None, extra: str = "") -> Path:
    """A config in `folder` for the case in `source`: posture 3 for validation, the others fitted; first guess
    from its test.json.
    """
    source, case = source.resolve(), source.name
    test = json.loads((source / "test.json").read_text())
    lines = [
        "schema: identify/1",
        f"name: {case}",
        f"robot: {{urdf: '{source / 'robot.urdf'}'}}",
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
