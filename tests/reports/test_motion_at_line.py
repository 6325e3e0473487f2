"""The measured motion at a line (operating deflection shape) on the page of a modal analysis and of a fit."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from identify.measured.frf_set import POWER
from identify.reports.shared.pick import ways
from tests.reports.browser import Page, browser
from tests.reports.kinds import page_of
from tests.reports.modes_sample import modes_result
from tests.reports.sample import frf_result

SAID = "[...document.querySelectorAll('.stage p')].at(-1).textContent"


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def modes_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("pages") / "modes.html"
    path.write_text(page_of(modes_result()), encoding="utf-8")
    return path


def _picture(page: Page) -> str:
    return str(page.run("$('robot-motion').toDataURL()"))


def _set(page: Page, picker: str, value: object, event: str = "change") -> None:
    chosen = f"e.value = {json.dumps(value)}; e.dispatchEvent(new Event('{event}'))"
    page.run(f"{{ const e = $('{picker}'); {chosen}; }}")


def test_the_motion_at_a_line_is_what_the_frfs_say(page: Page, modes_page: Path) -> None:
    m = modes_result().measurements["table"]
    assert m.geometry is not None
    page.open(modes_page)
    page.wait(f"{SAID}.startsWith('measured at')")
    line, force = 40, m.frf.input[0]
    _set(page, "robot-force", force)
    _set(page, "robot-line", line, "input")
    hz = m.frf.frequency_hz[line]
    page.wait(f"{SAID}.includes(' {hz:.4g}'.slice(0, 4)) && {SAID}.includes({json.dumps(force)})")
    found = re.search(r"largest (\S+) µm/N", page.run(SAID))
    assert found is not None
    seen = ways(m.geometry, m.frf.output)
    moved = np.zeros((len(m.geometry.nodes), 3), dtype=complex)
    for pair, (output, input_) in enumerate(zip(m.frf.output, m.frf.input, strict=True)):
        if input_ == force and output in seen:
            row, way = seen[output]
            moved[row] += m.frf.measured[line, pair] * way
    most = np.linalg.norm(moved, axis=1).max() / (2 * np.pi * hz) ** POWER[m.frf.quantity]
    assert float(found[1]) == pytest.approx(1e6 * most, rel=5e-3)


def test_it_follows_mode_slider_force_and_the_plot_of_an_frf(page: Page, modes_page: Path) -> None:
    m = modes_result().measurements["table"]
    page.open(modes_page)
    page.run("$('robot-play').click()")
    page.wait(f"{SAID}.startsWith('measured at')")
    for mode, hz in enumerate(m.modes.frequency_hz):
        page.run(
            f"$('robot-mode').selectedIndex = {mode}; $('robot-mode').dispatchEvent(new Event('change'))"
        )
        nearest = int(np.argmin(np.abs(m.frf.frequency_hz - hz)))
        page.wait(f"Number($('robot-line').value) === {nearest}")
    page.wait(f"{SAID}.startsWith('measured at')")
    before = _picture(page)
    _set(page, "robot-line", 5, "input")
    page.wait(f"$('robot-motion').toDataURL() !== {before!r}")
    page.run("$('frf').scrollIntoView(); drawAll()")
    page.wait("$('frf-plot').data !== undefined")
    page.wait("$('frf-plot').layout.shapes.length === 1")
    page.click_until("Number($('robot-line').value) > 30", "#frf-plot .nsewdrag", 0.5, 0.5)
    page.wait("$('frf-plot').layout.shapes[0].x0 > 20")


def test_a_measurement_without_known_directions_says_so(page: Page, tmp_path: Path) -> None:
    path = tmp_path / "fit.html"
    path.write_text(page_of(frf_result()), encoding="utf-8")
    page.open(path)
    page.wait(f"{SAID}.startsWith('measured at')")
    page.run(
        "Object.keys(DATA.measurements[0].robot.ways).forEach(k => delete DATA.measurements[0].robot.ways[k])"
    )
    _set(page, "robot-line", 3, "input")
    page.wait(f"{SAID}.startsWith('no response along known directions')")
    assert not page.console
    assert all(one.startswith(("file:", "data:", "blob:")) for one in page.requests[-1:])
