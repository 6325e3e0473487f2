"""What a comparison shows of its runs: measurements, lines, FRFs and modes that they have in common."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.measured.channel import Channel
from identify.measured.modal_tables import ModalTable
from identify.modal.mac import macx
from identify.modal.pairing import pair
from identify.reports.shared.figures import Mac
from identify.reports.shared.pick import shown_modes
from identify.results.comparison import Comparison
from identify.results.fit import FrfComparison, MeasurementResult


@dataclass(frozen=True)
class Shared:
    """A measurement that several runs have: what each made of it, by label, and its FRFs on common lines and
    pairs (empty: none).
    """

    name: str
    runs: dict[str, MeasurementResult]
    frfs: dict[str, FrfComparison]

    @property
    def first(self) -> MeasurementResult:
        """What the first run made of it."""
        return next(iter(self.runs.values()))

    @property
    def in_noise(self) -> bool:
        """Whether residuals are over the noise, else over the measurement."""
        return next(iter(self.frfs.values())).noise is not None


def shared(comparison: Comparison) -> list[Shared]:
    """The measurements that at least two runs have, by name, in the order of the first run that has them."""
    having: dict[str, dict[str, MeasurementResult]] = {}
    for label, run in comparison.runs.items():
        for name, m in run.measurements.items():
            having.setdefault(name, {})[label] = m
    return [
        Shared(name, runs, _common({label: m.frf for label, m in runs.items() if m.frf}))
        for name, runs in having.items()
        if len(runs) > 1
    ]


def _common(frfs: dict[str, FrfComparison]) -> dict[str, FrfComparison]:
    """FRF sets cut down to the lines and pairs that all have; empty for fewer than two sets, or nothing in
    common.
    """
    sets = list(frfs.values())
    if len(sets) < 2 or len({(frf.quantity, frf.unit) for frf in sets}) > 1:
        return {}
    lines, pairs = sets[0].frequency_hz, list(zip(sets[0].output, sets[0].input, strict=True))
    for frf in sets[1:]:
        lines = np.intersect1d(lines, frf.frequency_hz)
        has = set(zip(frf.output, frf.input, strict=True))
        pairs = [one for one in pairs if one in has]
    if not len(lines) or not pairs:
        return {}
    return {label: _cut(frf, lines, pairs) for label, frf in frfs.items()}


def _cut(frf: FrfComparison, lines: Array, pairs: list[tuple[str, str]]) -> FrfComparison:
    where = {one: number for number, one in enumerate(zip(frf.output, frf.input, strict=True))}
    columns = np.array([where[one] for one in pairs])
    both, curves = (
        np.ix_(np.isin(frf.frequency_hz, lines), columns),
        ("measured", "fitted", "band_95", "noise", "coherence"),
    )
    cut = {name: values[both] for name in curves if (values := getattr(frf, name)) is not None}
    errors = ("gap", "relative_error", "frac", "area_error")
    cut |= {name: values[columns] for name in errors if (values := getattr(frf, name)) is not None}
    output, into = zip(*pairs, strict=True)
    return dataclasses.replace(frf, frequency_hz=lines, output=output, input=into, initial=None, **cut)


def matched(a: MeasurementResult, b: MeasurementResult) -> dict[int, tuple[int, float]]:
    """For modes of a, the mode of b it became, by shape and frequency, and the MAC of the two."""
    found = pair(_table(a), _table(b))
    return {int(i): (int(j), float(mac)) for i, j, mac in zip(found.a, found.b, found.mac, strict=True)}


def _table(m: MeasurementResult) -> ModalTable:
    shown = shown_modes(m)
    channels = tuple(Channel(int(node), axis) for node in m.geometry.nodes for axis in (1, 2, 3))
    shapes = m.modes.point_shapes[:shown].reshape(shown, -1) if channels else None
    return ModalTable(m.modes.frequency_hz[:shown], m.modes.damping_ratio[:shown], channels, shapes)


def shape_mac(one: Shared) -> Mac | None:
    """MAC of the shapes of the first two runs at a posture; None where their points are not the same."""
    (label_a, a), (label_b, b) = list(one.runs.items())[:2]
    if not np.array_equal(a.geometry.nodes, b.geometry.nodes) or not len(a.geometry.nodes):
        return None
    tables = _table(a), _table(b)
    assert tables[0].shapes is not None and tables[1].shapes is not None
    hz, labels = (tables[0].frequency_hz, tables[1].frequency_hz), (label_a, label_b)
    return Mac(one.name, macx(tables[0].shapes, tables[1].shapes), *hz, *labels)
