"""Modes of a structure that works, from its responses alone.

The steps, each in its own file: `records`, `tones`, `correlations`, `ssi`; then clusters over orders and
their criteria as in any modal analysis (`identify.modal.stabilisation`, `identify.modal.selection`), and
`jackknife`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.measured.modal_tables import ModalTable
from identify.measured.time_history import TimeHistory
from identify.modal.analysis import check_by_hand
from identify.modal.layout import Layout, cmif
from identify.modal.lsfd import synthesise
from identify.modal.operational.jackknife import Scatter, jackknife
from identify.modal.operational.records import Records, records_of
from identify.modal.operational.settings import OperationalSettings
from identify.modal.operational.ssi import Correlations, chosen_references, correlations, subspace
from identify.modal.operational.tones import Tone, tones, without
from identify.modal.reasons import Why, because
from identify.modal.selection import Candidate, candidates, select
from identify.modal.settings import ModalSettings
from identify.modal.stabilisation import Diagram, clustered
from identify.modal.verified import Verified, unrefined
from identify.modal.verified import rows as rows_of
from identify.modal.window import frequency_and_damping

_BLOCKS = 30
"""Of the record, left out one by one."""
_REFERENCES = 8
"""Channels that all others are correlated with, at most."""
_PERIODS = 0.75
"""Of the lowest frequency of the band, that the lags of the Hankel matrix span."""
_LARGEST = 1200
"""Rows of the Hankel matrix at most."""
_STATES, _STEP = 80, 2
"""Largest order by default; orders are this far apart."""
_IDLE = 1e-3
"""Least part of the energy around a mode that only it explains."""
_UNSTEADY = 0.3
"""Standard deviation of a frequency, in half-bandwidths, from which on a pole is no mode."""
_LINES_A_WIDTH = 4.0
"""Correlations last so many times 1 / decay of a mode of the least damping at the lowest frequency."""


@dataclass(frozen=True)
class OperationalModes:
    """Modes and what is needed to judge them; rows of (m,) follow the frequencies.

    shapes (m, channels): displacements, the largest 1; participation (m, references): of half spectra in the
    units of the records; layout: half spectra in place of FRFs, of channels of unit RMS; rebuilt (L,
    channels, references): from the modes; size (channels,): RMS of the records; tones: taken out of them.
    """

    frequency_hz: Array
    damping_ratio: Array
    shapes: Complex
    participation: Complex
    scatter: Scatter
    verified: Verified
    rejected: tuple[Candidate, ...]
    diagram: Diagram
    layout: Layout
    rebuilt: Complex
    mode_indicator: Array
    records: Records
    correlations: Correlations
    tones: tuple[Tone, ...]
    settings: ModalSettings
    notes: tuple[str, ...]

    @property
    def table(self) -> ModalTable:
        """The modes with their intervals."""
        return ModalTable(
            frequency_hz=self.frequency_hz,
            damping_ratio=self.damping_ratio,
            channels=self.records.channels,
            shapes=self.shapes,
            frequency_std_hz=self.scatter.frequency_hz,
            damping_std=self.scatter.damping,
            source=self.records.source,
            sha256=self.records.sha256,
        )


def analyse(
    history: TimeHistory, operational: OperationalSettings, settings: ModalSettings | None = None
) -> OperationalModes:
    """Modes of response records; none is a table of length 0 with the rejected candidates and their reasons.

    InputError where the records cannot be analysed: see `records_of`; settings that need a force.
    """
    settings = settings or ModalSettings()
    _check(settings)
    raw, notes = records_of(history, settings.band_hz, operational.least_damping)
    found = tuple(tones(raw, operational.speeds_hz))
    records = without(raw, found)
    rows, lags = _lengths(records, operational.least_damping)
    references = chosen_references(records, _REFERENCES)
    layout = _layout(correlations(records, references, lags, _BLOCKS), records)
    # Poles take few lags, and so the blocks whose scatter tells their intervals may be short, and many.
    whole = correlations(records, references, 2 * rows, _blocks(records, operational.least_damping))
    diagram = _diagram(whole, rows, layout, settings)
    least = _IDLE if settings.min_contribution is None else settings.min_contribution
    strict = settings.model_copy(update={"refine": False, "residuals": ("upper",), "min_contribution": least})
    by_hand = settings.modes_hz is not None
    rarest = 0.0 if by_hand or settings.keep_hz else settings.min_presence / 2
    accepted, turned_down = select(candidates(diagram, rarest), strict)
    accepted, harmonic = (accepted, []) if by_hand else _set_aside(accepted, found)
    verified, scatter = _determined(unrefined(accepted, layout, strict), whole, rows, diagram, by_hand)
    rejected = sorted([*turned_down, *harmonic, *verified.rejected], key=lambda c: c.frequency_hz)
    check_by_hand(replace(verified, rejected=rejected), settings)
    frequency, damping = frequency_and_damping(verified.model.poles)
    shapes = np.array([mode.shape for mode in verified.modes]).reshape(-1, len(whole.size))
    largest = shapes[np.arange(len(shapes)), np.argmax(np.abs(shapes), axis=1)]
    return OperationalModes(
        frequency_hz=frequency,
        damping_ratio=damping,
        shapes=np.asarray(shapes / largest[:, None]),
        participation=verified.model.participation * whole.size[references],
        scatter=scatter,
        verified=verified,
        rejected=tuple(rejected),
        diagram=diagram,
        layout=layout,
        rebuilt=synthesise(verified.model, layout.s, 0),
        mode_indicator=cmif(layout),
        records=records,
        correlations=whole,
        tones=found,
        settings=settings,
        notes=notes,
    )


def _check(settings: ModalSettings) -> None:
    """InputError for settings that are of FRFs."""
    defaults = ModalSettings()
    for key in ("estimator", "references", "direction"):
        if getattr(settings, key) != getattr(defaults, key):
            raise InputError(key, repr(getattr(settings, key)), "not beside --output-only", "leave it out")


def _lengths(records: Records, least_damping: float) -> tuple[int, int]:
    """Block rows of the Hankel matrix, and lags of the correlations."""
    low = records.band_hz[0]
    rows = int(np.ceil(_PERIODS * records.rate_hz / low))
    rows = max(10, min(rows, _LARGEST // len(records.channels)))
    decays = _LINES_A_WIDTH / (2 * np.pi * least_damping * low)
    most = records.seconds / len(records.takes) / 4
    lags = int(min(decays, most) * records.rate_hz)
    return rows, max(lags, 2 * rows + 2)


def _blocks(records: Records, least_damping: float) -> int:
    """Blocks of the record, none shorter than the memory of its slowest mode."""
    return max(2, min(_BLOCKS, int(records.seconds * 2 * np.pi * least_damping * records.band_hz[0])))


def _layout(found: Correlations, records: Records) -> Layout:
    hz, spectra, decay = found.half_spectra(records.band_hz)
    references = tuple(records.channels[i] for i in found.references)
    return Layout(hz, spectra, records.channels, references, 0, decay, False, records.source)


def _diagram(found: Correlations, rows: int, layout: Layout, settings: ModalSettings) -> Diagram:
    most = rows * len(layout.references)
    top = min(settings.max_order or _STATES, most) // _STEP * _STEP
    orders = range(max(settings.min_order, _STEP) // _STEP * _STEP, top + 1, _STEP)
    space = subspace(found, found.mean, rows, top)
    sets = [space.poles(order) for order in orders]
    bare = replace(layout, decay=0.0)  # these poles never saw the window of the half spectra
    return clustered(sets, bare, settings, tuple(orders))


def _set_aside(accepted: list[Candidate], found: tuple[Tone, ...]) -> tuple[list[Candidate], list[Candidate]]:
    """Modes, and what is left of a tone: a pole there that is no wider than it."""
    kept, gone = [], []
    for mode in accepted:
        tone = next((t for t in found if _is_of(mode, t)), None)
        if tone is None or mode.by_hand:
            kept.append(mode)
        else:
            gone.append(replace(mode, reason=because(Why.HARMONIC, tone.frequency_hz)))
    return kept, gone


def _determined(
    found: Verified, whole: Correlations, rows: int, diagram: Diagram, by_hand: bool
) -> tuple[Verified, Scatter]:
    """Modes that stay where they are whichever block is left out, and how sure they are."""
    scatter = jackknife(whole, rows, found.modes, diagram.orders)
    half = -found.model.poles.real / (2 * np.pi)
    chosen = np.array([by_hand or mode.by_hand for mode in found.modes], dtype=bool)
    steady = chosen | (scatter.frequency_hz < _UNSTEADY * half)
    gone = [
        replace(mode, reason=because(Why.BLOCKS, std))
        for mode, std, kept in zip(found.modes, scatter.frequency_hz, steady, strict=True)
        if not kept
    ]
    return (
        replace(
            found,
            modes=[mode for mode, kept in zip(found.modes, steady, strict=True) if kept],
            model=rows_of(found.model, np.flatnonzero(steady), found.model.residuals),
            covariance=found.covariance[steady],
            rejected=[*found.rejected, *gone],
        ),
        scatter[steady],
    )


def _is_of(mode: Candidate, tone: Tone) -> bool:
    inside = tone.low_hz <= mode.frequency_hz <= tone.high_hz
    return inside and mode.half_bandwidth / np.pi <= 2 * tone.width_hz
