"""Arms in motion with one thing that their study does not say: links by Pinocchio, motors, gears, friction,
balancers and controllers written out here.

Nothing comes from identify.  `python -m tests.generator.hidden_motion FOLDER --seed N` writes one case: a
robot, a study (motion.yaml) and its records, two to fit and one to judge, and what was hidden (truth.json).
Bodies weigh a per cent or two more or less than described, encoders count, torques are noisy.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
from numpy.typing import NDArray

Array = NDArray[np.float64]
PERIOD_S, PARTS, EVERY, DURATION_S = 1e-3, 8, 4, 2.0
RATIO, CREEP, HEAVIER = 100.0, 2e-4, 0.015
RECORDS = ("one", "two", "three")
NOISE_RAD, NOISE_TORQUE, NOISE_TOOL_M, COUNTS = 1e-5, 0.01, 2e-5, 2**15
KINDS = (
    "Coulomb friction",
    "viscous friction",
    "integral action of the velocity loop",
    "position gain",
    "velocity gain",
    "motor torque gain",
    "motor rotor inertia",
    "mass beyond the description",
    "gravity balancer",
    "delay of the controller",
    "compliance of the gear",
    "backlash of the gear",
    "hardening of the gear",
    "compliance of the base",
    "flexibility of links",
)


@dataclass(frozen=True)
class Link:
    """A body behind a joint: where the joint is in the last link, its axis, mass, centre and moments."""

    at: tuple[float, float, float]
    axis: tuple[int, int, int]
    mass: float
    centre: tuple[float, float, float]
    moments: tuple[float, float, float]


@dataclass
class Case:
    """An arm with numbers a joint (joints,): as they are in truth, and as the study has them where it says
    otherwise.
    """

    links: list[Link]
    start: Array
    heavier: Array
    rotor: Array
    position_gain: Array
    velocity_gain: Array
    integral: Array
    feedforward: float
    coulomb: Array
    viscous: Array
    gain: Array
    balancer: Array
    delay_s: Array
    stiffness: Array | None = None
    damping: Array | None = None
    cubic: Array | None = None
    backlash: Array | None = None
    base: Array | None = None
    bending: tuple[int, Array] | None = None
    """Number of a link (from 0); stiffness and damping (2,) of each of its two hinges about every axis."""
    link_encoders: bool = False
    tracker: bool = False
    told: dict[str, Any] = field(default_factory=dict)
    truth: dict[str, Any] = field(default_factory=dict)

    @property
    def joints(self) -> int:
        """How many."""
        return len(self.links)


def two_link(rng: np.random.Generator) -> list[Link]:
    """In a vertical plane."""
    a, b = rng.uniform(0.45, 0.7, 2)
    first, second = rng.uniform(25, 45), rng.uniform(12, 25)
    return [
        Link((0, 0, 0.4), (0, 1, 0), first, (a / 2, 0, 0), (0.1, first * a * a / 10, first * a * a / 10)),
        Link((a, 0, 0), (0, 1, 0), second, (b / 2, 0.02, 0), (0.1, second * b * b / 10, second * b * b / 10)),
    ]


def six_axis(rng: np.random.Generator) -> list[Link]:
    """A column, an upper arm, a forearm and a wrist with a tool."""
    up, out, arm, fore = (
        rng.uniform(0.3, 0.5),
        rng.uniform(0.1, 0.2),
        rng.uniform(0.6, 0.9),
        rng.uniform(0.3, 0.4),
    )
    m = rng.uniform(0.8, 1.2, 6) * [90, 60, 45, 15, 9, 12]
    return [
        Link((0, 0, up), (0, 0, 1), m[0], (0.05, 0, -0.05), (2, 2, 2)),
        Link((out, 0, 0.1), (0, 1, 0), m[1], (0.0, 0.05, arm / 2), (3, 3, 0.8)),
        Link((0, 0, arm), (0, 1, 0), m[2], (0.1, 0, 0.08), (0.6, 1.2, 1.2)),
        Link((fore, 0, 0.1), (1, 0, 0), m[3], (0.1, 0, 0), (0.1, 0.3, 0.3)),
        Link((0.3, 0, 0), (0, 1, 0), m[4], (0.05, 0, 0), (0.05, 0.05, 0.05)),
        Link((0.1, 0, 0), (1, 0, 0), m[5], (0.12, 0.03, 0.0), (0.15, 0.12, 0.12)),
    ]


def urdf(case: Case, heavier: Array, elastic: bool = False) -> str:
    """The robot's description with bodies heavier by shares (joints,); elastic: with the hinges that it has
    under its base and in a link.

    The link is three pieces, hinged about all axes at a quarter and three quarters of its length: its mass is
    spread along it, and its own inertia is the described one.
    """
    parts = ['<robot name="hidden">']
    if elastic and case.base is not None:
        parts += ['<link name="base_rx"/>', '<link name="base_ry"/>']
        parts.append(_joint("hinge_rx", "base_rx", "base_ry", np.zeros(3), (1, 0, 0)))
        parts.append(_joint("hinge_ry", "base_ry", "base_link", np.zeros(3), (0, 1, 0)))
    parts.append(_body("base_link", 120.0, (0, 0, 0.15), 4 * np.eye(3)))
    last = "base_link"
    bends, shift = case.bending[0] if elastic and case.bending else -1, np.zeros(3)
    for n, (link, more) in enumerate(zip(case.links, heavier, strict=True)):
        own = f"link{n + 1}"
        parts.append(_joint(f"joint{n + 1}", last, own, np.array(link.at) - shift, link.axis))
        mass, moments = (1 + more) * link.mass, (1 + more) * np.diag(link.moments)
        last, shift = own, np.zeros(3)
        if n != bends:
            parts.append(_body(own, mass, link.centre, moments))
            continue
        along, centre = np.array(case.links[n + 1].at), np.array(link.centre)
        left = moments - mass / 32 * (along @ along * np.eye(3) - np.outer(along, along))
        parts.append(_body(own, mass / 4, centre - along / 4, left / 4))
        for hinge, share, at, behind in ((1, 0.5, 0.25, 0.0), (2, 0.25, 0.75, 0.25)):
            for axis, way in zip("xyz", np.eye(3), strict=True):
                child = f"{own}_{hinge}{axis}"
                parts.append(_joint(f"hinge{hinge}{axis}", last, child, at * along - shift, way))
                last, shift = child, at * along
                if axis != "z":
                    parts.append(f'<link name="{child}"/>')
            parts.append(_body(last, share * mass, centre + behind * along - shift, share * left))
    return "\n".join([*parts, "</robot>\n"])


def _told(numbers: Any) -> str:
    return " ".join(f"{number:.12g}" for number in numbers)


def _joint(name: str, parent: str, child: str, at: Array, axis: Any) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_told(at)}" rpy="0 0 0"/><axis xyz="{_told(axis)}"/>'
        '<limit lower="-6" upper="6" effort="1e9" velocity="1e9"/></joint>'
    )


def _body(name: str, mass: float, centre: Any, moments: Array) -> str:
    keys = (("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2))
    inertia = " ".join(f'{key}="{moments[row, column]:.12g}"' for key, row, column in keys)
    return (
        f'<link name="{name}"><inertial><origin xyz="{_told(centre)}" rpy="0 0 0"/>'
        f'<mass value="{mass:.12g}"/><inertia {inertia}/></inertial></link>'
    )


def trapezoids(start: Array, moves: list[dict[str, Any]]) -> Array:
    """Commanded angles (ticks, joints), rad: trapezoids of velocity, averaged over 80 ms."""
    fine = 1e-4
    time = np.arange(round(DURATION_S / fine) + 1) * fine
    angles = np.tile(start, (len(time), 1))
    for move in moves:
        distance, speed, ramped = abs(move["by_deg"]), move["speed_deg_s"], move["acceleration_deg_s2"]
        ramp = min(speed / ramped, np.sqrt(distance / ramped))
        whole = distance / (ramped * ramp) + ramp
        since = time - move["start_s"]
        velocity = np.minimum(np.minimum(since, whole - since), ramp).clip(min=0.0) * ramped
        way = np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2) * fine])
        area = np.concatenate([[0.0], np.cumsum((way[1:] + way[:-1]) / 2) * fine])
        late = np.interp(time - move["smoothing_s"], time, area, left=0.0)
        turned = np.sign(move["by_deg"]) * (area - late) / move["smoothing_s"]
        angles[:, move["joint"] - 1] += np.radians(turned)
    return angles[:: round(PERIOD_S / fine)]


def parts(case: Case) -> int:
    """Steps of the integrator a tick: pieces of a link that bends are light."""
    return PARTS if case.bending is None else 2 * PARTS


def creep(case: Case) -> Array:
    """Speed below which each drive creeps (joints,), rad/s: so that friction, which is then a damper, does
    not outrun the integrator, which is stable up to 2.8 times its step.
    """
    moved = 1 / (RATIO**2 * case.rotor)
    if case.stiffness is None and case.bending is None:
        nominal = pinocchio.buildModelFromXML(urdf(case, np.zeros(case.joints)))
        mass = np.triu(pinocchio.crba(nominal, nominal.createData(), case.start))
        mass = mass + np.triu(mass, 1).T + np.diag(RATIO**2 * case.rotor)
        moved = np.diag(np.linalg.inv(mass))
    slowest = np.maximum(CREEP, case.coulomb * moved * PERIOD_S / parts(case))
    return np.array([float(f"{speed:.6g}") for speed in slowest])


def _places(mask: list[bool]) -> Any:
    """Where a mask is true: a slice, which takes less time, where that is without a gap."""
    found = np.flatnonzero(mask)
    gap = len(found) == 0 or found[-1] - found[0] >= len(found)
    return found if gap else slice(int(found[0]), int(found[-1]) + 1)


class Arm:
    """The equations of motion, and the controller."""

    def __init__(self, case: Case) -> None:
        self.case, self.n, self.creep = case, case.joints, creep(case)
        self.model = pinocchio.buildModelFromXML(urdf(case, case.heavier, True))
        self.nominal = pinocchio.buildModelFromXML(urdf(case, np.zeros(case.joints)))
        names, self.size = list(self.model.names)[1:], self.model.nq
        self.own = _places([name.startswith("joint") for name in names])
        self.soft = _places([name.startswith("hinge") for name in names])
        bending = np.zeros((2, 0)) if case.bending is None else np.tile(case.bending[1][:, None], 6)
        base = np.zeros((2, 0)) if case.base is None else case.base
        self.hinge, self.loss = np.concatenate([base, bending], axis=1)
        self.elastic = case.stiffness is not None
        self.drive = slice(self.size, self.size + self.n) if self.elastic else self.own
        if not self.elastic:
            armature = np.zeros(self.model.nv)
            armature[self.own] = RATIO**2 * case.rotor
            self.model.armature = armature
        self.data, self.data_nominal = self.model.createData(), self.nominal.createData()

    def spring(self, windup: Array) -> Array:
        """Torque of the gears on the drives (joints,), N m."""
        c = self.case
        assert c.stiffness is not None
        half = np.zeros(self.n) if c.backlash is None else c.backlash / 2
        e = windup - np.clip(windup, -half, half)
        return np.asarray(c.stiffness * e + (0 if c.cubic is None else c.cubic) * e**3)

    def slope(self, y: Array, driven: Array) -> Array:
        """Derivative of the state: coordinates of the arm, of the rotors where gears bend, and velocities;
        driven: by torques of the motors at the gear output (joints,), N m.
        """
        c, half = self.case, len(y) // 2
        v, found = y[half:], np.empty(len(y))
        q, qd, spin = y[: self.size], v[: self.size], v[self.drive]
        on_link = driven - (c.coulomb * np.tanh(spin / self.creep) + c.viscous * spin)
        if self.elastic:
            gear = self.spring(q[self.own] - y[self.drive]) + c.damping * (qd[self.own] - spin)
            found[half + self.size :] = (on_link + gear) / (RATIO**2 * c.rotor)
            on_link = -gear
        if c.balancer.any():
            on_link = on_link + c.balancer[0] * np.sin(q[self.own]) + c.balancer[1] * np.cos(q[self.own])
        force = np.zeros(self.size)
        force[self.own] = on_link
        if len(self.hinge):
            force[self.soft] = -self.hinge * q[self.soft] - self.loss * qd[self.soft]
        found[:half] = v
        found[half : half + self.size] = pinocchio.aba(self.model, self.data, q, qd, force)
        return found

    def at_rest(self, turn: Array) -> tuple[Array, Array]:
        """State that holds the drives at `turn`, and the torque on each drive that does."""
        c = self.case
        q = np.zeros(self.model.nq)
        q[self.own] = turn
        for _ in range(60):
            weight = pinocchio.rnea(self.model, self.data, q, np.zeros(len(q)), np.zeros(len(q)))
            angle = q[self.own]
            hold = weight[self.own] - c.balancer[0] * np.sin(angle) - c.balancer[1] * np.cos(angle)
            q[self.soft] = -weight[self.soft] / self.hinge
            if self.elastic:
                assert c.stiffness is not None
                e = -hold / c.stiffness
                for _ in range(20):
                    cubic = 0 if c.cubic is None else c.cubic
                    e = e - (c.stiffness * e + cubic * e**3 + hold) / (c.stiffness + 3 * cubic * e**2)
                half = 0 if c.backlash is None else c.backlash / 2
                q[self.own] = turn + e + np.sign(e) * half
        x = np.concatenate([q, turn]) if self.elastic else q
        return np.concatenate([x, np.zeros(len(x))]), hold

    def run(self, wanted: Array) -> dict[str, Array]:
        """Signals at the ticks, (ticks, joints): turn of the drives and of the links, rad, reported torque, N
        m; of the tool (ticks, 3), m.
        """
        c, h = self.case, PERIOD_S / parts(self.case)
        speed = np.gradient(wanted, PERIOD_S, axis=0)
        ahead = np.array(
            [
                pinocchio.rnea(self.nominal, self.data_nominal, q, v, a)
                for q, v, a in zip(wanted, speed, np.gradient(speed, PERIOD_S, axis=0), strict=True)
            ]
        ) + RATIO**2 * c.told.get("rotor", c.rotor) * np.gradient(speed, PERIOD_S, axis=0)
        y, hold = self.at_rest(wanted[0])
        reported = hold / RATIO / c.gain
        stands = (c.integral == 0) & (c.feedforward == 0)
        if stands.any():
            y, hold = self.at_rest(
                wanted[0] - np.where(stands, RATIO * reported / c.position_gain / c.velocity_gain, 0.0)
            )
        size = len(y) // 2
        last = y[:size][self.drive].copy()
        integral = (
            RATIO * reported
            - c.feedforward * ahead[0]
            - c.velocity_gain * c.position_gain * (wanted[0] - last)
        )
        late, rows = [reported] * (int(np.ceil(c.delay_s.max() / h)) + parts(c) + 2), []
        back = np.round(c.delay_s / h).astype(int)
        for tick, target in enumerate(wanted):
            turn = y[:size][self.drive]
            rows.append((turn.copy(), y[self.own].copy(), RATIO * reported, self.tool(y)))
            error = c.position_gain * (target - turn) + speed[tick] - (turn - last) / PERIOD_S
            integral, last = integral + c.velocity_gain * c.integral * PERIOD_S * error, turn.copy()
            asked = (c.velocity_gain * error + integral + c.feedforward * ahead[tick]) / RATIO
            for _ in range(parts(c)):
                late.append(asked)
                given = np.array([late[-1 - b][joint] for joint, b in enumerate(back)])
                driven = RATIO * c.gain * given
                k1 = self.slope(y, driven)
                k2 = self.slope(y + h / 2 * k1, driven)
                k3 = self.slope(y + h / 2 * k2, driven)
                y = y + h / 6 * (k1 + 2 * (k2 + k3) + self.slope(y + h * k3, driven))
            reported = np.array([late[-1 - b][joint] for joint, b in enumerate(back)])
        names = ("motor", "link", "torque", "tool")
        return dict(zip(names, (np.array(part) for part in zip(*rows, strict=True)), strict=True))

    def tool(self, y: Array) -> Array:
        """Where the tool is, m: 0.1 m along x of the last link."""
        pinocchio.forwardKinematics(self.model, self.data, y[: self.model.nq])
        pose = self.data.oMi[self.model.njoints - 1]
        return np.asarray(pose.translation + pose.rotation @ np.array([0.1, 0.0, 0.0]))


def drawn(rng: np.random.Generator, kind: str, six: bool) -> Case:
    """An arm, with something of a kind hidden, or nothing where that is empty."""
    links = six_axis(rng) if six else two_link(rng)
    n = len(links)
    start = np.radians(
        rng.uniform([-20, -15, -10, -40, 20, -40], [20, 25, 20, 40, 60, 40])[:n]
        if six
        else rng.uniform([-60, 30], [-20, 80])
    )
    case = Case(links, start, rng.normal(scale=HEAVIER, size=n), *[np.zeros(n)] * 4, 0.0, *[np.zeros(n)] * 5)  # type: ignore[misc, arg-type]
    nominal = pinocchio.buildModelFromXML(urdf(case, np.zeros(n)))
    mass = np.diag(pinocchio.crba(nominal, nominal.createData(), start))
    weight = np.abs(pinocchio.rnea(nominal, nominal.createData(), start, np.zeros(n), np.zeros(n)))
    case.rotor = rng.uniform(0.4, 1.0, n) * mass / RATIO**2
    carried = mass + RATIO**2 * case.rotor
    case.position_gain = rng.uniform(8, 16) * np.ones(n)
    case.velocity_gain = rng.uniform(60, 100, n) * carried
    case.integral = rng.uniform(4, 10) * np.ones(n)
    case.feedforward = float(rng.choice([0.0, 1.0]))
    torque = np.maximum(weight, 0.15 * weight.max()) + carried * 2.0
    case.coulomb, case.viscous = rng.uniform(0.02, 0.05, n) * torque, rng.uniform(0.02, 0.05, n) * torque
    case.gain, case.balancer, case.delay_s = np.ones(n), np.zeros((2, n)), np.zeros(n)
    case.link_encoders = bool(rng.random() < 0.3)
    case.tracker = bool(rng.random() < 0.3)
    _hide(case, kind, rng, torque, carried, weight)
    return case


def _hide(
    case: Case, kind: str, rng: np.random.Generator, torque: Array, carried: Array, weight: Array
) -> None:
    n, joint = case.joints, int(rng.integers(case.joints))
    one = np.arange(n) == joint
    some = one if rng.random() < 0.5 else np.ones(n, dtype=bool)
    off = float(rng.choice([rng.uniform(0.65, 0.85), rng.uniform(1.2, 1.5)]))
    told, hidden = case.told, one
    if kind == "Coulomb friction":
        told["coulomb"], hidden = np.where(some, 0.0, case.coulomb), some
        case.coulomb = np.where(some, rng.uniform(0.06, 0.2, n) * torque, case.coulomb)
    elif kind == "viscous friction":
        told["viscous"], hidden = np.where(some, 0.0, case.viscous), some
        case.viscous = np.where(some, rng.uniform(0.08, 0.25, n) * torque, case.viscous)
    elif kind == "integral action of the velocity loop":
        told["integral"], hidden = np.zeros(n), np.ones(n, dtype=bool)
    elif kind == "position gain":
        told["position_gain"] = case.position_gain.copy()
        case.position_gain = np.where(one, off, 1.0) * case.position_gain
    elif kind == "velocity gain":
        told["velocity_gain"] = case.velocity_gain.copy()
        case.velocity_gain = np.where(one, off, 1.0) * case.velocity_gain
    elif kind == "motor torque gain":
        case.gain = np.where(one, off, 1.0)
    elif kind == "motor rotor inertia":
        told["rotor"] = case.rotor.copy()
        case.rotor = np.where(one, rng.uniform(1.5, 2.5), 1.0) * case.rotor
    elif kind == "mass beyond the description":
        case.heavier = np.where(one, rng.uniform(0.25, 0.6), case.heavier)
    else:
        hidden = _hide_beside(case, kind, rng, carried, weight, one)
    if kind.endswith("of the gear"):
        _bend(case, kind, rng, torque, one)
    case.truth = {"kind": kind, "joints": [int(k) + 1 for k in np.flatnonzero(hidden)] if kind else []}


def _hide_beside(
    case: Case, kind: str, rng: np.random.Generator, carried: Array, weight: Array, one: Array
) -> Array:
    """What stands beside gears and motors; the joints where it is."""
    n = case.joints
    if kind == "gravity balancer":
        joint = 0 if n == 2 else 1
        one, angle = np.arange(n) == joint, rng.uniform(-np.pi, np.pi)
        size = rng.uniform(0.2, 0.5) * max(weight[joint], 0.3 * weight.max())
        case.balancer = size * np.outer([np.sin(angle), np.cos(angle)], one)
    elif kind == "delay of the controller":
        case.delay_s, one = rng.uniform(1e-3, 3e-3) * np.ones(n), np.ones(n, dtype=bool)
    elif kind == "compliance of the base":
        one = np.zeros(n, dtype=bool)
        reach = carried[0] if n == 2 else carried[1]
        stiffness = rng.uniform(0.7, 1.3, 2) * (2 * np.pi * rng.uniform(9, 15)) ** 2 * (2.0 * reach)
        case.base = np.array([stiffness, 0.1 * np.sqrt(stiffness * 2.0 * reach)])
        case.tracker = bool(rng.random() < 0.7)
    elif kind == "flexibility of links":
        bent = 0 if n == 2 else int(rng.integers(1, 3))
        stiffness = (2 * np.pi * rng.uniform(9, 15)) ** 2 * carried[bent]
        hinges = 2 * np.array([stiffness, 0.1 * np.sqrt(stiffness * carried[bent])])
        case.bending, case.tracker = (bent, hinges), bool(rng.random() < 0.7)
        one = np.arange(n) == bent
    return one


def _bend(case: Case, kind: str, rng: np.random.Generator, torque: Array, one: Array) -> None:
    """Gears that bend: not said at all, or said without their backlash or hardening."""
    n = case.joints
    load = RATIO**2 * case.rotor
    case.stiffness = load * (2 * np.pi * rng.uniform(12, 20, n)) ** 2
    case.damping = 0.1 * np.sqrt(case.stiffness * load)
    case.link_encoders = True
    if kind == "compliance of the gear":
        case.told["rigid"] = True
        one[:] = True
        case.link_encoders = bool(rng.random() < 0.6)
    elif kind == "backlash of the gear":
        case.backlash = np.where(one, rng.uniform(0.15, 0.4) * torque / case.stiffness, 0.0)
    else:
        case.cubic = np.where(
            one, rng.uniform(0.5, 2.0) * case.stiffness / (torque / case.stiffness) ** 2, 0.0
        )


def moves(rng: np.random.Generator, joints: int) -> list[dict[str, Any]]:
    """Each joint goes somewhere and half of them back."""
    found = []
    for joint in range(1, joints + 1):
        by, begin = float(rng.choice([-1, 1]) * rng.uniform(12, 30)), float(rng.uniform(0.05, 0.25))
        told = {"speed_deg_s": float(rng.uniform(60, 120)), "acceleration_deg_s2": 600.0, "smoothing_s": 0.06}
        found.append({"joint": joint, "start_s": round(begin, 3), "by_deg": round(by, 2), **told})
        slow = float(rng.uniform(20, 50))
        back = {
            "joint": joint,
            "start_s": round(begin + 0.7, 3),
            "by_deg": round(-np.sign(by) * 0.6 * slow, 2),
        }
        found.append({**back, **told, "speed_deg_s": slow})
    return found


def write(case: Case, folder: Path, rng: np.random.Generator, names: Sequence[str] = RECORDS) -> None:
    """The robot, the study, its records, of which the one called three is to judge, and the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(urdf(case, np.zeros(case.joints)))
    records = []
    for name in names:
        asked = moves(rng, case.joints)
        _record(case, folder / f"{name}.csv", asked, rng)
        signals = {
            "motor_position": {"at": "motor{joint}", "unit": "rad"},
            "motor_torque": {"at": "torque{joint}", "unit": "N m"},
        }
        if case.link_encoders:
            signals["link_position"] = {"at": "link{joint}", "unit": "rad"}
        measured: dict[str, Any] = {"file": f"{name}.csv", "signals": signals}
        if case.tracker:
            measured["tool"] = {"at": ["x", "y", "z"], "unit": "m"}
        start = [float(f"{angle:.6f}") for angle in np.degrees(case.start)]
        one = {
            "name": name,
            "start_deg": start,
            "duration_s": DURATION_S,
            "moves": asked,
            "measured": measured,
        }
        records.append({**one, "use": "validate" if name == "three" else "fit"})
    (folder / "motion.yaml").write_text(json.dumps(_study(case, records), indent=1))
    (folder / "truth.json").write_text(json.dumps(case.truth))


def _study(case: Case, records: list[dict[str, Any]]) -> dict[str, Any]:
    def told(name: str) -> list[float]:
        return [float(f"{v:.9g}") for v in case.told.get(name, getattr(case, name))]

    study: dict[str, Any] = {
        "schema": "identify-motion/1",
        "name": "hidden",
        "robot": {"urdf": "robot.urdf"},
        "tool": {"link": f"link{case.joints}", "at_m": [0.1, 0, 0]},
        "motor": {"kind": "torque", "rotor_inertia": told("rotor")},
        "gear": {"ratio": RATIO},
        "friction": {
            "coulomb": told("coulomb"),
            "viscous": told("viscous"),
            "smoothing": "tanh",
            "creep_velocity": creep(case).tolist(),
        },
        "servo": {
            "kind": "cascade",
            "period_s": PERIOD_S,
            "position_gain": told("position_gain"),
            "velocity_gain": told("velocity_gain"),
            "velocity_integral": told("integral"),
            "velocity_feedforward": 1.0,
            "torque_feedforward": case.feedforward,
        },
        "records": records,
    }
    if case.stiffness is not None and not case.told.get("rigid"):
        assert case.damping is not None
        springs = {
            "stiffness": {"initial": case.stiffness.tolist(), "fixed": True},
            "damping": {"initial": case.damping.tolist(), "fixed": True},
        }
        study["effects"] = [{"kind": "joint-compliance", "axes": ["rz"], **springs}]
    return study


def _record(case: Case, path: Path, asked: list[dict[str, Any]], rng: np.random.Generator) -> None:
    start = np.radians(np.round(np.degrees(case.start), 6))
    seen = Arm(case).run(trapezoids(start, asked))
    grain = 2 * np.pi / COUNTS / RATIO
    rows = {name: values[::EVERY] for name, values in seen.items()}
    for name in ("motor", "link"):
        rows[name] = (
            np.round((rows[name] + rng.normal(scale=NOISE_RAD, size=rows[name].shape)) / grain) * grain
        )
    size = NOISE_TORQUE * np.abs(rows["torque"]).max(axis=0)
    rows["torque"] = rows["torque"] + size * rng.normal(size=rows["torque"].shape)
    rows["tool"] = rows["tool"] + rng.normal(scale=NOISE_TOOL_M, size=rows["tool"].shape)
    names = [
        "time_s",
        *(f"{what}{n + 1}" for what in ("motor", "link", "torque") for n in range(case.joints)),
        "x",
        "y",
        "z",
    ]
    time = np.arange(len(rows["tool"])) * PERIOD_S * EVERY
    table = np.column_stack([time, rows["motor"], rows["link"], rows["torque"], rows["tool"]])
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header=",".join(names), comments="")


def main() -> None:
    """Write one case."""
    parser = argparse.ArgumentParser(prog="python -m tests.generator.hidden_motion", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--kind", default="", choices=("", *KINDS))
    parser.add_argument("--six", action="store_true")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    write(drawn(rng, given.kind, given.six), given.folder, rng)


if __name__ == "__main__":
    main()
