"""The report of an explained motion: a section per kind of history, and what the records cannot say."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.reports.explain import tables
from identify.reports.explain.figure import histories, shares
from identify.reports.explain.pick import bars, history
from identify.reports.kit.cells import Column, Curves, Table, sentence, words
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
    "By effect: how much of the squares on the held-out record, before any effect, each took when it was"
    " added, in that order. By joint: the gap, the RMS residual over noise, before and after."
)


def report(result: ExplainResult) -> Report:
    """What is said of an explained motion."""
    sections = [_target(found) for found in result.targets.values()]
    unknown = [sentence(text) for text in result.unknown]
    treated = Table(
        "Records", (words("Record and treatment"),), tuple((text,) for text in result.conditioning)
    )
    limits: list[Part] = [
        Text("These records cannot say:", on=TERMINAL),
        Bullets([f"- {text}" for text in unknown], on=TERMINAL),
        Bullets(unknown),
        Heading("What was done to the records"),
        Bullets([sentence(text) for text in result.conditioning], on=PAGE),
        Tabular(treated, on=PRINT),
    ]
    sections.append(Section("unknown", "What these records cannot say", limits, "Cannot say"))
    return Report(tables.tiles(result), (), [*sections, *origin(result)])


def _target(found: TargetResult) -> Section:
    """What is left and how it was explained; the page shows one record and one joint at a time."""
    name, title = found.target, tables.title(found)
    picked = (("Record", f"{name}-record", ()), ("Joint", f"{name}-joint", ()))
    parts: list[Part] = [Tabular(tables.residual_table(found), on=EVERYWHERE), Pickers(picked)]
    parts.append(Drawing(f"{name}-history"))
    for curves in found.curves.values():
        figure, data = partial(histories, found, curves), partial(_curves, found, curves)
        parts.append(Drawing("", figure, f"Record {_record_name(curves)}.", data))
    if found.steps.name:
        parts.append(Heading("What each effect took away, and the gap"))
        parts.append(Drawing(f"{name}-shares", partial(shares, found), _BARS, note=_BARS))
    return Section(name, title, [*parts, *_tables(found)], data=_data(found), scripts=("explain.js",))


def _tables(found: TargetResult) -> list[Part]:
    """The effects, and folded on the page, how they were found, their values, and what was not found."""
    parts: list[Part] = []
    effects = tables.effect_table(found)
    if effects.rows:
        brief = tuple(column.heading for column in effects.columns[: 2 + len(found.joints)])
        parts.append(Tabular(effects, True, f"{found.target}-effects", terminal=brief, on=EVERYWHERE))
        read = zip(found.effects.name, found.effects.reading, strict=True)
        parts += [Text(f"{found.words(name)}: {reading}", on=TERMINAL) for name, reading in read if reading]
    if found.effects.name and found.pairs.fitted:
        parts.append(Heading("Every pair of records"))
        parts.append(Tabular(tables.pair_table(found), on=EVERYWHERE))
    for table in (tables.step_table(found), tables.value_table(found), tables.bound_table(found)):
        if table.rows:
            parts.append(Fold(table.title, [Tabular(table)]))
    return parts


def _data(found: TargetResult) -> dict[str, Any]:
    names, values = bars(found)
    target = {
        "name": found.target,
        "unit": tables.scale(found)[1],
        "joints": found.joints,
        "records": [_record(found, curves) for curves in found.curves.values()],
        "steps": list(names),
        "shares": values.T,
        "gap": [found.gap_start, found.gap],
    }
    return {"targets": [target]}


def _record_name(curves: Recorded) -> str:
    return f"{curves.name}, {_USE[curves.use]}"


def _record(found: TargetResult, curves: Recorded) -> dict[str, Any]:
    joints = [vars(history(found, curves, row)) for row in range(len(found.joints))]
    time_s = joints[0]["time_s"]
    shown = [{name: values for name, values in one.items() if name != "time_s"} for one in joints]
    return {"name": _record_name(curves), "time": time_s, "joints": shown}


def _curves(found: TargetResult, curves: Recorded) -> list[Curves]:
    """The numbers behind the histories: a set per joint."""
    unit, sets = tables.scale(found)[1], []
    columns = (Column("Time", "s"), *(Column(name, unit) for name in ("Measured", "Known", "Explained")))
    for row, joint in enumerate(found.joints):
        h = history(found, curves, row)
        title = f"{tables.title(found)}, record {curves.name}, joint {joint}"
        sets.append(Curves(title, columns, np.column_stack([h.time_s, h.measured, h.known, h.explained])))
    return sets
