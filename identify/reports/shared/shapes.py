"""Mode shapes made ready for pictures: scaled alike, the measured ones turned and scaled to fit the
model's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Complex
from identify.reports.kit.cells import number, percent
from identify.reports.shared.pick import mac_of, partner, shown_modes
from identify.results.fit import MeasurementResult
from identify.results.modes import AnalysedMeasurement
from identify.results.tables import Modes


@dataclass(frozen=True)
class ModeView:
    """A mode to look at.

    points (n, 3), skeleton (k, 3): the model's shape, largest displacement real and 1; None for a measured
    mode without a pair. measured (n, 3): the measured shape on the same scale, NaN where a point was not
    measured; None without one. label names the mode; model and measured say frequency and damping, empty
    where there is none. bodies (b, 6): shift and turn of the model's drawn links; hz:
    where the mode is, as measured where it is.
    """

    label: str
    model: str
    measured: str
    points: Complex | None
    skeleton: Complex | None
    measured_points: Complex | None
    bodies: Complex | None = None
    hz: float = np.nan


def mode_views(m: MeasurementResult) -> list[ModeView]:
    """The listed modes of the model with their measured ones, then the measured ones without a pair."""
    views = [_model_view(m, row) for row in range(shown_modes(m))]
    pairs = m.pairs
    if pairs is None or pairs.measured_shapes is None:
        return views
    for mode in np.setdiff1d(np.arange(len(pairs.measured_frequency_hz)), pairs.measured):
        shape = pairs.measured_shapes[mode]
        text = mode_text(pairs.measured_frequency_hz[mode], pairs.measured_damping_ratio[mode])
        views.append(ModeView(f"measured, no pair: {text}", "", text, None, None, shape / _largest(shape)))
    return views


def analysed_views(m: AnalysedMeasurement) -> list[ModeView]:
    """The modes of a modal analysis on its geometry; none where it is not known."""
    if m.shapes is None:
        return []
    views = []
    for row, shape in enumerate(m.shapes):
        text = mode_text(m.modes.frequency_hz[row], m.modes.damping_ratio[row])
        hz = float(m.modes.frequency_hz[row])
        views.append(ModeView(f"{row + 1}: {text}", "", text, None, None, shape / _largest(shape), hz=hz))
    return views


def model_view(modes: Modes, row: int) -> ModeView:
    """A mode of a model, without a measured one."""
    places = modes.point_shapes.shape[1]
    shape = np.concatenate([modes.point_shapes[row], modes.skeleton_shapes[row]])
    size = _largest(shape)
    shape = shape / size
    bodies = None if modes.body_shapes is None else modes.body_shapes[row] / size
    text = mode_text(modes.frequency_hz[row], modes.damping_ratio[row])
    hz = float(modes.frequency_hz[row])
    return ModeView(f"{row + 1}: {text}", text, "", shape[:places], shape[places:], None, bodies, hz)


def _model_view(m: MeasurementResult, row: int) -> ModeView:
    view = model_view(m.modes, row)
    measured_text, measured, hz = "", None, view.hz
    mode = None if m.pairs is None else partner(m.pairs, row)
    if m.pairs is not None and mode is not None:
        mac, hz = mac_of(m.pairs, row), float(m.pairs.measured_frequency_hz[mode])
        measured_text = mode_text(hz, float(m.pairs.measured_damping_ratio[mode])) + (
            "" if np.isnan(mac) else f", MAC {number(mac)}"
        )
        if m.pairs.measured_shapes is not None:
            measured = None if view.points is None else _fitted_to(m.pairs.measured_shapes[mode], view.points)
    return replace(view, measured=measured_text, measured_points=measured, hz=hz)


def beside_views(a: MeasurementResult, b: MeasurementResult, became: dict[int, int]) -> list[ModeView]:
    """The listed modes of model a, with the shape of b's mode that each became (by number) where a measured
    one would be.
    """
    views = []
    for row in range(shown_modes(a)):
        view, other = _model_view(a, row), became.get(row)
        text, moved = "", None
        if other is not None:
            text = mode_text(b.modes.frequency_hz[other], b.modes.damping_ratio[other])
            same = view.points is not None and np.array_equal(a.geometry.nodes, b.geometry.nodes)
            moved = (
                _fitted_to(b.modes.point_shapes[other], view.points)
                if same and view.points is not None
                else None
            )
        views.append(replace(view, measured=text, measured_points=moved))
    return views


def mode_text(hz: float, ratio: float) -> str:
    """Frequency and, where it is known, damping of a mode."""
    return f"{number(hz)} Hz" + ("" if np.isnan(ratio) else f", damping {percent(ratio)} %")


def _largest(shape: Complex) -> complex:
    """What a shape (places, 3) is divided by so that its largest displacement is real and 1; 1 for a shape
    that is zero.
    """
    known = np.nan_to_num(shape)
    length = np.linalg.norm(known, axis=1).max()
    if length == 0:
        return 1.0
    component = known.ravel()[np.argmax(np.abs(known))]
    return complex(length * component / np.abs(component))


def _fitted_to(measured: Complex, model: Complex) -> Complex:
    """The measured shape times the complex factor that brings it nearest to the model's (the modal scale
    factor).
    """
    known = np.isfinite(measured).all(axis=1)
    power = np.vdot(measured[known], measured[known]).real
    return np.asarray(measured * (np.vdot(measured[known], model[known]) / power if power else 1.0))
