"""Several robots of one type: means, scatters and single values against populations that are drawn, and
against the whole Gaussian problem solved at once.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.linalg import block_diag

from identify.batch.population import Estimate, population, scatter_interval
from identify.batch.run import run_batch
from identify.core.errors import InputError
from identify.reports.kinds import report_of
from identify.reports.kit.report import Tabular
from identify.results import file as result_file
from identify.results.batch import BatchResult, PopulationTable
from tests.batch.conftest import in_this_process
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

SIZE = 3
NONE = np.zeros((SIZE, 0))


def _covariance(rng: np.random.Generator, size: int, std: float) -> np.ndarray:
    mix = rng.normal(size=(size, size))
    return np.asarray(std**2 * (np.diag(rng.uniform(0.3, 1.5, size)) + mix @ mix.T / size) / 2)


def _drawn(seed: int, fits: int, scatter: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[Estimate]]:
    """Mean (SIZE,), values (fits, SIZE) and estimates of a population."""
    rng = np.random.default_rng([seed, fits])
    mean = rng.normal(size=SIZE)
    values = mean + scatter * rng.normal(size=(fits, SIZE))
    covariances = [_covariance(rng, SIZE, 1.0) for _ in range(fits)]
    numbers = np.arange(SIZE)
    drawn = zip(values, covariances, strict=True)
    return mean, values, [Estimate(numbers, rng.multivariate_normal(v, c), c, NONE) for v, c in drawn]


@pytest.mark.parametrize(
    ("fits", "scatter", "own"),
    [(6, (1.0, 0.0, 3.0), 0.93), (12, (1.0, 1.0, 1.0), 0.9)],
)
def test_intervals_hold_means_scatters_and_values_of_drawn_populations(
    fits: int, scatter: tuple[float, ...], own: float
) -> None:
    true, held = np.array(scatter), {"mean": [], "scatter": [], "own": []}  # type: ignore[var-annotated]
    gain = []
    for seed in range(60):
        mean, values, estimates = _drawn(seed, fits, true)
        found = population(estimates, true > -1)
        held["mean"].append(np.abs(found.mean - mean) <= found.mean_half)
        held["own"].append(np.abs(found.value - values) <= found.half)
        for k in range(SIZE):
            x = np.array([one.value[k] for one in estimates])
            std = np.array([np.sqrt(one.covariance[k, k]) for one in estimates])
            low, high = scatter_interval(x, std)
            held["scatter"].append(low <= true[k] <= high)
        alone = np.array([one.value for one in estimates])
        gain.append(np.mean((found.value - values) ** 2) / np.mean((alone - values) ** 2))
    assert 0.92 <= np.mean(held["mean"]) <= 0.99
    assert 0.93 <= np.mean(held["scatter"]) <= 0.985
    assert np.mean(held["own"]) >= own
    assert np.mean(gain) < 0.85, "values drawn to the mean are nearer the truth than those of single fits"


def test_intervals_are_no_wider_than_they_must_be() -> None:
    """Without noise: mean and scatter of a sample, Student and chi-square."""
    rng = np.random.default_rng(5)
    x = rng.normal(3.0, 2.0, 8)
    estimates = [
        Estimate(np.zeros(1, dtype=int), x[n : n + 1], np.full((1, 1), 1e-8), NONE[:1]) for n in range(8)
    ]
    found = population(estimates, np.ones(1, dtype=bool))
    assert found.mean[0] == pytest.approx(x.mean())
    assert found.scatter[0] == pytest.approx(x.std(ddof=1), rel=1e-4)
    assert found.mean_half[0] == pytest.approx(stats.t.ppf(0.975, 7) * x.std(ddof=1) / np.sqrt(8), rel=1e-3)
    ends = np.sqrt(7 * x.var(ddof=1) / stats.chi2.ppf([0.975, 0.025], 7))
    assert scatter_interval(x, np.full(8, 1e-4)) == pytest.approx(ends, rel=1e-4)
    np.testing.assert_allclose(found.value[:, 0], x, atol=1e-6)
    np.testing.assert_allclose(found.half, 1.96e-4, rtol=0.01)


def test_what_is_shared_is_pooled_by_its_information() -> None:
    _, _, estimates = _drawn(3, 5, np.zeros(SIZE))
    found = population(estimates, np.zeros(SIZE, dtype=bool))
    inverses = [np.linalg.inv(one.covariance) for one in estimates]
    covariance = np.linalg.inv(sum(inverses))
    mean = covariance @ sum(i @ one.value for i, one in zip(inverses, estimates, strict=True))
    np.testing.assert_allclose(found.mean, mean)
    np.testing.assert_allclose(found.mean_half, 1.96 * np.sqrt(np.diag(covariance)), rtol=1e-4)
    np.testing.assert_allclose(found.value, np.tile(mean, (5, 1)))


def test_errors_in_common_do_not_average_out() -> None:
    """The whole covariance of all estimates at once; one fit does not know the second parameter."""
    rng, fits = np.random.default_rng(8), 4
    own = [np.array([0] if n == 2 else [0, 1]) for n in range(fits)]
    slopes = [rng.normal(size=(len(one), 3)) for one in own]
    covariances = [_covariance(rng, len(one), 0.3) for one in own]
    values = [rng.normal(size=len(one)) for one in own]
    estimates = [Estimate(*parts) for parts in zip(own, values, covariances, slopes, strict=True)]
    found = population(estimates, np.zeros(2, dtype=bool))
    all_slopes, design = np.concatenate(slopes), np.eye(2)[np.concatenate(own)]
    whole = np.linalg.inv(block_diag(*covariances) + all_slopes @ all_slopes.T)
    covariance = np.linalg.inv(design.T @ whole @ design)
    np.testing.assert_allclose(found.mean, covariance @ design.T @ whole @ np.concatenate(values))
    np.testing.assert_allclose(found.mean_half, 1.96 * np.sqrt(np.diag(covariance)), rtol=1e-4)
    assert np.isnan(found.value[2, 1])


FITS, SCATTER = 4, np.array([0.0, 0.08, 0.0, 0.0, 0.06, 0.0])


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> tuple[BatchResult, np.ndarray, Path]:
    """Hammer tests of robots that differ in joints 2 and 5, their batch, and true stiffnesses (robots, 6)."""
    folder, arm = tmp_path_factory.mktemp("robots"), MAKES["random"](3).at_points([6, 10, 14])
    rng, true = np.random.default_rng(2), []
    for number in range(FITS):
        stiffness = arm.stiffness * np.exp(SCATTER * rng.normal(size=6))
        one = dataclasses.replace(arm, stiffness=stiffness)
        spec = TestSpec(arm=one, seed=20 + number, postures=1, binary=True, linear=True)
        generate(spec, folder / f"robot{number}")
        config_of(folder / f"robot{number}", folder, list(arm.stiffness), "starts: 1")
        true.append(stiffness)
    config = folder / "batch.yaml"
    text = (
        "schema: identify-batch/1\nname: robots\nstudies: ['robot*.yaml']\njoint: {shared: ['*.damping']}\n"
    )
    config.write_text(text)
    with in_this_process():
        return run_batch(config, folder / "robots.h5")[0], np.array(true), folder


def _stiffness(p: PopulationTable) -> list[int]:
    return [n for n, name in enumerate(p.parameter) if name.endswith("stiffness")]


def test_a_batch_of_robots_finds_what_differs_between_them(
    robots: tuple[BatchResult, np.ndarray, Path],
) -> None:
    result, true, folder = robots
    p = result.population
    assert p is not None
    rows = _stiffness(p)
    assert [bool(p.differs[n]) for n in rows] == [False, True, False, False, True, False]
    assert [bool(p.shared[n]) for n, name in enumerate(p.parameter)] == [
        name.endswith("damping") for name in p.parameter
    ]
    sample = np.log(true).std(axis=0, ddof=1)
    assert p.scatter[rows][[1, 4]] == pytest.approx(sample[[1, 4]], rel=0.3)
    inside = (p.scatter_low_95[rows] <= SCATTER) & (p.scatter_high_95[rows] >= SCATTER)
    assert inside.sum() >= 5
    held = (p.low_95[:, rows] <= true) & (true <= p.high_95[:, rows])
    assert held.mean() > 0.85
    assert np.isnan(p.scatter[p.shared]).all()
    assert result.verdict[-1].startswith("Together, the 4 fits differ in ")
    assert "joint2.rz.stiffness" in result.verdict[-1]
    kept = result_file.read(folder / "robots.h5", BatchResult)
    assert kept.population is not None
    np.testing.assert_array_equal(kept.population.scatter, p.scatter)


def test_a_report_shows_mean_and_scatter(robots: tuple[BatchResult, np.ndarray, Path]) -> None:
    sections = {section.anchor: section for section in report_of(robots[0]).sections}
    table = next(part.table for part in sections["population"].parts if isinstance(part, Tabular))
    assert [row[0] for row in table.rows] == list(robots[0].parameters.name)
    assert {row[1] for row in table.rows} == {"own", "shared"}


def test_a_pattern_that_no_parameter_has_is_refused(robots: tuple[BatchResult, np.ndarray, Path]) -> None:
    config = robots[2] / "wrong.yaml"
    config.write_text((robots[2] / "batch.yaml").read_text().replace("*.damping", "*.dampng"))
    with in_this_process(), pytest.raises(InputError, match="no parameter is called"):
        run_batch(config, robots[2] / "robots.h5", resume=True)
