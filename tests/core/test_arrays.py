"""Vector products against NumPy's."""

from __future__ import annotations

import numpy as np
import pytest

from identify.core.arrays import cross


@pytest.mark.parametrize(("one", "other"), [((3,), (3,)), ((5, 3), (3,)), ((2, 1, 3), (4, 3))])
def test_the_vector_product_is_numpy_s(one: tuple[int, ...], other: tuple[int, ...]) -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=one), rng.normal(size=other)
    assert np.array_equal(cross(a, b), np.cross(a, b))
