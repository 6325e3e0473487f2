"""The hammer test of `data/arm_hammer_test`, as somebody states it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from identify.core.yaml_input import yaml_text
from identify.measured.correction import Correction
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set
from identify.measured.uff.write import write_uff58
from identify.setup.score import Score, scored
from identify.setup.stated import Stated, stated
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

DATA = Path(__file__).parents[2] / "data" / "arm_hammer_test"
POSTURES = [[13.4, 10.2, -1.9, 8.0, 50.0, 8.4], [-13.7, 31.0, -3.2, -22.9, 38.2, -26.6]]
FILES = ("posture1.uff", "posture3.uff")


def config(**keys: Any) -> dict[str, Any]:
    """The study of two postures, with these keys in place of what it has."""
    measurements = [
        {"file": str(DATA / file), "posture_deg": posture, "averages": 4, "window_decay_per_s": 1.226}
        for file, posture in zip(FILES, POSTURES, strict=True)
    ]
    return {
        "schema": "identify/1",
        "name": "arm",
        "robot": {"urdf": str(DATA / "robot.urdf")},
        "points": str(DATA / "points.csv"),
        "measurements": measurements,
        "band_hz": [3, 80],
        "starts": 2,
        **keys,
    }


def each(**keys: Any) -> list[dict[str, Any]]:
    """The measurements, with these keys in each."""
    return [{**one, **keys} for one in config()["measurements"]]


def misread(folder: Path, wrong: Correction) -> list[dict[str, Any]]:
    """The measurements with files of their own, which say something else of the same FRFs."""
    found = each()
    for one in found:
        path = folder / Path(one["file"]).name
        write_uff58(path, wrong.applied(frfs(path.name), path.name))
        one["file"] = str(path)
    return found


def simulated(folder: Path, stiffer: Mapping[str, float] | None = None, **keys: Any) -> list[dict[str, Any]]:
    """The measurements with files of what the model itself predicts of the study with these keys, after a
    fit of it; stiffer: factors of parameters in the second file.
    """
    problem, fitted = _fitted(yaml_text(config(**keys)))
    found = each(noise={"relative": 0.02})
    for number, (one, m) in enumerate(zip(found, problem.measurements, strict=True)):
        factors = [(stiffer or {}).get(p.name, 1.0) if number else 1.0 for p in problem.parameters]
        assert isinstance(m.target, FrfTarget)
        data = m.target.data
        frf = m.target.predict(fitted * np.array(factors))
        path = folder / f"simulated{number}.uff"
        write_uff58(path, FrfSet(data.frequency_hz, frf, data.outputs, data.inputs, data.quantity), True)
        one["file"] = str(path)
    return found


@cache
def _fitted(text: str) -> tuple[Problem, np.ndarray]:
    """A study and its fitted values (parameters,); once, because several tests begin with the same."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "arm.yaml"
        path.write_text(text)
        problem = load_problem(read_study(path))
    return problem, scored(stated(problem).problem()).values


@cache
def _right() -> tuple[Stated, Score]:
    with TemporaryDirectory() as folder:
        told = of(Path(folder), config())
    return told, scored(told.problem())


def right() -> tuple[Stated, Score]:
    """The study as it is and its quick fit, of which nothing else was asked yet; read once."""
    told, score = _right()
    return told, replace(score, asked={})


@cache
def frfs(file: str = FILES[0]) -> FrfSet:
    """The FRFs of a file, by default of the first posture."""
    return load_frf_set(DATA / file, FrfFileOptions())


def written(folder: Path, data: dict[str, Any]) -> Path:
    """The study as a file."""
    path = folder / "arm.yaml"
    path.write_text(yaml_text(data))
    return path


def of(folder: Path, data: dict[str, Any]) -> Stated:
    """The study, ready to be asked."""
    return stated(load_problem(read_study(written(folder, data))))
