"""Points files: what is read, and every line that is refused."""

from __future__ import annotations

import csv
import io
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError, InputErrors
from identify.robot.points import as_written, check_links, new_points_text, read_points
from identify.robot.urdf import read_urdf
from tests.robot.random_arm import general_arm, write
from tests.shared import shared

HEADER = "node,name,link,x_m,y_m,z_m"
TURNED = HEADER + ",rx_deg,ry_deg,rz_deg"


def points_file(folder: Path, text: str) -> Path:
    path = folder / "points.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_point_has_its_link_position_and_link_axes(tmp_path: Path) -> None:
    points = read_points(
        points_file(tmp_path, f"{HEADER}\n12,wrist top,link5,0.1,-2e-1,3\n\n3,,base,0,0,0\n")
    )
    assert list(points) == [12, 3]
    wrist = points[12]
    assert (wrist.node, wrist.name, wrist.link, wrist.where) == (
        12,
        "wrist top",
        "link5",
        "points.csv line 2",
    )
    assert wrist.position.tolist() == [0.1, -0.2, 3]
    assert np.array_equal(wrist.axes, np.eye(3))


def test_cells_may_be_separated_by_semicolons_with_decimal_commas(tmp_path: Path) -> None:
    text = "sep=;\nnode;name;link;x_m;y_m;z_m\n1;a, b;arm;0,5;-1,25e-1;1\n"
    point = read_points(points_file(tmp_path, text))[1]
    assert (point.name, point.position.tolist()) == ("a, b", [0.5, -0.125, 1.0])
    with pytest.raises(InputErrors, match=r"line 2: x_m is '0,5.1'"):
        read_points(points_file(tmp_path, "node;name;link;x_m;y_m;z_m\n1;a;arm;0,5.1;0;0\n"))


def test_columns_may_come_in_any_order_with_spaces_and_a_byte_order_mark(tmp_path: Path) -> None:
    points = read_points(points_file(tmp_path, '\ufeffx_m, y_m ,z_m,link,name,node\n1, 2 ,3,arm,"a, b",7\n'))
    assert points[7].position.tolist() == [1, 2, 3]
    assert (points[7].link, points[7].name) == ("arm", "a, b")


def test_rows_of_axes_are_the_sensor_directions(tmp_path: Path) -> None:
    point = read_points(points_file(tmp_path, f"{TURNED}\n1,a,arm,0,0,0,0,0,90\n"))[1]
    assert point.axes == pytest.approx(np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), abs=1e-15)
    both = read_points(points_file(tmp_path, f"{TURNED}\n1,a,arm,0,0,0,90,0,90\n"))[
        1
    ]  # first about x, then about the fixed z
    assert both.axes[0] == pytest.approx([0, 1, 0], abs=1e-15)
    assert both.axes[1] == pytest.approx([0, 0, 1], abs=1e-15)


finite = st.floats(-1e3, 1e3)


@settings(max_examples=50, deadline=None)
@given(
    rows=st.lists(
        st.tuples(
            st.integers(1, 10**6),
            st.text(st.characters(exclude_categories=["C", "Z"]), max_size=8),
            *[finite] * 6,
        ),
        min_size=1,
        max_size=8,
        unique_by=lambda row: row[0],
    )
)
def test_what_is_written_is_read(rows: list[tuple[float | str, ...]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(TURNED.split(","))
    writer.writerows([row[0], row[1], "arm", *map(repr, row[2:])] for row in rows)
    with tempfile.TemporaryDirectory() as folder:
        points = read_points(points_file(Path(folder), text.getvalue()))
    assert list(points) == [row[0] for row in rows]
    for point, row in zip(points.values(), rows, strict=True):
        assert (point.name, point.position.tolist()) == (row[1], list(row[2:5]))
        assert point.axes @ point.axes.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(point.axes) == pytest.approx(1)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "points.csv: the file is empty"),
        ("\n\n", "points.csv: the file is empty"),
        (HEADER, "points.csv: no points"),
        (
            "node,name,x_m,y_m,z_m\n",
            "line 1: no column link in 'node,name,x_m,y_m,z_m'; expected the columns node,name,link",
        ),
        ("node name link x_m y_m z_m\n", "separated by commas"),
        (HEADER.replace("x_m", "x_mm"), "no column x_m"),
        (HEADER + ",rx_rad\n", "unknown or doubled columns"),
        (HEADER + ",x_m\n", "unknown or doubled columns"),
        (
            HEADER + ",rz_deg\n",
            "only a part of the sensor's orientation; expected all of rx_deg,ry_deg,rz_deg, or none",
        ),
    ],
)
def test_a_bad_file_is_refused(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        read_points(points_file(tmp_path, text))


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        ("1,a,arm,0,0", "line 3: 5 cells; expected 6, as in the first line"),
        ("one,a,arm,0,0,0", "line 3: node 'one'; expected a positive whole number"),
        ("1.5,a,arm,0,0,0", "node '1.5'"),
        ("-1,a,arm,0,0,0", "node '-1'"),
        ("0,a,arm,0,0,0", "node '0'"),
        ("²,a,arm,0,0,0", "node '²'"),
        ("1,a,arm,0,zero,0", "line 3: y_m is 'zero'; expected a finite number"),
        ("1,a,arm,0,0,nan", "z_m is 'nan'"),
        ("1,a,arm,inf,0,0", "x_m is 'inf'"),
        ("1,a,arm,0,,0", "y_m is ''"),
        ("1,a,,0,0,0", "line 3: the link is empty"),
        ("9,a,arm,0,0,0", r"line 3: node 9 is given already \(points.csv line 2\)"),
    ],
)
def test_a_bad_line_is_refused(tmp_path: Path, row: str, sentence: str) -> None:
    with pytest.raises(InputErrors, match=sentence):
        read_points(points_file(tmp_path, f"{HEADER}\n9,first,arm,0,0,0\n{row}\n"))


def test_all_bad_lines_come_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputErrors) as caught:
        read_points(
            points_file(tmp_path, f"{HEADER}\nx,a,arm,0,0,0\n2,a,arm,0,0,0\n2,a,arm,0,0,0\n3,a,arm,0,0,-\n")
        )
    assert [error.where for error in caught.value.errors] == [
        "points.csv line 2",
        "points.csv line 4",
        "points.csv line 5",
    ]


def test_a_sensor_turned_by_a_quarter_about_y_is_written_and_read(tmp_path: Path) -> None:
    """Several angles say the same there, which is no warning."""
    [turned] = read_points(points_file(tmp_path, f"{TURNED}\n1,a,arm,0.1,0,0,30,90,0\n")).values()
    [again] = read_points(points_file(tmp_path, new_points_text({1: turned}))).values()
    assert again.axes == pytest.approx(turned.axes, abs=1e-9)
    assert as_written(turned).axes == pytest.approx(turned.axes, abs=1e-9)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_points(tmp_path / "nothing.csv")


def test_points_on_links_and_frames_are_accepted_and_others_named(tmp_path: Path) -> None:
    robot = read_urdf(write(tmp_path, general_arm(0)))
    check_links(
        read_points(points_file(tmp_path, f"{HEADER}\n1,a,link6,0,0,0\n2,b,tool,0,0,0\n3,c,world,0,0,0\n")),
        robot,
    )
    bad = read_points(points_file(tmp_path, f"{HEADER}\n1,a,link6,0,0,0\n2,b,link7,0,0,0\n3,c,Tool,0,0,0\n"))
    with pytest.raises(
        InputErrors, match=r"points\.csv line 3: unknown link 'link7'; expected one of base_link, link1"
    ) as caught:
        check_links(bad, robot)
    assert len(caught.value.errors) == 2


def test_a_file_made_elsewhere_fits_its_robot() -> None:
    points = read_points(shared("hidden", "none_101", "points.csv"))
    check_links(points, read_urdf(shared("hidden", "none_101", "robot.urdf")))
    assert points[4].position.tolist() == [0.264225, -0.025065, 0.20727]
