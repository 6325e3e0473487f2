"""Thresholds that several analyses share."""

from __future__ import annotations

CONVINCING = 5.0
"""Log odds that speak very strongly for a model, which is a difference of BIC of 10: Kass and Raftery 1995,
section 3.2.
"""


MISSING = 2.0
"""Gap above which something is missing from a model, whatever is said of its parameters."""


QUIET = 1.15
"""Gap up to which a residual passes as noise."""
