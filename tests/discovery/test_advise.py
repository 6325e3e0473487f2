"""Which measurement would tell two models apart: against the closed forms of a planar arm."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from identify.discovery.advise import advise
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from tests.batch import planar

POSTURES = planar.postures(2)


FOLDED = np.array([[0.2, 2.55, 0.1]])


@pytest.fixture
def problem(tmp_path: Path) -> Problem:
    """The planar arm measured in two postures."""
    return _measured(tmp_path, POSTURES)


def _measured(folder: Path, postures: np.ndarray) -> Problem:
    study = planar.write_study(folder, postures)
    rows = [
        f"  - {{file: p{n}.csv, posture_deg: {np.rad2deg(q).tolist()}, noise: {{relative: {planar.NOISE}}}}}"
        for n, q in enumerate(postures, 1)
    ]
    study.write_text(study.read_text() + "\n".join(["measurements:", *rows]) + "\n")
    return load_problem(read_study(study))


def _values(problem: Problem, stiffness: np.ndarray) -> dict[str, float]:
    values = np.stack([stiffness, planar.DAMPING], axis=1).ravel().tolist()
    return dict(zip([p.name for p in problem.of_effects], values, strict=True))


def _apart(q: np.ndarray, stiffness: np.ndarray, output: str, impact: str) -> float:
    """By how much two arms differ at most, m/s^2/N, between two of the planar arm's channels."""
    _, rows = planar.channels(q)
    names = [f"p{node}:{axis}" for node in planar.NODES for axis in "XY"]
    s = 2j * np.pi * planar.LINES[:, None, None]
    one, other = (
        s**2 * np.linalg.inv(np.diag(k) + s * np.diag(planar.DAMPING) + s**2 * planar.mass_matrix(q))
        for k in (planar.STIFFNESS, stiffness)
    )
    difference = rows[names.index(output)] @ (one - other) @ rows[names.index(impact)]
    return float(np.abs(difference).max())


def _told(problem: Problem, stiffness: np.ndarray) -> str:
    effects = problem.file.study.effects
    one, other = ((effects, _values(problem, k)) for k in (planar.STIFFNESS, stiffness))
    return advise(problem, one, other)


def test_the_place_where_two_models_differ_most_is_named(problem: Problem) -> None:
    other = planar.STIFFNESS * np.array([1.0, 1.05, 1.0])
    sentence = _told(problem, other)
    found = re.match(
        r"To tell them apart, measure (p\d:[XY]) for an impact at (p\d:[XY]) in a measured posture"
        r" \(\[(.*?)\] degrees\): they differ there by up to ([\d.]+) times the noise",
        sentence,
    )
    assert found is not None, sentence
    output, impact, posture, ratio = found.groups()
    target = problem.targets().frf[0]
    noise = float(np.median(target.sigma))
    names = [f"p{node}:{axis}" for node in planar.NODES for axis in "XY"]
    best = [max(_apart(q, other, a, b) for a in names for b in names) for q in POSTURES]
    q = POSTURES[int(np.argmax(best))]
    assert posture == ", ".join(f"{angle:.0f}" for angle in np.rad2deg(q))
    assert _apart(q, other, output, impact) == pytest.approx(max(best), rel=1e-6)
    assert float(ratio) == pytest.approx(max(best) / noise, abs=0.051)


def test_another_posture_is_advised_where_it_shows_far_more(tmp_path: Path) -> None:
    """The joint at which two models differ hardly moves the tool of an arm that was measured folded."""
    problem = _measured(tmp_path, FOLDED)
    other = planar.STIFFNESS * np.array([1.02, 1.0, 1.0])
    sentence = _told(problem, other)
    found = re.search(
        r"up to ([\d.]+) times the noise\. Better still, (p\d:[XY]) for an impact at (p\d:[XY]) at joint"
        r" angles \[(.*?)\] degrees: ([\d.]+) times",
        sentence,
    )
    assert found is not None, sentence
    here, output, impact, posture, there = found.groups()
    q = np.deg2rad([float(angle) for angle in posture.split(",")])
    noise = float(np.median(problem.targets().frf[0].sigma))
    assert float(there) > 1.5 * float(here)
    assert _apart(q, other, output, impact) / noise == pytest.approx(float(there), rel=0.1)
    assert np.all(np.abs(np.rad2deg(q - FOLDED[0])) <= 61)


def test_models_that_are_the_same_differ_nowhere(problem: Problem) -> None:
    sentence = _told(problem, planar.STIFFNESS)
    assert "by up to 0.0 times the noise" in sentence
    assert "Better still" not in sentence
