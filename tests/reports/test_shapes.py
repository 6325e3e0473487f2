"""Mode shapes made ready for pictures."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from identify.reports.shared import robot_figure
from identify.reports.shared.shapes import mode_views
from tests.reports.sample import frf_result, modal_result


def test_the_largest_displacement_is_one_and_real() -> None:
    for view in mode_views(frf_result().measurements["posture1"]):
        assert view.points is not None and view.skeleton is not None
        both = np.concatenate([view.points, view.skeleton])
        assert np.linalg.norm(both, axis=1).max() == pytest.approx(1.0)
        largest = both.ravel()[np.argmax(np.abs(both))]
        assert largest.imag == pytest.approx(0.0, abs=1e-12)
        assert largest.real > 0
        assert view.measured_points is None
        assert view.measured == ""


def test_measured_shapes_are_turned_and_scaled_to_the_model() -> None:
    first = mode_views(modal_result().measurements["table"])[0]
    assert first.points is not None and first.measured_points is not None
    assert np.isnan(first.measured_points[0]).all(), "the first point was not measured"
    # The sample's measured shape is the model's times 4.2j, but for one direction of the last point.
    assert first.measured_points[1:-1] == pytest.approx(first.points[1:-1], rel=0.15, abs=0.02)
    assert first.label == "1: 12.05 Hz, damping 4.100 %"
    assert first.measured == "12.10 Hz, damping 4.350 %, MAC 0.9876"


def test_a_measured_mode_without_a_pair_comes_last() -> None:
    views = mode_views(modal_result().measurements["table"])
    assert len(views) == 5
    assert views[-1].points is None
    assert views[-1].label == "measured, no pair: 44.40 Hz, damping 2.000 %"
    assert views[-1].measured_points is not None
    assert np.nanmax(np.linalg.norm(views[-1].measured_points, axis=1)) == pytest.approx(1.0)


def test_bodies_of_links_are_drawn_in_the_pdf() -> None:
    m = modal_result().measurements["table"]
    bare = dataclasses.replace(m.geometry, bodies=None)
    for geometry, count in ((m.geometry, 1), (bare, 0)):
        for figure in (
            robot_figure.postures([robot_figure.PostureView("rest", geometry)]),
            robot_figure.shapes(geometry, mode_views(m)[:1]),
        ):
            drawn = [one for one in figure.axes[0].collections if isinstance(one, PolyCollection)]
            assert len(drawn) == count
            assert all(len(one.get_paths()) == 8 for one in drawn)


def test_a_mode_that_moves_nothing() -> None:
    m = frf_result().measurements["posture1"]
    m.modes.point_shapes[2] = 0
    m.modes.skeleton_shapes[2] = 0
    still = mode_views(m)[2]
    assert still.points is not None
    assert not still.points.any()
