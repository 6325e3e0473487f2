"""Nodes in CSV files: names of columns say units and what turns a sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.measured.registration.geometry_file import geometry_of, has_nodes, nodes_alone
from tests.setup.studies import DATA


def _file(folder: Path, text: str) -> Path:
    path = folder / "nodes.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("node,x_mm,y_mm,z_mm\n7,1000,2000,-500\n3,0,0,0\n", None),
        ("node;x;y;z\n7;1,0;2,0;-0,5\n3;0;0;0\n", None),
        ("Node, X, Y, Z, name\n7, 100, 200, -50, tip\n3, 0, 0, 0, foot\n", "cm"),
    ],
)
def test_units_and_separators(tmp_path: Path, text: str, unit: str | None) -> None:
    found = geometry_of(_file(tmp_path, text), unit)
    assert found.nodes == (3, 7)
    np.testing.assert_allclose(found.position_m, np.array([[0, 0, 0], [1, 2, -0.5]]))
    np.testing.assert_array_equal(found.axes, np.tile(np.eye(3), (2, 1, 1)))


def test_euler_angles_turn_about_the_fixed_axes(tmp_path: Path) -> None:
    """x by 90 degrees takes y to z; then z by 90 degrees takes x to y."""
    text = "node,x_m,y_m,z_m,rx_deg,ry_deg,rz_deg\n1,0,0,0,90,0,90\n"
    found = geometry_of(_file(tmp_path, text))
    np.testing.assert_allclose(found.axes[0], [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-15)


def test_z_looks_along_a_normal(tmp_path: Path) -> None:
    found = geometry_of(_file(tmp_path, "node,x_m,y_m,z_m,nx,ny,nz\n1,0,0,0,0,3,-4\n"))
    np.testing.assert_allclose(found.axes[0, 2], [0, 0.6, -0.8])
    np.testing.assert_allclose(found.axes[0] @ found.axes[0].T, np.eye(3), atol=1e-15)
    assert np.linalg.det(found.axes[0]) == pytest.approx(1)


def test_what_is_a_geometry(tmp_path: Path) -> None:
    assert nodes_alone(_file(tmp_path, "node,x,y,z\n1,0,0,0\n"))
    assert not has_nodes(_file(tmp_path, "node,name,link,x_m,y_m,z_m\n1,,a,0,0,0\n")), "a file of points"
    assert not has_nodes(_file(tmp_path, "frequency_hz,real,imag\n1,0,0\n"))
    assert not has_nodes(tmp_path / "none.csv")
    assert not has_nodes(DATA / "posture1.uff")


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("node,x_mm,y_mm,z_mm\n1,0,0,0\n", "m", "'m' although the file says 0.001 m"),
        ("node,x,y,z\n1,0,0\n", None, "3 cells; expected 4"),
        ("node,x,y,z\n1,0,0,zero\n", None, "line 2: z is 'zero'; expected a finite number"),
        ("node,x,y,z\n0,0,0,0\n", None, "node '0'; expected a positive whole number"),
        ("node,x,y,z\n1,0,0,0\n1,1,0,0\n", None, "node 1 is given already"),
        ("node,x,y,z\n", None, "no nodes"),
        ("node,x,y,z,nx,ny,nz\n1,0,0,0,0,0,0\n", None, "a normal of 0, 0, 0"),
        ("node,x,y,z,rx\n1,0,0,0,90\n", None, "the columns rx"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, unit: str | None, said: str) -> None:
    with pytest.raises((InputError, InputErrors), match=said):
        geometry_of(_file(tmp_path, text), unit)
