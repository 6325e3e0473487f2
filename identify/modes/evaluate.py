"""A modal analysis turned into what a result keeps, and its verdict in sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identify.core.arrays import Array, Complex, Index, Mask
from identify.measured.channel import Channel
from identify.measured.frf_set import UNIT, FrfSet
from identify.measured.geometry import MeasuredGeometry, displacements
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import ModalAnalysis, analyse
from identify.modal.frf_errors import frf_errors
from identify.modal.mac import auto_mac, mpc, mpd
from identify.modal.reasons import Why, in_short
from identify.modal.selection import Candidate
from identify.modal.settings import ESTIMATORS, ModalSettings
from identify.modal.setups.run import analyse_setups
from identify.modal.stabilisation import Diagram
from identify.modes.doubt import doubt_sentence, doubts
from identify.modes.setups import kept_setups
from identify.results import fit as results
from identify.results import tables
from identify.results.modes import (
    FAILED_REBUILD,
    MARKS,
    AnalysedMeasurement,
    ModeTable,
    Reciprocity,
    RejectedPoles,
    SetupPoles,
    StabilisationDiagram,
)

_STRETCHES = 16
"""Of a band, each of which is judged."""


@dataclass(frozen=True)
class Measured:
    """What is analysed: FRFs with their place in a study, and where the sensors are (None: not known); drawn:
    the same for pictures; setups: name and FRFs of each, where not all was measured at once.
    """

    name: str
    file: str
    data: FrfSet
    posture_deg: Sequence[float] = ()
    sensors: MeasuredGeometry | None = None
    drawn: tables.Geometry | None = None
    setups: Sequence[tuple[str, FrfSet]] = ()


def analysed(measured: Measured, settings: ModalSettings) -> tuple[ModalAnalysis, AnalysedMeasurement]:
    """The modal analysis of one measurement, and what a result keeps of it; InputError as `analyse`."""
    if not measured.setups:
        found = analyse(measured.data, settings)
        return found, _kept(measured, found, None)
    names, sets = zip(*measured.setups, strict=True)
    found, setups = analyse_setups(measured.data, sets, names, settings)
    return found, _kept(measured, found, None if setups is None else kept_setups(setups))


def _kept(measured: Measured, found: ModalAnalysis, setups: SetupPoles | None) -> AnalysedMeasurement:
    """What a result keeps of an analysis."""
    settings = found.settings
    shapes = displacements(measured.sensors, found.table) if measured.sensors is not None else None
    return AnalysedMeasurement(
        name=measured.name,
        file=measured.file,
        sha256=measured.data.sha256,
        posture_deg=np.array(measured.posture_deg, dtype=float),
        estimator=ESTIMATORS[settings.estimator],
        highest_order=found.diagram.orders[-1],
        parts=len(found.bands_hz),
        total_error=found.total_error,
        modes=mode_table(
            found.table,
            found.references,
            found.model.participation,
            settings,
            found.seen,
        ),
        rejected=rejected_poles(found.rejected),
        diagram=drawn_diagram(
            found.diagram,
            found.layout.frequency_hz,
            found.mode_indicator,
            settings,
            (*found.modes, *found.rejected),
        ),
        reciprocity=_reciprocity(found),
        frf=_frf(found, measured.data),
        geometry=measured.drawn,
        shapes=shapes,
        setups=setups,
    )


def mode_table(
    table: ModalTable,
    references: Sequence[Channel],
    participation: Complex,
    settings: ModalSettings,
    seen: tuple[Array, Array] | None = None,
) -> ModeTable:
    """Modes as a result keeps them; seen: frequencies and damping ratios as a window showed them."""
    assert table.shapes is not None and table.frequency_std_hz is not None and table.damping_std is not None
    seen_frequency, seen_damping = seen or (table.frequency_hz, table.damping_ratio)
    collinearity, deviation = mpc(table.shapes), np.degrees(mpd(table.shapes))
    return ModeTable(
        frequency_hz=table.frequency_hz,
        frequency_std_hz=table.frequency_std_hz,
        damping_ratio=table.damping_ratio,
        damping_std=table.damping_std,
        seen_frequency_hz=seen_frequency,
        seen_damping_ratio=seen_damping,
        mpc=collinearity,
        mpd_deg=deviation,
        channels=tuple(map(str, table.channels)),
        shapes=table.shapes,
        references=tuple(map(str, references)),
        participation=participation,
        auto_mac=auto_mac(table.shapes),
        doubt=doubts(table, collinearity, deviation, settings),
    )


def rejected_poles(found: Sequence[Candidate]) -> RejectedPoles:
    """Candidates that are no modes, as a result keeps them."""
    rows = np.array([[c.frequency_hz, c.damping_ratio, c.presence, c.mpc, np.degrees(c.mpd)] for c in found])
    frequency, damping, presence, mpc, mpd = rows.reshape(-1, 5).T
    reasons = [c.reason for c in found if c.reason is not None]
    texts, codes = tuple(map(str, reasons)), tuple(reason.code for reason in reasons)
    return RejectedPoles(frequency, damping, presence, mpc, mpd, texts, codes)


def drawn_diagram(
    diagram: Diagram,
    line_hz: Array,
    indicator: Array,
    settings: ModalSettings,
    judged: Sequence[Candidate],
) -> StabilisationDiagram:
    """Poles of every order over the mode indicator (L, references), as a result keeps them; judged: modes and
    rejected candidates, for what choices did to them.
    """
    clustered = diagram.cluster >= 0
    counts = np.bincount(diagram.cluster[clustered], minlength=1)
    firm = counts[np.maximum(diagram.cluster, 0)] >= settings.min_presence * len(diagram.orders)
    return StabilisationDiagram(
        diagram.order,
        diagram.frequency_hz,
        diagram.damping_ratio,
        clustered & firm,
        line_hz,
        indicator,
        _marks(diagram, judged),
    )


def _marks(diagram: Diagram, judged: Sequence[Candidate]) -> Index:
    """Of every pole (n,) the position in MARKS, -1 where no choice touched its cluster."""
    mark = np.full(len(diagram.poles), -1, dtype=np.intp)
    for one in judged:
        kind = _mark(one)
        if kind is not None:
            mark[_cluster_of(diagram, one)] = MARKS.index(kind)
    return mark


def _cluster_of(diagram: Diagram, one: Candidate) -> Mask:
    """Which poles (n,) are of the cluster whose middle is nearest to a candidate, within its half-bandwidth;
    where none is, as of a mode that no cluster showed, the poles that are within it.
    """
    near = np.abs(diagram.poles - one.pole) <= one.half_bandwidth
    numbers = np.unique(diagram.cluster[near & (diagram.cluster >= 0)])
    if not len(numbers):
        return np.asarray(near)
    members = [diagram.poles[diagram.cluster == number] for number in numbers]
    middles = np.array([np.median(m.real) + 1j * np.median(m.imag) for m in members])
    return np.asarray(diagram.cluster == numbers[np.argmin(np.abs(middles - one.pole))])


def _mark(one: Candidate) -> str | None:
    kept, dropped, idle = MARKS
    if one.by_hand:
        return kept
    return {Why.DROPPED: dropped, Why.IDLE: idle, Why.IDLE_BY_NOISE: idle}.get(one.why) if one.why else None


def _reciprocity(found: ModalAnalysis) -> Reciprocity:
    checks = found.reciprocity
    frac, level, error = np.array([[c.frac, c.level, c.error] for c in checks]).reshape(-1, 3).T
    return Reciprocity(tuple(str(c.a) for c in checks), tuple(str(c.b) for c in checks), frac, level, error)


def _frf(found: ModalAnalysis, data: FrfSet) -> results.FrfComparison:
    """Every measured FRF beside the one rebuilt from the modes, on the lines that were analysed."""
    layout = found.layout
    rows, columns = np.nonzero(~np.isnan(layout.frf).all(axis=0))
    responses, references = [layout.responses[i] for i in rows], [layout.references[j] for j in columns]
    outputs, inputs = (references, responses) if layout.transposed else (responses, references)
    measured, rebuilt = layout.frf[:, rows, columns], found.synthesised[:, rows, columns]
    return results.FrfComparison(
        quantity=data.quantity,
        unit=UNIT[data.quantity],
        window_decay_per_s=data.window_decay_per_s,
        frequency_hz=layout.frequency_hz,
        output=tuple(map(str, outputs)),
        input=tuple(map(str, inputs)),
        measured=measured,
        fitted=rebuilt,
        coherence=_coherence(data, layout.frequency_hz, outputs, inputs),
        **frf_errors(measured, rebuilt),
    )


def _coherence(
    data: FrfSet, frequency_hz: Array, outputs: list[Channel], inputs: list[Channel]
) -> Array | None:
    if data.coherence is None:
        return None
    lines = np.isin(data.frequency_hz, frequency_hz)
    return data.coherence[lines][
        :, [data.outputs.index(c) for c in outputs], [data.inputs.index(c) for c in inputs]
    ]


def verdict(measurements: Sequence[AnalysedMeasurement]) -> tuple[str, ...]:
    """What was found, how well it rebuilds the FRFs, what was rejected, and what the window did: one
    paragraph a measurement.
    """
    named = len(measurements) > 1
    paragraphs = [
        " ".join(filter(None, (_found(m), _rebuilt(m), doubtful(m), turned_down(m), _window(m))))
        for m in measurements
    ]
    return tuple(
        f"{m.name}: {said}" if named else said for m, said in zip(measurements, paragraphs, strict=True)
    )


def _found(m: AnalysedMeasurement) -> str:
    count, lines = len(m.modes.frequency_hz), m.frf.frequency_hz
    modes = {0: "No mode was", 1: "One mode was"}.get(count, f"{count} modes were")
    where = f"between {lines[0]:.4g} and {lines[-1]:.4g} Hz in {len(m.frf.output)} FRFs"
    parts = f", in {m.parts} parts of the band" if m.parts > 1 else ""
    return f"{modes} found {where} ({m.estimator}, orders up to {m.highest_order}{parts})."


def _rebuilt(m: AnalysedMeasurement) -> str:
    if not len(m.modes.frequency_hz):
        return ""
    median = float(np.nanmedian(m.frf.relative_error))
    said = (
        f"FRFs rebuilt from them differ by {100 * m.total_error:.3g} % (RMS over all; median FRF"
        f" {100 * median:.3g} %)."
    )
    if m.total_error < FAILED_REBUILD:
        return said
    return (
        f"{said} That is no model of these FRFs{_where_poor(m)}: narrow the band (`--band`) or raise"
        " `--max-order`."
    )


def doubtful(m: AnalysedMeasurement) -> str:
    """Which modes are doubtful, in a sentence."""
    return doubt_sentence(m.modes.frequency_hz, m.modes.doubt)


def _where_poor(m: AnalysedMeasurement) -> str:
    """The stretches of the band where most of the FRFs is not rebuilt, in words."""
    lines, measured = m.frf.frequency_hz, m.frf.measured
    edges = np.linspace(0, len(lines), _STRETCHES + 1).astype(int)
    poor = [
        np.nansum(np.abs(measured[a:b] - m.frf.fitted[a:b]) ** 2)
        > FAILED_REBUILD**2 * np.nansum(np.abs(measured[a:b]) ** 2)
        for a, b in pairwise(edges)
    ]
    starts = [n for n, bad in enumerate(poor) if bad and (n == 0 or not poor[n - 1])]
    ends = [n + 1 for n, bad in enumerate(poor) if bad and (n + 1 == len(poor) or not poor[n + 1])]
    spans = [
        f"{lines[edges[a]]:.4g} to {lines[edges[b] - 1]:.4g} Hz" for a, b in zip(starts, ends, strict=True)
    ]
    return " at " + ", ".join(spans) if spans and not all(poor) else ""


def turned_down(m: AnalysedMeasurement) -> str:
    """How many candidates were rejected, and why, in a sentence."""
    codes = m.rejected.why
    if not codes:
        return "No candidate was rejected."
    why = Counter(in_short(code).replace("FRFs", m.frf.noun.several) for code in codes)
    parts = ", ".join(f"{count} {short}" for short, count in why.most_common())
    return f"{len(codes)} candidate{'s were' if len(codes) > 1 else ' was'} rejected: {parts}."


def _window(m: AnalysedMeasurement) -> str:
    decay, seen, ratio = m.frf.window_decay_per_s, m.modes.seen_damping_ratio, m.modes.damping_ratio
    if not decay or not len(ratio):
        return ""
    most = int(np.argmax(seen - ratio))
    change = f"{100 * seen[most]:.3g} % became {100 * ratio[most]:.3g} %"
    return (
        f"Damping is corrected for the exponential window ({decay:.4g} 1/s); at"
        f" {m.modes.frequency_hz[most]:.4g} Hz {change}."
    )
