"""Names are text in figures, whatever is in them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import matplotlib.ticker
import pytest
from matplotlib.figure import Figure

from identify.reports.kit.figures import plain_powers, style, svg
from identify.reports.outcome import Result
from identify.reports.shared.frf_figure import ticks
from tests.reports.sample import frf_result

NAME = r"m $\undefined{$ b"


def named() -> Result:
    data = frf_result(lines=40, points=2)
    first, *rest = data.measurements.values()
    renamed = {NAME: dataclasses.replace(first, name=NAME), **{one.name: one for one in rest}}
    return Result(dataclasses.replace(data, name=NAME, measurements=renamed), (Path("r.h5"),))


def test_a_name_with_two_dollars_is_drawn_as_it_is() -> None:
    drawn = {name: named().plot(name) for name in named().figures}
    assert any(NAME.encode() in svg(figure) for figure in drawn.values())


def test_without_it_such_a_name_ends_the_report() -> None:
    figure = Figure()
    figure.text(0.5, 0.5, NAME)
    with pytest.raises(ValueError, match="undefined"):
        svg(figure)


def test_powers_of_ten_are_plain_numbers() -> None:
    with style():
        figure = Figure()
        axes = figure.subplots()
        axes.plot([1, 2], [1e-9, 1e-6])
        axes.set_yscale("log")
        assert isinstance(axes.yaxis.get_major_formatter(), matplotlib.ticker.LogFormatter)
        drawn = svg(plain_powers(figure)).decode()
    assert "1e-07" in drawn and "mathdefault" not in drawn


def test_decades_of_small_panels_are_plain_numbers() -> None:
    assert [label for _, label in ticks((1e-4, 0.1), log=True)] == ["0.0001", "0.001", "0.01", "0.1"]
    assert [label for _, label in ticks((1e-7, 1e-5), log=True)] == ["1e-07", "1e-06", "1e-05"]
