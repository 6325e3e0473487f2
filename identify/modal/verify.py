"""Refinement of the selected modes, and what it tells of them: a mode that wanders off, or whose refined shape is not one, is none."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.modal.layout import Layout
from identify.modal.lsfd import ModalModel, contributions, lsfd
from identify.modal.mac import mpc, mpd
from identify.modal.refine import Refined, refine
from identify.modal.selection import Candidate, arrays, idle_reason
from identify.modal.settings import ModalSettings


@dataclass(frozen=True)
class Verified:
    """Modes that stood the refinement, their model (rows in the same order), pole covariance (m, 2, 2), and those that did not."""

    modes: list[Candidate]
    model: ModalModel
    covariance: np.ndarray
    rejected: list[Candidate]


def unrefined(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """The modes as their clusters give them."""
    poles, participation = _arrays(modes, layout)
    return Verified(modes, lsfd(layout, poles, participation, settings.residuals), np.zeros((len(modes), 2, 2)), [])


def verify(modes: list[Candidate], layout: Layout, settings: ModalSettings) -> Verified:
    """Refine; drop modes that fail, wanderers first because they may have pushed others; refine again until all stand.

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
        faults = _wandered(kept, refined, layout)
        if settings.modes_hz is not None:
            held |= set(faults)
        else:
            faults = _least_first(kept, faults or _failed(kept, model, layout, settings))
            gone += [replace(mode, reason=faults[id(mode)]) for mode in kept if id(mode) in faults]
            kept = [mode for mode in kept if id(mode) not in faults]
        if not faults and not quick:
            return _sorted(kept, model, refined, gone)
        quick = bool(faults)
    empty = unrefined([], layout, settings)
    return replace(empty, rejected=gone)


def _arrays(modes: list[Candidate], layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    if modes:
        return arrays(modes)
    return np.zeros(0, dtype=complex), np.zeros((0, len(layout.references)), dtype=complex)


def _wandered(modes: list[Candidate], refined: Refined, layout: Layout) -> dict[int, str]:
    """Modes whose half-power band left the measured band, that grow in time, or moved by more than a half-bandwidth."""
    faults = {}
    for mode, pole in zip(modes, refined.poles, strict=True):
        frequency, damping = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
        seen = layout.frequency_hz[0] <= frequency * (1 + damping) and frequency * (1 - damping) <= layout.frequency_hz[-1]
        if not seen or damping <= 0 or abs(pole - mode.pole) > max(mode.half_bandwidth, 2 * np.pi * layout.spacing_hz / 2):
            faults[id(mode)] = f"not a resonance of its own: refinement moves it to {frequency:.4g} Hz, damping {damping:.2%}"
    return faults


def _least_first(modes: list[Candidate], faults: dict[int, str]) -> dict[int, str]:
    """Of close faulty modes only the one that contributes least: it may be what spoils the other."""
    chosen: list[Candidate] = []
    for mode in sorted((mode for mode in modes if id(mode) in faults), key=lambda mode: mode.contribution):
        if all(abs(mode.pole - other.pole) > 1.5 * max(mode.half_bandwidth, other.half_bandwidth) for other in chosen):
            chosen.append(mode)
    return {id(mode): faults[id(mode)] for mode in chosen}


def _failed(modes: list[Candidate], model: ModalModel, layout: Layout, settings: ModalSettings) -> dict[int, str]:
    """Modes whose refined shape or contribution fails the criteria."""
    share = contributions(layout, model.poles, model.participation, settings.residuals)
    collinear, deviation = mpc(model.shapes), np.degrees(mpd(model.shapes))
    faults = {}
    for r, mode in enumerate(modes):
        if share[r] < settings.min_contribution:
            faults[id(mode)] = idle_reason(share[r]) + " after refinement"
        elif collinear[r] < settings.min_mpc or deviation[r] > settings.max_mpd_deg:
            faults[id(mode)] = f"refined shape is complex: MPC {collinear[r]:.2f}, MPD {deviation[r]:.0f} deg"
    return faults


def _sorted(modes: list[Candidate], model: ModalModel, refined: Refined, gone: list[Candidate]) -> Verified:
    order = np.argsort(np.abs(model.poles), kind="stable")
    ordered = replace(model, poles=model.poles[order], participation=model.participation[order], shapes=model.shapes[order])
    return Verified([modes[r] for r in order], ordered, refined.covariance[order], gone)
