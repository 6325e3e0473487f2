"""From clusters of poles to modes: criteria on presence, spread, damping, shape and contribution, or a manual
choice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Complex
from identify.core.coded import Coded
from identify.core.errors import InputError
from identify.modal.layout import Layout
from identify.modal.lsfd import contributions
from identify.modal.reasons import Why, because
from identify.modal.settings import ModalSettings
from identify.modal.stabilisation import Diagram

MANUAL_REACH = 0.02
"""How far (relative) a cluster may be from a frequency that was asked for."""


_LATE, _STEADY, _SHARP = 0.3, 0.95, 0.1
"""A pole that only high orders can tell appears in this part of all orders, in this part of those from its
first on, and scatters over them by less than this part of its half-bandwidth."""
_LOOSE_MPC, _LOOSE_MPD = 0.5, 1.4
IDLE_SHARE = 0.01


@dataclass(frozen=True)
class Candidate:
    """A cluster of poles.  pole: median over orders (rad/s); participation (references,) and shape
    (responses,): its dominant direction, unit length; frequency_std_hz, damping_std: spread over orders;
    presence: part of the orders it appears in; steadiness: the same of the orders from its first on; mpc, mpd
    (rad): medians; contribution: see `lsfd.contributions`, NaN where not computed; reason: why it is not a
    mode; by_hand: whether somebody said that it is one.
    """

    pole: complex
    participation: Complex
    shape: Complex
    frequency_std_hz: float
    damping_std: float
    presence: float
    mpc: float
    mpd: float
    steadiness: float = 1.0
    contribution: float = np.nan
    reason: Coded | None = None
    by_hand: bool = False

    @property
    def frequency_hz(self) -> float:
        """|lambda| / 2 pi."""
        return abs(self.pole) / (2 * np.pi)

    @property
    def damping_ratio(self) -> float:
        """-Re lambda / |lambda|."""
        return -self.pole.real / abs(self.pole)

    @property
    def half_bandwidth(self) -> float:
        """zeta omega, rad/s."""
        return -self.pole.real

    @property
    def is_rare(self) -> bool:
        """Whether it was turned down because too few orders found it, or twice, and for nothing else."""
        return self.why in (Why.RARE, Why.DUPLICATE)

    @property
    def why(self) -> Why | None:
        """The code of the reason why it is not a mode."""
        return None if self.reason is None else Why(self.reason.code)


def candidates(diagram: Diagram, least_presence: float) -> list[Candidate]:
    """One candidate for every cluster of at least that presence, most present first."""
    found = []
    counts = np.bincount(diagram.cluster[diagram.cluster >= 0])
    for number in np.argsort(-counts, kind="stable"):
        if counts[number] < max(2, least_presence * len(diagram.orders)):
            break
        found.append(_candidate(diagram, np.flatnonzero(diagram.cluster == number)))
    return found


def _candidate(diagram: Diagram, members: NDArray[np.intp]) -> Candidate:
    poles = diagram.poles[members]
    return Candidate(
        pole=complex(np.median(poles.real), np.median(poles.imag)),
        participation=_dominant(diagram.participation[members]),
        shape=_dominant(diagram.shapes[members]),
        frequency_std_hz=float(np.std(diagram.frequency_hz[members])),
        damping_std=float(np.std(diagram.damping_ratio[members])),
        presence=len(members) / len(diagram.orders),
        steadiness=len(members) / int(np.sum(np.array(diagram.orders) >= np.min(diagram.order[members]))),
        mpc=float(np.median(diagram.mpc[members])),
        mpd=float(np.median(diagram.mpd[members])),
    )


def _dominant(rows: Complex) -> Complex:
    """The unit vector most like all rows, whatever their phases."""
    return np.asarray(np.linalg.svd(rows, full_matrices=False)[2][0])


def select(
    found: list[Candidate], settings: ModalSettings, *, late: bool = False
) -> tuple[list[Candidate], list[Candidate]]:
    """Accepted modes by frequency, and rejected candidates with the reason.

    Before refinement the shape criteria are loose: close modes mix in their clusters, and part when they are
    refined; `verify` applies the criteria in full.  late: whether a pole that only high orders tell may pass.
    """
    if settings.modes_hz is not None:
        return _chosen(found, settings.modes_hz)
    if settings.refine:
        loose = {"min_mpc": settings.min_mpc * _LOOSE_MPC, "max_mpd_deg": settings.max_mpd_deg * _LOOSE_MPD}
        settings = settings.model_copy(update=loose)
    accepted: list[Candidate] = []
    rejected: list[Candidate] = []
    kept = [_nearest(found, frequency) for frequency in settings.keep_hz]
    dropped = [_nearest(found, frequency) for frequency in settings.drop_hz]
    for candidate in found:
        by_hand = any(candidate is other for other in kept)
        reason = None
        if not by_hand:
            reason = _dropped(candidate, dropped) or _fault(candidate, settings, late)
            reason = reason or _duplicate(candidate, accepted, settings)
        (rejected if reason else accepted).append(replace(candidate, reason=reason, by_hand=by_hand))
    return sorted(accepted, key=lambda c: c.frequency_hz), rejected


def _nearest(found: list[Candidate], frequency_hz: float) -> Candidate | None:
    """The cluster that is meant by a frequency: of those near it the one in most orders."""
    near = [c for c in found if is_near(c, frequency_hz)]
    firm = [c for c in near if abs(c.frequency_hz - frequency_hz) <= c.half_bandwidth / (2 * np.pi)]
    by_presence = max(firm, key=lambda c: c.presence, default=None)
    return by_presence or min(near, key=lambda c: abs(c.frequency_hz - frequency_hz), default=None)


def is_near(candidate: Candidate, frequency_hz: float) -> bool:
    """Whether a cluster is meant by a frequency that was given by hand."""
    return abs(candidate.frequency_hz - frequency_hz) <= MANUAL_REACH * frequency_hz


def _dropped(candidate: Candidate, meant: list[Candidate | None]) -> Coded | None:
    """Why a cluster is out: it, or one within its half-power bandwidth, was dropped by hand."""
    near = [abs(candidate.pole - c.pole) <= 2 * c.half_bandwidth for c in meant if c is not None]
    return because(Why.DROPPED) if any(near) else None


def _fault(candidate: Candidate, settings: ModalSettings, late: bool) -> Coded | None:
    """The first criterion that a candidate fails."""
    spread = candidate.frequency_std_hz / candidate.frequency_hz
    damping_spread = candidate.damping_std / candidate.damping_ratio
    rare = candidate.presence < settings.min_presence
    apart = 2 * np.pi * candidate.frequency_std_hz / candidate.half_bandwidth
    late = late and candidate.presence >= _LATE and candidate.steadiness >= _STEADY and apart < _SHARP
    ratio, mpd = candidate.damping_ratio, float(np.degrees(candidate.mpd))
    checks = (
        (rare and not late, Why.RARE, candidate.presence),
        (spread > settings.max_frequency_spread, Why.FREQUENCY_SCATTERS, spread),
        (damping_spread > settings.max_damping_spread, Why.DAMPING_SCATTERS, damping_spread),
        (ratio > settings.max_damping_ratio, Why.DAMPED, ratio),
        (candidate.mpc < settings.min_mpc, Why.COMPLEX, candidate.mpc),
        (mpd > settings.max_mpd_deg, Why.COMPLEX_DEVIATION, mpd),
    )
    return next((because(why, value) for failed, why, value in checks if failed), None)


def _duplicate(candidate: Candidate, accepted: list[Candidate], settings: ModalSettings) -> Coded | None:
    for other in accepted:
        near = abs(candidate.pole - other.pole) < 1.5 * max(candidate.half_bandwidth, other.half_bandwidth)
        mac = abs(np.vdot(candidate.shape, other.shape)) ** 2
        if near and mac > settings.duplicate_mac:
            return because(Why.DUPLICATE, other.frequency_hz, float(mac))
    return None


def without_idle(
    accepted: list[Candidate], layout: Layout, settings: ModalSettings
) -> tuple[list[Candidate], list[Candidate]]:
    """Backward elimination: the mode that explains least goes, until all explain their share of the response
    around them.
    """
    share = least_share(settings)
    kept, gone = list(accepted), []
    while kept:
        poles, participation = arrays(kept)
        parts = contributions(layout, poles, participation, settings.residuals)
        kept = [
            replace(candidate, contribution=float(part)) for candidate, part in zip(kept, parts, strict=True)
        ]
        least = min(kept, key=lambda candidate: np.inf if candidate.by_hand else candidate.contribution)
        if least.by_hand or least.contribution >= share:
            break
        kept.remove(least)
        gone.append(replace(least, reason=because(Why.IDLE, least.contribution)))
    return kept, gone


def least_share(settings: ModalSettings) -> float:
    """Least part of the energy around a mode that only it explains, where noise is no measure of that."""
    return IDLE_SHARE if settings.min_contribution is None else settings.min_contribution


def _chosen(found: list[Candidate], modes_hz: tuple[float, ...]) -> tuple[list[Candidate], list[Candidate]]:
    """The most present cluster near each frequency asked for."""
    chosen: list[Candidate] = []
    for frequency in sorted(modes_hz):
        near = [
            c
            for c in found
            if abs(c.frequency_hz / frequency - 1) <= MANUAL_REACH and all(c is not other for other in chosen)
        ]
        if not near:
            known = ", ".join(f"{c.frequency_hz:.4g}" for c in sorted(found, key=lambda c: c.frequency_hz))
            raise InputError(
                "modes_hz",
                f"no cluster of poles within {MANUAL_REACH:.0%} of {frequency:g} Hz",
                f"one of {known} Hz",
            )
        # Of equally near clusters the firmer one; a bin is a twentieth of the reach wide.
        chosen.append(
            min(
                near,
                key=lambda c: (round(abs(c.frequency_hz / frequency - 1) / MANUAL_REACH * 20), -c.presence),
            )
        )
    reason = because(Why.NOT_CHOSEN)
    rest = [replace(c, reason=reason) for c in found if all(c is not other for other in chosen)]
    return sorted(chosen, key=lambda c: c.frequency_hz), rest


def arrays(modes: list[Candidate]) -> tuple[Complex, Complex]:
    """Poles (m,) and participation (m, references) of the candidates."""
    return np.array([mode.pole for mode in modes]), np.stack([mode.participation for mode in modes])
