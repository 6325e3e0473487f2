"""The modal analysis of several setups: together where their poles agree, merged where these differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from identify.core.arrays import Array, Complex, Mask
from identify.core.errors import InputError
from identify.core.interruption import check
from identify.core.text import listed
from identify.measured.common_lines import common_axis
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import ModalAnalysis, analyse
from identify.modal.selection import MANUAL_REACH
from identify.modal.settings import ModalSettings
from identify.modal.setups.analysis import Merged, merged, poles_of
from identify.modal.setups.residues import is_joined
from identify.modal.setups.result import as_analysis, pooled

_NOTHING_BY_HAND: dict[str, Any] = {"modes_hz": None, "keep_hz": (), "drop_hz": ()}
"""What is chosen by hand are modes of all setups."""
EXPLAINED = 0.5
"""Part of the differences of poles that moved masses may leave and still be what explains them."""
_BY_CHANCE = 1e-3
"""Probability of poles that differ so much where they are the same, over all modes: below it they differ."""


@dataclass(frozen=True)
class Setups:
    """What setups have shown: names, merged modes; agree: whether their poles do; together: whether the modes
    of the analysis are those of all FRFs at once.
    """

    names: tuple[str, ...]
    merged: Merged
    agree: bool
    together: bool

    @property
    def unexplained(self) -> float:
        """Part of the differences of poles that moved masses leave, the median of modes; 1 without any."""
        return unexplained(self.merged)


def unexplained(modes: Merged) -> float:
    """See `Setups.unexplained`."""
    if modes.loading is None or not len(modes.poles):
        return 1.0
    size = np.abs(modes.own)
    left = np.nanmax(np.abs(size - modes.loading.predicted), axis=1)
    spread = np.nanmax(size, axis=1) - np.nanmin(size, axis=1)
    return float(np.median(np.minimum(left / np.maximum(spread, 1e-12 * np.nanmax(size)), 1.0)))


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
        found.append(analyse(one, settings.model_copy(update=_NOTHING_BY_HAND)))
    if not any(len(one.table) for one in found):
        return analyse(data, settings), None
    sets = [as_analysed(one, own) for one, own in zip(sets, found, strict=True)]
    modes = merged(sets, found, settings.min_presence)
    agree = poles_agree(modes, [(one.model.poles, one.table) for one in found])
    if agree or unexplained(modes) > EXPLAINED:
        # What differs may be errors of the measurement: a common model does as long as it splits no mode.
        common = _common(data, settings)
        if common is not None and (agree or len(common.table) <= len(modes.poles)):
            return common, Setups(tuple(names), modes, agree, together=True)
        modes = merged(sets, found, settings.min_presence, weighs=False)
    modes = modes.rows(_chosen(modes, settings))
    analysis = as_analysis(pooled(sets, data.source, data.sha256), modes, names, found)
    return replace(analysis, settings=settings), Setups(tuple(names), modes, agree, together=False)


def _common(data: FrfSet, settings: ModalSettings) -> ModalAnalysis | None:
    """Modes of all FRFs at once; None where a common model cannot be, as without a response that was measured
    with every force: each setup by itself has passed all else.
    """
    try:
        return analyse(data, settings)
    except InputError:
        return None


def as_analysed(data: FrfSet, found: ModalAnalysis) -> FrfSet:
    """The channels of a set that were analysed."""
    layout = found.layout
    sides = layout.responses, layout.references
    outputs, inputs = sides[::-1] if layout.transposed else sides
    return data.pairs([data.outputs.index(c) for c in outputs], [data.inputs.index(c) for c in inputs])


def _chosen(modes: Merged, settings: ModalSettings) -> Mask:
    """Modes that were not dropped by hand, or of some that were named these alone; InputError for a frequency
    without a mode.
    """
    hz = np.abs(modes.poles) / (2 * np.pi)

    def near(asked: Sequence[float], key: str) -> Mask:
        rows = np.abs(hz[:, None] / np.array(asked).reshape(1, -1) - 1) <= MANUAL_REACH
        for frequency in np.array(asked)[~rows.any(axis=0)]:
            found = f"no mode of all setups near {frequency:g} Hz"
            raise InputError(key, found, "one of " + ", ".join(f"{f:.4g}" for f in hz) + " Hz")
        return np.asarray(rows.any(axis=1))

    near(settings.keep_hz, "keep_hz")
    if settings.modes_hz is not None:
        return near(settings.modes_hz, "modes_hz")
    return ~near(settings.drop_hz, "drop_hz")


def poles_agree(modes: Merged, found: Sequence[tuple[Complex, ModalTable]]) -> bool:
    """Whether frequencies of setups, with poles and a table each, differ by no more than their intervals let
    them.
    """
    own, std = poles_of(found, modes.member)
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
