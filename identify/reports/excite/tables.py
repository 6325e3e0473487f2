"""The tables of an exciting motion, as finished text; terminal, HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit.cells import Column, Table, number, unit, words
from identify.results.excite import ExciteResult


def tiles(result: ExciteResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first."""
    kept = result.promised.kept[result.promised.wanted == 1]
    return (
        ("Motion", f"{number(result.period_s, 3)} s", f"a period, run {result.periods} times"),
        (
            "Against random motion",
            f"{number(result.random_ratio, 3)} times",
            "narrower intervals, at the median",
        ),
        (
            "In the rehearsal",
            f"{number(result.come_true, 3)}",
            f"of the promised intervals is how far values scatter, median; {result.draws} runs",
        ),
        (
            "The promise holds",
            f"{number(100 * float(np.mean(kept)), 3)} %",
            "of rehearsed values; 95 % were promised",
        ),
    )


def limit_table(result: ExciteResult) -> Table:
    """What each joint does, and what it may."""
    low, high, speed, acceleration, moves = result.limits
    rows = []
    for n, joint in enumerate(result.joints):
        rows.append(
            (
                joint if moves[n] else f"{joint} (stands)",
                _range(result.position[:, n]),
                _range(np.array([low[n], high[n]])),
                number(np.degrees(np.abs(result.velocity[:, n]).max()), 3),
                number(np.degrees(speed[n]), 3),
                number(np.degrees(np.abs(result.acceleration[:, n]).max()), 3),
                number(np.degrees(acceleration[n]), 3),
            )
        )
    heads = (
        words("Joint"),
        Column("Angle", "°"),
        Column("Limits", "°"),
        Column("Speed", "°/s"),
        Column("Most speed", "°/s"),
        Column("Acceleration", "°/s²"),
        Column("Most acceleration", "°/s²"),
    )
    note = "The motion begins and ends at rest; speeds and accelerations are largest values."
    if np.isfinite(result.room_m):
        note += f" Points stay {number(1e3 * result.room_m, 3)} mm or more inside their workspace."
    return Table("Limits", heads, tuple(rows), note)


def promised_table(result: ExciteResult) -> Table:
    """What each parameter's interval will be, would be after motion at random, and was in the rehearsal."""
    p = result.promised
    rows = [
        (
            p.name[n] + ("" if p.wanted[n] else " *"),
            number(p.expected[n]),
            unit(p.unit[n]),
            number(p.promised[n]),
            number(p.random[n]),
            number(p.scatter[n]),
            number(p.error[n], 2),
            number(100 * p.held[n], 3),
            number(100 * p.kept[n], 3),
        )
        for n in range(len(p.name))
    ]
    heads = (
        words("Parameter"),
        Column("Expected"),
        words("Unit"),
        Column("± promised"),
        Column("± random"),
        Column("± rehearsed"),
        Column("Mean error"),
        Column("Own interval holds", "%"),
        Column("Promised one holds", "%"),
    )
    note = (
        "Half the 95 % interval. Random: the median of 40 motions within the same limits. Rehearsed: 1.96"
        f" standard deviations over {result.draws} simulated runs."
    )
    if not p.wanted.all():
        note += " * found along, not what the motion was chosen for."
    return Table("Promised intervals", heads, tuple(rows), note)


def series_table(result: ExciteResult) -> Table:
    """The coefficients, from which the motion can be made at any rate."""
    rows = [("centre", *(number(value, 7) for value in np.degrees(result.centre)))]
    for kind, values in (("sine", result.sine), ("cosine", result.cosine)):
        rows += [
            (f"{kind} {k}", *(number(value, 7) for value in np.degrees(row)))
            for k, row in enumerate(values, 1)
        ]
    heads = (words("Term"), *(Column(joint, "°") for joint in result.joints))
    note = f"Angle = centre + sum of terms; term k turns k times in {number(result.period_s, 6)} s."
    return Table("Fourier series", heads, tuple(rows), note)


def _range(values: Array) -> str:
    low, high = np.degrees([values.min(), values.max()])
    return f"{number(low, 4)} to {number(high, 4)}"
