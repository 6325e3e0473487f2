"""Experimental modal analysis without clicking: measured FRFs in, modal table and its quality out.

The steps, each in its own file: `layout`, `bands` (which does the next for each part of a wide band),
`stabilisation` (with `plscf` or `lsce`), `selection`, `verify` (with `refine`, `lsfd` and `imperfect`),
`scaling`, `window`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Mask
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.modal.bands import Identified, identified
from identify.modal.layout import Layout, arrange, cmif
from identify.modal.lsfd import ModalModel
from identify.modal.reasons import Why
from identify.modal.scaling import ReciprocityCheck, reciprocity, scale
from identify.modal.selection import Candidate, is_near
from identify.modal.settings import ModalSettings
from identify.modal.stabilisation import Diagram
from identify.modal.verified import Verified, in_band
from identify.modal.window import frequency_and_damping, seen_through

_CHOSEN = 1.15
"""By how much errors exceed those that noise makes in a model that is known: weights, number of poles and
residual terms come from the same data. Seen on structures drawn at random (`tests.benchmarks.modal_exam`)."""


@dataclass(frozen=True)
class ModalAnalysis:
    """Modes of an FRF set and all that is needed to judge and to plot them; rows of (m,) follow the table.

    table: frequencies, damping (window corrected), shapes at `layout.responses`, standard deviations (from
    noise, and where more than noise is left also from the spread over orders); model: poles, participation at
    `layout.references`, receptance residues and residuals; outside: resonances beyond the band that were
    fitted with them; modes: the cluster behind each mode; rejected: candidates with the reason; synthesised
    (L, responses, references): the model's FRFs; bands_hz: the parts of the band that were analysed apart;
    by_noise (m,): where noise is all that the model leaves.
    """

    table: ModalTable
    model: ModalModel
    outside: ModalModel
    modes: tuple[Candidate, ...]
    rejected: tuple[Candidate, ...]
    diagram: Diagram
    layout: Layout
    settings: ModalSettings
    synthesised: Complex
    reciprocity: tuple[ReciprocityCheck, ...]
    bands_hz: tuple[tuple[float, float], ...]
    by_noise: Mask

    @property
    def references(self) -> tuple[Channel, ...]:
        """The reference channels, columns of the participation."""
        return self.layout.references

    @property
    def seen(self) -> tuple[Array, Array]:
        """Frequencies, Hz, and damping ratios (m,) as the window showed them, before its correction."""
        return frequency_and_damping(seen_through(self.model.poles, self.layout.decay))

    @property
    def total_error(self) -> float:
        """RMS error of all synthesised FRFs in the band over the RMS of what was measured."""
        return synthesis_error(self.layout.frf, self.synthesised)[1]

    @property
    def mode_indicator(self) -> Array:
        """(L, references): CMIF of the responses that every force was measured with; of magnitudes where
        there is none.
        """
        if self.layout.complete.any():
            return cmif(self.layout)
        return np.asarray(np.sqrt(np.nansum(np.abs(self.layout.frf) ** 2, axis=(1, 2))))[:, None]


def analyse(frf_set: FrfSet, settings: ModalSettings | None = None) -> ModalAnalysis:
    """Modes of measured FRFs; none is a table of length 0 with the rejected candidates and their reasons.

    InputError where the set cannot be analysed: no lines in the band, gaps between lines, unknown references,
    all zero.
    """
    settings = settings or ModalSettings()
    layout = arrange(frf_set, settings)
    found = identified(layout, settings)
    check_by_hand(found.verified, settings)
    inside = in_band(found.verified, layout, settings)
    verified = replace(inside, rejected=sorted(inside.rejected, key=lambda c: c.frequency_hz))
    return _result(frf_set, layout, replace(found, verified=verified), settings)


def check_by_hand(found: Verified, settings: ModalSettings) -> None:
    """InputError for a frequency given by hand where no cluster of poles is."""
    kept = [mode for mode in found.modes if mode.by_hand]
    dropped = [mode for mode in found.rejected if mode.why is Why.DROPPED]
    for key, frequencies, candidates in (
        ("keep_hz", settings.keep_hz, kept),
        ("drop_hz", settings.drop_hz, dropped),
    ):
        for frequency in frequencies:
            if not any(is_near(candidate, frequency) for candidate in candidates):
                fix = "take a frequency from the stabilisation diagram of the report"
                raise InputError(key, f"no cluster of poles near {frequency:g} Hz", fix=fix)


def _result(frf_set: FrfSet, layout: Layout, found: Identified, settings: ModalSettings) -> ModalAnalysis:
    verified, model = found.verified, found.verified.model
    shapes, mass_normalised = scale(model, layout)
    frequency, damping = frequency_and_damping(model.poles)
    noise = _noise(model.poles, verified.covariance)
    spread = np.array([[mode.frequency_std_hz, mode.damping_std] for mode in verified.modes]).reshape(-1, 2)
    # Low orders scatter by more than the refined modes do: where noise is all that is left, they say nothing.
    std = np.where(verified.by_noise[:, None], _CHOSEN * noise, np.hypot(noise, spread))
    table = ModalTable(
        frequency,
        damping,
        layout.responses,
        shapes,
        std[:, 0],
        std[:, 1],
        np.ones(len(model)) if mass_normalised else None,
        source=frf_set.source,
        sha256=frf_set.sha256,
    )
    return ModalAnalysis(
        table=table,
        model=model,
        outside=verified.outside,
        modes=tuple(verified.modes),
        rejected=tuple(verified.rejected),
        diagram=found.diagram,
        layout=layout,
        settings=settings,
        synthesised=found.rebuilt,
        bands_hz=found.bands_hz,
        by_noise=verified.by_noise,
        reciprocity=reciprocity(frf_set),
    )


def _noise(poles: Complex, covariance: Array) -> Array:
    """Standard deviations of frequency (Hz) and damping ratio, (m, 2), from the covariance of real and
    imaginary parts.
    """
    size = np.abs(poles)
    turn = np.stack([poles.real, poles.imag], axis=1) / size[:, None]
    across = np.stack([-(turn[:, 1] ** 2), turn[:, 0] * turn[:, 1]], axis=1) / size[:, None]
    variance = [np.einsum("ri,rij,rj->r", g, covariance, g) for g in (turn / (2 * np.pi), across)]
    return np.asarray(np.sqrt(np.maximum(np.stack(variance, axis=1), 0.0)))


def synthesis_error(measured: Complex, synthesised: Complex) -> tuple[Array, float]:
    """RMS error over RMS of each FRF (responses, references), NaN where not measured or zero, and of all FRFs
    together.
    """
    power = np.sum(np.abs(measured) ** 2, axis=0)
    error = np.sum(np.abs(measured - synthesised) ** 2, axis=0)
    ratio = np.sqrt(np.divide(error, power, out=np.full(power.shape, np.nan), where=power > 0))
    return ratio, float(np.sqrt(np.nansum(error) / np.nansum(power)))
