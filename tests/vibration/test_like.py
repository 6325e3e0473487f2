"""A fitted robot as what is known of another of its type."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.vibration.problem import load_problem
from identify.vibration.run import run_fit
from identify.vibration.study import read_study
from tests.batch import planar

SPREAD = 0.2


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of a robot that was measured well."""
    return study(
        tmp_path_factory.mktemp("first"), "name: first", planar.postures(2), planar.constant, fit=True
    )


def study(
    folder: Path, extra: str, angles: np.ndarray, law: Callable[[np.ndarray], np.ndarray], *, fit: bool
) -> Path:
    """A study of postures (n, 3), rad, or its result."""
    path = planar.write_study(folder, angles, law)
    rows = [
        f"  - {{file: p{n}.csv, posture_deg: {np.rad2deg(q).tolist()}, noise: {{relative: {planar.NOISE}}}}}"
        for n, q in enumerate(angles, 1)
    ]
    text = path.read_text().replace("name: planar", extra)
    path.write_text("\n".join([text, "band_hz: [4, 64]", "measurements:", *rows]) + "\n")
    if fit:
        run_fit(path, folder / "fit.h5", {})
        return folder / "fit.h5"
    return path


def like(first: Path) -> str:
    return f"name: second\nlike: {{result: {first}, spread: {SPREAD}}}"


def test_parameters_start_at_the_other_robots_within_what_is_stated(first: Path, tmp_path: Path) -> None:
    config = study(tmp_path, like(first), planar.postures(1), planar.constant, fit=False)
    problem = load_problem(read_study(config))
    found = result_file.read(first, FitResult).parameters
    assert [p.name for p in problem.parameters] == list(found.name)
    np.testing.assert_allclose([p.initial for p in problem.parameters], found.value, rtol=1e-9)
    for p, std in zip(problem.parameters, found.std, strict=True):
        reach = 2 * np.hypot(std, SPREAD)
        assert np.log([p.initial / p.lower, p.upper / p.initial]) == pytest.approx(reach, rel=2e-3)


def test_what_the_data_do_not_tell_stays_what_it_is_in_the_type(first: Path, tmp_path: Path) -> None:
    """A test of the second robot below its second mode: what it leaves open is as wide as the type is."""
    angles = planar.postures(1, seed=4)
    wide, narrow = (
        result_file.read(study(tmp_path / name, extra, angles, _softer, fit=True), FitResult)
        for name, extra in (("alone", "name: alone"), ("like", like(first)))
    )
    std, known = wide.parameters.std, narrow.parameters.std
    assert (known < np.hypot(SPREAD, result_file.read(first, FitResult).parameters.std) * 1.1).all()
    assert (known <= std * 1.1).all() and narrow.gap < 1.2
    truth = np.concatenate([_softer(angles[0]), planar.DAMPING])
    values = dict(zip(narrow.parameters.name, narrow.parameters.value, strict=True))
    found = [values[f"joint{n}.rz.{what}"] for what in ("stiffness", "damping") for n in (1, 2, 3)]
    assert np.abs(np.log(np.array(found) / truth)).max() < 0.5
    assert any(str(first) in name for name in narrow.provenance.input_files)


def _softer(q: np.ndarray) -> np.ndarray:
    return planar.STIFFNESS * np.array([0.85, 0.9, 1.1])


def test_a_robot_that_is_not_as_alike_as_stated_is_told(first: Path, tmp_path: Path) -> None:
    def weak(q: np.ndarray) -> np.ndarray:
        return planar.STIFFNESS * np.array([1.0, 0.4, 1.0])

    result = result_file.read(study(tmp_path, like(first), planar.postures(2), weak, fit=True), FitResult)
    assert any("At a bound" in one and "joint2.rz.stiffness" in one for one in result.verdict)


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("{result: nothing.h5, spread: 0.2}", r"nothing\.h5"),
        ("{result: p1.csv, spread: 0.2}", r"p1\.csv"),
        ("{result: p1.csv, spread: 0}", "spread"),
        ("{result: p1.csv}", "spread"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path: Path, key: str, said: str) -> None:
    config = study(tmp_path, f"name: x\nlike: {key}", planar.postures(1), planar.constant, fit=False)
    with pytest.raises((InputError, InputErrors), match=said):
        load_problem(read_study(config))


def test_parameters_of_other_names_and_fixed_ones_stay(first: Path, tmp_path: Path) -> None:
    config = study(tmp_path, like(first), planar.postures(1), planar.constant, fit=False)
    text = config.read_text().replace(
        "  - kind: joint", "  - {kind: joint-compliance, joints: [3], axes: [ry]}\n  - kind: joint"
    )
    config.write_text(text.replace("bounds: [0.1, 1.0e4]", "bounds: [0.1, 1.0e4], fixed: true"))
    plain = config.with_name("plain.yaml")
    plain.write_text(config.read_text().replace(like(first), "name: plain"))
    one, other = (load_problem(read_study(path)).parameters for path in (config, plain))
    for p, q in zip(one, other, strict=True):
        if ".ry." in p.name or p.name.endswith("damping"):
            assert p == q
        else:
            assert replace(p, initial=q.initial, lower=q.lower, upper=q.upper) == q and p != q
