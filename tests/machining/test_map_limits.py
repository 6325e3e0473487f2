"""Limits of a map against `identify stability` and `identify deflection` at the same postures."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.machining.run import run_stability
from identify.machining.run_deflection import Load, run_deflection
from identify.map.asked import MapOptions, Workpiece, parse_spindle, parse_workpiece
from identify.map.limits import Wanted
from identify.map.run import run_map
from identify.map.sentences import best_and_worst
from identify.reports.map.tables import limit_table
from identify.results.map import LimitRows, MapResult, PostureRows
from tests.batch import planar
from tests.batch.conftest import in_this_process
from tests.machining.planar_fit import TOOL


@pytest.fixture(autouse=True)
def at_once() -> Iterator[None]:
    """Maps run in this process."""
    with in_this_process():
        yield


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("map") / "postures.csv"
    rows = [",".join(f"{np.rad2deg(angle):.9f}" for angle in q) for q in planar.postures(3)]
    path.write_text("\n".join(["joint1_deg,joint2_deg,joint3_deg", *rows]) + "\n")
    return path


def _mapped(fit: Path, out: Path, **options: object) -> tuple[MapResult, LimitRows]:
    result, _ = run_map(fit, MapOptions(lines=2, modes=1, **options), out, workers=1)  # type: ignore[arg-type]
    assert result.limit is not None
    return result, result.limit


def test_depths_are_those_of_stability(planar_fit: Path, table: Path, tmp_path: Path) -> None:
    tool = planar_fit.with_name("tool.yaml")
    asked = {"postures": table, "limit": "depth", "cutter": tool, "rpm": (5000.0,), "feeds": 2}
    result, limit = _mapped(planar_fit, tmp_path / "m.h5", **asked)
    assert limit.value.shape == (3, 2)
    (tmp_path / "t.yaml").write_text(TOOL.replace("[3000, 9000]", "[5000, 9000]"))
    for row, q in enumerate(planar.postures(3)):
        said = ",".join(f"{np.rad2deg(angle):.9f}" for angle in q)
        own, _ = run_stability(planar_fit, tmp_path / "t.yaml", tmp_path / "s.h5", said, speeds=2)
        depth, low, high = (one[0] for one in (own.limits.depth_m, own.limits.low_95, own.limits.high_95))
        assert limit.value[row, 0] == pytest.approx(depth, rel=5e-3)
        assert limit.high_95[row, 0] / limit.low_95[row, 0] - 1 == pytest.approx(high / low - 1, rel=0.2)
        assert limit.chatter_hz[row, 0] == pytest.approx(own.limits.chatter_hz[0], rel=5e-3)
    assert limit.value[:, 1] == pytest.approx(limit.value[:, 0], rel=2e-3), "a feed the other way round"
    assert np.ptp(limit.value[:, 0]) > 0.05 * limit.value[0, 0], "postures differ"
    best = int(np.argmax(limit.value.max(axis=1)))
    assert f"is best at {result.rows.name[best]}" in result.verdict[1]
    with (tmp_path / "m.csv").open() as stream:
        written = list(csv.DictReader(stream))
    assert float(written[1]["depth_m_low_feed180"]) == pytest.approx(limit.low_95[1, 1], rel=1e-8)


def test_deflections_are_those_of_deflection(planar_fit: Path, table: Path, tmp_path: Path) -> None:
    result, limit = _mapped(
        planar_fit, tmp_path / "m.h5", postures=table, limit="deflection", force="80,-50,30"
    )
    for row, q in enumerate(planar.postures(3)):
        said = ",".join(f"{np.rad2deg(angle):.9f}" for angle in q)
        own = run_deflection(planar_fit, Load(force="80,-50,30", posture=said), tmp_path / "d.h5")[0].rows
        assert limit.value[row, 0] == pytest.approx(own.size_m[0], rel=1e-6)
        width = limit.high_95[row, 0] - limit.low_95[row, 0]
        assert width == pytest.approx(own.size_high_95[0] - own.size_low_95[0], rel=0.2)
    worst = int(np.argmax(limit.value[:, 0]))
    assert f"worst at {result.rows.name[worst]}" in result.verdict[1]
    table_of = limit_table(result)
    assert table_of is not None
    assert table_of.rows[-1][0] == result.rows.name[worst]


def test_frequencies_are_the_map_s_own(planar_fit: Path, table: Path, tmp_path: Path) -> None:
    result, limit = _mapped(planar_fit, tmp_path / "m.h5", postures=table, limit="frequency")
    assert np.array_equal(limit.value[:, 0], result.rows.frequency_hz[:, 0])
    plain = run_map(planar_fit, MapOptions(postures=table, lines=2, modes=1), tmp_path / "p.h5", workers=1)[0]
    assert plain.limit is None
    assert limit_table(plain) is None
    assert np.array_equal(plain.rows.frequency_hz, result.rows.frequency_hz)


def test_no_limit_is_better_than_any() -> None:
    one = np.array([[1e-3], [np.inf], [5e-4]])
    nothing = np.full((3, 1), np.nan)
    limit = LimitRows("depth", "a mill", 5e-3, np.zeros(1), one, one, one, nothing, nothing)
    empty = np.zeros((3, 1))
    rows = PostureRows(("a", "b", "c"), empty, np.zeros((3, 3)), *[empty] * 10)
    said = best_and_worst(rows, limit)[0]
    assert "best at b" in said
    assert "none up to 5 mm" in said
    assert "worst at c" in said


def test_what_is_wanted_goes_to_a_worker_and_back(planar_fit: Path) -> None:
    from identify.machining.tool import read_tool

    wanted = Wanted("depth", read_tool(planar_fit.with_name("tool.yaml")).study, (4000.0, 5000.0), 3)
    assert Wanted.of(wanted.given) == wanted


def test_a_workpiece_is_read() -> None:
    places = parse_workpiece("1:2:3,-0.5:0.5:2,0.8:0.8:1")
    assert places.shape == (6, 3)
    assert places[0] == pytest.approx([1, -0.5, 0.8])
    assert Workpiece(places).turns == 1
    for text in ("1:2:3", "1:2:3,0:1:2,a:b:1", "1:2:3,0:1:2,1:2"):
        with pytest.raises(InputError, match="X1:X2:COUNT"):
            parse_workpiece(text)
    with pytest.raises(InputError, match="from the spindle to the tip"):
        parse_spindle("0,0,0")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"limit": "width"}, "'width'.*depth, deflection, frequency"),
        ({"limit": "depth"}, "--cutter tool.yaml"),
        ({"limit": "deflection"}, "--force 100,0,-50"),
        ({"force": "1,2,3"}, "without `--limit`"),
        ({"workpiece": "1:2:3,0:1:2,1:1:1"}, "none or several"),
        ({"postures": None, "grid": [(2, 0.0, 1.0, 2), (2, 5.0, 6.0, 2)]}, "joint 2 twice"),
        ({"postures": None, "grid": [(2, 0.0, float("nan"), 2)]}, "from 0 to nan"),
        ({"band_hz": (5.0, float("inf"))}, "--band: 5 to inf Hz"),
    ],
)
def test_a_limit_that_cannot_be_is_refused(
    planar_fit: Path, table: Path, tmp_path: Path, options: dict[str, object], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        run_map(planar_fit, MapOptions(**{"postures": table, **options}), tmp_path / "x.h5", workers=1)  # type: ignore[arg-type]
    assert not (tmp_path / "x.h5").exists()
