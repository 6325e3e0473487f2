"""Records of an arm with hidden drive effects, by Pinocchio and closed forms; shares no code with what
explains them.

The arm is a Denavit-Hartenberg table of three joints (five with a wrist); joints move along sums of sines
whose derivatives are exact. Units of what is written are degrees, degrees per second and N m at the motor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]
RATE = 125.0
RATIO = np.array([160.0, 180.0, 150.0, 100.0, 90.0])
# d, a, alpha (deg), mass, centre, moments of inertia about it
TABLE = (
    (0.5, 0.3, -90.0, 120.0, (-0.1, 0.02, 0.03), (4.0, 5.0, 4.5)),
    (0.0, 0.9, 0.0, 90.0, (-0.45, 0.01, 0.05), (1.5, 9.0, 8.5)),
    (0.0, 0.6, 0.0, 60.0, (-0.3, 0.03, 0.0), (0.8, 3.0, 2.8)),
    (0.0, 0.1, 90.0, 20.0, (-0.05, 0.02, 0.01), (0.2, 0.25, 0.22)),
    (0.1, 0.08, 0.0, 12.0, (-0.02, 0.03, 0.02), (0.1, 0.12, 0.11)),
)
PAYLOAD_KG, PAYLOAD_AT = 25.0, (0.12, 0.0, 0.05)
ZERO_DEG = np.array([5.0, -70.0, 40.0, 15.0, -20.0])
Torque = Callable[["Motion"], Array]


@dataclass(frozen=True)
class Motion:
    """Time, angles (from the robot's zero), speeds, accelerations (samples, joints), and the torques of the
    true rigid links.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    rigid: Array
    at: Callable[[Array], Array]


@dataclass(frozen=True)
class Hidden:
    """What the arm has and its user does not know.

    counts: of the motors' encoders per turn, and of the link encoders per 1/100 turn, 0 without end;
    torque_lag_s: of the first-order filter through which torques were recorded; bodies_off: standard
    deviation, as a share, of the errors of what is stated of masses, centres, moments;
    motor: torques at the motors (samples, joints) to add; payload_kg: beyond the stated one; deflection:
    motor minus link position; latency_s (joints,); noise: standard deviations of torque and of link position,
    and how much a torque sample keeps of the last; seeds: of the motion and noise of the two records.
    """

    motor: tuple[Torque, ...] = ()
    payload_kg: float = 0.0
    deflection: Callable[[Motion], Array] | None = None
    latency_s: tuple[float, ...] = (0.0,) * 5
    torque_noise: float = 0.05
    position_noise: float = 2e-6
    memory: float = 0.0
    error: Callable[[Motion], Array] | None = None
    seeds: tuple[int, int] = (11, 12)
    bodies_off: float = 0.0
    counts: int = 0
    torque_lag_s: float = 0.0
    extra: dict[str, object] = field(default_factory=dict)


def only(joints: int, joint: int, values: Array) -> Array:
    """Values (samples,) at one joint, nothing at the others: (samples, joints)."""
    found = np.zeros((len(values), joints))
    found[:, joint - 1] = values
    return found


def rigid_model(joints: int, payload_kg: float) -> pin.Model:
    """The arm of that many joints with its payload on the last link."""
    model, parent, place = pin.Model(), 0, pin.SE3.Identity()
    for number, (d, a, alpha, mass, centre, moments) in enumerate(TABLE[:joints]):
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"j{number}")
        place = pin.SE3(np.eye(3), np.array([0, 0, d])) * pin.SE3(
            pin.utils.rotate("x", np.radians(alpha)), np.array([a, 0.0, 0.0])
        )
        model.appendBodyToJoint(parent, pin.Inertia(mass, np.array(centre), np.diag(moments)), place)
    model.appendBodyToJoint(parent, pin.Inertia(payload_kg, np.array(PAYLOAD_AT), np.zeros((3, 3))), place)
    return model


def move(seed: int, joints: int, payload_kg: float, seconds: float = 12.0) -> Motion:
    """A motion of three sines per joint, of up to 40 degrees a second, seeded."""
    rng = np.random.default_rng(seed)
    frequency = rng.uniform(0.08, 0.45, (joints, 3))
    size = np.radians(rng.uniform(4.0, 9.0, (joints, 3)))
    phase = rng.uniform(0, 2 * np.pi, (joints, 3))

    def angles(time: Array, order: int = 0) -> Array:
        w = 2 * np.pi * frequency
        values = size * w**order * np.sin(w * time[:, None, None] + phase + order * np.pi / 2)
        return values.sum(axis=2) + (np.radians(ZERO_DEG[:joints]) if order == 0 else 0.0)

    time = np.arange(int(seconds * RATE)) / RATE
    q, v, a = (angles(time, order) for order in range(3))
    model = rigid_model(joints, payload_kg)
    data = model.createData()
    rigid = np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
    return Motion(time, q, v, a, rigid, angles)


def record(path: Path, seed: int, joints: int, hidden: Hidden) -> None:
    """Write a record as CSV: time_s, and for each joint its position, speed, motor torque, link position and
    command.
    """
    rng = np.random.default_rng([seed, 7])
    motion = move(seed, joints, PAYLOAD_KG + hidden.payload_kg)
    torque = motion.rigid / RATIO[:joints]
    for effect in hidden.motor:
        torque = torque + effect(motion)
    torque = torque + coloured(rng, torque.shape, hidden.torque_noise, hidden.memory)
    torque = _lagged(torque, hidden.torque_lag_s)
    link = np.empty_like(torque)
    bend = hidden.deflection(motion) if hidden.deflection else np.zeros_like(torque)
    for joint in range(joints):
        late = motion.time - hidden.latency_s[joint]
        link[:, joint] = motion.at(late)[:, joint] - np.interp(late, motion.time, bend[:, joint])
    link += rng.normal(scale=hidden.position_noise, size=link.shape)
    error = hidden.error(motion) if hidden.error else rng.normal(scale=1e-5, size=link.shape)
    columns = {"time_s": motion.time}
    seen, link = _counted(motion.q, hidden.counts * RATIO[:joints]), _counted(link, hidden.counts * 100)
    for joint in range(joints):
        offset = ZERO_DEG[joint]
        columns[f"position{joint + 1}"] = np.degrees(seen[:, joint]) - offset
        columns[f"speed{joint + 1}"] = np.degrees(motion.v[:, joint])
        columns[f"torque{joint + 1}"] = torque[:, joint]
        columns[f"link{joint + 1}"] = np.degrees(link[:, joint]) - offset
        columns[f"command{joint + 1}"] = np.degrees(motion.q[:, joint] + error[:, joint]) - offset
    np.savetxt(
        path,
        np.column_stack(list(columns.values())),
        delimiter=",",
        header=",".join(columns),
        comments="",
        fmt="%.12g",
    )


def _counted(angle: Array, counts: Array | float) -> Array:
    """Angles (samples, joints) in whole counts, so many per turn; 0: as they are."""
    if not np.any(counts):
        return angle
    grain = 2 * np.pi / counts
    return np.asarray(np.round(angle / grain) * grain)


def _lagged(torque: Array, lag_s: float) -> Array:
    """Torques (samples, joints) behind a filter of first order; from its first value on."""
    if not lag_s:
        return torque
    keep, found = np.exp(-1 / (RATE * lag_s)), torque.copy()
    for row in range(1, len(torque)):
        found[row] = keep * found[row - 1] + (1 - keep) * torque[row]
    return found


def coloured(rng: np.random.Generator, shape: tuple[int, ...], size: float, memory: float) -> Array:
    """Noise of that standard deviation, each sample keeping a part of the last one (first-order
    autoregression).
    """
    fresh = rng.normal(scale=size * np.sqrt(1 - memory**2), size=shape)
    fresh[0] = rng.normal(scale=size, size=shape[1:])
    for row in range(1, shape[0]):
        fresh[row] += memory * fresh[row - 1]
    return fresh


def _stated(joints: int, hidden: Hidden) -> list[tuple[float, list[float], list[float]]]:
    """Mass, centre and moments of each link as its user believes them."""
    rng = np.random.default_rng([hidden.seeds[0], 77])
    found = []
    for _, _, _, mass, centre, moments in TABLE[:joints]:
        off = hidden.bodies_off * rng.normal(size=7)
        shifted = np.array(centre) + off[1:4] * float(np.linalg.norm(centre))
        turned = np.array(moments) * (1 + off[4:])
        turned = np.minimum(turned, 0.999 * (turned.sum() - turned))  # a drawing is of a body that can be
        found.append((float(mass * (1 + off[0])), shifted.tolist(), turned.tolist()))
    return found


def study(folder: Path, count: int, hidden: Hidden, judged: Hidden | None = None, **more: object) -> Path:
    """A study of two records of the arm of so many joints; judged: what the second record has hidden, if
    something else.
    """
    joints = count
    record(folder / "a.csv", hidden.seeds[0], joints, hidden)
    record(folder / "b.csv", hidden.seeds[1], joints, judged or hidden)
    rows = [
        f"  - {{name: j{n + 1}, d_m: {d}, a_m: {a}, alpha_deg: {alpha}}}"
        for n, (d, a, alpha, *_) in enumerate(TABLE[:joints])
    ]
    links = [
        f"  - {{name: link{n + 1}, mass_kg: {mass}, centre_m: {list(centre)}, inertia_kg_m2:"
        f" {[*moments, 0, 0, 0]}}}"
        for n, (mass, centre, moments) in enumerate(_stated(joints, hidden))
    ]
    (folder / "robot.yaml").write_text(
        "\n".join(["name: arm", "convention: standard", "joints:", *rows, "links:", *links]) + "\n"
    )
    lines = [
        "schema: identify-explain/1",
        "name: hidden",
        "robot:",
        "  dh: robot.yaml",
        f"  payload: [{{link: link{joints}, mass_kg: {PAYLOAD_KG}, centre_m: {list(PAYLOAD_AT)}}}]",
        f"drives: {{gear_ratio: {RATIO[:joints].tolist()}}}",
        "records: [{name: A, file: a.csv}, {name: B, file: b.csv, use: validate}]",
        "time: {at: time_s}",
        "signals:",
        "  motor_position: {at: 'position{joint}', unit: deg}",
        "  motor_velocity: {at: 'speed{joint}', unit: deg/s}",
        "  motor_torque: {at: 'torque{joint}', unit: N m}",
        *(["  link_position: {at: 'link{joint}', unit: deg}"] if hidden.extra.get("links", True) else []),
        *(["  command_position: {at: 'command{joint}', unit: deg}"] if hidden.error else []),
        f"joint_zero_deg: {ZERO_DEG[:joints].tolist()}",
        "stationary_below_deg_per_s: 0.5",
        *(f"{key}: {value}" for key, value in more.items()),
    ]
    path = folder / "study.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path
