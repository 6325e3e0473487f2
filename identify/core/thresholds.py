"""Thresholds and quantiles that several analyses share."""

from __future__ import annotations

CONVINCING = 5.0
"""Log odds that speak very strongly for a model, which is a difference of BIC of 10: Kass and Raftery 1995,
section 3.2.
"""


MISSING = 2.0
"""Gap above which something is missing from a model, whatever is said of its parameters."""


PERCENTILES_95 = (2.5, 97.5)
"""Of draws, the ends of a 95 % interval."""


SIGMAS_95 = 1.96
"""Standard deviations of a normal distribution on each side of a two-sided 95 % interval."""


SIGMAS_95_ONE_SIDED = 1.645
"""The same where a bound leaves one side only."""


CLOSED = 1.1
"""Gap below which nothing is looked for: a few averages give the noise to some 5 %."""


QUIET = 1.15
"""Gap up to which a residual passes as noise."""


MATERIAL = 0.015
"""A smaller fall of the gap than this is within what estimators and noise models get wrong."""
