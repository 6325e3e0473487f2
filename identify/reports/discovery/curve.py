"""Measured dynamic stiffness in a report: the figure, its tables, and what is said of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.text import capital, listed
from identify.core.thresholds import SIGMAS_95
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column, Curves, Table, digits, ready, words
from identify.reports.kit.report import EVERYWHERE, PAGE, Heading, Part, Parts, Tabular, Text
from identify.results.curves import CurveTable, PlaceTable
from identify.results.discovery import DiscoveryResult

AGREE = 2.0
"""RMS difference of a posture from the pooled curve over its standard deviation up to which they agree."""
_MOST, _SURE = 3, 5.0
"""Coordinates of a place that are drawn; standard deviations from which a change with force is one."""
_TRENDS = {
    "real": (
        "something slips, such as springs held by friction",
        "something hardens, or has play",
    ),
    "imaginary": ("damping falls with force, as dry friction does", "damping rises with force"),
}
"""What a lower and a higher part to stronger impacts mean."""
_NOTE = (
    "Points: measured line by line, with no law assumed and one value for all postures, with 95 % intervals."
    " Line: the law of the added effect. A flat real part is a spring; an imaginary part in proportion to"
    " frequency is a damper, a constant one hysteresis; a real part that falls with the square of frequency"
    " is a mass; a peak is a body on a spring of its own."
)


def parts(result: DiscoveryResult) -> Parts:
    """What was measured at the places in question; nothing where no curve was."""
    curves = sorted(result.curves.items(), key=lambda item: int(item[0]))
    said = by_strength(list(result.curves.values()))
    return [
        *(Text(text, on=EVERYWHERE) for text in said),
        *(part for key, curve in curves for part in _parts(int(key), curve)),
    ]


def place_table(step: int, places: PlaceTable) -> Table:
    """Where the gap could come from, whatever it is."""
    columns = [
        words("Place", places.sentence),
        Column("Gap left", "", places.gap, digits(3)),
        Column("Numbers", "", map(str, places.unknowns), ready),
    ]
    note = (
        "Remaining gap if each frequency line has its own unknown there, the same for all postures: no law"
        " is assumed. Numbers: how many real numbers were fitted; the gap takes them into account."
    )
    return Table(f"Places, step {step}", columns, note)


def sentences(curve: CurveTable) -> str:
    """What the curve says, in words."""
    law = f"Of simple laws, {curve.laws[0]} is the likeliest" if curve.laws else ""
    if len(curve.laws) > 1:
        law += f" (log odds {curve.law_log_odds[0]:.0f} over {curve.laws[1]})"
    said = [f"{capital(curve.place)}: with a free dynamic stiffness, the gap is {curve.gap:.2f}."]
    said += [f"{capital(curve.axis)}."] if curve.axis else []
    said += [law + "."] if law else []
    apart = [name for name, rms in zip(curve.sets, curve.agreement, strict=True) if rms > AGREE]
    if len(curve.sets) > 1:
        said.append(
            f"{listed(apart)} {'differs' if len(apart) == 1 else 'differ'} from the others by more than their"
            " uncertainty: the place, or something else in the model, is not quite right."
            if apart
            else "All postures agree within their uncertainty, also those that were not fitted."
            if not all(curve.fitted)
            else "All postures agree within their uncertainty."
        )
    if curve.errors_held:
        said.append("Nuisance parameters are fixed as fitted; intervals do not include their uncertainty.")
    return " ".join(said)


def by_strength(curves: Sequence[CurveTable]) -> list[str]:
    """What becomes of a dynamic stiffness from the weakest to the strongest impacts, for every place that was
    measured at several; nothing is said where the curves agree within their uncertainty.
    """
    said: list[str] = []
    levels: dict[str, list[CurveTable]] = {}
    for curve in curves:
        if np.isfinite(curve.peak_n):
            levels.setdefault(curve.site or curve.place, []).append(curve)
    for place, own in levels.items():
        weak, strong = (pick(own, key=lambda curve: curve.peak_n) for pick in (min, max))
        for entry in chosen(weak):
            for part, (falls, rises) in _TRENDS.items():
                change, std = _change(weak, strong, entry, part)
                if abs(change) > _SURE * std:
                    said.append(
                        f"{capital(place)}, {weak.entries[entry]}: with impacts of {strong.peak_n:.0f} N"
                        f" in place of {weak.peak_n:.0f} N the {part} part of the dynamic stiffness is"
                        f" {abs(change):.3g} {weak.unit} {'lower' if change < 0 else 'higher'}:"
                        f" {falls if change < 0 else rises}."
                    )
                    break  # what slips seems damped otherwise, too
    return said


def _change(weak: CurveTable, strong: CurveTable, entry: int, part: str) -> tuple[float, float]:
    """Weighted mean of the difference over lines, and its standard deviation as if lines were independent."""
    name = "std_real" if part == "real" else "std_imag"
    variance = getattr(weak, name)[:, entry] ** 2 + getattr(strong, name)[:, entry] ** 2
    change = getattr(strong.value - weak.value, "real" if part == "real" else "imag")[:, entry]
    known = np.isfinite(change) & (variance > 0)
    weight = 1 / variance[known]
    if not known.any():
        return 0.0, np.inf
    return float(weight @ change[known] / weight.sum()), float(1 / np.sqrt(weight.sum()))


def chosen(curve: CurveTable) -> list[int]:
    """Entries that are drawn: those along one coordinate."""
    return [n for n, name in enumerate(curve.entries) if " with " not in name][:_MOST]


def plot(anchor: str, curve: CurveTable) -> Plot:
    """Real and imaginary part over frequency, a row for each coordinate."""
    panels = []
    for entry in chosen(curve):
        for part, title in (("real", "real part"), ("imag", "imaginary part")):
            value, law = (getattr(values[:, entry], part) for values in (curve.value, curve.law))
            half = SIGMAS_95 * getattr(curve, f"std_{part}")[:, entry]
            hz = curve.frequency_hz
            lines = [Line("measured, with 95 % interval", hz, value, value - half, value + half, points=True)]
            if np.isfinite(law).any():
                lines.append(Line("law of the added effect", hz, law))
            y = Column(f"{curve.entries[entry]}, {title}", curve.unit)
            panels.append(Panel(y, lines, top=reach(curve, entry, part)))
    caption = f"Dynamic stiffness, measured: {curve.place}. {_NOTE}"
    return Plot(anchor, Column("Frequency", "Hz"), panels, caption, _NOTE, height=1.7, columns=2)


def reach(curve: CurveTable, entry: int, part: str) -> tuple[float, float]:
    """Limits of an axis: what is known well, and the law."""
    value, std = getattr(curve.value[:, entry], part), curve.std_real[:, entry]
    sure = np.isfinite(value) & np.isfinite(std)
    known = sure & (std <= 3 * np.median(std[sure])) if sure.any() else sure
    shown = [value[known], getattr(curve.law[:, entry], part)]
    every = np.concatenate([one[np.isfinite(one)] for one in shown] + [np.zeros(1)])
    low, high = float(every.min()), float(every.max())
    margin = 0.1 * max(high - low, 1e-12)
    return low - margin, high + margin


def _parts(number_of: int, curve: CurveTable) -> list[Part]:
    return [
        Heading(capital(curve.effect or curve.place), 4, on=EVERYWHERE),
        Text(sentences(curve), on=EVERYWHERE),
        plot(f"stiffness-{number_of}", curve).drawing(lambda: [_numbers(curve)]),
        Tabular(_law_table(curve), on=PAGE),
    ]


def _law_table(curve: CurveTable) -> Table:
    columns = [
        words("Law", curve.laws),
        Column("Gap", "", curve.law_gap, digits(3)),
        Column("Log odds", "", curve.law_log_odds, digits(3)),
    ]
    note = "Log odds: of the first law over the second, of the others over the first (negative)."
    return Table("Simple laws through the curve", columns, note)


def _numbers(curve: CurveTable) -> Curves:
    columns = [Column("Frequency", "Hz", curve.frequency_hz)]
    shown = (
        ("real", curve.value.real),
        ("imaginary", curve.value.imag),
        ("std of real", curve.std_real),
        ("std of imaginary", curve.std_imag),
        ("law, real", curve.law.real),
        ("law, imaginary", curve.law.imag),
    )
    for n, name in enumerate(curve.entries):
        columns += [Column(f"{name} {part}", curve.unit, values[:, n]) for part, values in shown]
    return Curves(f"dynamic stiffness, {curve.place}", columns)
