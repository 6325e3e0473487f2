"""What was measured, before a model meets it: one measurement of a study with its posture, data in the band
and their noise.

One measurement under two names is recognised by what is in it: it would count twice, or be called data that
were not fitted.  FRFs of motors are taken to the gear output where their file tells torque or motion at the
motor's shaft: with n turns of the motor per turn of the joint, a turn of the shaft is n times that of the
gear output, and a torque at the gear output n times that at the shaft.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.collect import collect
from identify.core.errors import InputError, InputErrors
from identify.measured.channel import Channel, motors_of
from identify.measured.correction import turned
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable, read_modal_table
from identify.measured.noise import with_noise, with_relative_noise, without_bias
from identify.measured.record_length import record_length, shortest_record
from identify.measured.silent import connected, noise_alone, without
from identify.measured.source import read_source
from identify.model.effects.base import Effect
from identify.model.effects.geared import Geared
from identify.model.nuisances.basis import Basis
from identify.model.transient import Impact
from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.points import Point
from identify.robot.posture import at_posture
from identify.vibration.study import MeasurementSettings, RelativeNoise, Study, StudyFile

_ALIKE = 1e-3
"""RMS of the difference of two FRFs over their own up to which they are one, perhaps written with fewer
digits: two measurements are never as near as that."""


@dataclass(frozen=True)
class Given:
    """One measurement before a model meets it: its data in the band, with their noise where it is known, and
    length of record; basis: what nuisance parameters change, where they are stated.
    """

    name: str
    settings: MeasurementSettings
    posture: Array
    data: FrfSet | ModalTable
    record: float | None = None
    impact: Impact | None = None
    basis: Basis | None = None

    @property
    def posture_deg(self) -> Array:
        """Joint angles of the robot file (joints,), degrees, without the rounding of their conversion."""
        return np.asarray(np.round(np.rad2deg(self.posture), 9), dtype=np.float64)

    @property
    def noise(self) -> Array | None:
        """Of its FRFs, where it is known."""
        return self.data.noise if isinstance(self.data, FrfSet) else None

    @property
    def outputs(self) -> tuple[Channel, ...]:
        """Response channels; none of a modal table, whose shapes are not compared with uncertainty."""
        return self.data.outputs if isinstance(self.data, FrfSet) else ()

    @property
    def inputs(self) -> tuple[Channel, ...]:
        """Force channels."""
        return self.data.inputs if isinstance(self.data, FrfSet) else ()

    @property
    def driven(self) -> frozenset[int]:
        """Joints whose motors are driven: all that holds their rotors is in the torque that is an input."""
        if self.settings.motor_torque == "added":
            return frozenset()
        return motors_of(self.inputs)


def read_given(
    file: StudyFile,
    robot: Robot,
    known: Mapping[str, FrfSet],
    points: Mapping[int, Point],
    off: Collection[int] = (),
) -> list[Given]:
    """Every measurement of a study; known: FRFs that `read_frfs` has read already, by names of measurements;
    off: nodes that lie on no link, whose channels are left out.

    Raises InputError or InputErrors, also where one measurement stands there twice.
    """
    settings = file.study.measurements
    postures = collect([partial(posture_of, file.study, m, robot, n) for n, m in enumerate(settings)])
    names = measurement_names(settings)
    tasks = zip(settings, names, strict=True)
    chosen = collect([partial(_chosen, file, m, name, known) for m, name in tasks])
    if errors := list(doubles(list(zip(names, chosen, strict=True)))):
        raise InputErrors(errors)
    each = zip(settings, names, postures, chosen, strict=True)
    given = [_on_robot(one, off) for one in collect([partial(given_of, *one) for one in each])]
    return collect([partial(as_modelled, one, file.study.effects, robot, points) for one in given])


def _on_robot(given: Given, off: Collection[int]) -> Given:
    if not isinstance(given.data, FrfSet):
        return given
    outputs, inputs = (
        [c for c in channels if c.motor is None and c.node in off]
        for channels in (given.outputs, given.inputs)
    )
    reason = "lies on no link of the robot by the geometry of the test"
    return replace(given, data=without(given.data, outputs, inputs, reason))


def as_modelled(given: Given, effects: Sequence[Effect], robot: Robot, points: Mapping[int, Point]) -> Given:
    """A measurement as the model has its channels: motors at the gear output, where the file tells them at
    the shaft, and points along the links' axes, where it has them along the base's.
    """
    if not isinstance(given.data, FrfSet):
        return given
    if given.settings.motor_torque == "added" and not motors_of(given.inputs):
        where = f"{given.name} motor_torque"
        raise InputError(where, "no motor among the forces", "joint2:motor", "leave the key out")
    each = given.settings.motor_side, effects, robot, given.name
    return _along_links(replace(given, data=at_gear_outputs(given.data, *each)), robot, points)


def _along_links(given: Given, robot: Robot, points: Mapping[int, Point]) -> Given:
    if given.settings.correct.axes == "link" or not isinstance(given.data, FrfSet):
        return given
    engine, axes = Engine(at_posture(robot, given.posture)), dict[int, Array]()
    for node in {one.node for one in (*given.data.outputs, *given.data.inputs) if one.motor is None}:
        if node not in points:
            raise InputError(given.name, f"channels of point {node}", "a point of the points file")
        axes[node] = base_axes(engine, points[node])
    return replace(given, data=turned(given.data, axes, given.name))


def base_axes(engine: Engine, point: Point) -> Array:
    """Directions (3, 3) of a point's axes, as rows, in those of the base."""
    return point.axes @ engine.axes(point.link).T


def posture_of(study: Study, settings: MeasurementSettings, robot: Robot, number: int) -> Array:
    """Joint angles of the robot file (joints,), rad, of the measurement with that number; InputError where
    there are too few or too many.
    """
    for key in ("posture_deg", "speed_deg_per_s"):
        values = getattr(settings, key)
        if values is not None and len(values) != len(robot.joints):
            where, expected = (
                f"measurements.{number}.{key}",
                f"{len(robot.joints)}, one per joint of {robot.name!r}",
            )
            raise InputError(
                where, f"{len(values)} angles" if key == "posture_deg" else f"{len(values)} speeds", expected
            )
    return study.joint_angles.posture(settings.posture_deg)


def measurement_names(measurements: list[MeasurementSettings]) -> list[str]:
    """The given names, or file stems; a number is added where two are the same."""
    names: list[str] = []
    for settings in measurements:
        name = settings.label
        names.append(name if name not in names else f"{name}_{len(names) + 1}")
    return names


def _chosen(
    file: StudyFile, settings: MeasurementSettings, name: str, known: Mapping[str, FrfSet]
) -> FrfSet | ModalTable:
    """The data of a measurement as they were recorded, of the channels and lines that are used."""
    if settings.modes is not None:
        shapes = file.resolve(settings.shapes) if settings.shapes else None
        return read_modal_table(file.resolve(settings.modes), shapes)
    whole = known[name] if name in known else read_frfs(file, settings)
    return in_band(whole.chosen(settings.outputs, settings.inputs, name), file.study.band_hz, name)


def given_of(settings: MeasurementSettings, name: str, posture: Array, chosen: FrfSet | ModalTable) -> Given:
    """A measurement of chosen data, with their noise where it is known and without dead channels."""
    if isinstance(chosen, ModalTable):
        return Given(name, settings, posture, chosen)
    data = connected(chosen)
    if isinstance(settings.noise, RelativeNoise):
        data = without(data, *noise_alone(data), "is nothing but noise")
    data = _with_noise(data, settings)
    return Given(name, settings, posture, data, record_length(data), _impact(data, settings))


def _impact(data: FrfSet, settings: MeasurementSettings) -> Impact | None:
    """The impacts as stated, and the length of the records."""
    record = data.record_s or shortest_record(data)
    if settings.impact is None or record is None:
        return None
    return Impact(settings.impact.peak_n, settings.impact.width_ms * 1e-3, record)


def read_frfs(file: StudyFile, settings: MeasurementSettings) -> FrfSet:
    """The FRFs of a measurement as its files and its repeats give them, put right where the study says so."""
    return settings.correct.applied(read_as_they_are(file, settings), file.resolve(settings.source).name)


def read_as_they_are(file: StudyFile, settings: MeasurementSettings) -> FrfSet:
    """The same without what the study corrects."""
    own = [file.resolve(path) for path in settings.sources]
    repeats = [file.resolve(path) for path in settings.repeats]
    return read_source([own[0] if len(own) == 1 else own, *repeats], settings, settings.estimate)


def in_band(data: FrfSet, band: tuple[float, float] | None, name: str) -> FrfSet:
    """The lines of a band, by default all but that of 0 Hz; InputError where there are none, or FRFs are no
    numbers there.
    """
    first, last = data.frequency_hz[0], data.frequency_hz[-1]
    inside = data.band(*band) if band else data.lines(data.frequency_hz > 0)
    if not len(inside.frequency_hz):
        span = f"[{band[0]:g}, {band[1]:g}] Hz" if band else "above 0 Hz"
        raise InputError(
            name,
            f"no frequency line in the band {span}",
            f"a band within {first:g} to {last:g} Hz",
            "change `band_hz`",
        )
    partly = np.isnan(inside.frf).any(axis=0) & inside.measured
    if partly.any():
        output, entry = np.argwhere(partly)[0]
        line = inside.frequency_hz[np.isnan(inside.frf[:, output, entry])][0]
        where = f"{name} FRF {inside.outputs[output]}/{inside.inputs[entry]}"
        raise InputError(
            where,
            f"not a number at {line:g} Hz",
            "finite values in the band",
            "repair the file or leave the channel out",
        )
    return inside


def _with_noise(data: FrfSet, settings: MeasurementSettings) -> FrfSet:
    """With what is known of their noise; FRFs whose coherence tells it are taken for H1."""
    if isinstance(settings.noise, RelativeNoise):
        return with_relative_noise(data, settings.noise.relative)
    if data.noise is not None or data.coherence is None:
        return data
    if settings.estimate is None or settings.estimate.method == "h1":
        return without_bias(data)
    return with_noise(data)


def doubles(given: Sequence[tuple[str, FrfSet | ModalTable]]) -> Iterator[InputError]:
    """An error for each two of these (name, data) that share measured values, whatever they are called."""
    for (one, first), (other, second) in combinations(given, 2):
        if isinstance(first, FrfSet) and isinstance(second, FrfSet):
            same = _frfs_alike(first, second)
            what = f"{same} of the FRFs"
        else:
            same = int(type(first) is type(second) and first.sha256 == second.sha256 and first.sha256 != "")
            what = "the table of modes"
        if same:
            yield InputError(
                other,
                f"{what} are those of {one}" if same > 1 else f"{what} is that of {one}",
                "data of its own in each measurement, or they would count twice",
                "name another file, or take one of the two measurements out of the study",
            )


def _frfs_alike(first: FrfSet, second: FrfSet) -> int:
    """How many FRFs of one set are in the other, under whatever channels."""
    common, here, there = np.intersect1d(
        first.frequency_hz.round(6), second.frequency_hz.round(6), return_indices=True
    )
    if first.quantity != second.quantity or len(common) < 2:
        return 0
    a, b = _columns(first, here), _columns(second, there)
    size, other = (np.sum(np.abs(one) ** 2, axis=0) for one in (a, b))
    apart = size[:, None] + other - 2 * (a.conj().T @ b).real
    return int(np.any((apart <= _ALIKE**2 * size[:, None]) & (size[:, None] > 0), axis=1).sum())


def _columns(data: FrfSet, lines: np.ndarray[tuple[int], np.dtype[np.intp]]) -> Complex:
    """(lines, FRFs) that were measured."""
    return np.asarray(data.frf[lines][:, data.measured])


def at_gear_outputs(
    data: FrfSet, motor_side: Sequence[str], effects: Sequence[Effect], robot: Robot, where: str
) -> FrfSet:
    """The set with `torque` and `motion` of motors at the gear output, where `motor_side` names them;
    InputError for a motor whose gear ratio no effect states, or a set without motors.
    """
    if not motor_side:
        return data
    if not motors_of((*data.outputs, *data.inputs)):
        raise InputError(f"{where} motor_side", "no channel of a motor", "joint2:motor", "leave the key out")
    ratios = _ratios(effects, robot)
    out, force = np.ones(len(data.outputs)), np.ones(len(data.inputs))
    if "motion" in motor_side:
        out = 1 / _factors(data.outputs, ratios, where)
    if "torque" in motor_side:
        force = 1 / _factors(data.inputs, ratios, where)
    factor = out[:, None] * force
    return replace(
        data, frf=data.frf * factor, noise=None if data.noise is None else data.noise * np.abs(factor)
    )


def _ratios(effects: Iterable[Effect], robot: Robot) -> dict[int, float]:
    """Gear ratios by number of the joint."""
    geared = [effect for effect in effects if isinstance(effect, Geared)]
    return {
        number: ratio
        for effect in geared
        for number, ratio in zip(effect.numbers(robot), effect.gear_ratio, strict=True)
    }


def _factors(channels: Sequence[Channel], ratios: dict[int, float], where: str) -> Array:
    """(channels,): gear ratio of each that is a motor, else one."""
    for channel in channels:
        if channel.motor is not None and channel.motor not in ratios:
            raise InputError(
                f"{where} motor_side",
                f"{channel}, whose gear ratio is not stated",
                f"`gear_ratio` of a rotor-inertia or servo of joint {channel.motor}",
            )
    return np.array([1.0 if one.motor is None else ratios[one.motor] for one in channels])
