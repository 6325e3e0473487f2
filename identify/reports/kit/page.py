"""The page of a report: one file that opens from disk without network; the data are embedded once, and
scripts draw them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from identify.reports.kit.cells import sentence
from identify.reports.kit.report import GAP, PAGE, Drawing, Report, drawn, speaks_of_gap, visible
from identify.results.header import Header

ASSETS = Path(__file__).parents[1] / "assets"
_EARLY, _LATE, _LAST = ("page.js", "robot.js"), ("frf.js", "motion_at_line.js"), ("mac.js",)
"""Scripts before and after the plotting library, and behind those of a kind of report: text, tables and the
robot need not wait for it.
"""


def page(result: Header, report: Report) -> str:
    """The whole page of a report."""
    sections = [(section, visible(section.parts, PAGE)) for section in report.sections]
    shown = [(section, parts) for section, parts in sections if parts]
    plots = [plot for section, _ in shown for plot in drawn(section.parts)]
    own = dict.fromkeys(script for plot in plots if isinstance(plot, Drawing) for script in plot.scripts)
    loader = jinja2.FileSystemLoader(ASSETS)
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["kind"] = lambda part: type(part).__name__
    environment.filters["visible"] = lambda parts: visible(parts, PAGE)
    data = _together([plot.page for plot in plots])
    return environment.get_template("page.html.j2").render(
        result=result,
        tiles=report.tiles,
        opening=visible(report.opening, PAGE),
        sections=shown,
        sentence=sentence,
        gap=GAP if speaks_of_gap(report) else "",
        style=asset("report.css"),
        scripts=[*map(asset, _EARLY), Markup(_plotly()), *map(asset, (*_LATE, *own, *_LAST))],
        packed=any(one.get("frf") for one in data.get("measurements", [])),
        data=Markup(json_inside(data)),
    )


def asset(name: str) -> Markup:
    """The text of a file of the page, as it is."""
    return Markup((ASSETS / name).read_text("utf-8"))


def _plotly() -> str:
    """The plotting library, read where it is installed: importing plotly takes longer than the page."""
    spec = find_spec("plotly")
    assert spec is not None and spec.origin is not None
    return (Path(spec.origin).parent / "package_data" / "plotly.min.js").read_text("utf-8")


def _together(parts: list[Mapping[str, Any]]) -> dict[str, Any]:
    """The data of all sections; lists of one name are joined in order."""
    found: dict[str, Any] = {}
    for part in parts:
        for name, value in part.items():
            found[name] = [*found[name], *value] if name in found else value
    return found


def json_inside(value: dict[str, Any]) -> str:
    """JSON that may stand inside a script element."""
    return json.dumps(_plain(value), separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _short(value: float) -> float | int:
    rounded = float(f"{value:.6g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e6 else rounded


def _plain(value: Any) -> Any:
    """Arrays as lists with six significant digits, NaN as null."""
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, float):
        return _short(value) if np.isfinite(value) else None
    return value
