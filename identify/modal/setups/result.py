"""Merged modes as a modal analysis: one table and one set of FRFs, for all that judges and plots one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

from identify.core.arrays import Array, Complex, Mask
from identify.measured.frf_set import POWER, FrfSet
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import ModalAnalysis
from identify.modal.layout import Layout
from identify.modal.lsfd import ModalModel
from identify.modal.reasons import Why, because
from identify.modal.scaling import reciprocity, scale
from identify.modal.selection import Candidate
from identify.modal.setups.analysis import Merged
from identify.modal.setups.residues import Grid
from identify.modal.stabilisation import Diagram
from identify.modal.window import frequency_and_damping


def pooled(sets: Sequence[FrfSet], source: str = "", sha256: str = "") -> FrfSet:
    """All FRFs of several setups in one set; a pair that was measured in several is that of the first."""
    grid = Grid.of(sets)
    plain = replace(grid, turn=tuple(np.abs(turn) for turn in grid.turn))
    known = [one.coherence for one in sets if one.coherence is not None]
    averages = [one.averages for one in sets if one.averages is not None]
    return replace(
        sets[0],
        frf=_spread(grid, [one.frf for one in sets]),
        outputs=grid.outputs,
        inputs=grid.inputs,
        coherence=_spread(plain, known).real if len(known) == len(sets) else None,
        noise=None,
        averages=min(averages, default=None),
        source=source,
        sha256=sha256,
    )


def _spread(grid: Grid, values: Sequence[Complex] | Sequence[Array]) -> Complex:
    """Values (L, outputs, inputs) of all setups on all channels, NaN where nothing was measured."""
    whole = grid.spread(0, np.asarray(values[0], dtype=complex))
    for k, one in enumerate(values[1:], 1):
        more = grid.spread(k, np.asarray(one, dtype=complex))
        whole = np.where(np.isnan(whole), more, whole)
    return whole


def as_analysis(
    data: FrfSet, merged: Merged, names: Sequence[str], found: Sequence[ModalAnalysis]
) -> ModalAnalysis:
    """The modes of all setups as those of one analysis; data: `pooled`; FRFs are rebuilt from the modes that
    each setup has by itself, with its own sensors on.
    """
    inside = _inside(merged, found[0])
    rows = [int(r) for r in np.flatnonzero(inside)]
    layout, rebuilt = _layout(data, merged.grid, found), _rebuilt(merged.grid, found)
    model = ModalModel(merged.poles[inside], merged.participation[inside], merged.shapes[inside], {})
    if layout.transposed:
        model = replace(model, participation=model.shapes, shapes=model.participation)
        rebuilt = rebuilt.transpose(0, 2, 1)
    shapes, mass_normalised = scale(model, layout)
    frequency, damping = frequency_and_damping(model.poles)
    std = merged.frequency_std_hz[inside], merged.damping_std[inside]
    mass = np.ones(len(model)) if mass_normalised else None
    none = np.zeros(0, dtype=int)
    return ModalAnalysis(
        table=ModalTable(
            frequency, damping, layout.responses, shapes, *std, mass, None, data.source, data.sha256
        ),
        model=model,
        outside=ModalModel(model.poles[none], model.participation[none], model.shapes[none], {}),
        modes=tuple(_candidate(merged, r, found) for r in rows),
        rejected=tuple(_rejected(merged, inside, names, found)),
        diagram=_diagram([one.diagram for one in found]),
        layout=layout,
        settings=found[0].settings,
        synthesised=rebuilt,
        reciprocity=reciprocity(data),
        bands_hz=found[0].bands_hz,
        by_noise=np.array([_by_noise(merged, r, found) for r in rows], dtype=np.bool_),
    )


def _inside(merged: Merged, first: ModalAnalysis) -> Mask:
    """Modes whose own frequency, without sensors, is in the band."""
    hz, lines = np.abs(merged.poles) / (2 * np.pi), first.layout.frequency_hz
    return np.asarray((hz >= lines[0]) & (hz <= lines[-1]))


def _lines(found: Sequence[ModalAnalysis]) -> Array:
    """The lines that were analysed in all setups, Hz."""
    return reduce(np.intersect1d, [one.layout.frequency_hz for one in found])


def _layout(data: FrfSet, grid: Grid, found: Sequence[ModalAnalysis]) -> Layout:
    """All FRFs on the lines that were analysed, the smaller side as references."""
    lines = np.isin(data.frequency_hz, _lines(found))
    transposed = len(grid.outputs) < len(grid.inputs)
    frf, sides = data.frf[lines], (grid.outputs, grid.inputs)
    if transposed:
        frf, sides = frf.transpose(0, 2, 1), sides[::-1]
    decay, power = data.window_decay_per_s, POWER[data.quantity]
    return Layout(data.frequency_hz[lines], frf, *sides, power, decay, transposed, data.source)


def _rebuilt(grid: Grid, found: Sequence[ModalAnalysis]) -> Complex:
    """FRFs (L, outputs, inputs) of each setup's own modes."""
    lines, own = _lines(found), []
    for one in found:
        frf = one.synthesised[np.isin(one.layout.frequency_hz, lines)]
        own.append(frf.transpose(0, 2, 1) if one.layout.transposed else frf)
    return _spread(grid, own)


def _candidate(merged: Merged, r: int, found: Sequence[ModalAnalysis]) -> Candidate:
    """The mode as the first setup that shows it found it."""
    k = int(np.flatnonzero(merged.member[r] >= 0)[0])
    mode: Candidate = found[k].modes[int(merged.member[r, k])]
    return replace(mode, pole=complex(merged.poles[r]))


def _by_noise(merged: Merged, r: int, found: Sequence[ModalAnalysis]) -> bool:
    return all(found[k].by_noise[j] for k, j in enumerate(merged.member[r]) if j >= 0)


def _rejected(
    merged: Merged, inside: Mask, names: Sequence[str], found: Sequence[ModalAnalysis]
) -> list[Candidate]:
    """What is no mode of all setups, and what each setup turned down."""
    own = [
        replace(c, reason=c.reason and c.reason.and_(f" ({name})"))
        for name, one in zip(names, found, strict=True)
        for c in one.rejected
    ]
    for r in map(int, np.flatnonzero(~inside)):
        hz = abs(merged.poles[r]) / (2 * np.pi)
        own.append(replace(_candidate(merged, r, found), reason=because(Why.BEYOND, hz)))
    some = next(mode for one in found for mode in one.modes)
    for hz, count in merged.turned_down:
        reason = because(Why.FEW_SETUPS, count, len(names))
        own.append(replace(some, pole=complex(2j * np.pi * hz), presence=count / len(names), reason=reason))
    return sorted(own, key=lambda c: c.frequency_hz)


def _diagram(diagrams: Sequence[Diagram]) -> Diagram:
    """Poles of all setups over each other; without their shapes, which are at different channels."""
    first = np.cumsum([0, *(1 + int(np.max(d.cluster, initial=-1)) for d in diagrams)])
    cluster = [np.where(d.cluster >= 0, d.cluster + at, -1) for d, at in zip(diagrams, first, strict=False)]

    def all_of(name: str) -> Array:
        return np.concatenate([getattr(d, name) for d in diagrams])

    count = sum(len(d.poles) for d in diagrams)
    return Diagram(
        order=all_of("order").astype(int),
        poles=np.concatenate([d.poles for d in diagrams]),
        participation=np.zeros((count, 0), dtype=complex),
        shapes=np.zeros((count, 0), dtype=complex),
        mpc=all_of("mpc"),
        mpd=all_of("mpd"),
        cluster=np.concatenate(cluster),
        orders=max((d.orders for d in diagrams), key=len),
    )
