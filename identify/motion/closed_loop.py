"""FRFs of an arm in its closed loop, recorded and simulated alike, of records that excite one joint each in
the same posture (Nagoya, Figs. 8 to 10).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identify.core.arrays import Array, Complex, Index
from identify.core.errors import InputError
from identify.core.text import listed
from identify.motion.excitation import Excitation, closed_loop_frf
from identify.motion.study import RecordSettings
from identify.results.motion import ClosedLoopFrfs, RecordResult
from identify.robot.description import Robot

_Group = list[tuple[RecordSettings, Excitation]]
_WHOLE = 1e-6
"""Of a sample, by which a period may differ from a whole number of them."""


def closed_loops(
    robot: Robot, settings: Sequence[RecordSettings], records: Mapping[str, RecordResult]
) -> tuple[dict[str, ClosedLoopFrfs], list[str]]:
    """FRFs by the names of the records that they come from, and sentences on records of which there are none.

    Joints that no record of a posture excites are held by their controllers.
    """
    found, notes = {}, []
    for group in _postures(settings):
        name = listed([one.name for one, _ in group])
        joints = np.array([robot.joint_number(excited.joint) - 1 for _, excited in group])
        try:
            found[name] = _frfs(group, joints, [records[one.name] for one, _ in group])
        except InputError as error:
            notes.append(f"no closed-loop FRFs of {name}: {error.found}, expected {error.expected}")
    return found, notes


def _postures(settings: Sequence[RecordSettings]) -> list[_Group]:
    """Excited records of one posture, band and period, each of another joint."""
    groups: dict[tuple[object, ...], _Group] = {}
    for one in settings:
        if one.excitation is not None:
            e = one.excitation
            key = (tuple(one.start_deg), e.band_hz, e.period_s)
            group = groups.setdefault(key, [])
            if e.joint not in [other.joint for _, other in group]:
                group.append((one, e))
    return list(groups.values())


def _frfs(group: _Group, joints: Index, records: list[RecordResult]) -> ClosedLoopFrfs:
    excitation = group[0][1]
    models, measured = [_simulated(one) for one in records], [_measured(one) for one in records]
    f, velocity, acceleration = _both(models, joints, excitation)
    seen = [one for one in measured if one is not None]
    if len(seen) == len(records):
        _, *recorded = _both(seen, joints, excitation)
    else:
        recorded = [None, None]
    return ClosedLoopFrfs(
        start_deg=records[0].start_deg,
        joint=joints + 1,
        frequency_hz=f,
        velocity=velocity,
        acceleration=acceleration,
        velocity_measured=recorded[0],
        acceleration_measured=recorded[1],
    )


def _simulated(record: RecordResult) -> tuple[Array, dict[str, Array]]:
    """Times and signals of the model: at the samples of the record, where all that is needed was recorded."""
    compared = record.comparisons
    if _measured(record) is not None:
        times = compared["motor_torque"].time_s
        own = {quantity: one.simulated for quantity, one in compared.items()}
        ticks = {quantity: trace.values for quantity, trace in record.signals.items()}
        if "link_position" not in own:
            own["link_position"] = _sampled(ticks["link_position"], record.time_s, times)
        return times, own
    return record.time_s, {quantity: trace.values for quantity, trace in record.signals.items()}


def _sampled(values: Array, ticks: Array, times: Array) -> Array:
    return np.stack([np.interp(times, ticks, column) for column in values.T], axis=1)


def _measured(record: RecordResult) -> tuple[Array, dict[str, Array]] | None:
    """Times and signals as recorded; None without torques and positions of the motors."""
    compared = record.comparisons
    if not {"motor_torque", "motor_position"} <= set(compared):
        return None
    own = {quantity: one.measured for quantity, one in compared.items()}
    return compared["motor_torque"].time_s, own


def _both(
    records: Sequence[tuple[Array, dict[str, Array]]], joints: Index, excitation: Excitation
) -> tuple[Array, Complex, Complex | None]:
    """Lines of the excited band, Hz; velocity of the motors, acceleration of the links (None where one has no
    links' positions), per torque.
    """
    sample = float(records[0][0][1] - records[0][0][0])
    samples = excitation.period_s / sample
    if abs(samples - round(samples)) > _WHOLE * samples:
        found = f"a period of {excitation.period_s:g} s in samples of {sample:g} s"
        raise InputError("excitation.period_s", found, "a whole number of samples")
    if min(len(times) for times, _ in records) < 2 * round(samples):
        raise InputError("duration_s", "less than two periods", "two or more, as the first is not used")
    torque = [signals["motor_torque"][:, joints] for _, signals in records]
    if not all(np.isfinite(rows).all() for rows in torque):
        raise InputError("motor_torque", "gaps, or a motion that runs away", "numbers throughout")

    def per_torque(quantity: str) -> tuple[Array, Complex]:
        response = [signals[quantity][:, joints] for _, signals in records]
        return closed_loop_frf(torque, response, sample, excitation.period_s)[:2]

    f, motor = per_torque("motor_position")
    low, high = excitation.band_hz
    band = (f >= low) & (f <= high)
    jw = 2j * np.pi * f[:, None, None]
    known = all(_known(signals, joints) for _, signals in records)
    link = (jw**2 * per_torque("link_position")[1])[band] if known else None
    return f[band], (jw * motor)[band], link


def _known(signals: Mapping[str, Array], joints: Index) -> bool:
    return "link_position" in signals and bool(np.isfinite(signals["link_position"][:, joints]).all())
