"""The planar arm of the batches, fitted at two postures, for tests of what a fitted model says of cutting."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.vibration.run import run_fit
from tests.batch import planar

POSTURE = planar.postures(2)[0]
TOOL = """schema: identify-tool/1
name: planar mill
teeth: 2
diameter_mm: 16
node: 2
spindle_axis: [0, 0, -1]
feed: [1, 0.5, 0]
cut: {kind: up, width_mm: 8}
coefficients: {tangential_n_per_mm2: 600, radial_n_per_mm2: 150}
spindle_rpm: [3000, 9000]
max_depth_mm: 5
"""


def write_fit(folder: Path) -> Path:
    """The result file of the fit, and `tool.yaml` beside it."""
    study = planar.write_study(folder / "study", planar.postures(2))
    rows = [
        f"  - {{file: p{n}.csv, posture_deg: {q.tolist()}, noise: {{relative: {planar.NOISE}}}}}"
        for n, q in enumerate(np.rad2deg(planar.postures(2)), 1)
    ]
    study.write_text(study.read_text() + "\n".join(["band_hz: [4, 64]", "measurements:", *rows]) + "\n")
    run_fit(study, folder / "fit.h5", {})
    (folder / "tool.yaml").write_text(TOOL)
    return folder / "fit.h5"


def tip_jacobian(q: np.ndarray) -> np.ndarray:
    """(3, 3): motion of the tool's point along the base's axes per joint."""
    return np.vstack([planar._jacobian(q, 3, 0.3), np.zeros(3)])
