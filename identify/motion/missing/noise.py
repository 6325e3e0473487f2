"""Noise of records of which the study says none: what changes from sample to sample."""

from __future__ import annotations

import numpy as np

from identify.core.correlated import white_level
from identify.core.errors import InputError
from identify.motion.problem import MotionProblem
from identify.motion.study import WEIGHTS


def with_noise(problem: MotionProblem) -> tuple[MotionProblem, tuple[str, ...]]:
    """The problem with a noise for every recorded signal that can be compared, one per joint where the study
    says none, and a sentence for each signal of which none can be told.

    InputError where nothing is left to compare.
    """
    noise, notes = dict(problem.file.study.noise), list[str]()
    recorded = [q for q in WEIGHTS if any(q in record.recorded for record in problem.records)]
    for quantity in recorded:
        if quantity in noise or problem.file.study.noise:
            continue
        found = _levels(problem, quantity)
        if np.isfinite(found).all():
            noise[quantity] = [float(f"{level:.3g}") for level in found]
        else:
            notes.append(
                f"noise of {quantity} cannot be told from its motion: it was not compared; give `noise`"
            )
    if not noise:
        raise InputError(
            "records",
            "nothing was recorded that a simulation can be compared with",
            "records with `measured`, and `noise` where they have none of their own",
        )
    return problem.with_study(noise=noise), tuple(notes)


def _levels(problem: MotionProblem, quantity: str) -> np.ndarray:
    """Of each column, the median over records; joints that were not recorded have that of the others."""
    rows = []
    for record in problem.records:
        signal = record.recorded.get(quantity)
        if signal is not None:
            used = np.isfinite(signal)
            rows.append(
                [white_level(s, u) if u.any() else np.nan for s, u in zip(signal.T, used.T, strict=True)]
            )
    levels = np.array(rows)
    known = np.isfinite(levels) & (levels > 0)
    levels = np.where(known, levels, np.nan)
    column = np.array([np.median(c[np.isfinite(c)]) if np.isfinite(c).any() else np.nan for c in levels.T])
    measured = np.array(
        [
            any(
                np.isfinite(r.recorded[quantity][:, n]).any()
                for r in problem.records
                if quantity in r.recorded
            )
            for n in range(len(column))
        ]
    )
    return np.where(measured, column, np.nanmax(column) if np.isfinite(column).any() else np.nan)
