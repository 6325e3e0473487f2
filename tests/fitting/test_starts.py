"""Start values drawn as scipy draws them, without importing it."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats

from identify.fitting.fit import latin_hypercube


@pytest.mark.parametrize(("count", "size"), [(1, 1), (9, 12), (50, 3)])
def test_the_latin_hypercube_is_that_of_scipy_bit_for_bit(count: int, size: int) -> None:
    drawn = latin_hypercube(count, size, np.random.default_rng([count, 0x5747]).spawn(1)[0])
    theirs = scipy.stats.qmc.LatinHypercube(size, rng=np.random.default_rng([count, 0x5747]))
    assert np.array_equal(drawn, theirs.random(count))
    assert np.array_equal(np.sort(np.floor(drawn * count), axis=0)[:, 0], np.arange(count))
