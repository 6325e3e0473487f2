"""A study turned into what a fit works on: the robot read, data loaded and checked, a model assembled at every posture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from identify.costs.target import FrfTarget, ModalTarget, Targets, channel_rows, frf_target
from identify.effects.base import Parameter
from identify.errors import InputError, InputErrors
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import read_modal_table
from identify.measured.noise import noise_std
from identify.measured.source import read_source
from identify.model.system import System, assemble, build_site, list_parameters
from identify.reference import Reference, read_reference
from identify.robot.description import Robot
from identify.robot.dh import read_dh
from identify.robot.points import Point, check_links, read_points
from identify.robot.urdf import read_urdf
from identify.study import MeasurementSettings, RelativeNoise, RobotSettings, StudyFile

Array = NDArray[np.float64]
T = TypeVar("T")


@dataclass(frozen=True)
class Measurement:
    """One measurement and the model at its posture (rad); `target` is what a cost compares."""

    name: str
    settings: MeasurementSettings
    posture: Array
    system: System
    target: FrfTarget | ModalTarget


@dataclass(frozen=True)
class Problem:
    """Everything a fit works on; parameters are in the order of the effects."""

    file: StudyFile
    robot: Robot
    points: dict[int, Point]
    parameters: tuple[Parameter, ...]
    measurements: tuple[Measurement, ...]
    reference: Reference | None = None

    def targets(self, use: str = "fit") -> Targets:
        """What is to be fitted, or only predicted (`validate`)."""
        chosen = [m.target for m in self.measurements if m.settings.use == use]
        return Targets(
            tuple(target for target in chosen if isinstance(target, FrfTarget)),
            tuple(target for target in chosen if isinstance(target, ModalTarget)),
        )


def load_problem(file: StudyFile) -> Problem:
    """Read and assemble everything a study names.

    Raises InputError or, where several things are wrong, InputErrors.
    """
    study = file.study
    robot = read_robot(study.robot, file.path.parent)
    points = read_points(file.resolve(study.points)) if study.points else {}
    check_links(points, robot)
    postures = _collect([partial(_posture, m, robot, n) for n, m in enumerate(study.measurements)])
    site = build_site(robot, postures[0], study.effects, points=points)
    parameters = tuple(list_parameters(robot, site, study.effects))
    if not any(parameter.free for parameter in parameters):
        raise InputError("effects", "every parameter is fixed", "at least one to fit", "remove `fixed: true` from one")
    names = measurement_names(study.measurements)
    tasks = zip(study.measurements, names, postures, strict=True)
    measurements = _collect([partial(_measurement, file, robot, points, m, name, posture) for m, name, posture in tasks])
    reference = None
    if study.reference is not None:
        reference = read_reference(file.resolve(study.reference), [parameter.name for parameter in parameters])
    return Problem(file, robot, points, parameters, tuple(measurements), reference)


def read_robot(settings: RobotSettings, folder: Path) -> Robot:
    """The robot of a config with its payloads; paths are relative to `folder`."""
    path = settings.urdf or settings.dh or Path()
    robot = (read_urdf if settings.urdf else read_dh)(folder / path)
    if settings.gravity_m_s2 is not None:
        robot = replace(robot, gravity=np.array(settings.gravity_m_s2))
    for number, payload in enumerate(settings.payload):
        xx, yy, zz, xy, xz, yz = payload.inertia_kg_m2
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        robot = robot.with_payload(payload.link, payload.mass_kg, np.array(payload.centre_m), inertia, f"robot.payload.{number}.link")
    return robot


def _collect(makers: Sequence[Callable[[], T]]) -> list[T]:
    """The results of all makers, or all of their errors at once."""
    results, errors = [], []
    for make in makers:
        try:
            results.append(make())
        except InputError as error:
            errors.append(error)
        except InputErrors as several:
            errors += several.errors
    if errors:
        raise InputErrors(errors)
    return results


def _posture(settings: MeasurementSettings, robot: Robot, number: int) -> Array:
    found, expected = len(settings.posture_deg), len(robot.joints)
    if found != expected:
        where = f"measurements.{number}.posture_deg"
        raise InputError(where, f"{found} angles", f"{expected}, one per joint of {robot.name!r}")
    return np.deg2rad(settings.posture_deg)


def measurement_names(measurements: list[MeasurementSettings]) -> list[str]:
    """The given names, or file stems; a number is added where two are the same."""
    names: list[str] = []
    for settings in measurements:
        name = settings.name or settings.source.stem
        names.append(name if name not in names else f"{name}_{len(names) + 1}")
    return names


def _measurement(
    file: StudyFile, robot: Robot, points: dict[int, Point], settings: MeasurementSettings, name: str, posture: Array
) -> Measurement:
    system = assemble(robot, build_site(robot, posture, file.study.effects, settings.detached, points), file.study.effects)
    path = file.resolve(settings.source)
    if settings.modes is not None:
        table = read_modal_table(path, file.resolve(settings.shapes) if settings.shapes else None)
        out = channel_rows(system, points, table.channels, name) if table.shapes is not None else None
        return Measurement(name, settings, posture, system, ModalTarget(name, table, system, out))
    data = _in_band(_select(read_frfs(file, settings), settings, name), file.study.band_hz, name)
    return Measurement(name, settings, posture, system, frf_target(name, data, system, points, _noise(data, settings)))


def read_frfs(file: StudyFile, settings: MeasurementSettings) -> FrfSet:
    """The FRFs of a measurement as its file and its repeats give them."""
    return read_source([file.resolve(path) for path in (settings.source, *settings.repeats)], settings, settings.estimate)


def _select(data: FrfSet, settings: MeasurementSettings, name: str) -> FrfSet:
    def numbers(wanted: list[str] | None, present: tuple[Channel, ...], key: str) -> list[int]:
        if wanted is None:
            return list(range(len(present)))
        channels = [Channel.parse(text, f"{name} {key}") for text in wanted]
        for channel in channels:
            if channel not in present:
                raise InputError(f"{name} {key}", f"channel {channel} is not in the file", "one of " + ", ".join(map(str, present)))
        return [present.index(channel) for channel in channels]

    return data.pairs(numbers(settings.outputs, data.outputs, "outputs"), numbers(settings.inputs, data.inputs, "inputs"))


def _in_band(data: FrfSet, band: tuple[float, float] | None, name: str) -> FrfSet:
    first, last = data.frequency_hz[0], data.frequency_hz[-1]
    inside = data.band(*band) if band else data.lines(data.frequency_hz > 0)
    if not len(inside.frequency_hz):
        span = f"[{band[0]:g}, {band[1]:g}] Hz" if band else "above 0 Hz"
        raise InputError(name, f"no frequency line in the band {span}", f"a band within {first:g} to {last:g} Hz", "change `band_hz`")
    partly = np.isnan(inside.frf).any(axis=0) & inside.measured
    if partly.any():
        output, entry = np.argwhere(partly)[0]
        line = inside.frequency_hz[np.isnan(inside.frf[:, output, entry])][0]
        where = f"{name} FRF {inside.outputs[output]}/{inside.inputs[entry]}"
        raise InputError(where, f"not a number at {line:g} Hz", "finite values in the band", "repair the file or leave the channel out")
    return inside


def _noise(data: FrfSet, settings: MeasurementSettings) -> Array | None:
    if isinstance(settings.noise, RelativeNoise):
        level = np.sqrt(np.mean(np.abs(data.frf) ** 2, axis=0))
        return np.broadcast_to(settings.noise.relative * level / np.sqrt(2), data.frf.shape).copy()
    if data.noise is not None or data.coherence is None:
        return data.noise
    return noise_std(data)
