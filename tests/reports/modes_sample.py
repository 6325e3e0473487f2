"""A modal analysis compensated for the reports' tests: two measurements, one without geometry, from the same
closed forms as `sample`.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from identify.results.modes import (
    AnalysedMeasurement,
    ModesResult,
    ModeTable,
    Reciprocity,
    RejectedPoles,
    StabilisationDiagram,
)
from identify.results.tables import Geometry
from tests.reports.sample import DAMPING, HZ, frf_result


def modes_result() -> ModesResult:
    """Three modes at points with trace lines, and one mode of a measurement whose points are not known."""
    fitted = frf_result()
    m = fitted.measurements["posture1"]
    assert m.frf is not None
    lines = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]])
    geometry = dataclasses.replace(
        m.geometry, skeleton=np.zeros((0, 3)), point_links=("",) * 6, segments=lines
    )
    frf = dataclasses.replace(m.frf, initial=None, band_95=None, noise=None, gap=None)
    shapes = m.modes.point_shapes[:3]
    measurements = {
        "table": dataclasses.replace(_analysed("table", 3, shapes, geometry), frf=frf),
        "floor": dataclasses.replace(_analysed("floor", 1, shapes, None), frf=frf),
    }
    return ModesResult(
        name="made_up_beam",
        verdict=("table: 3 modes were found & kept.", "floor: One mode was found."),
        notes=("no geometry was given for <floor>",),
        seconds=1.25,
        measurements=measurements,
        provenance=dataclasses.replace(fitted.provenance, config_path="", config_sha256=""),
    )


def _analysed(name: str, modes: int, shapes: np.ndarray, geometry: Geometry | None) -> AnalysedMeasurement:
    flat = shapes[:modes].reshape(modes, -1)
    m = frf_result().measurements["posture1"]
    assert m.frf is not None
    return AnalysedMeasurement(
        name=name,
        file=f"{name}.uff",
        sha256="ab" * 32,
        posture_deg=np.zeros(0),
        estimator="pLSCF estimator",
        highest_order=20,
        total_error=0.0345,
        modes=_table(modes, flat),
        rejected=RejectedPoles(
            np.array([20.5, 33.25]),
            np.array([0.5, 0.001]),
            np.array([0.2, 0.9]),
            np.array([0.4, 0.99]),
            np.array([40.0, 2.0]),
            ("appears in 20 % of the orders", "duplicate of 33.3 Hz"),
            ("rare", "duplicate"),
        ),
        diagram=_diagram(),
        reciprocity=Reciprocity(("1:+X",), ("2:-Y",), np.array([0.99]), np.array([1.02]), np.array([0.03])),
        frf=m.frf,
        geometry=geometry,
        shapes=None if geometry is None else shapes[:modes],
    )


def _table(modes: int, flat: np.ndarray) -> ModeTable:
    rows = slice(modes)
    return ModeTable(
        frequency_hz=HZ[rows],
        frequency_std_hz=1e-3 * HZ[rows],
        damping_ratio=DAMPING[rows],
        damping_std=0.01 * DAMPING[rows],
        seen_frequency_hz=HZ[rows],
        seen_damping_ratio=1.2 * DAMPING[rows],
        mpc=np.array([0.999, 0.98, 0.9])[rows],
        mpd_deg=np.array([0.5, 3.0, 12.0])[rows],
        channels=tuple(f"{node}:+{axis}" for node in range(1, 7) for axis in "XYZ"),
        shapes=flat,
        references=("6:-X", "6:-Y"),
        participation=np.ones((modes, 2), complex),
        auto_mac=np.eye(modes) * 0.9 + 0.1,
    )


def _diagram() -> StabilisationDiagram:
    order = np.repeat(np.arange(2, 22, 2), 3)
    frequency = np.tile(HZ[:3], 10)
    lines = np.linspace(3.125, 80.0, 120)
    indicator = np.stack([1 / (1 + (lines - 27) ** 2), 0.1 / (1 + (lines - 60) ** 2)], axis=1)
    return StabilisationDiagram(order, frequency, np.full(30, 0.03), order > 8, lines, indicator)
