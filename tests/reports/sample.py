"""Results compensated for the reports' tests: plausible numbers from closed forms, with everything awkward
that a result may hold.

The FRFs are those of three modes with made-up shapes at points of a bent arm; nothing is computed by the
package.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from identify.results.fit import (
    FitResult,
    FrfComparison,
    MeasurementResult,
    ModePairs,
    ProfileCurve,
    PublishedValues,
)
from identify.results.tables import (
    Bodies,
    Geometry,
    Modes,
    ParameterTable,
    Provenance,
    SettingTable,
    StartTable,
)

HZ, DAMPING = np.array([12.05, 27.39, 61.5, 187.25]), np.array([0.041, 0.032, 0.0525, 0.081])
CONFIG = (
    'schema: identify/1\nname: made_up_arm\n# </script><script>alert("#config")</script> & *stars* $5$ {{'
    " braces }}\nband_hz: [3, 80]\n"
)
_AXES = ("X", "Y", "Z")


def frf_result(lines: int = 120, points: int = 6, **changes: Any) -> FitResult:
    """A fit to FRFs: one posture for validation, one FRF that the model does not move, one parameter fixed,
    one at its bound.
    """
    rng = np.random.default_rng(7)
    measurements = {
        "posture1": _measurement(rng, "posture1", "fit", lines, points),
        "posture2": _measurement(rng, "posture2", "validate", lines, points),
    }
    return dataclasses.replace(_result(measurements), **changes)


def modal_result(**changes: Any) -> FitResult:
    """A fit to a modal table: no FRFs, one measured mode without a pair, one damping ratio not measured, no
    validation.
    """
    rng = np.random.default_rng(8)
    geometry, modes = _geometry(8), _modes(rng, 8, 9)
    geometry = dataclasses.replace(geometry, bodies=_bodies(geometry))
    modes = dataclasses.replace(modes, body_shapes=np.tile(modes.skeleton_shapes[:, 2:4], 2))
    pairs = ModePairs(
        measured_frequency_hz=np.array([12.1, 27.2, 44.4]),
        measured_damping_ratio=np.array([0.0435, np.nan, 0.02]),
        measured=np.array([0, 1]),
        model=np.array([0, 1]),
        mac=np.array([0.9876, 0.9123]),
        mac_matrix=np.array([[0.9876, 0.02, 0.1, 0.0], [0.05, 0.9123, 0.2, 0.01], [0.11, 0.21, 0.28, 0.3]]),
        measured_shapes=_measured_shapes(modes),
        origin="modal table modes.yaml",
    )
    one = MeasurementResult(
        "table",
        "fit",
        "modes.yaml",
        "ab" * 32,
        np.array([0.0, -90.0, 12.5]),
        np.nan,
        geometry,
        modes,
        None,
        pairs,
    )
    verdict = (
        "The fit ended at a cost of 0.00079 after 0.6 s; one start reached it.",
        "Second sentence.",
        "Third sentence.",
    )
    base = _result({"table": one})
    given = {
        "verdict": verdict,
        "notes": (),
        "gap": np.nan,
        "gap_validation": np.nan,
        "cost_kind": "eigenfrequency",
        **changes,
    }
    return dataclasses.replace(base, **given)


def large_result(frfs: int = 3000, lines: int = 500) -> FitResult:
    """As many FRFs as a report must bear, in three measurements."""
    rng = np.random.default_rng(9)
    points = frfs // 27
    names = ("posture1", "posture2", "posture3")
    return _result({name: _measurement(rng, name, "fit", lines, points, inputs=3) for name in names})


def _measurement(
    rng: np.random.Generator, name: str, use: str, lines: int, points: int, inputs: int = 2
) -> MeasurementResult:
    modes = _modes(rng, points, 5)
    frf = _frf(rng, modes, lines, points, inputs)
    gap = float(np.sqrt(np.mean(frf.gap**2))) if frf.gap is not None else float("nan")
    posture = np.array([-7.6, 12.8, 44.5, 12.5, 46.2, -34.1])
    return MeasurementResult(
        name, use, f"{name}.uff", "cd" * 32, posture, gap, _geometry(points), modes, frf, None
    )


def _geometry(points: int) -> Geometry:
    t = np.linspace(0, 1, points)
    skeleton = np.array([[0, 0, 0], [0, 0, 0.5], [0.2, 0, 0.8], [0.5, 0.1, 1.4], [1.2, 0.2, 1.3]])
    along = np.stack([np.interp(t, np.linspace(0, 1, 5), skeleton[:, axis]) for axis in range(3)], axis=1)
    links = tuple(f"link_{int(4 * x)}" for x in t)
    names = tuple(f"p<{i}>" for i in range(1, points + 1))
    turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    axes = np.tile(turned, (points, 1, 1))
    places = along + np.array([0.05, 0.03, 0.02])
    bodies = ("foot", "column", "upper arm", "forearm")
    return Geometry(np.arange(1, points + 1), names, links, places, skeleton, None, axes, bodies)


def _bodies(geometry: Geometry) -> Bodies:
    """Two links look like tetrahedra, the mesh of a third was not found."""
    corners = 0.3 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    pose = np.tile(np.eye(4), (2, 1, 1))
    pose[:, :3, 3] = geometry.skeleton[1:3]
    of_link, bare = np.repeat([0, 1], 4), np.array([True, False, False, True])
    said = ("link forearm is drawn as a line, not as its body (<arm>.dae: meshes are not read)",)
    return Bodies(
        ("column", "upper arm"), pose, np.tile(corners, (2, 1)), of_link, np.r_[faces, faces + 4], bare, said
    )


def _modes(rng: np.random.Generator, points: int, joints: int) -> Modes:
    t = np.linspace(0, 1, points)[None, :, None]
    direction = rng.normal(size=(4, 1, 3)) + 0.2j * rng.normal(size=(4, 1, 3))
    at_joints = np.linspace(0, 1, 5)[None, :, None]
    return Modes(HZ, DAMPING, direction * t**2, direction * at_joints**2)


def _measured_shapes(modes: Modes) -> np.ndarray:
    """The first three shapes, turned, scaled and slightly wrong; the first point was not measured."""
    shapes = 4.2j * modes.point_shapes[:3]
    shapes[:, -1, 2] *= 1.1
    shapes[:, 0] = np.nan
    return shapes


def _frf(rng: np.random.Generator, modes: Modes, lines: int, points: int, inputs: int) -> FrfComparison:
    f = np.linspace(3.125, 80.0, lines)
    s = 2j * np.pi * f[:, None]
    outputs = [(node, axis) for node in range(points) for axis in range(3)]
    forced = [(points - 1, axis) for axis in range(inputs)]
    pairs = [(o, i) for o in outputs for i in forced]
    fitted, initial = (_accelerance(modes, s, pairs, shift) for shift in (1.0, 1.13))
    fitted[:, 0] = 0.0
    initial[:, 0] = 0.0
    sigma = np.maximum(0.02 * np.abs(fitted), 2e-5)
    measured = fitted + sigma * (rng.normal(size=fitted.shape) + 1j * rng.normal(size=fitted.shape))
    measured[lines // 2 :, 3] *= 1.5
    difference = np.abs(fitted - measured)
    size = np.linalg.norm(measured, axis=0)
    top = np.abs(np.sum(measured.conj() * fitted, axis=0)) ** 2
    return FrfComparison(
        quantity="accelerance",
        unit="m/s^2/N",
        window_decay_per_s=0.7,
        frequency_hz=f,
        output=tuple(f"{node + 1}:+{_AXES[axis]}" for (node, axis), _ in pairs),
        input=tuple(f"{node + 1}:-{_AXES[axis]}" for _, (node, axis) in pairs),
        measured=measured,
        initial=initial,
        fitted=fitted,
        band_95=0.03 * np.abs(fitted),
        noise=sigma,
        coherence=1 / (1 + 4e-4 * (1 + rng.random(fitted.shape))),
        gap=np.sqrt(np.mean((difference / sigma) ** 2, axis=0) / 2),
        relative_error=np.linalg.norm(difference, axis=0) / size,
        frac=top / np.maximum(size**2 * np.linalg.norm(fitted, axis=0) ** 2, 1e-30),
        area_error=np.abs(np.abs(fitted) - np.abs(measured)).sum(axis=0) / np.abs(measured).sum(axis=0),
    )


def _accelerance(modes: Modes, s: np.ndarray, pairs: list[Any], shift: float) -> np.ndarray:
    total = np.zeros((len(s), len(pairs)), dtype=complex)
    for hz, damping, shape in zip(modes.frequency_hz, modes.damping_ratio, modes.point_shapes, strict=True):
        w = 2 * np.pi * hz * shift
        residue = np.array([(shape[o] * shape[i]).real for o, i in pairs]) / 40
        total += s**2 * residue / (s**2 + 2 * damping * w * s + w**2)
    return total


def _result(measurements: dict[str, MeasurementResult]) -> FitResult:
    starts = StartTable(
        initial=np.array([[1.0e6, 400.0, 2.0e5, 35.0, -0.02], [3.0e6, 150.0, 9.0e4, 35.0, 0.03]]),
        final=np.array([[1.8345e6, 1959.06, 1.0e8, 35.0, 0.0123], [9.0e5, 800.0, 3.0e4, 35.0, -0.04]]),
        cost=np.array([1.0295611, 2.75]),
        evaluations=np.array([166, 219]),
        seconds=np.array([0.4017, 0.4772]),
        converged=np.array([True, False]),
        sentence=("ftol is satisfied", "the budget is spent"),
    )
    return FitResult(
        key="key",
        name="made_up_arm",
        seed=3,
        verdict=(
            "The fit ended at a cost of 1.03 after 1.6 s; 1 of 2 starts reached it.",
            "The model agrees.",
            "3 of 4 free parameters are determined.",
        ),
        notes=("only one start found the best minimum, 1 < 2 & more `starts` would tell",),
        effects=("drive compliance of joint 1 (rz)", "appended mass at link_3"),
        cost_kind="frf-least-squares",
        cost=1.0295611,
        gap=1.0331,
        gap_validation=1.0626,
        converged=True,
        seconds=1.5958,
        parameters=_parameters(),
        correlation=np.array([[1, 0.2, -0.7, 0], [0.2, 1, 0.1, 0.3], [-0.7, 0.1, 1, 0], [0, 0.3, 0, 1.0]]),
        singular_values=np.array([5.2e3, 812.5, 12.25, 0.0]),
        directions=np.eye(4),
        inseparable=("offset.z",),
        starts=starts,
        history=_history(),
        measurements=measurements,
        published=PublishedValues(
            "Table 2 of a paper", np.array([1.9e6, np.nan, 5.0e7, np.nan, np.nan]), HZ[:2] * 1.01, DAMPING[:2]
        ),
        profiles={
            "joint1.rz.damping": ProfileCurve(
                np.linspace(1400, 2600, 7), np.linspace(-3, 3, 7) ** 2, 1575.5, 2371.25
            )
        },
        provenance=_provenance(),
    )


def _parameters() -> ParameterTable:
    return ParameterTable(
        name=(
            "joint1.rz.stiffness",
            "joint1.rz.damping",
            "joint2.rz.stiffness",
            "mass.link_3.mass",
            "offset.z",
        ),
        unit=("N m/rad", "N m s/rad", "N m/rad", "kg", "m"),
        initial=np.array([1.0e6, 400.0, 2.0e5, 35.0, -0.02]),
        value=np.array([1834540.53, 1959.06259, 1.0e8, 35.0, 0.0123]),
        lower=np.array([1e4, 0.1, 1e4, 1.0, -0.05]),
        upper=np.array([1e8, 1e5, 1e8, 100.0, 0.05]),
        log=np.array([True, True, True, False, False]),
        free=np.array([True, True, True, False, True]),
        std=np.array([0.011, 0.13, 0.6, np.nan, 0.02]),
        low_95=np.array([1.7954e6, 1518.2, 3.1e7, np.nan, -0.027]),
        high_95=np.array([1.8746e6, 2527.9, 1.0e8, np.nan, 0.05]),
        status=("determined", "determined", "weak", "fixed", "not determined"),
    )


def _history() -> np.ndarray:
    rows = [
        (start, stage, k, 30.0 / (1 + k) + 1.03, 0.01 * k)
        for start in range(2)
        for stage in range(2)
        for k in range(1, 30, 3)
    ]
    return np.array(rows)


def _provenance() -> Provenance:
    return Provenance(
        identify="0.1.0",
        python="3.11.7",
        platform="Linux x86_64",
        packages=("numpy 2.4.6", "scipy 1.17.1"),
        written="2025-03-04T05:06:07+00:00",
        config_path="made_up_arm.yaml",
        config_sha256="12" * 32,
        config=CONFIG,
        input_files=("a/long/folder/with/many/parts/and/more/parts/of/it/robot.urdf", "points.csv"),
        input_sha256=("34" * 32, "56" * 32),
        settings=SettingTable(
            (
                "name",
                "band_hz",
                "measurements.0.noise",
                "measurements.1.noise",
                "measurements.0.file",
                "measurements.1.file",
                "seed",
            ),
            ("made_up_arm", "[3, 80]", "coherence", "coherence", "null", "a < b.uff", "3"),
            (
                "made_up_arm.yaml line 2",
                "made_up_arm.yaml line 4",
                "default",
                "default",
                "default",
                "made_up_arm.yaml line 9",
                "command line",
            ),
        ),
    )
