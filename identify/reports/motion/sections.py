"""The report of a motion: the records, their histories, circular tests (drawn as Kobe's Fig. 16: radial
errors enlarged about the mean circle, recorded and simulated), errors and fitted parameters.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from identify.reports.kit import plotting as mpl
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column, Curves, Table
from identify.reports.kit.figures import BLUE, GRID, MUTED, ORANGE, WIDTH_IN
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    Drawing,
    Heading,
    Part,
    Parts,
    Pickers,
    Report,
    Section,
    Tabular,
    Text,
    given,
    origin,
)
from identify.reports.motion import tables
from identify.reports.motion.closed_loop import extremes_table, frf_plots
from identify.reports.motion.pick import RECORDED, moving, panels
from identify.reports.shared.parameters import PARAMETERS_TERMINAL, parameter_table
from identify.results.circular import CircularTest
from identify.results.motion import MotionResult, RecordResult

_PICKERS = (("Record", "motion-record", ()), ("Joint", "motion-joint", ()))
_LOOKS: dict[str, dict[str, Any]] = {
    "feedback": {"color": BLUE, "lw": 1.1, "label": "feedback position"},
    "end": {"color": ORANGE, "lw": 1.1, "ls": "--", "dashes": (4, 1.2), "label": "mechanical end"},
}
_SHARE = 0.4
"""Of the radius, that the largest error is drawn as, before the factor is made round."""


def report(result: MotionResult) -> Report:
    """What is said of a motion."""
    opening: Parts = [
        Text(f"Model: {'; '.join(result.effects)}.", "effects"),
        Tabular(tables.record_table(result)),
        given(tables.trial_table(result), on=EVERYWHERE),
    ]
    sections = [
        Section("motion", "Motion", list(_motion(result))),
        Section("circles", "Circular tests", list(_circles(result))),
        Section("closed-loop", "FRFs in the closed loop", list(_frfs(result)), "Closed loop"),
        Section("errors", "Errors", [*_sorted(tables.rms_tables(result), "rms"), *_tracking(result)]),
    ]
    if result.parameters is not None:
        fitted = parameter_table(result.parameters)
        shown = Tabular(fitted, sort="parameters", terminal=PARAMETERS_TERMINAL, on=EVERYWHERE)
        sections.append(Section("parameters", "Parameters", [shown]))
    return Report(tables.tiles(result), opening, [*sections, *origin(result)])


def _sorted(found: list[Table], name: str) -> list[Tabular]:
    return [Tabular(one, heading=True, sort=f"{name}-{k}", on=EVERYWHERE) for k, one in enumerate(found)]


def _tracking(result: MotionResult) -> Iterator[Part]:
    table = tables.tracking_table(result)
    if table is not None:
        yield from _sorted([table], "tracking")


def _frfs(result: MotionResult) -> Iterator[Part]:
    if result.frfs:
        yield Tabular(extremes_table(result.frfs), sort="closed-loop", on=EVERYWHERE)
        for name, plot in zip(result.frfs, frf_plots(result.frfs, result.joints), strict=True):
            yield Heading(name, on=PAGE)
            yield plot.drawing()


def _circles(result: MotionResult) -> Iterator[Part]:
    yield from _sorted(tables.circle_tables(result), "circle")
    yield from _sorted(tables.glitch_tables(result), "glitch")
    for record in result.records.values():
        if record.circles is not None:
            caption = f"{record.name}: radial errors enlarged about the mean circle."
            yield Drawing("", partial(circles, record.circles), caption, partial(_radial, record.circles))


def _motion(result: MotionResult) -> Iterator[Part]:
    """The page shows one record and one joint at a time, the PDF the joint that turns farthest."""
    records = list(result.records.values())
    page = {"joints": list(result.joints), "records": [_record(one) for one in records]}
    yield Pickers(_PICKERS)
    yield Drawing("motion-plot", page=page, scripts=("motion.js",))
    for record in records:
        joint = moving(record)
        plot = Plot(
            "",
            Column("Time", "s"),
            _panels(record, joint),
            f"{_name(record)}: {result.joints[joint]}.",
            height=0.95,
        )
        yield plot.printed()


def _panels(record: RecordResult, joint: int) -> list[Panel]:
    """Position, how far it is off, velocity, and current or torque of one joint."""
    return [
        Panel(
            Column(panel.label, panel.unit),
            [
                Line(one.name, one.time, one.values[:, joint], look="noisy" if one.name == RECORDED else "")
                for one in panel.curves
            ],
        )
        for panel in panels(record)
    ]


def _name(record: RecordResult) -> str:
    return record.name + (", not fitted" if record.use == "validate" else "")


def _record(record: RecordResult) -> dict[str, Any]:
    shown = [
        {
            "label": panel.label,
            "unit": panel.unit,
            "curves": [{"name": one.name, "time": one.time, "values": one.values.T} for one in panel.curves],
        }
        for panel in panels(record)
    ]
    return {"name": _name(record), "moving": moving(record), "panels": shown}


def _radial(tests: dict[str, CircularTest]) -> list[Curves]:
    return [
        Curves(
            f"Circular test, {name}",
            [Column("Angle", "°", np.degrees(test.angle)), Column("Radial error", "µm", 1e6 * test.error)],
        )
        for name, test in tests.items()
    ]


def circles(tests: dict[str, CircularTest], axes: tuple[str, str] = ("X", "Y")) -> mpl.Figure:
    """A panel of what was recorded, where it was, and one of what was simulated, on the same enlarged
    scale.
    """
    panels = (
        [("recorded", "recorded "), ("simulated", "")]
        if any(name.startswith("recorded") for name in tests)
        else [("simulated", "")]
    )
    worst = max(float(np.abs(test.error).max()) for name, test in tests.items() if name != "command")
    radius = tests["command"].radius
    factor = _round(_SHARE * radius / max(worst, 1e-9))
    figure = mpl.Figure((WIDTH_IN if len(panels) == 2 else 0.55 * WIDTH_IN, 4.0), layout="constrained")
    for place, (title, prefix) in zip(np.atleast_1d(figure.subplots(1, len(panels))), panels, strict=True):
        _panel(
            place, {name: tests[prefix + name] for name in _LOOKS if prefix + name in tests}, radius, factor
        )
        place.set(title=title, xlabel=f"{axes[0]} (mm)", ylabel=f"{axes[1]} (mm)")
    figure.legend(*place.get_legend_handles_labels(), loc="outside upper left", ncols=3)
    return figure


def _round(value: float) -> float:
    """The next smaller of 1, 2, 5, 10, 20, ..."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value))


def _panel(axes: mpl.Axes, tests: dict[str, CircularTest], radius: float, factor: float) -> None:
    angle = np.linspace(0, 2 * np.pi, 361)
    division = radius * 0.2
    for ring in (-1, 0, 1):
        color, width = (MUTED, 0.9) if ring == 0 else (GRID, 0.7)
        label = f"mean circle; rings {1e6 * division / factor:.0f} µm apart" if ring == 0 else None
        axes.plot(
            *(1e3 * (radius + ring * division) * np.array([np.cos(angle), np.sin(angle)])),
            label=label,
            color=color,
            lw=width,
        )
    for name, test in tests.items():
        x, y = (
            1e3
            * (
                test.enlarged(factor)
                + (radius - test.radius) * np.column_stack([np.cos(test.angle), np.sin(test.angle)])
            ).T
        )
        axes.plot(x, y, **_LOOKS[name])
    reach = 1e3 * radius * (1.05 + _SHARE)
    axes.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach))
    axes.text(0, 0, f"radial error\nenlarged {factor:g} times", ha="center", va="center", color=MUTED)
