"""Studies of the shared hammer tests with something hidden: config text from their test.json, truth for scoring only."""

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
    """A config for a case in `folder`: postures 1 and 2 fitted, 3 for validation; default first guess from its test.json."""
    source = shared("hidden", case)
    test = json.loads((source / "test.json").read_text())
    lines = ["schema: identify/1", f"name: {case}", f"robot: {{urdf: '{source / 'robot.urdf'}'}}", f"points: '{source / 'points.csv'}'"]
    lines.append("measurements:")
    for entry in test["files"]:
        use = "validate" if entry["file"].startswith("posture3") else "fit"
        decay = test["exponential_window_decay_per_s"]
        lines.append(
            f"  - {{file: '{source / entry['file']}', posture_deg: {entry['posture_deg']}, averages: {test['averages']}, "
            f"window_decay_per_s: {decay}, use: {use}}}"
        )
    guess = initial or test["initial_stiffness_nm_per_rad"]
    lines += ["band_hz: [3, 80]", "effects:", "  - kind: joint-compliance", "    axes: [rz]"]
    lines.append(f"    stiffness: {{initial: {[float(k) for k in np.asarray(guess)]}, bounds: [1.0e+4, 1.0e+8]}}")
    lines.append("    damping: {damping_ratio: 0.04, bounds: [0.1, 1.0e+5]}")
    path = folder / f"{case}.yaml"
    path.write_text("\n".join([*lines, extra]) + "\n")
    return path
