"""The report of an explained motion: a section per kind of history, and what the records cannot say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.reports.explain import tables
from identify.reports.explain.tables import scale
from identify.reports.kit import plotting as mpl
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column, Curves, Table, sentence, several, words
from identify.reports.kit.figures import GRID, INK, PALETTE, WIDTH_IN
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    PRINT,
    TERMINAL,
    Bullets,
    Drawing,
    Fold,
    Heading,
    Part,
    Parts,
    Pickers,
    Report,
    Section,
    Tabular,
    Text,
    origin,
)
from identify.results.explain import Curves as Recorded
from identify.results.explain import ExplainResult, TargetResult

_USE = {"fit": "fitted", "validate": "held out", "test": "only reported"}
_BARS = (
    "By effect: share of the squares on the held-out record, before any effect, that each explained when it"
    " was added, in that order. By joint: the gap, the RMS residual over noise, before and after."
)


def report(result: ExplainResult) -> Report:
    """What is said of an explained motion."""
    targets = [
        Section(one.target, tables.title(one), [*_target(one), *_tables(one)])
        for one in result.targets.values()
    ]
    unknown = Section("unknown", "What these records do not determine", _unknown(result), "Cannot say")
    return Report(tables.tiles(result), (), [*targets, unknown, *origin(result)])


def _unknown(result: ExplainResult) -> Parts:
    unknown = [sentence(text) for text in result.unknown]
    return [
        Text("These records cannot say:", on=TERMINAL),
        Bullets([f"- {text}" for text in unknown], on=TERMINAL),
        Bullets(unknown),
        Heading("What was done to the records"),
        Bullets([sentence(text) for text in result.conditioning], on=PAGE),
        Tabular(Table("Records", [words("Record and treatment", result.conditioning)]), on=PRINT),
    ]


def _target(found: TargetResult) -> Iterator[Part]:
    """What is left and how it was explained; the page shows one record and one joint at a time."""
    name = found.target
    yield Tabular(tables.residual_table(found), on=EVERYWHERE)
    yield Pickers((("Record", f"{name}-record", ()), ("Joint", f"{name}-joint", ())))
    yield Drawing(f"{name}-history", page={"targets": [_data(found)]}, scripts=("explain.js",))
    for curves in found.curves.values():
        plot = histories(found, curves, f"Record {_record_name(curves)}.")
        yield plot.printed(partial(_curves, found, curves))
    if found.steps.name:
        yield Heading("What each effect explains, and the gap")
        yield Drawing(f"{name}-shares", partial(shares, found), _BARS, partial(_shares, found), _BARS)


def _tables(found: TargetResult) -> Iterator[Part]:
    """The effects, and folded on the page, how they were found, their values, and what was not found."""
    effects = tables.effect_table(found)
    if effects.rows:
        brief = tuple(column.heading for column in effects.columns[: 2 + len(found.joints)])
        yield Tabular(effects, True, f"{found.target}-effects", terminal=brief, on=EVERYWHERE)
        for name, reading in zip(found.effects.name, found.effects.reading, strict=True):
            if reading:
                yield Text(f"{found.words(name)}: {reading}", on=TERMINAL)
    if found.effects.name and found.pairs.fitted:
        yield Heading("Every pair of records")
        yield Tabular(tables.pair_table(found), on=EVERYWHERE)
    for table in (tables.step_table(found), tables.value_table(found), tables.bound_table(found)):
        if table.rows:
            yield Fold(table.title, [Tabular(table)])


def _data(found: TargetResult) -> dict[str, Any]:
    names, values = bars(found)
    return {
        "name": found.target,
        "unit": tables.scale(found)[1],
        "joints": found.joints,
        "records": [_record(found, curves) for curves in found.curves.values()],
        "steps": list(names),
        "shares": values.T,
        "gap": [found.gap_start, found.gap],
    }


def _shares(found: TargetResult) -> list[Table]:
    """The numbers behind the bars: by effect, and by joint."""
    names, values = bars(found)
    joints = [f"Joint {joint}" for joint in found.joints]
    gaps = Column("Gap before", "", found.gap_start), Column("Gap after", "", found.gap)
    effects = [words("Effect", names), *several(joints, "% of the squares at first", values)]
    return [Table("effects", effects), Table("gap", [words("Joint", found.joints), *gaps])]


def _record_name(curves: Recorded) -> str:
    return f"{curves.name}, {_USE[curves.use]}"


def _joints(found: TargetResult, curves: Recorded) -> list[History]:
    return [history(found, curves, row) for row in range(len(found.joints))]


def _record(found: TargetResult, curves: Recorded) -> dict[str, Any]:
    shown = [
        {name: values for name, values in vars(one).items() if name != "time_s"}
        for one in _joints(found, curves)
    ]
    return {"name": _record_name(curves), "time": curves.time_s, "joints": shown}


def _curves(found: TargetResult, curves: Recorded) -> list[Curves]:
    """The numbers behind the histories: a set per joint."""
    of, sets = tables.scale(found)[1], []
    for joint, h in zip(found.joints, _joints(found, curves), strict=True):
        named = (("Measured", h.measured), ("Known", h.known), ("Explained", h.explained))
        columns = [Column("Time", "s", h.time_s), *(Column(name, of, values) for name, values in named)]
        sets.append(Curves(f"{tables.title(found)}, record {curves.name}, joint {joint}", columns))
    return sets


@dataclass(frozen=True)
class History:
    """One joint of one record in the shown unit, (samples,): measured, known, explained; left before and
    after, NaN where not counted.
    """

    time_s: Array
    measured: Array
    known: Array
    explained: Array
    before: Array
    after: Array


def history(found: TargetResult, curves: Recorded, row: int) -> History:
    """The curves of the joint in that row."""
    factor, _ = scale(found)
    measured, known, explained = (
        factor * getattr(curves, name)[:, row] for name in ("measured", "known", "explained")
    )
    used = curves.used[:, row]
    before, after = (np.where(used, measured - model, np.nan) for model in (known, explained))
    return History(curves.time_s, measured, known, explained, before, after)


def bars(found: TargetResult) -> tuple[tuple[str, ...], Array]:
    """Names of effects and how much each step took of the squares there were at first, % of all (steps,
    joints); found order.
    """
    squares = np.vstack([found.rms_judge_start, found.steps.rms_judge]) ** 2
    return found.steps.name, -100 * np.diff(squares, axis=0) / squares[0]


def histories(found: TargetResult, curves: Recorded, caption: str) -> Plot:
    """Left the history of every joint, right what is left of it."""
    of, panels = scale(found)[1], []
    for row, joint in enumerate(found.joints):
        h = history(found, curves, row)
        lines = [
            Line("measured", h.time_s, h.measured, look="noisy"),
            Line("from what is known", h.time_s, h.known),
            Line("with the effects found", h.time_s, h.explained),
        ]
        left = [Line("left before", h.time_s, h.before), Line("left after", h.time_s, h.after)]
        panels += [Panel(Column(f"Joint {joint}", of), lines), Panel(Column("What is left", of), left)]
    return Plot("", Column("Time", "s"), panels, caption, height=1.35, columns=2)


def shares(found: TargetResult) -> mpl.Figure:
    """A bar per step and joint: how much of the squares there were at first each effect took when it was
    added.
    """
    names, values = bars(found)
    figure = mpl.Figure((WIDTH_IN, 0.9 + 0.17 * max(len(names), 3)), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 1))
    rows = np.arange(len(names), dtype=float)
    height = 0.8 / len(found.joints)
    for column, joint in enumerate(found.joints):
        at = rows + (column - (len(found.joints) - 1) / 2) * height
        left.barh(at, values[:, column], height, color=PALETTE[column], label=f"joint {joint}")
    left.set(
        yticks=rows, yticklabels=names, ylim=(len(names) - 0.5, -0.5), xlabel="Of the squares at first (%)"
    )
    left.legend(loc="lower right")
    place = np.arange(len(found.joints), dtype=float)
    right.barh(place - 0.2, found.gap_start, 0.38, color=GRID, label="before")
    right.barh(place + 0.2, found.gap, 0.38, color=INK, label="after")
    right.set(
        xscale="log",
        yticks=place,
        yticklabels=[f"joint {joint}" for joint in found.joints],
        xlabel="Gap (1 is noise)",
    )
    right.set_ylim(len(found.joints) - 0.5, -0.5)
    right.legend(loc="best")
    return figure
