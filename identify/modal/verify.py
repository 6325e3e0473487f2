"""Refinement of the selected modes, and what it tells of them: a mode that wanders off, or whose refined
shape is not one, is none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.modal.layout import Layout
from identify.modal.lsfd import ModalModel, contributions, lsfd
from identify.modal.mac import mpc, mpd
from identify.modal.refine import Refined, refine
from identify.modal.selection import Candidate, arrays, idle_reason
from identify.modal.settings import ModalSettings

_BEYOND = 1.5
"""How far (as a factor) beyond the band a resonance may be and still be told from residuals."""


@dataclass(frozen=True)
class Verified:
    """Modes that stood the refinement, their model (rows in the same order), pole covariance (m, 2, 2), and
    those that did not.

    outside: resonances beyond the band that were refined with the rest; no modes of the table, they act as
    residuals.
    """

    modes: list[Candidate]
    model: ModalModel
    outside: ModalModel
    covariance: np.ndarray
    rejected: list[Candidate]


def unrefined(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """The modes as their clusters give them."""
    poles, participation = _arrays(modes, layout)
    model = lsfd(layout, poles, participation, settings.residuals)
    return Verified(modes, model, _rows(model, np.zeros(0, dtype=int), {}), np.zeros((len(modes), 2, 2)), [])


def verify(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """Refine; drop modes that fail, wanderers first because they may have pushed others; refine again until
    all stand.

    Modes chosen by hand stay: one that wanders is held at its cluster instead.
    """
    kept, gone = list(modes), []
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
        if settings.modes_hz is not None:
            held |= set(faults)
        else:
            faults = _least_first(kept, faults or _failed(kept, model, layout, settings, outside))
            gone += [replace(mode, reason=faults[id(mode)]) for mode in kept if id(mode) in faults]
            kept = [mode for mode in kept if id(mode) not in faults]
        if not faults and not quick:
            return _split(kept, model, refined, outside, gone)
        quick = bool(faults)
    empty = unrefined([], layout, settings)
    return replace(empty, rejected=gone)


def _arrays(modes: list[Candidate], layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    if modes:
        return arrays(modes)
    return np.zeros(0, dtype=complex), np.zeros((0, len(layout.references)), dtype=complex)


def _stays(mode: Candidate, pole: complex, layout: Layout) -> bool:
    """Whether a decaying pole is within a half-bandwidth of its cluster, and its half-power band touches the
    measured band.
    """
    frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    seen = (
        layout.frequency_hz[0] <= frequency * (1 + damping)
        and frequency * (1 - damping) <= layout.frequency_hz[-1]
    )
    return bool(
        seen and damping > 0 and abs(pole - mode.pole) <= max(mode.half_bandwidth, np.pi * layout.spacing_hz)
    )


def _is_outside(mode: Candidate, pole: complex, layout: Layout, settings: ModalSettings) -> bool:
    """Whether a pole that did not stay is a resonance beyond the band, but not far."""
    frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    low, high = layout.frequency_hz[0], layout.frequency_hz[-1]
    beyond = low / _BEYOND < frequency < low or high < frequency < high * _BEYOND
    automatic = settings.modes_hz is None
    return bool(
        automatic and beyond and 0 < damping <= settings.max_damping_ratio and not _stays(mode, pole, layout)
    )


def _wandered(
    modes: list[Candidate], refined: Refined, layout: Layout, outside: list[bool]
) -> dict[int, str]:
    """Modes that did not stay and are no resonance beyond the band either."""
    faults = {}
    for mode, pole, is_outside in zip(modes, refined.poles, outside, strict=True):
        if not is_outside and not _stays(mode, pole, layout):
            frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
            faults[id(mode)] = (
                f"not a resonance of its own: refinement moves it to {frequency:.4g} Hz, damping"
                f" {damping:.2%}"
            )
    return faults


def _least_first(modes: list[Candidate], faults: dict[int, str]) -> dict[int, str]:
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
    modes: list[Candidate], model: ModalModel, layout: Layout, settings: ModalSettings, outside: list[bool]
) -> dict[int, str]:
    """Modes whose contribution or, in the band, refined shape fails the criteria."""
    share = contributions(layout, model.poles, model.participation, settings.residuals)
    collinear, deviation = mpc(model.shapes), np.degrees(mpd(model.shapes))
    faults = {}
    for r, mode in enumerate(modes):
        if share[r] < settings.min_contribution:
            faults[id(mode)] = idle_reason(share[r]) + " after refinement"
        elif not outside[r] and (collinear[r] < settings.min_mpc or deviation[r] > settings.max_mpd_deg):
            faults[id(mode)] = f"refined shape is complex: MPC {collinear[r]:.2f}, MPD {deviation[r]:.0f} deg"
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
        gone.append(
            replace(
                modes[r], reason=f"a resonance beyond the band, at {frequency:.4g} Hz; kept as a residual"
            )
        )
    inside = _rows(model, inner, model.residuals)
    return Verified(
        [modes[r] for r in inner], inside, _rows(model, outer, {}), refined.covariance[inner], gone
    )


def _rows(model: ModalModel, rows: np.ndarray, residuals: dict[str, np.ndarray]) -> ModalModel:
    return ModalModel(model.poles[rows], model.participation[rows], model.shapes[rows], residuals)
