"""A band too wide for one model is analysed in parts, where the modes found in the whole do not rebuild its
FRFs.

Each part has terms of its own for what lies beside it; neighbours overlap, and a mode belongs to the part in
whose own lines it lies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.interruption import check
from identify.modal.layout import Layout
from identify.modal.lsfd import ModalModel, synthesise
from identify.modal.selection import Candidate, candidates, select
from identify.modal.settings import ModalSettings
from identify.modal.stabilisation import Diagram, stabilisation
from identify.modal.verified import Verified, unrefined
from identify.modal.verify import verify

_OVERLAP = 0.1
"""Of its lines, by which a part reaches over its seams."""
_POOR = 0.5
"""Error over RMS of the FRFs in a stretch of a band, beyond which parts of it are tried."""
_PATTERN = 0.3
"""Correlation of what is left at neighbouring lines: below it, it is noise, which no other model explains."""
_BETTER = 0.8
"""Parts are kept where they bring the error to this share of what it was."""
_STRETCHES = 8
"""Of a band, whose errors count alike."""
_FEWEST, _PART = 512, 768
"""Lines: a part with fewer is not split again; parts have about so many."""


@dataclass(frozen=True)
class Identified:
    """Modes of a band, with the diagrams they came from and the FRFs that they rebuild, (L, responses,
    references); bands_hz: the parts it was analysed in.
    """

    diagram: Diagram
    verified: Verified
    rebuilt: Complex
    bands_hz: tuple[tuple[float, float], ...]


def identified(layout: Layout, settings: ModalSettings) -> Identified:
    """The modes of a band, in as many parts as it takes; modes chosen by hand are found in one."""
    if settings.modes_hz is not None or not settings.refine:
        return _whole(layout, settings)
    return _in_parts(layout, settings)


def _whole(layout: Layout, settings: ModalSettings, *, late: bool = False) -> Identified:
    check()
    diagram = stabilisation(layout, settings)
    manual = settings.modes_hz is not None
    least = 0.0 if manual or settings.keep_hz else settings.min_presence / 2
    accepted, rejected = select(candidates(diagram, least), settings, late=late)
    if settings.refine:
        found = verify(accepted, layout, settings, rejected)
    else:
        found = unrefined(accepted, layout, settings)
    found = replace(found, rejected=rejected + found.rejected)
    rebuilt = synthesise(found.model, layout.s, layout.power)
    rebuilt = rebuilt + synthesise(found.outside, layout.s, layout.power)
    band = (float(layout.frequency_hz[0]), float(layout.frequency_hz[-1]))
    return Identified(diagram, found, rebuilt, (band,))


def _in_parts(layout: Layout, settings: ModalSettings, *, late: bool = False) -> Identified:
    """The band as a whole or, where that explains it poorly and parts do better, in parts; late: see
    `select`, for parts of what one model did not explain.
    """
    lines = len(layout.frequency_hz)
    whole = _whole(layout, settings, late=late)
    if lines < _FEWEST or not _unexplained(layout, whole.rebuilt):
        return whole
    seams = np.linspace(0, lines, max(2, -(-lines // _PART)) + 1).astype(int)
    overlap = int(_OVERLAP * seams[1])
    spans = [slice(max(a - overlap, 0), min(b + overlap, lines)) for a, b in pairwise(seams)]
    parts = [_in_parts(_lines(layout, span), settings, late=True) for span in spans]
    cores = [
        slice(a - span.start, b - span.start) for (a, b), span in zip(pairwise(seams), spans, strict=True)
    ]
    rebuilt = np.concatenate([part.rebuilt[core] for part, core in zip(parts, cores, strict=True)])
    before, after = (np.mean(_errors(layout, frf)) for frf in (whole.rebuilt, rebuilt))
    if after > _BETTER * before:
        return whole
    found = parts[0]
    for part, seam in zip(parts[1:], seams[1:-1], strict=True):
        found = _joined(found, part, float(layout.frequency_hz[seam]))
    return replace(found, rebuilt=rebuilt)


def _lines(layout: Layout, lines: slice) -> Layout:
    return replace(layout, frequency_hz=layout.frequency_hz[lines], frf=layout.frf[lines])


def _unexplained(layout: Layout, rebuilt: Complex) -> bool:
    """Whether some stretch of a band is rebuilt poorly, and what is left there is not noise."""
    poor = np.flatnonzero(_errors(layout, rebuilt) > _POOR)
    edges = np.append(_edges(layout), len(layout.frequency_hz))
    left = layout.frf - rebuilt
    return any(_pattern(left[edges[n] : edges[n + 1]]) > _PATTERN for n in poor)


def _errors(layout: Layout, rebuilt: Complex) -> Array:
    """What is not rebuilt over the FRFs, RMS, of every stretch of the band: one where the FRFs are small
    counts like the others.
    """
    size = np.nansum(np.abs(layout.frf) ** 2, axis=(1, 2))
    left = np.nansum(np.abs(layout.frf - rebuilt) ** 2, axis=(1, 2))
    edges = _edges(layout)
    whole = np.maximum(np.add.reduceat(size, edges), np.finfo(float).tiny)
    return np.asarray(np.sqrt(np.add.reduceat(left, edges) / whole))


def _edges(layout: Layout) -> Index:
    """The first line of every stretch."""
    lines = len(layout.frequency_hz)
    return np.linspace(0, lines, _STRETCHES, endpoint=False).astype(np.intp)


def _pattern(left: Complex) -> float:
    """Correlation of what is left between neighbouring lines, 0 for noise."""
    product = np.abs(np.nansum(left[1:] * left[:-1].conj()))
    return float(product / max(np.nansum(np.abs(left) ** 2), np.finfo(float).tiny))


def _joined(below: Identified, above: Identified, seam_hz: float) -> Identified:
    """Two parts as one: of each the modes on its side of the seam, and those beyond that both have there."""
    parts = [below, above]
    low, high = (part.verified for part in parts)
    keep = [_frequency(low.model) < seam_hz, _frequency(high.model) >= seam_hz]
    for r in np.flatnonzero(~keep[0]):
        # Found on either side of the seam, each time just beyond it: neither would keep it.
        twins = np.flatnonzero(_same(low.model.poles[r], high.model.poles) & ~keep[1])
        keep[0][r] = bool(len(twins))
    for r in np.flatnonzero(keep[0]):
        keep[1] &= ~_same(low.model.poles[r], high.model.poles)
    rows = [np.flatnonzero(mask) for mask in keep]
    sides = [
        [_is_below(c, seam_hz) for c in low.rejected],
        [not _is_below(c, seam_hz) for c in high.rejected],
    ]
    verified = Verified(
        modes=[part.modes[r] for part, own in zip((low, high), rows, strict=True) for r in own],
        model=_stacked([low.model, high.model], rows),
        outside=_stacked(
            [low.outside, high.outside],
            [
                np.flatnonzero(_frequency(low.outside) < seam_hz),
                np.flatnonzero(_frequency(high.outside) >= seam_hz),
            ],
        ),
        covariance=np.concatenate(
            [part.covariance[own] for part, own in zip((low, high), rows, strict=True)]
        ),
        rejected=[
            c
            for part, own in zip((low, high), sides, strict=True)
            for c, mine in zip(part.rejected, own, strict=True)
            if mine
        ],
        by_noise=np.concatenate([part.by_noise[own] for part, own in zip((low, high), rows, strict=True)]),
    )
    diagram = _drawn([part.diagram for part in parts], seam_hz)
    return Identified(diagram, verified, below.rebuilt, below.bands_hz + above.bands_hz)


def _frequency(model: ModalModel) -> np.ndarray:
    return np.asarray(np.abs(model.poles) / (2 * np.pi))


def _same(pole: complex, others: Complex) -> np.ndarray:
    """Which poles are this one, found again in the other part: within a half-bandwidth."""
    return np.asarray(np.abs(others - pole) < np.maximum(-others.real, -pole.real))


def _is_below(candidate: Candidate, seam_hz: float) -> bool:
    return candidate.frequency_hz < seam_hz


def _stacked(models: list[ModalModel], rows: list[np.ndarray]) -> ModalModel:
    """Rows of two models as one; the terms for modes beyond a part hold in that part only, and are left."""
    pairs = list(zip(models, rows, strict=True))
    return ModalModel(
        np.concatenate([model.poles[own] for model, own in pairs]),
        np.concatenate([model.participation[own] for model, own in pairs]),
        np.concatenate([model.shapes[own] for model, own in pairs]),
        {},
    )


def _drawn(diagrams: list[Diagram], seam_hz: float) -> Diagram:
    """Both diagrams, each on its side of the seam."""
    low, high = diagrams
    masks = [low.frequency_hz < seam_hz, high.frequency_hz >= seam_hz]
    shift = 1 + int(np.max(low.cluster, initial=-1))
    clusters = [low.cluster, np.where(high.cluster >= 0, high.cluster + shift, -1)]

    def both(name: str) -> np.ndarray:
        return np.concatenate([getattr(d, name)[mask] for d, mask in zip(diagrams, masks, strict=True)])

    return Diagram(
        order=both("order"),
        poles=both("poles"),
        participation=both("participation"),
        shapes=both("shapes"),
        mpc=both("mpc"),
        mpd=both("mpd"),
        cluster=np.concatenate([own[mask] for own, mask in zip(clusters, masks, strict=True)]),
        orders=max(low.orders, high.orders, key=len),
    )
