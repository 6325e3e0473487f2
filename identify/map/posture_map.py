"""A fitted model at any posture: modes, static compliance and FRFs of a point, with intervals.

The model is rebuilt from the result of a fit alone.  Intervals are by the delta method: exact sensitivities
at the fitted values times the covariance of the fit.  They say what the noise of the fitted data leaves open,
not what the model lacks.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array
from identify.core.config import validated
from identify.core.errors import InputError
from identify.core.yaml_input import parse_yaml
from identify.fitting.tables import scale_of
from identify.model.effects.base import Effect
from identify.model.effects.measurement import MeasurementEffect
from identify.model.effects.site import Site
from identify.model.frf import frf_and_gradient
from identify.model.modes import complex_modes, frequency_and_damping_gradient
from identify.model.system import System, assemble, build_site, list_parameters
from identify.results.fit import Description, FitResult
from identify.results.map import PostureRows
from identify.robot.description import Robot
from identify.robot.points import Point, read_points
from identify.robot.read import read_robot
from identify.vibration.study import Study

_Z_95 = 1.96


@dataclass(frozen=True)
class FittedModel:
    """A model with its fitted parameters: values (p,), spread (p, f) with spread @ spread.T their covariance;
    posture (joints,), rad, of the first measurement, and the band of the fit, Hz, where it had one.
    """

    robot: Robot
    points: Mapping[int, Point]
    effects: Sequence[Effect]
    values: Array
    spread: Array
    posture: Array
    band_hz: tuple[float, float] | None

    def system(self, posture: Array) -> System:
        """The model at a posture (joints,), rad."""
        site = build_site(self.robot, posture, self.effects, points=self.points, reference=self._first)
        return assemble(self.robot, site, self.effects)

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
    values, spread = result.parameters.value, _spread(result)
    return FittedModel(robot, points, effects, values[kept], spread[kept], posture, study.band_hz)


def _described(study: Study, description: Description) -> tuple[Robot, dict[int, Point]]:
    """Robot and points from their texts, through the same readers as from files."""
    key = "urdf" if study.robot.urdf is not None else "dh"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "robot").write_text(description.robot, encoding="utf-8")
        robot = read_robot(study.robot.model_copy(update={key: Path("robot")}), folder)
        if not description.points:
            return robot, {}
        (folder / "points.csv").write_text(description.points, encoding="utf-8")
        return robot, read_points(folder / "points.csv")


def _spread(result: FitResult) -> Array:
    """(p, f): a root of the covariance of all parameters."""
    scale = scale_of(result.parameters)
    slope = scale.slope(scale.to_x(result.parameters.value)) * result.parameters.std[scale.free]
    squares, directions = np.linalg.eigh(result.correlation)
    spread = np.zeros((len(result.parameters.name), len(scale.free)))
    spread[scale.free] = slope[:, None] * directions * np.sqrt(np.maximum(squares, 0.0))
    return spread


def tool_point(model: FittedModel, node: int | None) -> Point:
    """The point with a node, or the last one, or the origin of the last link where there are no points;
    InputError for an unknown node.
    """
    if node is not None and node not in model.points:
        raise InputError(
            "--tool",
            f"no point {node}",
            "one of " + ", ".join(map(str, model.points)) if model.points else "no node",
        )
    if model.points:
        return model.points[node] if node is not None else list(model.points.values())[-1]
    last = model.robot.links[-1].name
    return Point(0, "origin", last, np.zeros(3), np.eye(3), "")


def map_postures(
    model: FittedModel, tool: Point, names: Sequence[str], postures: Array, line_hz: Array, modes: int
) -> PostureRows:
    """The model at postures (n, joints), rad, for a point, at frequencies (lines,), with the first `modes`
    modes.
    """
    rows = [_at(model, tool, posture, line_hz, modes) for posture in postures]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    tool_m, frequency, damping, compliance, receptance, band = columns
    return PostureRows(
        name=tuple(names),
        posture_deg=np.rad2deg(postures),
        tool_m=tool_m,
        frequency_hz=frequency[:, 0],
        frequency_low_95=frequency[:, 1],
        frequency_high_95=frequency[:, 2],
        damping_ratio=damping[:, 0],
        damping_low_95=damping[:, 1],
        damping_high_95=damping[:, 2],
        compliance_m_per_n=compliance,
        receptance_m_per_n=receptance.astype(np.complex64),
        band_95=band.astype(np.float32),
        peak_m_per_n=np.abs(receptance[:, :, range(3), range(3)]).max(axis=1, initial=0.0),
    )


def _at(
    model: FittedModel, tool: Point, posture: Array, line_hz: Array, modes: int
) -> tuple[NDArray[Any], ...]:
    """Tool position (3,), frequencies and damping with limits (3, modes), compliance (3, 3), receptance and
    half band (lines, 3, 3).
    """
    system, number = model.system(posture), len(model.values)
    matrices = system.matrices(model.values)
    found = complex_modes(*matrices)
    d_frequency, d_damping = frequency_and_damping_gradient(found, system.factors, number)
    out = system.base_jacobian(tool.link, tool.position)
    s = np.asarray(2j * np.pi * line_hz, dtype=complex)
    h, gradient = frf_and_gradient(matrices, system.factors, s, out, out.T, 0, np.arange(number))
    return (
        system.site.engine.position(tool.link, tool.position),
        _limits(found.frequency_hz, d_frequency @ model.spread, modes),
        _limits(found.damping_ratio, d_damping @ model.spread, modes),
        (out @ np.linalg.solve(matrices[2], out.T)).real,
        h,
        _Z_95 * np.linalg.norm(gradient @ model.spread, axis=-1),
    )


def _limits(values: Array, change: Array, count: int) -> Array:
    """(3, count): values (m,) and their 95 % limits, on a logarithmic scale as they are positive; change (m,
    f); NaN beyond m.
    """
    table = np.full((3, count), np.nan)
    shown = min(count, len(values))
    values, reach = values[:shown], _Z_95 * np.linalg.norm(change[:shown], axis=1) / np.abs(values[:shown])
    with np.errstate(over="ignore"):
        table[:, :shown] = values, values * np.exp(-reach), values * np.exp(reach)
    return table
