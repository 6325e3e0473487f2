"""Fit elastic robot models to measured vibration; see `identify.cli` for the commands and
`identify.fitting.fit` for the loop.
"""

__version__ = "0.1.0"
