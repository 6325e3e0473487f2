"""Sparse stacks of matrices against dense ones."""

from __future__ import annotations

import numpy as np
import pytest

from identify.model.stack import Stack

SIZE, COUNT = 5, 4


@pytest.fixture
def dense() -> np.ndarray:
    """(count, n, n): symmetric, the third with one entry, the second without any."""
    rng = np.random.default_rng(3)
    found = rng.normal(size=(COUNT, SIZE, SIZE)) * (rng.random((COUNT, SIZE, SIZE)) < 0.4)
    found = found + np.swapaxes(found, 1, 2)
    found[1] = found[2] = 0.0
    found[2, 3, 3] = 2.0
    return found


@pytest.fixture
def stack(dense: np.ndarray) -> Stack:
    return Stack.of([(n, one) for n, one in enumerate(dense) if n != 1], COUNT, SIZE)


def test_its_matrices_are_those_that_were_given(stack: Stack, dense: np.ndarray) -> None:
    assert len(stack) == COUNT and stack.any()
    for numbers in (slice(None), np.array([3, 0]), np.array([True, False, True, False]), 2, -1):
        assert np.array_equal(stack[numbers], dense[numbers])
    assert not Stack.of([], COUNT, SIZE).any()
    assert np.array_equal(Stack.of([], COUNT, SIZE)[:], np.zeros_like(dense))


@pytest.mark.parametrize("shape", [(), (1,), (3,), (2, 3)])
def test_a_weighted_sum_is_that_of_dense_matrices(
    stack: Stack, dense: np.ndarray, shape: tuple[int, ...]
) -> None:
    values = np.random.default_rng(5).normal(size=(*shape, COUNT)) * 1e6
    found = stack.weighted(values)
    assert found == pytest.approx(np.tensordot(values, dense, axes=1), rel=1e-13)
    assert np.array_equal(found, np.swapaxes(found, -1, -2)), "symmetric to the last bit"
    assert found.flags.c_contiguous
    assert np.array_equal(Stack.of([], COUNT, SIZE).weighted(values), np.zeros((*shape, SIZE, SIZE)))


@pytest.mark.parametrize("chosen", [[0, 3, 4], [4, 1], []])
def test_some_of_its_rows_and_columns(stack: Stack, dense: np.ndarray, chosen: list[int]) -> None:
    at = np.array(chosen, dtype=int)
    assert np.array_equal(stack.over(at)[:], dense[:, at[:, None], at])
