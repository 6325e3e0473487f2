"""What refinement leaves of the selected modes, for `verify` and `imperfect`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Mask
from identify.core.coded import Coded
from identify.modal.layout import Layout
from identify.modal.lsfd import ModalModel, lsfd
from identify.modal.reasons import RESIDUAL, Why, because
from identify.modal.selection import Candidate, arrays, without_idle
from identify.modal.settings import ModalSettings

BEYOND = 1.5
"""How far (as a factor) beyond the band a resonance may be and still be distinguished from residuals."""


@dataclass(frozen=True)
class Verified:
    """Modes that the data need, their model (rows in the same order), pole covariance (m, 2, 2) and those
    that are none.

    outside: what was fitted with the rest and is no mode of the table: resonances beyond the band, poles with
    too much damping or a complex shape; they act as residuals.  by_noise (m,): whether the covariance says
    all, as where the residual is noise; elsewhere the spread over orders counts besides.
    """

    modes: list[Candidate]
    model: ModalModel
    outside: ModalModel
    covariance: np.ndarray
    rejected: list[Candidate]
    by_noise: Mask


def unrefined(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """The modes as their clusters give them, those that explain too little aside; all that were chosen."""
    idle: list[Candidate] = []
    if settings.modes_hz is None:
        modes, idle = without_idle(modes, layout, settings)
    poles, participation = pole_arrays(modes, layout)
    model = lsfd(layout, poles, participation, settings.residuals)
    none = rows(model, np.zeros(0, dtype=int), {})
    return Verified(modes, model, none, np.zeros((len(modes), 2, 2)), idle, np.zeros(len(modes), dtype=bool))


def pole_arrays(modes: list[Candidate], layout: Layout) -> tuple[Complex, Complex]:
    """Poles (m,) and participation (m, references) of the candidates, also of none."""
    if modes:
        return arrays(modes)
    return np.zeros(0, dtype=complex), np.zeros((0, len(layout.references)), dtype=complex)


def stays(mode: Candidate, pole: complex, layout: Layout) -> bool:
    """Whether a decaying pole is within a half-bandwidth of its cluster, and its half-power band touches the
    measured band.
    """
    frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    seen = (
        layout.frequency_hz[0] <= frequency * (1 + damping)
        and frequency * (1 - damping) <= layout.frequency_hz[-1]
    )
    return bool(
        seen
        and damping > 0
        and abs(pole - mode.pole) <= max(mode.half_bandwidth, np.pi * layout.spacing_hz(frequency))
    )


def in_band(found: Verified, layout: Layout, settings: ModalSettings) -> Verified:
    """The modes whose own frequency is in the band, and those that were chosen by hand; of others, a flank in
    the band acts as a residual.
    """
    hz = np.abs(found.model.poles) / (2 * np.pi)
    chosen = np.array([settings.modes_hz is not None or mode.by_hand for mode in found.modes], dtype=bool)
    kept = chosen | ((hz >= layout.frequency_hz[0]) & (hz <= layout.frequency_hz[-1]))
    own, other = np.flatnonzero(kept), np.flatnonzero(~kept)
    if not len(other):
        return found
    reasons = [because(Why.BEYOND, hz[r], more=RESIDUAL) for r in other]
    beyond = [
        replace(found.modes[r], pole=complex(found.model.poles[r]), reason=reason)
        for r, reason in zip(other, reasons, strict=True)
    ]
    gone = rows(found.model, other, {})
    outside = ModalModel(
        np.concatenate([found.outside.poles, gone.poles]),
        np.concatenate([found.outside.participation, gone.participation]),
        np.concatenate([found.outside.shapes, gone.shapes]),
        {},
    )
    return Verified(
        [found.modes[r] for r in own],
        rows(found.model, own, found.model.residuals),
        outside,
        found.covariance[own],
        [*found.rejected, *beyond],
        found.by_noise[own],
    )


def parted(
    modes: Sequence[Candidate],
    model: ModalModel,
    faults: Sequence[Coded | None],
    covariance: Array,
    by_noise: Mask,
    gone: Sequence[Candidate],
) -> Verified:
    """Modes and rows of their model (m,), by frequency: those without a fault, and the others aside, after
    those that were gone before.
    """
    order = np.argsort(np.abs(model.poles), kind="stable")
    inner, outer = (
        np.array([r for r in order if bool(faults[r]) == out], dtype=int) for out in (False, True)
    )
    return Verified(
        [modes[r] for r in inner],
        rows(model, inner, model.residuals),
        rows(model, outer, {}),
        covariance[inner],
        [*gone, *(replace(modes[r], reason=faults[r]) for r in outer)],
        by_noise[inner],
    )


def rows(model: ModalModel, which: np.ndarray, residuals: dict[str, np.ndarray]) -> ModalModel:
    """Some rows of a model."""
    return ModalModel(model.poles[which], model.participation[which], model.shapes[which], residuals)
