"""Noise of records of which the study says none: what changes from sample to sample."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.core.correlated import white_level
from identify.core.errors import InputError
from identify.motion.problem import MotionProblem
from identify.motion.study import WEIGHTS


def with_noise(problem: MotionProblem) -> tuple[MotionProblem, tuple[str, ...]]:
    """The problem with a noise for every recorded signal that can be compared, one per joint where the study
    says none, and a sentence for each signal whose noise cannot be estimated.

    InputError where nothing is left to compare.
    """
    if not any(record.recorded for record in problem.records if record.settings.use == "fit"):
        raise InputError(
            "records",
            "nothing was recorded in a record of `use: fit` that a simulation can be compared with",
            "a record with `measured` that is fitted",
        )
    noise, notes = dict(problem.file.study.noise), list[str]()
    recorded = [q for q in WEIGHTS if any(q in record.recorded for record in problem.records)]
    for quantity in recorded:
        if quantity in noise or problem.file.study.noise:
            continue
        found = _levels(problem, quantity)
        if np.isfinite(found).all():
            noise[quantity] = [float(f"{level:.3g}") for level in found]
        else:
            notes.append(f"noise of {quantity} cannot be separated from its motion: it was not compared")
    if not noise:
        raise InputError(
            "noise", "; ".join(notes), "the standard deviation of measured signals", "give `noise`"
        )
    return problem.with_study(noise=noise), tuple(notes)


def _levels(problem: MotionProblem, quantity: str) -> Array:
    """Of each column, the median over records; joints of which nothing was recorded have the largest."""
    signals = [record.recorded[quantity] for record in problem.records if quantity in record.recorded]
    rows = np.array([[_level(column) for column in signal.T] for signal in signals])
    columns = [column[np.isfinite(column)] for column in rows.T]
    levels = np.array([np.median(own) if len(own) else np.nan for own in columns])
    silent = np.isnan(np.concatenate(signals)).all(axis=0)
    return np.where(silent, np.max(levels[~silent], initial=0.0), levels)


def _level(signal: Array) -> float:
    """Of one joint's signal (samples,), NaN where it cannot be determined."""
    used = np.isfinite(signal)
    level = white_level(np.where(used, signal, 0.0), used) if used.any() else 0.0
    return level if level > 0 else float("nan")
