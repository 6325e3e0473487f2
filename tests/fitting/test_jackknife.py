"""The jackknife over blocks against refits without each block, and how often its intervals hold the truth."""

from __future__ import annotations

import numpy as np
import pytest

from identify.fitting.jackknife import block_jackknife, scatter_of_blocks, widening

NONE = np.zeros(2)


def test_what_a_block_pulls_is_what_a_refit_without_it_gives_back() -> None:
    rng = np.random.default_rng(1)
    columns, noise, blocks = rng.normal(size=(60, 2)), rng.normal(size=60), np.repeat(np.arange(6), 10)
    blocks = rng.permutation(blocks)
    best = np.linalg.lstsq(columns, noise, rcond=None)[0]
    matrix, _ = block_jackknife(columns, noise - columns @ best, blocks, NONE)
    moved = [
        np.linalg.lstsq(columns[blocks != one], noise[blocks != one], rcond=None)[0] - best
        for one in range(6)
    ]
    assert matrix == pytest.approx(np.transpose(moved) @ moved, rel=1e-9)


def test_scatter_of_blocks_is_the_jackknife_and_as_expected_of_independent_residuals() -> None:
    rng = np.random.default_rng(3)
    columns, blocks = rng.normal(size=(60, 2)), np.repeat(np.arange(6), 10)
    left, prior = rng.normal(size=60), np.array([0.3, 0.7])
    rows = [(columns[blocks == one], left[blocks == one]) for one in range(6)]
    parts, scores = np.array([j.T @ j for j, _ in rows]), np.array([j.T @ e for j, e in rows])
    matrix, _ = block_jackknife(columns, left, blocks, prior)
    found, expected = scatter_of_blocks(parts, scores, prior)
    assert found == pytest.approx(np.diag(matrix), rel=1e-9)
    scatter = []
    for _ in range(2000):  # values as known without data, then measured
        truth = rng.normal(size=2) / np.sqrt(prior)
        noise = columns @ truth + rng.normal(size=60)
        value = np.linalg.solve(columns.T @ columns + np.diag(prior), columns.T @ noise)
        rest = noise - columns @ value
        own = np.array([j.T @ rest[blocks == one] for one, (j, _) in enumerate(rows)])
        scatter.append(scatter_of_blocks(parts, own, prior)[0])
    assert np.mean(scatter, axis=0) == pytest.approx(expected, rel=0.05)


def test_a_mean_of_equal_blocks_has_one_degree_of_freedom_less_than_blocks() -> None:
    for count in (4, 15):
        blocks = np.repeat(np.arange(count), 8)
        _, freedom = block_jackknife(np.ones((8 * count, 1)), np.zeros(8 * count), blocks, np.zeros(1))
        assert freedom[0] == pytest.approx(count - 1)
    assert widening(np.array([3.0, 1e9])) == pytest.approx([3.182 / 1.96, 1.0], rel=1e-3)


@pytest.mark.parametrize("shared", [True, False])
def test_intervals_hold_the_truth_where_blocks_have_an_error_in_common(shared: bool) -> None:
    """Eight blocks of twenty numbers; as if they were independent, few hold it where they are not."""
    rng, blocks = np.random.default_rng(2), np.repeat(np.arange(8), 20)
    columns = np.column_stack([np.ones(160), np.linspace(-1, 1, 160)])
    held, naive = np.zeros(2), np.zeros(2)
    for _ in range(300):
        noise = rng.normal(size=160) + (2.0 * rng.normal(size=8)[blocks] if shared else 0.0)
        best = np.linalg.lstsq(columns, noise, rcond=None)[0]
        matrix, freedom = block_jackknife(columns, noise - columns @ best, blocks, NONE)
        held += np.abs(best) < 1.96 * np.sqrt(np.diag(matrix)) * widening(freedom)
        naive += np.abs(best) < 1.96 * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    assert ((held > 276) & (held < 297)).all(), "nine tenths and more, and not all"
    assert (naive < 150).all() == shared
