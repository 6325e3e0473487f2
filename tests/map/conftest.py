"""A planar arm of closed forms whose second joint is stiffer the further joint 3 is turned, which no effect
of the fitted model says.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from identify.vibration.run import run_fit
from tests.batch import planar

FITTED = 2


def stiffer(q: np.ndarray) -> np.ndarray:
    """Stiffness of the joints, by posture."""
    return planar.STIFFNESS * np.array([1.0, 1.0 + 0.4 * q[2], 1.0])


def modes(q: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """True frequencies, Hz, and damping ratios, (3,) each."""
    mass = planar.mass_matrix(q)
    below = -np.linalg.solve(mass, np.hstack([np.diag(stiffness), np.diag(planar.DAMPING)]))
    values = np.linalg.eigvals(np.block([[np.zeros((3, 3)), np.eye(3)], [below]]))
    values = np.array(sorted(values[values.imag > 0], key=abs))
    return np.abs(values) / (2 * np.pi), -values.real / np.abs(values)


def fitted(folder: Path, angles: np.ndarray, law: planar.Law, seed: int = 1, extra: str = "") -> Path:
    """The result of a fit of the first postures (n, 3), rad, with the others beside them."""
    study = planar.write_study(folder / "study", angles, law, seed)
    width = len(str(len(angles)))
    rows = [
        f"  - {{file: p{n:0{width}d}.csv, posture_deg: {np.rad2deg(q).tolist()},"
        f" noise: {{relative: {planar.NOISE}}}, use: {'fit' if n <= FITTED else 'validate'}}}"
        for n, q in enumerate(angles, 1)
    ]
    study.write_text(
        study.read_text() + "\n".join(["band_hz: [4, 64]", extra, "measurements:", *rows]) + "\n"
    )
    run_fit(study, folder / "fit.h5", {})
    return folder / "fit.h5"


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], Path]:
    """A fit with so many measured postures, made when it is first asked for."""
    made: dict[int, Path] = {}

    def of(count: int) -> Path:
        if count not in made:
            made[count] = fitted(tmp_path_factory.mktemp("measured"), planar.postures(count), stiffer)
        return made[count]

    return of
