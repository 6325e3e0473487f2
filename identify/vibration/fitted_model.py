"""A model rebuilt from the result of a fit alone, with the covariance of its parameters,
and where the robot stands, as a command says it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.config import validated
from identify.core.errors import InputError
from identify.core.yaml_input import parse_yaml
from identify.fitting.tables import scale_of
from identify.measured.channel import Channel, motors_of
from identify.model.effects.base import Effect
from identify.model.effects.measurement import MeasurementEffect
from identify.model.effects.site import Site
from identify.model.geometry import visuals_of
from identify.model.system import Factors, System, assemble, build_site, list_parameters
from identify.results.fit import Description, FitResult
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.read import read_robot
from identify.vibration.fitted_errors import Off, corrected, with_errors
from identify.vibration.given import measurement_names
from identify.vibration.study import Study
from identify.vibration.study_points import study_points


@dataclass(frozen=True)
class FittedModel:
    """A model with its fitted parameters: values (p,), spread (p, f) with spread @ spread.T their covariance;
    posture (joints,), rad, of the first measurement, and the band of the fit, Hz, where it had one.

    log (p,): which of them are fitted on a logarithmic scale; lower, upper (p,): their bounds.  robot: as the
    fit found it, where nuisance parameters were fitted along; off: those errors.  driven: joints whose
    motors' torques were inputs, by name of the measurement; detached: measurements without the last links.
    """

    robot: Robot
    points: Mapping[int, Point]
    effects: Sequence[Effect]
    values: Array
    spread: Array
    log: NDArray[np.bool_]
    lower: Array
    upper: Array
    posture: Array
    band_hz: tuple[float, float] | None
    off: Off | None = None
    driven: Mapping[str, frozenset[int]] = field(default_factory=dict)
    detached: frozenset[str] = frozenset()

    def system(self, posture: Array, driven: frozenset[int] = frozenset()) -> System:
        """The model at a posture (joints,), rad, with the motors of some joints driven."""
        site = build_site(self.robot, posture, self.effects, points=self.points, reference=self._first)
        return assemble(self.robot, site, self.effects, driven=driven)

    def sensitivity(self, system: System, posture: Array) -> tuple[Factors, Array]:
        """What changes Z at a posture (joints,), rad, and a root (u, v) of the covariance of its u owners:
        the parameters, then what was stated of the robot, where that was said to be uncertain.
        """
        if self.off is None:
            return system.factors, self.spread
        return with_errors(self.off, self.robot, system, posture, self.spread)

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """(count, p): parameters drawn from their covariance, on the scale that they were fitted on and
        within their bounds.
        """
        return self._moved(rng.standard_normal((count, self.spread.shape[1])) @ self.spread.T)

    def drawn_matrices(
        self, system: System, posture: Array, count: int, rng: np.random.Generator, errors: Array
    ) -> tuple[Array, Array, Array]:
        """M, C, K (count, n, n) of a system at a posture (joints,), rad: with parameters and nuisance
        parameters
         drawn from their covariance, and relative errors of stiffnesses, of RMS errors (p,), as
        `identify.vibration.misfit` has them: their real part, which is all that acts at rest.
        """
        factors, root = self.sensitivity(system, posture)
        change, own = rng.standard_normal((count, root.shape[1])) @ root.T, len(self.values)
        values = self._moved(change[:, :own])
        if errors.any():
            values = values * np.exp(errors / np.sqrt(2) * rng.standard_normal(values.shape))
        found = list(system.matrices(values))
        for power, matrix in ((0, 2), (2, 0)):
            kept = (factors.owner >= own) & (factors.power == power)
            amounts = change[:, factors.owner[kept]] * np.asarray(factors.weight[kept]).real
            vectors = factors.vectors[:, kept]
            found[matrix] = found[matrix] + (vectors * amounts[:, None, :]) @ vectors.T
        return found[0], found[1], found[2]

    def _moved(self, change: Array) -> Array:
        """Parameters (count, p) at changes (count, p), on the scale that they were fitted on and within their
        bounds.
        """
        relative = np.divide(change, self.values, out=np.zeros_like(change), where=self.log)
        drawn = np.where(self.log, self.values * np.exp(np.clip(relative, -50, 50)), self.values + change)
        return np.where(np.any(self.spread, axis=1), np.clip(drawn, self.lower, self.upper), self.values)

    @cached_property
    def _first(self) -> Site:
        """The robot at the first measurement's posture, which scales start values as it did in the fit."""
        return build_site(self.robot, self.posture, self.effects, points=self.points)


def fitted_model(result: FitResult, where: str) -> FittedModel:
    """The model of a result; InputError where the result does not hold the robot, or holds another model than
    its config says.
    """
    if result.description is None:
        raise InputError(
            where, "without the robot's description", "a result of this version", "run the fit again"
        )
    data = parse_yaml(result.provenance.config, where)
    study = validated(Path(where), data, Study)
    robot, points = _described(study, result.description)
    first = next(iter(result.measurements.values()))
    robot = replace(robot, visuals=visuals_of(first.geometry))
    posture = np.deg2rad(first.posture_deg)
    effects = [effect for effect in study.effects if not isinstance(effect, MeasurementEffect)]
    known = tuple(
        p.name for p in list_parameters(robot, build_site(robot, posture, effects, points=points), effects)
    )
    kept = [row for row, name in enumerate(result.parameters.name) if name in known]
    if tuple(result.parameters.name[row] for row in kept) != known:
        raise InputError(
            where,
            "other parameters than its config names",
            "a result of `identify fit`",
            "fit the study with all its effects",
        )
    table, off, spread = result.parameters, None, _spread(result)
    if result.uncertainty is not None:
        robot, off = corrected(robot, result.uncertainty, where)
        spread = _slope(result) @ off.of_parameters
    return FittedModel(
        robot,
        points,
        effects,
        table.value[kept],
        spread[kept],
        table.log[kept],
        table.lower[kept],
        table.upper[kept],
        posture,
        study.band_hz,
        off,
        _driven(study, result),
        _detached(study),
    )


def _driven(study: Study, result: FitResult) -> dict[str, frozenset[int]]:
    """Joints whose motors are driven, so that nothing else holds them, by name of the measurement."""
    added = {
        name
        for name, one in zip(measurement_names(study.measurements), study.measurements, strict=True)
        if one.motor_torque == "added"
    }
    return {
        name: motors_of(map(Channel.parse, one.frf.input))
        for name, one in result.measurements.items()
        if one.frf is not None and name not in added
    }


def _detached(study: Study) -> frozenset[str]:
    """Names of the measurements for which links were taken off."""
    named = zip(measurement_names(study.measurements), study.measurements, strict=True)
    return frozenset(name for name, one in named if one.detached is not None)


def _described(study: Study, description: Description) -> tuple[Robot, dict[int, Point]]:
    """Robot and points from their texts, through the same readers as from files."""
    key = "urdf" if study.robot.urdf is not None else "dh"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot").write_text(description.robot, encoding="utf-8")
        robot = read_robot(study.robot.model_copy(update={key: Path("robot"), "arguments": {}}), folder)
        if not description.points:
            return robot, {}
        (folder / "points.csv").write_text(description.points, encoding="utf-8")
        return robot, study_points(study, folder / "points.csv", robot)


def _spread(result: FitResult) -> Array:
    """(p, f): a root of the covariance of all parameters."""
    std = result.parameters.std[scale_of(result.parameters).free]
    squares, directions = np.linalg.eigh(result.correlation)
    return np.asarray(_slope(result) @ (std[:, None] * directions * np.sqrt(np.maximum(squares, 0.0))))


def _slope(result: FitResult) -> Array:
    """(p, f): change of all parameters with the free ones on their search scale."""
    scale = scale_of(result.parameters)
    slope = np.zeros((len(result.parameters.name), len(scale.free)))
    slope[scale.free, np.arange(len(scale.free))] = scale.slope(scale.to_x(result.parameters.value))
    return slope


def check_band(band_hz: tuple[float, float]) -> None:
    """Raise an InputError for what is no band."""
    low, high = band_hz
    if not 0 <= low < high < np.inf:
        raise InputError("--band", f"{low:g} to {high:g} Hz", "two frequencies, the lower first")


def tool_point(model: FittedModel, node: int | None, where: str = "--tool") -> Point:
    """The point with a node, or the last one, or the origin of the last link where there are no points;
    InputError for an unknown node.
    """
    if node is not None and node not in model.points:
        raise InputError(
            where,
            f"no point {node}",
            "one of " + ", ".join(map(str, model.points)) if model.points else "no node",
        )
    if model.points:
        return model.points[node] if node is not None else list(model.points.values())[-1]
    last = model.robot.links[-1].name
    return Point(0, "origin", last, np.zeros(3), np.eye(3), "")


def posture_of(text: str | None, fit: FitResult, model: FittedModel) -> Array:
    """(joints,), rad, from angles in degrees, or the name of a measurement; default: that of the first.

    InputError for other texts.
    """
    names = list(fit.measurements)
    if text is None or text in names:
        return np.asarray(np.deg2rad(fit.measurements[text or names[0]].posture_deg))
    joints = len(model.robot.joints)
    try:
        angles = np.array([float(part) for part in text.split(",")])
    except ValueError:
        angles = np.array([])
    if angles.shape != (joints,) or not np.isfinite(angles).all():
        expected = f"{joints} angles in degrees such as 0,30,-60,0,45,0, or one of {', '.join(names)}"
        raise InputError("--posture", repr(text), expected)
    return np.asarray(np.deg2rad(angles))
