"""What a fit does not explain, as errors of its stiffnesses, against residuals that were drawn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.vibration.fitted_model import FittedModel, fitted_model
from identify.vibration.misfit import components, misfit
from tests.batch import planar


@pytest.fixture(scope="module")
def fit(planar_fit: Path) -> FitResult:
    return result_file.read(planar_fit, FitResult)


@pytest.fixture(scope="module")
def model(fit: FitResult) -> FittedModel:
    return fitted_model(fit, "fit.h5")


def _altered(fit: FitResult, errors: list[float], noise: float, decay: float = 0.0) -> FitResult:
    """With residuals in place of its own: noise, in units of the stated, and a relative error of each
    stiffness, complex and anew at each line; closed form, of records behind a window of that decay, 1/s.
    """
    rng = np.random.default_rng(3)
    value = dict(zip(fit.parameters.name, fit.parameters.value, strict=True))
    k, c = (np.array([value[f"joint{n}.rz.{w}"] for n in (1, 2, 3)]) for w in ("stiffness", "damping"))
    found = {}
    for name, one in fit.measurements.items():
        assert one.frf is not None and one.frf.noise is not None
        rows = dict(zip(*planar.channels(np.deg2rad(one.posture_deg)), strict=True))
        out, force = (np.array([rows[t] for t in texts]) for texts in (one.frf.output, one.frf.input))
        measured = one.frf.fitted.copy()
        for line, hz in enumerate(one.frf.frequency_hz):
            s = decay + 2j * np.pi * hz
            z = np.diag(k) + s * np.diag(c) + s**2 * planar.mass_matrix(np.deg2rad(one.posture_deg))
            xi = np.array(errors) * (rng.normal(size=3) + 1j * rng.normal(size=3)) / np.sqrt(2)
            inside = np.linalg.inv(z)
            measured[line] -= s**2 * np.sum((out @ inside @ np.diag(k * xi) @ inside) * force, axis=1)
        shape = measured.shape
        drawn = rng.normal(size=shape) + 1j * rng.normal(size=shape)
        measured = measured + noise * one.frf.noise * drawn
        found[name] = replace(one, frf=replace(one.frf, measured=measured, window_decay_per_s=decay))
    return replace(fit, measurements=found)


def test_errors_of_stiffnesses_are_found_beside_noise(fit: FitResult, model: FittedModel) -> None:
    names = [parameter.name for parameter in model.system(model.posture).parameters]
    own = [names.index(f"joint{n}.rz.stiffness") for n in (1, 2, 3)]
    found = misfit(_altered(fit, [0.0, 0.05, 0.0], 1.0), model)
    assert found[own[1]] == pytest.approx(0.05, rel=0.25)
    assert found[[own[0], own[2]]].max() < 0.01
    both = misfit(_altered(fit, [0.1, 0.05, 0.1], 1.0), model)
    assert both[own] == pytest.approx([0.1, 0.05, 0.1], rel=0.35)
    assert not np.delete(both, own).any(), "dampers are the imaginary part of stiffnesses"


def test_a_window_widens_what_stiffnesses_do(fit: FitResult, model: FittedModel) -> None:
    own = [p.name for p in model.system(model.posture).parameters].index("joint2.rz.stiffness")
    windowed = _altered(fit, [0.0, 0.05, 0.0], 1.0, decay=30.0)
    assert misfit(windowed, model)[own] == pytest.approx(0.05, rel=0.25)
    untold = {
        name: replace(one, frf=replace(one.frf, window_decay_per_s=0.0))  # type: ignore[type-var]
        for name, one in windowed.measurements.items()
    }
    assert misfit(replace(windowed, measurements=untold), model)[own] < 0.03


def test_noise_alone_is_no_misfit(fit: FitResult, model: FittedModel) -> None:
    assert misfit(_altered(fit, [0.0, 0.0, 0.0], 1.0), model).max() < 0.005
    assert misfit(fit, model).max() < 0.005
    assert misfit(_altered(fit, [0.0, 0.0, 0.0], 3.0), model).max() < 0.015, "that is in the covariance"
    assert misfit(_altered(fit, [0.0, 0.1, 0.0], 3.0), model).max() > 0.07


def test_components_are_linear_in_powers() -> None:
    rng = np.random.default_rng(5)
    slope = rng.uniform(0.1, 5.0, (20000, 2))
    noise = np.full(20000, 0.3)
    power = (noise + slope @ [0.5, 0.1]) * rng.exponential(size=20000)
    assert components(power, noise, slope, 0) == pytest.approx([0.5, 0.1], rel=0.1)
    assert components(power, noise, slope, 20000) == pytest.approx(
        components(2 * power, noise, slope, 0), rel=1e-6
    ), "half of what was measured went into the fit"
    assert components(power, noise / 2, slope, 0) == pytest.approx([0.5, 0.1], rel=0.1), "noise understated"
    assert components(power - noise, 0 * noise, slope, 0) == pytest.approx([0.5, 0.1], rel=0.15)
    assert not components(np.zeros(0), np.zeros(0), np.zeros((0, 2)), 3).any()
