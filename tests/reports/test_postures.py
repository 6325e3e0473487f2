"""Reports of batches and maps: the same numbers in page, document and file, and the pictures in a browser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from identify.reports.batch import tables as batch_tables
from identify.reports.kit.cells import NONE, Table
from identify.reports.map import tables as map_tables
from identify.reports.shared.posture_pick import batch_postures
from identify.reports.write import write_reports
from identify.results import file as result_file
from identify.results.batch import BatchResult, DependenceTable, JobTable, ModesByPosture, ParametersByPosture
from identify.results.map import MapResult, PostureRows
from tests.reports.browser import Page, browser
from tests.reports.pdf_text import lines
from tests.reports.sample import frf_result
from tests.reports.test_write import Tables

COUNT, FAILED = 24, 5


def batch_result() -> BatchResult:
    """Made-up numbers: a parameter that rises with joint 2, one that is not usable twice, one failed fit."""
    rng = np.random.default_rng(11)
    q = rng.uniform(-60, 60, (COUNT, 3))
    value = np.stack([2.0e5 * (1 + 0.002 * q[:, 1]), np.full(COUNT, 35.0)], axis=1) * (
        1 + 0.004 * rng.normal(size=(COUNT, 2))
    )
    usable = np.ones((COUNT, 2), dtype=bool)
    usable[:2, 1] = False
    for array in (value, q):
        array[FAILED] = np.nan
    state = tuple("failed" if n == FAILED else "done" for n in range(COUNT))
    gap = np.where(np.isnan(value[:, 0]), np.nan, 1 + 0.05 * rng.random(COUNT))
    hz = np.stack([12 + 0.05 * q[:, 1], 31 + 0.02 * q[:, 0]], axis=1)
    jobs = JobTable(
        name=tuple(f"p{n:02d}" for n in range(COUNT)),
        state=state,
        error=tuple("p05.csv: 3 < 4 & cannot be read" if s == "failed" else "" for s in state),
        file=tuple(f"made_up/p{n:02d}.h5" for n in range(COUNT)),
        attempts=np.array([2 if s == "failed" else 1 for s in state]),
        seconds=rng.uniform(0.4, 0.7, COUNT),
        converged=np.array([s == "done" for s in state]),
        gap=gap,
        cost=gap**2,
        relative_error=0.02 * gap,
        posture_deg=q,
        tool_m=np.stack(
            [np.cos(np.deg2rad(q[:, 0])), np.sin(np.deg2rad(q[:, 0])), 0.8 + 0.005 * q[:, 1]], axis=1
        ),
    )
    names, log = ("joint2.rz.stiffness", "joint2.rz.damping"), np.array([True, True])
    std = np.full((COUNT, 2), 0.004)
    parameters = ParametersByPosture(
        names,
        ("N m/rad", "N m s/rad"),
        log,
        value,
        std,
        0.992 * value,
        1.008 * value,
        usable,
        None,
        None,
        None,
    )
    d = DependenceTable(
        parameter=names,
        count=np.array([23, 21]),
        mean=np.array([2.0e5, 35.0]),
        mean_low_95=np.array([1.99e5, 34.9]),
        mean_high_95=np.array([2.01e5, 35.1]),
        chi_square=np.array([5123.25, 19.5]),
        freedom=np.array([22, 20]),
        p_value=np.array([0.0, 0.4925]),
        scatter=np.array([0.0712, 0.0]),
        trend_joint=np.array([2, 1]),
        slope_per_rad=np.array([0.1146, 0.001]),
        slope_std=np.array([0.002, 0.002]),
        slope_p_value=np.array([1e-20, 1.0]),
        depends=np.array([True, False]),
    )
    verdict, notes = (
        ("23 of 24 fits completed.", "The residuals are small.", "1 of 2 parameters depends."),
        ("a sign of something",),
    )
    modes = ModesByPosture(hz, 0.03 + 0 * hz, 1.001 * hz, 0.031 + 0 * hz)
    return BatchResult(
        name="made_up",
        verdict=verdict,
        notes=notes,
        seconds=12.5,
        provenance=frf_result().provenance,
        workers="2 local workers",
        joint_file="",
        joint_gap=float("nan"),
        jobs=jobs,
        parameters=parameters,
        modes=modes,
        dependence=d,
    )


def map_result() -> MapResult:
    """Made-up numbers over a grid of two joints, the third mode missing at one posture."""
    a, b = (grid.ravel() for grid in np.meshgrid(np.linspace(-60, 60, 6), np.linspace(-40, 40, 5)))
    q = np.stack([a, b, np.full(30, 10.0)], axis=1)
    hz = np.stack([12 + 0.05 * b, 31 + 0.02 * a, 80 + 0.01 * a], axis=1)
    hz[3, 2] = np.nan
    ratio, line = 0.03 + 1e-4 * hz, np.linspace(5, 60, 12)
    w = 2 * np.pi * hz[:, :1]
    h = 1e-3 / (w**2 - (2 * np.pi * line) ** 2 + 2j * 0.03 * w * 2 * np.pi * line)
    full = (h[:, :, None, None] * np.array([[1, 0.1, 0], [0.1, 2, 0], [0, 0, 0.5]])).astype(np.complex64)
    rows = PostureRows(
        tuple(f"p{n:02d}" for n in range(1, 31)),
        q,
        np.stack([a / 60, b / 40, a * 0 + 1], axis=1),
        *(hz, 0.99 * hz, 1.01 * hz, ratio, 0.9 * ratio, 1.1 * ratio),
        np.abs(full[:, 0]).astype(float),
        full,
        (0.05 * np.abs(full)).astype(np.float32),
        np.abs(full).max(axis=1)[:, range(3), range(3)].astype(float),
    )
    said = (
        "30 postures were mapped.",
        "The first mode lies between 10 and 14 Hz.",
        "The tool is most compliant at p01.",
    )
    return MapResult(
        name="made_up",
        verdict=said,
        notes=("intervals say <what>",),
        seconds=3.5,
        provenance=frf_result().provenance,
        workers="2 local workers",
        model="fit.h5",
        tool="tip on link3",
        joints=("j1", "j2", "j3"),
        line_hz=line,
        rows=rows,
    )


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("postures")
    made = {"batch": folder / "batch.h5", "map": folder / "map.h5"}
    result_file.write(batch_result(), made["batch"])
    result_file.write(map_result(), made["map"])
    for path in made.values():
        write_reports(path)
    return made


def _tables(kind: str) -> list[Table]:
    if kind == "batch":
        result = batch_result()
        made = [
            batch_tables.dependence_table(result),
            batch_tables.trend_table(result),
            batch_tables.failure_table(result),
        ]
        return [table for table in (*made, batch_tables.job_table(result)) if table is not None]
    return [map_tables.mode_table(map_result())]


@pytest.mark.parametrize("kind", ["batch", "map"])
def test_page_and_document_print_the_same_tables(kind: str, files: dict[str, Path]) -> None:
    rows = Tables(files[kind].with_suffix(".html").read_text("utf-8")).rows
    printed = " ".join(re.sub(r"\s+", " ", line) for line in lines(files[kind].with_suffix(".pdf")))
    for table in _tables(kind):
        for row in table.rows:
            assert list(row) in rows, table.title
            numbers = [cell for cell, column in zip(row, table.columns, strict=True) if column.numeric]
            assert all(cell in printed for cell in numbers), (table.title, row)


def test_the_tables_say_what_the_file_says() -> None:
    row = next(
        row for row in batch_tables.dependence_table(batch_result()).rows if row[0] == "joint2.rz.stiffness"
    )
    assert row[1:] == ("2.000e5", "N·m/rad", "0.50", NONE, "23", "5123", "22", "< 1e-9", "7.12", "depends")
    trend = batch_tables.trend_table(batch_result()).rows[0]
    assert trend[1] == "joint 2"
    assert float(trend[2]) == pytest.approx(100 * np.expm1(0.1146 * np.deg2rad(10)), rel=1e-3)
    assert batch_tables.job_table(batch_result()).rows[0][0] == "p05", "the failed one first"


def test_a_quantity_is_shown_over_the_joint_that_explains_it() -> None:
    postures = batch_postures(batch_result())
    named = {one.name: postures.joint_of(one) + 1 for one in postures.quantities}
    assert named["joint2.rz.stiffness"] == 2
    assert (named["frequency of mode 1"], named["frequency of mode 2"]) == (2, 1)


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with browser() as opened:
        yield opened


@pytest.mark.parametrize("kind", ["batch", "map"])
def test_pictures_are_drawn_and_follow_their_choices(kind: str, files: dict[str, Path], page: Page) -> None:
    page.console.clear()
    page.open(files[kind].with_suffix(".html"))
    page.run("drawAll()")
    page.wait("[...document.querySelectorAll('.plot')].every(p => p.querySelector('.main-svg'))")
    assert page.console == []
    first = page.run("$('trend-plot').layout.title.text")
    assert first == ("joint2.rz.stiffness" if kind == "batch" else "frequency of mode 1")
    assert page.run("$('posture-over').selectedOptions[0].text") == "Joint 2 (°)"
    shown = page.run("Array.from($('trend-plot').data[0].y)")
    expected = (
        batch_result().parameters.value[:, 0] if kind == "batch" else map_result().rows.frequency_hz[:, 0]
    )
    assert shown == pytest.approx(expected[np.isfinite(expected)], rel=1e-5)
    page.run(
        "$('posture-quantity').value = [...$('posture-quantity').options].find(o => o.text === 'frequency of"
        " mode 2').value"
    )
    page.run("$('posture-quantity').dispatchEvent(new Event('change'))")
    page.wait("$('posture-plot').layout.title.text.startsWith('frequency of mode 2')")
    assert page.run("$('posture-over').selectedOptions[0].text") == "Joint 1 (°)"


def test_the_tool_of_a_map(files: dict[str, Path], page: Page) -> None:
    page.open(files["map"].with_suffix(".html"))
    page.run("drawAll()")
    page.run("$('tool-axis').value = '1'; $('tool-axis').dispatchEvent(new Event('change'))")
    name = page.run("$('tool-posture').selectedOptions[0].text").split(" (")[0]
    row = map_result().rows.name.index(name)
    shown = page.run("Array.from($('tool-plot').data.find(t => t.name === 'receptance').y)")
    assert shown == pytest.approx(1e6 * np.abs(map_result().rows.receptance_m_per_n[row, :, 1, 1]), rel=1e-4)
