"""Where the starts of a fit begin."""

from __future__ import annotations

import numpy as np
import scipy.stats

from identify.core.parameters import Parameter
from identify.fitting.fit import starting_points

STARTS, SEED, FACTOR = 8, 3, 10.0
PARAMETERS = tuple(Parameter(f"k{n}", "N m/rad", 10.0**n, 1e-9, 1e9) for n in (3, 4, 5))


def test_starts_are_a_latin_hypercube_around_the_initial_values() -> None:
    """The first is the initial one; the others have one in each of as many parts of every side as they
    are, and the numbers that scipy would draw.
    """
    first, *others = starting_points(PARAMETERS, STARTS, FACTOR, SEED)
    assert np.allclose(first, np.log([1e3, 1e4, 1e5]))
    inside = (np.array(others) - first + np.log(FACTOR)) / (2 * np.log(FACTOR))
    parts = np.sort(np.floor(inside * (STARTS - 1)), axis=0)
    assert np.array_equal(parts, np.tile(np.arange(STARTS - 1.0)[:, None], 3))
    sampler = scipy.stats.qmc.LatinHypercube(3, rng=np.random.default_rng([SEED, 0x5747]))
    assert np.allclose(inside, sampler.random(STARTS - 1), atol=1e-12)


def test_one_start_is_the_initial_values() -> None:
    assert len(starting_points(PARAMETERS, 1, FACTOR, SEED)) == 1
