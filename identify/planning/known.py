"""What is known before a test: of a study, its start values; of a fit, what its data said."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.optimize

from identify.core.arrays import Array, Index
from identify.core.config import validated
from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.core.yaml_input import YAML_SUFFIXES, parse_yaml
from identify.fitting.tables import scale_of
from identify.model.effects.measurement import MeasurementEffect
from identify.model.system import build_site, list_parameters
from identify.planning.information import FreeModel, TestNoise
from identify.results.discovery import fit_of
from identify.results.fit import FrfComparison, StatedUncertainty
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.read import read_robot
from identify.vibration.fitted_model import FittedModel, fitted_model
from identify.vibration.given import posture_of
from identify.vibration.nuisances.settings import UncertaintySettings
from identify.vibration.study import Study, read_study
from identify.vibration.study_points import points_of

_GROWTH_DEGREE = 3
"""Of the logarithm of the noise of a test over frequency."""


@dataclass(frozen=True)
class FittedErrors:
    """Nuisance parameters (e), by place and change, in units of what was stated: covariance (p + e, p +
    e) of the free parameters on their search scale, then of these.
    """

    names: tuple[tuple[str, str], ...]
    covariance: Array


@dataclass(frozen=True)
class Known:
    """The model, its free parameters (names, units, numbers among the model's), and the derivative of their
    values by the search scale; information and bounds (p, p): what data and bounds say of them on that scale;
    the noise of an accelerance; band (3,): lowest, highest frequency and resolution, Hz.

    config: text of the study; config_folder: where its paths begin, None in the text of a fit.  settings:
    what was said to be uncertain of what was stated; fitted: what a fit found of it.
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
    settings: UncertaintySettings | None = None
    fitted: FittedErrors | None = None

    @property
    def free_model(self) -> FreeModel:
        """The model with its free parameters."""
        return FreeModel(self.model, self.free, self.step)

    def before(self, anew: bool) -> Array:
        """(p, p): what is known before the test; anew: as if there were no data yet."""
        return self.bounds if anew or not self.information.any() else self.information


def known_of(
    path: Path, noise: float | None, resolution: float | None, force_noise: float | None = None
) -> Known:
    """Of a study or a fit; noise, m/s^2/N, resolution, Hz, and the noise of the force, relative, where they
    are known.

    InputError for a file that is neither, and where noise, band or resolution is not known or not possible.
    """
    for option, value in {"noise": noise, "resolution": resolution, "force-noise": force_noise}.items():
        if value is not None and not (0 < value < np.inf or (value == 0 and option == "force-noise")):
            raise InputError(f"--{option}", f"{value:g}", "a number above 0")
    if path.suffix in YAML_SUFFIXES:
        return _of_study(path, noise, resolution, force_noise or 0.0)
    return _of_fit(path, noise, resolution, force_noise)


def places_of(path: Path) -> tuple[Robot, dict[int, Point]]:
    """The robot of a study or a fit, and all points that could be hit and measured."""
    if path.suffix in YAML_SUFFIXES:
        file = read_study(path)
        robot = read_robot(file.study.robot, path.parent)
        return robot, points_of(file, robot)
    model = fitted_model(fit_of(path), str(path))
    return model.robot, dict(model.points)


def _of_study(path: Path, noise: float | None, resolution: float | None, force_noise: float) -> Known:
    file = read_study(path)
    study, where = file.study, str(path)
    if noise is None or resolution is None:
        raise InputError(
            where, "without data, noise and resolution are not known", "`--noise 0.003 --resolution 0.5`"
        )
    if study.band_hz is None:
        raise InputError(f"{where}: band_hz", "missing", "the band of the test, such as [3, 80]")
    robot = read_robot(study.robot, path.parent)
    points = points_of(file, robot)
    if not points:
        raise InputError(f"{where}: points", "missing", "the points that can be hit and measured")
    posture = posture_of(study, study.measurements[0], robot, 0)
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
        TestNoise(noise, force_noise, study.measurements[0].window_decay_per_s or 0.0),
        np.array([*study.band_hz, resolution]),
        0.0,
        file.text,
        path.parent,
        study.uncertainty,
    )


def _of_fit(path: Path, noise: float | None, resolution: float | None, force_noise: float | None) -> Known:
    fit = fit_of(path)
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
        _noise(frfs, noise, force_noise),
        np.array([line_hz[0], line_hz[-1], apart]),
        fit.gap,
        fit.provenance.config,
        None,
        validated(path, parse_yaml(fit.provenance.config, str(path)), Study).uncertainty,
        None if fit.uncertainty is None else _errors(fit.uncertainty, rows),
    )


def _errors(stated: StatedUncertainty, rows: list[int]) -> FittedErrors:
    """What a fit found of what was stated; rows: of its free parameters."""
    assert stated.root is not None  # `fitted_model` has refused a result without
    first = len(stated.root) - len(stated.shift)
    kept = stated.root[[*rows, *range(first, len(stated.root))]]
    return FittedErrors(tuple(zip(stated.place, stated.change, strict=True)), kept @ kept.T)


def _noise(frfs: list[FrfComparison], floor: float | None, relative: float | None) -> TestNoise:
    """That of a fit's accelerances where it is not stated; InputError where there are none."""
    decay = float(np.median([one.window_decay_per_s for one in frfs]))
    found = [one for one in frfs if one.quantity == "accelerance"]
    known = [(one.noise.ravel(), np.abs(one.fitted).ravel()) for one in found if one.noise is not None]
    if not known:
        if floor is None:
            what = "not given, and the fit has no accelerances"
            raise InputError("--noise", what, "m/s^2/N, such as 0.003")
        return TestNoise(floor, relative or 0.0, decay)
    noise, size = (np.concatenate(column) for column in zip(*known, strict=True))
    columns = np.stack([np.ones_like(size), size**2], axis=1) / noise[:, None] ** 2  # relative errors alike
    own = np.sqrt(scipy.optimize.nnls(columns, np.ones(len(size)))[0])
    levels = [
        float(value) if given is None else given for value, given in zip(own, (floor, relative), strict=True)
    ]
    growth = () if floor is not None or relative is not None else noise_growth(found, levels[0], levels[1])
    return TestNoise(levels[0], levels[1], decay, growth)


def noise_growth(frfs: list[FrfComparison], floor: float, relative: float) -> tuple[float, ...]:
    """How the noise of accelerances grows along the frequency beyond what is flat: an impact has less force
    the higher the frequency, and what is measured is divided by it.
    """
    line_hz, level = [], []
    for one in frfs:
        if one.noise is not None:
            flat = floor**2 + (relative * np.abs(one.fitted)) ** 2
            line_hz.append(one.frequency_hz)
            level.append(0.5 * np.log(np.mean(one.noise**2 / flat, axis=1)))
    powers = np.polynomial.Polynomial.fit(
        np.concatenate(line_hz) / 100, np.concatenate(level), _GROWTH_DEGREE
    ).convert()
    return tuple(float(c) for c in powers.coef[::-1])
