"""What holds for every kind of report: it opens in a browser, prints, exports, and says the same numbers as
its result file everywhere.
"""

from __future__ import annotations

import csv
import json
import re
import time
from collections.abc import Iterator
from html import escape, unescape
from pathlib import Path
from xml.etree import ElementTree

import h5py
import matplotlib.image
import numpy as np
import pytest

from identify.core.analyses import OF_KIND
from identify.reports.kit.cells import NONE, Number, Table
from tests.reports.browser import Page, browser
from tests.reports.kinds import CASES, Made, make
from tests.reports.pdf_text import poppler
from tests.reports.test_write import Tables

_AXES_UNTOLD = """[...document.querySelectorAll('.plot')].flatMap(p => Object.entries(p._fullLayout)
    .filter(([key, axis]) => /^[xy]axis/.test(key) && axis.visible && axis.type !== 'category'
            && !(axis.tickvals && axis.tickmode === 'array' && axis.ticktext) && !(axis.matches)
            && !/\\(.+\\)|=/.test(axis.title.text || ''))
    .map(([key, axis]) => `${p.id} ${key}: ${axis.title.text}`))"""
"""Axes that do not say what they show, with its unit."""
_BACKGROUND = "getComputedStyle(document.body).backgroundColor"
_INK = "[...document.querySelectorAll('.plot')].map(plot => plot._fullLayout.font.color)"


@pytest.fixture(scope="module", params=CASES, ids=lambda case: case.name)
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    return make(request.param, tmp_path_factory.mktemp(request.param.name))


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with browser() as opened:
        yield opened


def test_every_kind_has_a_case() -> None:
    assert {case.kind for case in CASES} == set(OF_KIND)


@pytest.fixture
def opened(page: Page, made: Made) -> Page:
    """The page of that result, as other tests may have left it."""
    if page.at != made.page:
        page.open(made.page)
    return page


def test_everything_is_drawn_in_silence_by_day_and_by_night(page: Page, made: Made) -> None:
    page.console.clear()
    page.requests.clear()
    page.open(made.page)
    page.run("drawAll()")
    page.wait("[...document.querySelectorAll('.plot')].every(plot => plot.querySelector('.main-svg'))")
    drawn = ".scatterlayer .trace, .barlayer .trace, .heatmaplayer image"
    empty = page.run(
        f"[...document.querySelectorAll('.plot')].filter(p => !p.querySelector('{drawn}')).map(p => p.id)"
    )
    assert empty == []
    assert page.run("document.querySelectorAll('.plot').length") >= 1
    assert page.run("document.documentElement.scrollWidth <= innerWidth"), "nothing sticks out"
    assert page.run(_AXES_UNTOLD) == []
    assert page.run(_BACKGROUND) == "rgb(255, 255, 255)"
    ink = page.run(_INK)
    page.theme(dark=True)
    page.wait(f"{_BACKGROUND} === 'rgb(20, 24, 29)'")
    page.wait(f"{_INK}.every(color => !{json.dumps(ink)}.includes(color))")
    page.theme(dark=False)
    page.wait(f"{_BACKGROUND} === 'rgb(255, 255, 255)'")
    assert page.console == []
    assert all(address.startswith(("file:", "data:", "blob:")) for address in page.requests), page.requests


def test_the_channel_picker_changes_the_plot(opened: Page, made: Made) -> None:
    assert opened.run("Boolean($('frf-plot'))") == made.case.frfs
    if not made.case.frfs:
        return
    opened.run("drawAll()")
    opened.wait("$('frf-plot').data !== undefined")
    before, curve = (
        opened.run("$('frf-title').textContent"),
        opened.run("JSON.stringify(Array.from($('frf-plot').data.at(-1).y))"),
    )
    opened.run(
        "{ const e = $('frf-output'); e.selectedIndex = (e.selectedIndex + 1) % e.options.length;"
        " e.dispatchEvent(new Event('change')); }"
    )
    opened.wait(f"$('frf-title').textContent !== {before!r}")
    opened.wait(f"JSON.stringify(Array.from($('frf-plot').data.at(-1).y)) !== {curve!r}")
    assert opened.console == []


def test_the_shapes_move_until_they_are_told_not_to(opened: Page, made: Made) -> None:
    canvases = opened.run("[...document.querySelectorAll('canvas')].map(canvas => canvas.id)")
    assert bool(canvases) == made.case.shapes
    if not made.case.shapes:
        return
    for canvas in canvases:
        first = opened.run(f"$('{canvas}').toDataURL()")
        opened.wait(f"$('{canvas}').toDataURL() !== {first!r}")
    opened.run("$('robot-play').click()")
    still = opened.run(f"$('{canvases[0]}').toDataURL()")
    time.sleep(0.2)
    assert opened.run(f"$('{canvases[0]}').toDataURL()") == still


def test_directions_are_drawn(opened: Page, made: Made) -> None:
    if not (made.case.frfs and made.case.shapes):
        return
    opened.run("$('robot-play').textContent === 'Pause' && $('robot-play').click()")
    canvas = opened.run("document.querySelector('canvas').id")
    with_arrows = opened.run(f"$('{canvas}').toDataURL()")
    opened.run("$('robot-arrows').click()")
    assert opened.run(f"$('{canvas}').toDataURL()") != with_arrows


def test_the_pdf_has_numbered_pages_with_something_on_each(made: Made, tmp_path: Path) -> None:
    pages = int(re.search(r"Pages:\s+(\d+)", poppler("pdfinfo", str(made.printed)))[1])  # type: ignore[index]
    text = "\n".join(made.text)
    assert re.findall(rf"(\d+) ?/ ?{pages}$", text, re.MULTILINE) == [
        str(number) for number in range(1, pages + 1)
    ]
    poppler("pdftoppm", "-r", "30", "-png", str(made.printed), str(tmp_path / "page"))
    pictures = sorted(tmp_path.glob("*.png"))
    assert len(pictures) == pages
    for picture in pictures:
        grey = matplotlib.image.imread(picture)[..., :3].mean(axis=2)
        assert (grey > 0.97).mean() > 0.3, f"{picture.name} is dark"
        assert (grey < 0.8).mean() > 0.003, f"{picture.name} is empty"


def test_page_and_pdf_say_what_the_result_says(made: Made) -> None:
    printed = re.sub(r"\s+", " ", " ".join(made.text))
    html = unescape(re.sub(r"\s+", " ", made.page.read_text("utf-8").partition("<script")[0]))
    for said in (
        *made.result.verdict,
        *(note[1:] for note in made.result.notes),
        *made.result.provenance.packages,
    ):
        assert said in printed
        assert said in html


def test_the_page_prints_every_table(made: Made) -> None:
    """As a row of a table, or, of one column, as a text (which may begin with a capital)."""
    page = made.page.read_text("utf-8").partition("<script")[0]
    rows = {tuple(row) for row in Tables(page).rows}
    for table in made.document.tables:
        missing = [row for row in table.rows if tuple(map(str, row)) not in rows]
        assert not [row for row in missing if len(row) > 1 or escape(row[0][1:]) not in page], table.title


def test_the_pdf_prints_the_same_numbers(made: Made) -> None:
    printed = [re.sub(r"\s+", " ", line).strip() for line in made.text]
    for block in (block for block in made.document.blocks if block["kind"] == "table"):
        for row in block["rows"]:
            numbers = [
                str(cell) for cell, column in zip(row, block["columns"], strict=True) if column["numeric"]
            ]
            assert (
                not numbers
                or any(_in_order(numbers, line.split(" ")) for line in printed)
                or _wrapped(numbers, printed)
            ), row


def _in_order(cells: list[str], words: list[str]) -> bool:
    rest = iter(words)
    return all(cell in rest for cell in cells)


def _wrapped(cells: list[str], printed: list[str]) -> bool:
    """Whether the cells stand, in order of the line they begin on, in a row of up to three lines, some broken
    at a hyphen.
    """
    return any(
        all(cell.replace(" ", "") in "".join(printed[i : i + 3]).replace(" ", "") for cell in cells)
        for i in range(len(printed))
    )


def test_numbers_are_those_of_the_file(made: Made) -> None:
    with h5py.File(made.files[0]) as file:
        for title, heading, dataset, factor in made.case.kept:
            name, _, number = dataset.partition(":")
            stored = factor * file[name][()]
            if number:
                stored = stored[~np.isnan(stored[:, int(number)]), int(number)]
            table = _table(made, title)
            column = [c.heading for c in table.columns].index(heading)
            cells = [row[column] for row in table.rows][: len(stored)]
            assert len(cells) == len(stored)
            for cell, value in zip(cells, stored, strict=True):
                assert isinstance(cell, Number)
                assert cell.value == pytest.approx(value, rel=1e-12, nan_ok=True)
                assert (
                    str(cell) == NONE
                    if np.isnan(value)
                    else float(cell) == pytest.approx(value, rel=5.001e-4)
                )


def _table(made: Made, title: str) -> Table:
    return next(table for table in made.document.tables if table.title.startswith(title))


def test_every_figure_is_exported_as_picture_and_drawing_with_its_data(made: Made) -> None:
    names = sorted(file.name for file in made.exported.iterdir())
    drawings = [name for name in names if name.endswith(".svg")]
    assert len(drawings) == len(made.document.drawn) >= 1
    for drawing in drawings:
        stem = drawing.removesuffix(".svg")
        assert ElementTree.parse(made.exported / drawing).getroot().tag.endswith("svg")
        picture = matplotlib.image.imread(made.exported / f"{stem}.png")
        assert picture.shape[1] > 300 and picture[..., :3].std() > 0.01
        assert any(name.startswith(stem) and name.endswith(".csv") for name in names), (
            f"{drawing} without data"
        )


def test_every_csv_is_a_table_with_units(made: Made) -> None:
    for path in made.exported.glob("*.csv"):
        read = list(
            csv.reader(line for line in path.read_text("utf-8").splitlines() if not line.startswith("#"))
        )
        assert len({len(row) for row in read}) == 1, path.name
        assert all(read[0]), f"{path.name}: a column without a heading"
    units = {"Hz", "s", "%", "µm"}
    heads = " ".join(path.read_text("utf-8").splitlines()[0] for path in made.exported.glob("table*.csv"))
    if made.case.kind == "joints":  # its values have each their own
        assert "Unit" in heads
    else:
        assert any(f"({unit})" in heads for unit in units)


def test_exported_tables_are_not_rounded(made: Made) -> None:
    exported = sorted(made.exported.glob("table*.csv"))
    assert len(exported) == len(made.document.tables)
    for path, table in zip(exported, made.document.tables, strict=True):
        head, *rows = csv.reader(path.read_text("utf-8").splitlines())
        assert head == [column.head for column in table.columns]
        for row, cells in zip(rows, table.rows, strict=True):
            for text, cell in zip(row, cells, strict=True):
                if not isinstance(cell, Number):
                    assert text == cell
                elif np.isnan(cell.value):
                    assert text == ""
                else:
                    assert float(text) == cell.value
