"""The page in a real browser: it draws, moves, follows its pickers, and asks nothing of the network."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from identify.results.fit import FrfComparison
from tests.reports.browser import Page, browser
from tests.reports.kinds import page_of
from tests.reports.pdf_text import poppler
from tests.reports.sample import frf_result, large_result, modal_result


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    made = {"frf": frf_result(), "modal": modal_result()}
    for name, result in made.items():
        (folder / f"{name}.html").write_text(page_of(result), encoding="utf-8")
    return {name: folder / f"{name}.html" for name in made}


@pytest.fixture(scope="module")
def frf() -> FrfComparison:
    found = frf_result().measurements["posture2"].frf
    assert found is not None
    return found


def _choose(page: Page, picker: str, value: str) -> None:
    page.run(f"{{ const e = $('{picker}'); e.value = {value!r}; e.dispatchEvent(new Event('change')); }}")


def _picture(page: Page, canvas: str = "robot-model") -> str:
    return str(page.run(f"$('{canvas}').toDataURL()"))


def test_the_helper_sees_errors_and_requests(page: Page, tmp_path: Path) -> None:
    """Negative control of `test_kinds.test_everything_is_drawn_in_silence`."""
    broken = tmp_path / "broken.html"
    broken.write_text(
        "<img src='http://127.0.0.1:9/x.png'><script>document.documentElement.dataset.ready = 1;"
        " missing()</script>"
    )
    page.console.clear()
    page.open(broken)
    assert any("missing is not defined" in said for said in page.console)
    assert "http://127.0.0.1:9/x.png" in page.requests


def test_the_channel_picker_shows_the_measured_and_fitted_curves(
    page: Page, files: dict[str, Path], frf: FrfComparison
) -> None:
    page.open(files["frf"])
    _choose(page, "frf-measurement", "posture2")
    _choose(page, "frf-output", "4:+Z")
    _choose(page, "frf-input", "6:-Y")
    page.run("$('frf-plot').scrollIntoView()")
    page.wait("$('frf-title').textContent.includes('4:+Z / 6:-Y')")
    page.wait("$('frf-plot').data !== undefined")
    pair = list(zip(frf.output, frf.input, strict=True)).index(("4:+Z", "6:-Y"))
    title = page.run("$('frf-title').textContent")
    assert frf.gap is not None
    assert (
        title == f"posture2, accelerance 4:+Z / 6:-Y: gap {frf.gap[pair]:.3f}, relative error"
        f" {100 * frf.relative_error[pair]:.3f} %"
    )
    for name, curve in (("measured", frf.measured), ("fitted", frf.fitted), ("start model", frf.initial)):
        magnitude, phase = (_trace(page, name, axis) for axis in ("y", "y2"))
        assert magnitude == pytest.approx(np.abs(curve[:, pair]), rel=2e-4)
        shown = np.isfinite(phase)
        assert shown.sum() > 0.9 * len(phase)
        assert (
            np.abs(np.exp(1j * np.radians(phase[shown])) - np.exp(1j * np.angle(curve[shown, pair]))).max()
            < 2e-3
        )
    assert frf.coherence is not None
    assert _trace(page, "coherence", "y3") == pytest.approx(frf.coherence[:, pair], abs=6e-4)


def _trace(page: Page, name: str, axis: str) -> np.ndarray:
    values = page.run(
        f"Array.from($('frf-plot').data.find(t => t.name === '{name}' && t.yaxis === '{axis}').y, v =>"
        " isNaN(v) ? null : v)"
    )
    return np.array([np.nan if value is None else value for value in values])


def test_scale_start_model_and_steps(page: Page, files: dict[str, Path]) -> None:
    page.open(files["frf"])
    page.run("drawAll()")
    assert page.run("$('frf-plot').layout.yaxis.type") == "log"
    _choose(page, "frf-scale", "linear")
    page.wait("$('frf-plot').layout.yaxis.type === 'linear'")
    page.run("$('frf-initial').click()")
    page.wait("$('frf-plot').data.filter(t => t.name === 'start model').every(t => t.visible === false)")
    before = page.run("$('frf-title').textContent")
    page.run("$('frf-next').click()")
    page.wait(f"$('frf-title').textContent !== {before!r}")
    page.run("$('frf-back').click()")
    page.wait(f"$('frf-title').textContent === {before!r}")


def test_rows_and_cells_lead_to_their_frf(page: Page, files: dict[str, Path]) -> None:
    page.open(files["frf"])
    page.run("drawAll()")
    row = "document.querySelector('table[data-sort=\"frf-1\"] tbody').rows[3]"
    channels = page.run(f"[{row}.cells[0].textContent, {row}.cells[1].textContent].join(' / ')")
    page.run(f"{row}.cells[2].click()")
    page.wait(f"$('frf-title').textContent.startsWith('posture2, accelerance {channels}:')")
    title = "$('frf-title').textContent.startsWith('posture1, accelerance 1:+X / 6:-X')"
    page.click_until(title, "#gap-plot .nsewdrag", 0.5, 0.5 / 36)


def test_the_mode_shapes_move(page: Page, files: dict[str, Path]) -> None:
    page.open(files["modal"])
    for canvas in ("robot-model", "robot-measured"):
        first = _picture(page, canvas)
        page.wait(f"$('{canvas}').toDataURL() !== {first!r}")
    page.run("$('robot-play').click()")
    still = _picture(page)
    time.sleep(0.3)
    assert _picture(page) == still
    page.run("$('robot-mode').selectedIndex = 1; $('robot-mode').dispatchEvent(new Event('change'))")
    assert _picture(page) != still
    captions = page.run("[...document.querySelectorAll('.stage p')].map(p => p.textContent)")
    assert captions == ["model 27.39 Hz, damping 3.200 %", "measured 27.20 Hz, MAC 0.9123"]
    page.run("$('robot-amplitude').value = 0; $('robot-amplitude').dispatchEvent(new Event('input'))")
    at_rest = _picture(page)
    page.run("$('robot-play').click()")
    time.sleep(0.3)
    assert _picture(page) == at_rest


def test_the_view_turns_and_points_tell_their_names(page: Page, files: dict[str, Path]) -> None:
    page.open(files["frf"])
    page.run("$('robot-play').click(); $('robot').scrollIntoView()")
    before = _picture(page)
    x, y, width, height = page.box("#robot-model")
    told = page.run(
        f"""(() => {{ const told = new Set();
        for (let y = {y}; y < {y + height}; y += 6) for (let x = {x}; x < {x + width}; x += 6) {{
        $('robot-model').dispatchEvent(new PointerEvent('pointermove', {{clientX: x, clientY: y}}));
        if (!$('robot-tip').hidden) told.add($('robot-tip').textContent); }} return [...told]; }})()"""
    )
    points = [said.splitlines() for said in told if "\n" in said]
    assert points and all(said[0].endswith(">") and said[1].startswith("on link_") for said in points)
    assert {said for said in told if "\n" not in said} == {"foot", "column", "upper arm", "forearm"}
    page.mouse("mousePressed", x + width / 2, y + height / 2, button="left", buttons=1)
    page.mouse("mouseMoved", x + width / 2 + 80, y + height / 2 + 20, button="left", buttons=1)
    page.mouse("mouseReleased", x + width / 2 + 80, y + height / 2 + 20, button="left")
    turned = _picture(page)
    assert turned != before
    page.run("$('robot-reset').click()")
    assert _picture(page) == before
    _choose(page, "robot-measurement", "posture2")
    assert page.run("$('robot-about').textContent").startswith("posture2, validation only")


def test_links_that_have_a_body_are_drawn_as_it(page: Page, files: dict[str, Path]) -> None:
    """Light inside the tetrahedron of the column; without triangles there is nothing there."""
    page.open(files["modal"])
    page.run("$('robot-play').click(); $('robot').scrollIntoView()")
    said = "Not drawn as they look: link forearm is drawn as a line, not as its body (<arm>.dae"
    assert said in page.run("$('robot-about').textContent")
    with_bodies = _picture(page)
    page.run("DATA.measurements[0].robot.bodies.triangles = []; window.dispatchEvent(new Event('resize'))")
    assert _picture(page) != with_bodies


def test_tables_sort(page: Page, files: dict[str, Path]) -> None:
    page.open(files["frf"])
    column = (
        "[...document.querySelector('table[data-sort=\"parameters\"] tbody').rows].map(r =>"
        " r.cells[1].textContent)"
    )
    heading = "document.querySelector('table[data-sort=\"parameters\"]').tHead.rows[0].cells[1].click()"
    page.run(heading)
    assert [float(text) for text in page.run(column)] == [1e8, 1.835e6, 1959.0, 35.0, 0.0123]
    page.run(heading)
    assert [float(text) for text in page.run(column)] == [0.0123, 35.0, 1959.0, 1.835e6, 1e8]


def test_the_theme_follows_its_button(page: Page, files: dict[str, Path]) -> None:
    page.open(files["frf"])
    page.run("drawAll()")
    ink = "getComputedStyle(document.querySelector('#frf-plot .xtick text')).fill"
    light = page.run(ink)
    page.run("$('theme').click()")
    page.wait("document.documentElement.dataset.theme === 'dark'")
    assert page.run(ink) != light
    page.run("$('theme').click()")
    assert page.run(ink) == light


def test_it_prints(page: Page, files: dict[str, Path], tmp_path: Path) -> None:
    page.open(files["frf"], dark=True)
    page.pdf(tmp_path / "printed.pdf")
    text = poppler("pdftotext", "-layout", str(tmp_path / "printed.pdf"), "-")
    assert "Where the model disagrees" in text
    assert "Place between the bounds" in text, "plots that were not yet drawn are drawn for paper"


@pytest.mark.exam
def test_three_thousand_frfs_stay_usable(page: Page, tmp_path: Path) -> None:
    """How fast such a page opens is measured by `tests.benchmarks.report`."""
    path = tmp_path / "large.html"
    path.write_text(page_of(large_result()), encoding="utf-8")
    assert path.stat().st_size < 20e6
    page.open(path)
    page.run("drawAll()")
    before = page.run("$('frf-title').textContent")
    page.run("$('frf-next').click()")
    page.wait(f"$('frf-title').textContent !== {before!r}")
