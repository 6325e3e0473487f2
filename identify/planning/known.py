"""What is known before a test: of a study, its start values; of a fit, what its data said."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core.arrays import Array, Index
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.fitting.tables import scale_of
from identify.model.effects.measurement import MeasurementEffect
from identify.model.system import build_site, list_parameters
from identify.planning.information import TestNoise
from identify.results import file as result_file
from identify.results.fit import FitResult, FrfComparison
from identify.robot.points import read_points
from identify.robot.read import read_robot
from identify.vibration.fitted_model import FittedModel, fitted_model
from identify.vibration.study import read_study


@dataclass(frozen=True)
class Known:
    """The model, its free parameters (names, units, numbers among the model's), and the derivative of their
    values by the search scale; information and bounds (p, p): what data and bounds say of them on that scale;
    the noise of an accelerance; band (3,): lowest, highest frequency and resolution, Hz.

    config: text of the study; config_folder: where its paths begin, None in the text of a fit.
    """

    name: str
    model: FittedModel
    names: tuple[str, ...]
    units: tuple[str, ...]
    free: Index
    step: Array
    information: Array
    bounds: Array
    noise: TestNoise
    band: Array
    gap: float
    config: str
    config_folder: Path | None


def known_of(path: Path, noise: float | None, resolution: float | None) -> Known:
    """Of a study or a fit; noise, m/s^2/N, and resolution, Hz, where they are told.

    InputError for a file that is neither, and where noise, band or resolution is not known.
    """
    if path.suffix in (".yaml", ".yml"):
        return _of_study(path, noise, resolution)
    return _of_fit(path, noise, resolution)


def _of_study(path: Path, noise: float | None, resolution: float | None) -> Known:
    file = read_study(path)
    study, where = file.study, str(path)
    if noise is None or resolution is None:
        raise InputError(
            where, "without data, noise and resolution are not known", "`--noise 0.003 --resolution 0.5`"
        )
    if study.band_hz is None:
        raise InputError(f"{where}: band_hz", "missing", "the band of the test, such as [3, 80]")
    if study.points is None:
        raise InputError(f"{where}: points", "missing", "the points that can be hit and measured")
    robot, points = read_robot(study.robot, path.parent), read_points(file.resolve(study.points))
    posture = np.deg2rad(np.array(study.measurements[0].posture_deg))
    effects = [effect for effect in study.effects if not isinstance(effect, MeasurementEffect)]
    with file.located():
        parameters = list_parameters(robot, build_site(robot, posture, effects, points=points), effects)
    values, lower, upper = (
        np.array([getattr(one, key) for one in parameters]) for key in ("initial", "lower", "upper")
    )
    log, scale = np.array([one.log for one in parameters]), Scale(tuple(parameters))
    spread = np.zeros((len(parameters), 1))
    model = FittedModel(robot, points, effects, values, spread, log, lower, upper, posture, study.band_hz)
    free = scale.free
    return Known(
        study.name,
        model,
        tuple(parameters[k].name for k in free),
        tuple(parameters[k].unit for k in free),
        free,
        scale.slope(scale.to_x(values)),
        np.zeros((len(free), len(free))),
        np.diag(scale.prior_information()),
        TestNoise(noise),
        np.array([*study.band_hz, resolution]),
        0.0,
        file.text,
        path.parent,
    )


def _of_fit(path: Path, noise: float | None, resolution: float | None) -> Known:
    fit: FitResult = result_file.read(path, FitResult)
    model = fitted_model(fit, str(path))
    own = [parameter.name for parameter in model.system(model.posture).parameters]
    table, scale = fit.parameters, scale_of(fit.parameters)
    rows = [k for k, row in enumerate(scale.free) if table.name[row] in own]
    named = tuple(table.name[scale.free[k]] for k in rows)
    std = table.std[scale.free[rows]]
    covariance = std[:, None] * fit.correlation[np.ix_(rows, rows)] * std
    frfs = [one.frf for one in fit.measurements.values() if one.frf is not None]
    if not (named and frfs):
        raise InputError(str(path), "no free parameter, or no FRFs", "a fit of FRFs")
    line_hz = frfs[0].frequency_hz
    apart = resolution or float(np.median(np.diff(line_hz)))
    return Known(
        fit.name,
        model,
        named,
        tuple(table.unit[scale.free[k]] for k in rows),
        np.array([own.index(name) for name in named]),
        scale.slope(scale.to_x(table.value))[rows],
        np.asarray(np.linalg.inv(covariance)),
        np.diag(scale.prior_information()[rows]),
        TestNoise(_floor(frfs) if noise is None else noise),
        np.array([line_hz[0], line_hz[-1], apart]),
        fit.gap,
        fit.provenance.config,
        None,
    )


def _floor(frfs: list[FrfComparison]) -> float:
    """The median noise of a fit's accelerances; InputError where there are none."""
    found = [one.noise.ravel() for one in frfs if one.noise is not None and one.quantity == "accelerance"]
    if not found:
        raise InputError("--noise", "not given, and the fit has no accelerances", "m/s^2/N, such as 0.003")
    return float(np.median(np.concatenate(found)))
