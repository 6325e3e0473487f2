"""What a run shows in the terminal: a progress bar with the best cost, and a summary of the result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.table import Table

from identify.fitting.fit import Progress
from identify.fitting.selection.workbench import Story
from identify.fitting.uncertainty import AT_LOWER, BOUNDS
from identify.measured.finding import Finding
from identify.results.discovery import DiscoveryResult, OptionTable
from identify.results.fit import FitResult, MeasurementResult
from identify.results.modes import AnalysedMeasurement, ModesResult
from identify.results.side_by_side import SideBySide
from identify.results.tables import ParameterTable

_SHOWN = 6
_MARK = {"fail": "[red]fail[/]", "warn": "[yellow]warn[/]", "info": "info"}


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """A bar over the starts of a fit with the best cost so far and the time left; nothing where quiet."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[best]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    with Bar(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as bar:
        task = bar.add_task("reading", total=None, best="")
        lowest = [np.inf]

        def show(start: int, starts: int, kind: str, evaluations: int, best: float) -> None:
            lowest[0] = min(lowest[0], best)
            text = f"best cost {lowest[0]:.4g}"
            bar.update(
                task,
                description=f"start {start + 1} of {starts}, {kind}",
                total=starts,
                completed=start,
                best=text,
            )

        yield Progress(show)


@contextmanager
def story(quiet: bool) -> Iterator[Story]:
    """The turns of a discovery as they come, and a bar over the candidates of a step; nothing where quiet."""
    console = Console(stderr=True)
    columns = (
        TextColumn("trying candidates"),
        BarColumn(),
        TextColumn("{task.completed} of {task.total}"),
        TimeElapsedColumn(),
    )
    with Bar(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as bar:
        task = bar.add_task("", total=None)

        def say(sentence: str) -> None:
            if not quiet:
                bar.console.print(sentence, highlight=False)

        yield Story(say, lambda number, total: bar.update(task, completed=number, total=total))


def print_discovery(result: DiscoveryResult) -> None:
    """The verdict, what was added with its numbers, and where each step looked."""
    console = Console()
    console.print(*result.verdict, sep="\n", highlight=False)
    for note in result.notes:
        console.print(f"[yellow]note:[/] {escape(note)}", highlight=False)
    for name in result.added.named:
        console.print(f"added: {escape(name)}", highlight=False)
    for number, step in enumerate(result.steps.values(), start=1):
        console.print(
            f"\nStep {number}. {escape(step.where)}",
            escape(step.decision),
            escape(step.advice),
            sep="\n",
            highlight=False,
        )
        console.print(_option_table(step.options))


def _option_table(options: OptionTable) -> Table:
    """The best candidates of a step."""
    table = Table("candidate", "gap", "not fitted", "log odds", "", box=SIMPLE_HEAD)
    for row in range(min(_SHOWN, len(options.sentence))):
        numbers = (options.gap[row], options.gap_validation[row])
        evidence = "" if np.isnan(options.log_odds[row]) else f"{options.log_odds[row]:.0f}"
        table.add_row(
            options.sentence[row],
            *("" if np.isnan(n) else f"{n:.2f}" for n in numbers),
            evidence,
            options.verdict[row],
        )
    return table


def print_result(result: FitResult) -> None:
    """The verdict, the parameters and the modes."""
    console = Console()
    console.print(*result.verdict, sep="\n", highlight=False)
    for note in result.notes:
        console.print(f"[yellow]note:[/] {note}", highlight=False)
    console.print(parameter_rows(f"{result.name}: parameters", result.parameters))
    for measurement in result.measurements.values():
        console.print(mode_table(measurement))


def parameter_rows(title: str, p: ParameterTable) -> Table:
    """Fitted values with their intervals."""
    tight = (0, 1, 0, 0)
    table = Table(
        "parameter",
        "value",
        "unit",
        "95 %",
        "data say",
        title=title,
        box=SIMPLE_HEAD,
        pad_edge=False,
        padding=tight,
    )
    for number, column in enumerate(table.columns):
        column.no_wrap, column.justify = True, "right" if number in (1, 3) else "left"
    for row, name in enumerate(p.name):
        table.add_row(name, f"{p.value[row]:.4g}", p.unit[row], _interval(p, row), p.status[row])
    return table


def _interval(p: ParameterTable, row: int) -> str:
    """Half the 95 % interval in per cent of the value where it is narrow, its ends where it is wide; its one
    end at a bound.
    """
    if not p.free[row]:
        return ""
    if p.status[row] in BOUNDS:
        low = p.status[row] == AT_LOWER
        return f"at most {p.high_95[row]:.3g}" if low else f"at least {p.low_95[row]:.3g}"
    half = (p.high_95[row] - p.low_95[row]) / 2 / abs(p.value[row]) if p.value[row] else np.inf
    return f"± {100 * half:.2g} %" if half < 0.5 else f"{p.low_95[row]:.2g} to {p.high_95[row]:.2g}"


def mode_table(measurement: MeasurementResult) -> Table:
    """Modes of the model at one posture, beside the measured ones where there are any."""
    use = "" if measurement.use == "fit" else ", not fitted"
    gap = "" if np.isnan(measurement.gap) else f", gap {measurement.gap:.2f}"
    table = Table(
        "mode",
        "Hz",
        "damping %",
        "measured Hz",
        "measured %",
        "MAC",
        title=f"{measurement.name}{use}{gap}",
        box=SIMPLE_HEAD,
    )
    pairs = measurement.pairs
    measured = (
        {}
        if pairs is None
        else dict(
            zip(pairs.model.tolist(), zip(pairs.measured.tolist(), pairs.mac, strict=True), strict=True)
        )
    )
    for row, (frequency, damping) in enumerate(
        zip(measurement.modes.frequency_hz, measurement.modes.damping_ratio, strict=True)
    ):
        beside = ["", "", ""]
        if pairs is not None and row in measured:
            mode, mac = measured[row]
            ratio = pairs.measured_damping_ratio[mode]
            beside = [
                f"{pairs.measured_frequency_hz[mode]:.3f}",
                f"{100 * ratio:.2f}",
                "" if np.isnan(mac) else f"{mac:.3f}",
            ]
        table.add_row(str(row + 1), f"{frequency:.3f}", f"{100 * damping:.2f}", *beside)
    return table


def print_modes(result: ModesResult) -> None:
    """The verdict and the modes of a modal analysis."""
    console = Console()
    console.print(*result.verdict, sep="\n", highlight=False)
    for note in result.notes:
        console.print(f"[yellow]note:[/] {escape(note)}", highlight=False)
    for measurement in result.measurements.values():
        if len(measurement.modes.frequency_hz):
            console.print(analysed_table(measurement))


def analysed_table(measurement: AnalysedMeasurement) -> Table:
    """Modes with their standard deviations and the quality of their shapes."""
    table = Table(
        "mode",
        "Hz",
        "±",
        "damping %",
        "±",
        "with window %",
        "MPC",
        "MPD °",
        title=f"{measurement.name}: modes",
    )
    m = measurement.modes
    for row in range(len(m.frequency_hz)):
        frequency, damping = f"{m.frequency_hz[row]:.3f}", f"{100 * m.damping_ratio[row]:.3f}"
        spread = f"{m.frequency_std_hz[row]:.2g}", f"{100 * m.damping_std[row]:.2g}"
        quality = f"{100 * m.seen_damping_ratio[row]:.3f}", f"{m.mpc[row]:.3f}", f"{m.mpd_deg[row]:.1f}"
        table.add_row(str(row + 1), frequency, spread[0], damping, spread[1], *quality)
    return table


def print_comparison(tables: Sequence[SideBySide]) -> None:
    """The tables of `identify compare`."""
    console = Console()
    for side_by_side in tables:
        table = Table(*side_by_side.columns, title=side_by_side.title, box=SIMPLE_HEAD)
        for row in side_by_side.rows:
            table.add_row(*row)
        console.print(table)


def print_findings(findings: Mapping[str, Sequence[Finding]]) -> None:
    """One line per finding of the checks."""
    console = Console()
    for name, found in findings.items():
        for finding in found:
            console.print(f"{name}: {_MARK[finding.level]} {finding.sentence}", highlight=False)
        failed = sum(finding.level == "fail" for finding in found)
        console.print(f"{name}: {'no check failed' if not failed else f'{failed} failed'}", highlight=False)
