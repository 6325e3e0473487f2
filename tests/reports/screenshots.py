"""Pictures of reports for the README: `python -m tests.reports.screenshots RUN.h5 ...` writes
`docs/<kind>_report.png` for each result.

Several fits in one word, joined by `+`, are compared: `A.h5+B.h5`.  `motion=RUN.h5` is the stage with the
motion at a line beside a mode, `docs/motion_at_line.png`.
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path

from PIL import Image

from identify.reports.kinds import read_any
from identify.results.comparison import compared
from tests.reports.browser import Page, browser
from tests.reports.kinds import page_of

DOCS = Path(__file__).parents[2] / "docs"
_WIDTH, _HEIGHT, _SCALE = 1240, 1900, 0.72
_TALL = {"discovery": 2850}
"""Kinds whose picture is higher, because it tells a story."""
_LARGEST = 200_000
_LEFT_OUT = {
    "discovery": (
        "#added h3, #added h3 ~ *, #steps .note, #steps details, #options-0 ~ *, #parts-0-3, #parts-0-4,"
        " #parts-0-5, #gap > .note, #gap > .note + h3, #gap > .scroll"
    ),
    "modes": "#modes .block:not(:nth-of-type(1))",
    "compare": "#parameters .scroll, #parameters .note, #modes .block:not(:nth-of-type(1))",
}
"""What is left out of a picture for more kinds of plots to have room."""


def shoot(page: Page, files: list[Path]) -> Path:
    """Open the report of a result, or of a comparison, and keep a picture of its first screens."""
    result = compared(files) if len(files) > 1 else read_any(files[0])
    target = DOCS / f"{result.KIND}_report.png"
    with tempfile.TemporaryDirectory() as folder:
        html, raw = Path(folder) / "report.html", Path(folder) / "raw.png"
        html.write_text(page_of(result), encoding="utf-8")
        page.open(html, width=_WIDTH, height=_TALL.get(result.KIND, _HEIGHT))
        page.run("drawAll()")
        page.wait("[...document.querySelectorAll('.plot')].every(plot => plot.querySelector('.main-svg'))")
        page.run(
            f"document.querySelectorAll({_LEFT_OUT.get(result.KIND, 'none')!r}).forEach(part =>"
            " part.remove())"
        )
        page.run("$('robot-play') && $('robot-play').click()")
        page.run("new Promise(done => setTimeout(done, 600))")
        page.screenshot(raw)
        target.write_bytes(_small(raw))
    return target


def shoot_motion(page: Page, file: Path) -> Path:
    """The stage of a result with FRFs and shapes: a mode, and the motion that was measured there."""
    target = DOCS / "motion_at_line.png"
    with tempfile.TemporaryDirectory() as folder:
        html, raw = Path(folder) / "report.html", Path(folder) / "raw.png"
        html.write_text(page_of(read_any(file)), encoding="utf-8")
        page.open(html, width=_WIDTH, height=700)
        page.run("$('robot').scrollIntoView(); $('robot-play').click()")
        page.run("$('robot-mode').selectedIndex = 2; $('robot-mode').dispatchEvent(new Event('change'))")
        page.run("$('robot-amplitude').value = 0.6; $('robot-amplitude').dispatchEvent(new Event('input'))")
        page.run("new Promise(done => setTimeout(done, 600))")
        page.screenshot(raw)
        target.write_bytes(_small(raw))
    return target


def _small(raw: Path) -> bytes:
    """Scaled down, in 256 colours."""
    with Image.open(raw) as picture:
        size = round(_SCALE * picture.width), round(_SCALE * picture.height)
        reduced = (
            picture.convert("RGB")
            .resize(size, Image.Resampling.LANCZOS)
            .quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=4, dither=Image.Dither.NONE)
        )
    stream = io.BytesIO()
    reduced.save(stream, format="PNG", optimize=True)
    assert stream.tell() < _LARGEST, f"{stream.tell()} bytes"
    return stream.getvalue()


def main() -> None:
    """Take the pictures that were asked for."""
    with browser() as page:
        for word in sys.argv[1:]:
            motion = word.startswith("motion=")
            files = [Path(name) for name in word.removeprefix("motion=").split("+")]
            print(shoot_motion(page, files[0]) if motion else shoot(page, files))


if __name__ == "__main__":
    main()
