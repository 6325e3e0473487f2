"""The files of nodes on a robot: their points, for a study, and the page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from identify.core.atomic import ELSEWHERE, write_text
from identify.core.errors import InputError
from identify.measured.registration.place import Placing
from identify.measured.registration.run import Asked, place_points
from identify.reports.points.page import points_page
from identify.reports.shown import working
from identify.robot.points import new_points_text


def write_points(
    robot: Path, data: Sequence[Path], asked: Asked, out: Path, page: Path | None, quiet: bool
) -> tuple[Placing, list[Path]]:
    """Where the nodes of data are on a robot, and what was written: `out`, where the data have a geometry,
    and the page, by default beside it.  InputError for points that exist, which are kept.
    """
    page = page or out.with_suffix(".html")
    inputs = {path.resolve() for path in (robot, *data, asked.registration.pairs) if path is not None}
    for option, path in (("--out", out), ("--page", page)):
        if path.resolve() in inputs:
            fix = f"choose another with `{option}`"
            raise InputError(str(path), "an input, which would be overwritten", "a new file", fix)
    if page.resolve() == out.resolve():
        raise InputError("--page", f"{page}, which is the file of points", "a file of its own")
    if out.exists() and data:
        raise InputError(str(out), "the file exists", "a new file", ELSEWHERE)
    with working(quiet, "laying the geometry on the robot"):
        placing = place_points(robot, data, asked)
    texts = {out: new_points_text(placing.points)} if placing.points else {}
    texts[page] = points_page(placing)
    for path, text in texts.items():
        write_text(path, text)
    return placing, list(texts)
