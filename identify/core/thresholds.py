"""Thresholds that several analyses share."""

from __future__ import annotations

CONVINCING = 10.0
"""Difference of BIC that speaks very strongly for a model: Kass and Raftery 1995, section 3.2."""


MISSING = 2.0
"""Gap above which something is missing from a model, whatever is said of its parameters."""


QUIET = 1.15
"""Gap up to which a residual passes as noise."""
