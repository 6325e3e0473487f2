"""Modes of response records in several setups, from those of each to one measurement of a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.measured.geometry import MeasuredGeometry, displacements
from identify.measured.modal_tables import ModalTable
from identify.modal.operational.analysis import OperationalModes
from identify.modal.operational.merged import merged_responses, unit_shapes
from identify.modal.reasons import Why, because
from identify.modal.setups.run import Setups, poles_agree
from identify.modal.window import frequency_and_damping
from identify.modes.evaluate import mode_table
from identify.modes.sensors import drawn
from identify.modes.setups import kept_setups
from identify.results.fit import FrfComparison
from identify.results.modes import (
    AnalysedMeasurement,
    OutputOnly,
    RejectedPoles,
    StabilisationDiagram,
    Tones,
)


def together(
    name: str,
    found: Sequence[OperationalModes],
    kept: Sequence[AnalysedMeasurement],
    sensors: MeasuredGeometry | None,
) -> tuple[AnalysedMeasurement, ModalTable]:
    """One measurement from those of all setups, and its modal table."""
    names = [one.name for one in kept]
    merged = merged_responses(found, names)
    own = [(one.verified.model.poles, one.table) for one in found]
    shapes, shape_std = unit_shapes(merged, found)
    frequency, damping = frequency_and_damping(merged.poles)
    table = ModalTable(
        frequency, damping, merged.grid.outputs, shapes, merged.frequency_std_hz, merged.damping_std
    )
    first = kept[0]
    participation = first.modes.participation[merged.member[:, 0]]
    one = replace(
        first,
        name=name,
        file=", ".join(m.file for m in kept),
        total_error=float(np.sqrt(np.mean([m.total_error**2 for m in kept]))),
        modes=mode_table(table, found[0].layout.references, participation, found[0].settings),
        rejected=_rejected(kept, merged.turned_down),
        diagram=_diagram([m.diagram for m in kept]),
        frf=_spectra([m.frf for m in kept]),
        geometry=None if sensors is None else drawn(sensors),
        shapes=None if sensors is None else displacements(sensors, table),
        output_only=_extras([m.output_only for m in kept if m.output_only is not None], shape_std),
        setups=kept_setups(Setups(tuple(names), merged, poles_agree(merged, own), together=False)),
    )
    return one, table


def _rejected(kept: Sequence[AnalysedMeasurement], few: Sequence[tuple[float, int]]) -> RejectedPoles:
    """Of every setup what it turned down, and what not all of them show."""
    lone = np.array([hz for hz, _ in few])
    none = np.full(len(few), np.nan)
    parts = [
        *(m.rejected for m in kept),
        RejectedPoles(
            lone,
            none,
            np.array([count / len(kept) for _, count in few]),
            none,
            none,
            tuple(str(because(Why.FEW_SETUPS, count, len(kept))) for _, count in few),
            (Why.FEW_SETUPS,) * len(few),
        ),
    ]
    order = np.argsort(np.concatenate([part.frequency_hz for part in parts]), kind="stable")
    reasons = [f"{reason} ({m.name})" for m in kept for reason in m.rejected.reason] + list(parts[-1].reason)
    codes = [code for part in parts for code in part.why]

    def all_of(field: str) -> Array:
        return np.concatenate([getattr(part, field) for part in parts])[order]

    return RejectedPoles(
        frequency_hz=all_of("frequency_hz"),
        damping_ratio=all_of("damping_ratio"),
        presence=all_of("presence"),
        mpc=all_of("mpc"),
        mpd_deg=all_of("mpd_deg"),
        reason=tuple(reasons[k] for k in order),
        why=tuple(codes[k] for k in order),
    )


def _diagram(parts: Sequence[StabilisationDiagram]) -> StabilisationDiagram:
    """Poles of all setups, over the indicator of the first."""
    names = ("order", "frequency_hz", "damping_ratio", "stable", "mark")
    return replace(parts[0], **{name: np.concatenate([getattr(d, name) for d in parts]) for name in names})


def _spectra(parts: Sequence[FrfComparison]) -> FrfComparison:
    """Half spectra of all setups on the lines of the first; of setups with other lines (longer or shorter
    records) none, and of pairs of references those of the first.
    """
    alike = [
        p for p in parts if np.array_equal(p.frequency_hz, parts[0].frequency_hz) and p.unit == parts[0].unit
    ]
    seen: set[tuple[str, str]] = set()
    columns = []
    for part in alike:
        pairs = list(zip(part.output, part.input, strict=True))
        columns.append(np.array([n for n, pair in enumerate(pairs) if pair not in seen], dtype=int))
        seen |= set(pairs)
    both = list(zip(alike, columns, strict=True))

    def values(name: str) -> Any:
        return np.concatenate([getattr(part, name)[..., rows] for part, rows in both], axis=-1)

    def texts(name: str) -> tuple[str, ...]:
        return tuple(getattr(part, name)[n] for part, rows in both for n in rows)

    curves = ("measured", "fitted", "relative_error", "frac", "area_error")
    named = {name: values(name) for name in curves}
    return replace(parts[0], output=texts("output"), input=texts("input"), **named)


def _extras(parts: Sequence[OutputOnly], shape_std: Array) -> OutputOnly:
    """Seconds of all setups, and the tones of each."""
    names = ("frequency_hz", "width_hz", "kurtosis", "share", "multiple", "speed_hz")
    tones = Tones(*(np.concatenate([getattr(part.tones, name) for part in parts]) for name in names))
    seconds, blocks = sum(part.seconds for part in parts), min(part.blocks for part in parts)
    return replace(parts[0], seconds=seconds, blocks=blocks, shape_std=shape_std, tones=tones)
