"""The PDF report: the same tables as the HTML page and printed figures, set by typst, the same bytes for the
same result.
"""

from __future__ import annotations

from identify.core.text import count, listed
from identify.reports.fit import data, frf_figure, measurement_tables, pick, search_figure, tables
from identify.reports.fit.pick import modes_in_band
from identify.reports.kit import figures, robot_figure
from identify.reports.kit.document import Document
from identify.reports.kit.shapes import mode_views
from identify.results.fit import FitResult, FrfComparison

_WORST_ROWS = 10


def document(result: FitResult) -> Document:
    """The PDF of a fit, in the making."""
    made = Document()
    with figures.style():
        _opening(made, result)
        _parameters(made, result)
        _modes(made, result)
        _frfs(made, result)
        _search(made, result)
    made.sources(result)
    return made


def _opening(made: Document, result: FitResult) -> None:
    made.opening(result, tables.tiles(result))
    made.add("paragraph", f"Model: {'; '.join(result.effects)}.")
    made.table(measurement_tables.measurement_table(result))
    measurements = list(result.measurements.values())
    drawn = measurements[: robot_figure.POSTURES]
    first = "" if drawn == measurements else f" The first {len(drawn)} of {len(measurements)} postures."
    caption = f"The robot with its measurement points; {robot_figure.ARROWS}; floor grid 0.5 m.{first}"
    made.figure(
        robot_figure.postures(measurements),
        caption,
        *(data.geometry(m.name, m.geometry) for m in measurements),
    )


def _parameters(made: Document, result: FitResult) -> None:
    made.add("heading", "Parameters")
    made.table(tables.parameter_table(result))
    places = "Start and fitted values between their bounds, and the size of the 95 % intervals."
    made.figure(figures.parameters(result), places, tables.parameter_table(result))
    profiles, published = tables.profile_table(result), tables.published_table(result)
    if profiles is not None:
        made.table(profiles, heading=True)
        rise = "Profile likelihood: rise of chi-square, all other parameters fitted again; dotted: 3.84."
        made.figure(figures.profiles(result), rise, *data.profiles(result))
    if published is not None:
        made.table(published, heading=True)


def _modes(made: Document, result: FitResult) -> None:
    made.add("heading", "Modes")
    measurements = list(result.measurements.values())
    for m in measurements:
        made.table(measurement_tables.mode_table(m), heading=True)
    published = tables.published_modes_table(result)
    if published is not None:
        made.table(published, heading=True)
    matrices = [found for found in map(figures.pair_mac, measurements) if found]
    mac = figures.mac(matrices)
    if mac is not None:
        made.figure(
            mac, "Modal assurance criterion (MAC) of measured and model modes.", *map(data.mac, matrices)
        )
    first = measurements[0]
    caption = f"Modes of the model, {first.name}: at rest (grey) and at both ends of the motion, enlarged"
    caption += "; rings: measured." if first.pairs and first.pairs.measured_shapes is not None else "."
    views = mode_views(first)
    made.figure(
        robot_figure.shapes(first.geometry, views[: modes_in_band(first)]),
        caption,
        data.shapes(first.geometry, views),
    )


def _frfs(made: Document, result: FitResult) -> None:
    found = [(m, m.frf) for m in result.measurements.values() if m.frf is not None]
    if not found:
        return
    made.add("heading", "Frequency response functions")
    made.table(measurement_tables.error_table(result))
    for m, frf in found:
        made.add("subheading", f"{m.name}, {measurement_tables.use(m)}")
        overlays(made, m.name, frf)
    made.add("heading", "Where the model disagrees")
    for m, frf in found:
        made.figure(figures.gap_map(m.name, frf), f"Residual by band and FRF, {m.name}.", data.gap_map(frf))


def overlays(made: Document, name: str, frf: FrfComparison, modelled: str = "fitted") -> None:
    """Chosen FRFs of a measurement, and a table of those with the largest error; modelled names the curve
    beside the measured one.
    """
    made.figure(frf_figure.overlays(frf, modelled), _chosen(name, frf), *data.frfs(frf, modelled))
    worst = measurement_tables.frf_table(name, frf)
    made.add(
        "paragraph",
        f"The {min(_WORST_ROWS, len(worst.rows))} FRFs of {name} with the largest error, of"
        f" {len(worst.rows)}:",
    )
    made.table(worst, rows=_WORST_ROWS)


def _chosen(name: str, frf: FrfComparison) -> str:
    by = "relative error" if frf.gap is None else "gap"
    pairs = pick.shown_frfs(frf)
    drive = sum(pick.is_drive_point(frf, pair) for pair in pairs)
    parts = [count(drive, "drive point")] if drive else []
    if drive < len(pairs):
        parts.append(f"the {len(pairs) - drive} other FRFs with the largest {by}")
    coherence = "" if frf.coherence is None else " \N{GREEK SMALL LETTER GAMMA}²: coherence."
    return f"{name}: {frf.quantity}, {measurement_tables.band(frf)}; {listed(parts)}.{coherence}"


def _search(made: Document, result: FitResult) -> None:
    made.add("heading", "Convergence")
    made.figure(
        figures.convergence(result),
        "Best cost over evaluations; solid, dashed, dotted: first, second, third stage, which may have costs"
        " of their own.",
        data.history(result),
    )
    made.figure(
        search_figure.starts(result), "Free parameters before and after every start.", *data.starts(result)
    )
    made.table(tables.start_table(result))
    made.add("heading", "Identifiability")
    groups = "; ".join(result.inseparable)
    made.add(
        "paragraph",
        f"Not separable by these data: {groups}." if groups else "The data separate all free parameters.",
    )
    made.table(tables.direction_table(result))
    if len(result.correlation) > 1:
        made.figure(
            search_figure.correlation(result), "Correlation of the estimates.", data.correlation(result)
        )
