"""The modal analysis of several setups: together where their poles agree, merged where these differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.interruption import check
from identify.core.text import listed
from identify.measured.common_lines import common_axis
from identify.measured.frf_set import FrfSet
from identify.modal.analysis import ModalAnalysis, analyse
from identify.modal.settings import ModalSettings
from identify.modal.setups.analysis import Merged, merged, poles_of
from identify.modal.setups.residues import is_joined
from identify.modal.setups.result import as_analysis

_BY_CHANCE = 1e-3
"""Probability of poles that differ so much where they are the same, over all modes: below it they differ."""


@dataclass(frozen=True)
class Setups:
    """What setups have shown: names, merged modes; together: whether their poles agree, so that the modes of
    the analysis are those of all FRFs at once.
    """

    names: tuple[str, ...]
    merged: Merged
    together: bool


def analyse_setups(
    data: FrfSet, sets: Sequence[FrfSet], names: Sequence[str], settings: ModalSettings
) -> tuple[ModalAnalysis, Setups | None]:
    """Modes of several setups; data: the FRFs of all (`result.pooled`).  Without a mode in any setup, those
    of all FRFs at once.

    InputError as `analyse`, and for setups without a common axis, quantity or window, or that no channel
    joins.
    """
    _check(sets, names, data)
    found = []
    for one in sets:
        check()
        found.append(analyse(one, settings))
    if not any(len(one.table) for one in found):
        return analyse(data, settings), None
    modes = merged(sets, found, settings.min_presence)
    agree = poles_agree(modes, found)
    analysis = analyse(data, settings) if agree else as_analysis(data, modes, names, found)
    return analysis, Setups(tuple(names), modes, agree)


def poles_agree(modes: Merged, found: Sequence[ModalAnalysis]) -> bool:
    """Whether frequencies of setups differ by no more than their intervals let them."""
    own, std = poles_of([(a.model.poles, a.table) for a in found], modes.member)
    weight = np.where(np.isfinite(own), 1 / std[..., 0] ** 2, 0.0)
    size = np.where(np.isfinite(own), np.abs(own), 0.0)
    mean = np.sum(weight * size, axis=1) / np.sum(weight, axis=1)
    left = np.sum(weight * (size - mean[:, None]) ** 2, axis=1)
    freedom: Array = np.sum(weight > 0, axis=1) - 1
    chance = scipy.special.chdtrc(np.maximum(freedom, 1), np.where(freedom > 0, left, 0.0))
    return bool(np.min(chance, initial=1.0) * len(modes.poles) > _BY_CHANCE)


def _check(sets: Sequence[FrfSet], names: Sequence[str], data: FrfSet) -> None:
    common_axis(
        [(n, one.frequency_hz) for n, one in zip(names, sets, strict=True)], "frequency", "export them alike"
    )
    for what, values in (
        ("quantities", {one.quantity: n for n, one in zip(names, sets, strict=True)}),
        ("window decays", {one.window_decay_per_s: n for n, one in zip(names, sets, strict=True)}),
    ):
        if len(values) > 1:
            found = f"different {what}: " + listed([f"{value} in {name}" for value, name in values.items()])
            raise InputError(data.source, found, "one for all setups", "export them alike")
    if not is_joined(data.measured):
        found = "setups without a channel in common"
        fix = "measure the same force, or the same sensor, in every setup"
        raise InputError(data.source, found, "forces or sensors that join them", fix)
