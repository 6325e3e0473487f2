"""Arms of two links in motion, each simulated by `tests.generator` once and written wherever it is used."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from tests.generator import hidden_motion


def write(folder: Path, kind: str = "", seed: int = 4) -> None:
    """What `hidden_motion.write` writes of an arm with something hidden, as its constants are now: one record
    to fit.
    """
    constants = ("PERIOD_S", "PARTS", "EVERY", "DURATION_S", "CREEP")
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in _files(kind, seed, tuple(getattr(hidden_motion, one) for one in constants)).items():
        (folder / name).write_text(text)


@cache
def _files(kind: str, seed: int, _constants: tuple[float, ...]) -> dict[str, str]:
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        hidden_motion.write(hidden_motion.drawn(rng, kind, False), Path(folder), rng, ["one"])
        return {path.name: path.read_text() for path in Path(folder).iterdir()}
