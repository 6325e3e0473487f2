"""Modes of FRFs that are off in ways that no mode explains: noise is no measure of a mode there.

What tells instead: a mode that wanders off when refined, explains less than its share of the response around
it, or has no shape, is none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.core.coded import Coded
from identify.modal.layout import Layout
from identify.modal.lsfd import ModalModel, contributions, lsfd
from identify.modal.mac import mpc, mpd
from identify.modal.reasons import RESIDUAL, Why, because
from identify.modal.refine_imperfect import Refined, refine
from identify.modal.selection import Candidate, arrays, least_share, without_idle
from identify.modal.settings import ModalSettings
from identify.modal.verified import BEYOND, Verified, rows, stays, unrefined

_FIRM = 0.8
"""Part of the orders in which a cluster appears, beyond which a mode that wanders off is held where it was
found: what pushes it is what no mode explains."""


def imperfect(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """Refine; drop modes that fail, wanderers first because they may have pushed others; refine again until
    all stand.
    """
    kept, gone = without_idle(modes, layout, settings)
    held: set[int] = set()
    quick = True
    while kept:
        poles, participation = arrays(kept)
        free = np.array([id(mode) not in held for mode in kept])
        refined = refine(layout, poles, participation, settings.residuals, free, quick=quick)
        model = lsfd(layout, refined.poles, refined.participation, settings.residuals, refined.weight)
        outside = [
            _is_outside(mode, pole, layout, settings) for mode, pole in zip(kept, refined.poles, strict=True)
        ]
        faults = _wandered(kept, refined, layout, outside)
        firm = {id(mode) for mode in kept if id(mode) in faults and (mode.by_hand or mode.presence >= _FIRM)}
        if firm:
            held |= firm
            continue
        faults = _least_first(kept, faults or _failed(kept, model, layout, settings, outside))
        gone += [replace(mode, reason=faults[id(mode)]) for mode in kept if id(mode) in faults]
        kept = [mode for mode in kept if id(mode) not in faults]
        if not faults and not quick:
            return _split(kept, model, refined, outside, gone)
        quick = bool(faults)
    empty = unrefined([], layout, settings)
    return replace(empty, rejected=gone)


def _is_outside(mode: Candidate, pole: complex, layout: Layout, settings: ModalSettings) -> bool:
    """Whether a pole that did not stay is a resonance beyond the band, but not far."""
    frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    low, high = layout.frequency_hz[0], layout.frequency_hz[-1]
    beyond = low / BEYOND < frequency < low or high < frequency < high * BEYOND
    return bool(beyond and 0 < damping <= settings.max_damping_ratio and not stays(mode, pole, layout))


def _wandered(
    modes: list[Candidate], refined: Refined, layout: Layout, outside: list[bool]
) -> dict[int, Coded]:
    """Modes that did not stay and are no resonance beyond the band either."""
    faults = {}
    for mode, pole, is_outside in zip(modes, refined.poles, outside, strict=True):
        if not is_outside and not stays(mode, pole, layout):
            frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
            faults[id(mode)] = because(Why.MOVED, frequency, damping)
    return faults


def _least_first(modes: list[Candidate], faults: dict[int, Coded]) -> dict[int, Coded]:
    """Of close faulty modes only the one that contributes least: it may be what spoils the other."""
    chosen: list[Candidate] = []
    for mode in sorted((mode for mode in modes if id(mode) in faults), key=lambda mode: mode.contribution):
        if all(
            abs(mode.pole - other.pole) > 1.5 * max(mode.half_bandwidth, other.half_bandwidth)
            for other in chosen
        ):
            chosen.append(mode)
    return {id(mode): faults[id(mode)] for mode in chosen}


def _failed(
    modes: list[Candidate],
    model: ModalModel,
    layout: Layout,
    settings: ModalSettings,
    outside: list[bool],
) -> dict[int, Coded]:
    """Modes whose contribution or, in the band, refined shape fails the criteria."""
    share = contributions(layout, model.poles, model.participation, settings.residuals)
    collinear, deviation = mpc(model.shapes), np.degrees(mpd(model.shapes))
    faults = {}
    for r, mode in enumerate(modes):
        if mode.by_hand:
            continue
        if share[r] < least_share(settings):
            faults[id(mode)] = because(Why.IDLE, share[r], more=" after refinement")
        elif not outside[r] and (collinear[r] < settings.min_mpc or deviation[r] > settings.max_mpd_deg):
            faults[id(mode)] = because(Why.COMPLEX_REFINED, collinear[r], deviation[r])
    return faults


def _split(
    modes: list[Candidate], model: ModalModel, refined: Refined, outside: list[bool], gone: list[Candidate]
) -> Verified:
    """Modes of the band by frequency, and what lies beyond it."""
    order = np.argsort(np.abs(model.poles), kind="stable")
    inner = np.array([r for r in order if not outside[r]], dtype=int)
    outer = np.array([r for r in order if outside[r]], dtype=int)
    for r in outer:
        frequency = abs(model.poles[r]) / (2 * np.pi)
        gone.append(replace(modes[r], reason=because(Why.BEYOND, frequency, more=RESIDUAL)))
    inside = rows(model, inner, model.residuals)
    modes, by_noise = [modes[r] for r in inner], np.zeros(len(inner), dtype=bool)
    return Verified(modes, inside, rows(model, outer, {}), refined.covariance[inner], gone, by_noise)
