"""Makes of six-axis arms: two fixed ones, `compact` (6 kg payload) and `large` (200 kg payload), and random
ones by seed.

Drawn in the posture of zero angles: column and upper arm upright, forearm level.  Bodies are solid cylinders
and boxes of realistic mass; how link frames are turned differs from make to make.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tests.generator.arm import Arm, Joint, Link, Point
from tests.generator.rigid import Array, Inertia, box, cylinder, frame_with_z, to_rpy, turn
from tests.generator.tree import at_posture

Frames = Literal["parallel", "along-axes", "skew"]
_MASS_SHARE = np.array([0.27, 0.25, 0.20, 0.13, 0.08, 0.025, 0.045])
_JOINT_HZ = np.array([[11, 20], [12, 22], [18, 34], [38, 80], [32, 60], [55, 120]], dtype=float)
_ROOT = np.zeros(3)


def _vector(x: float, y: float, z: float) -> Array:
    return np.array([x, y, z])


@dataclass(frozen=True)
class Make:
    """What distinguishes makes: lengths in m, total mass in kg, sense of the six axes, and how link frames
    are turned.
    """

    name: str
    base: float
    column: float
    shoulder: float
    side: float
    upper: float
    elbow: float
    rear: float
    fore: float
    wrist: float
    wrist_shift: float
    tool: float
    mass: float
    sense: tuple[int, ...]
    frames: Frames
    joint_hz: tuple[float, ...]
    damping_ratio: tuple[float, ...]

    @property
    def reach(self) -> float:
        """Shoulder to flange, stretched."""
        return self.upper + self.rear + self.fore + self.wrist

    @property
    def origins(self) -> Array:
        """Joint positions at zero angles (6, 3), and the tool's end as a seventh."""
        one = np.array([0.0, 0.0, self.base])
        two = one + _vector(self.shoulder, self.side, self.column)
        three = two + _vector(0.0, 0.0, self.upper)
        four = three + _vector(self.rear, -0.7 * self.side, self.elbow)
        five = four + _vector(self.fore, 0.0, 0.0)
        six = five + _vector(self.wrist, self.wrist_shift, 0.0)
        return np.array([one, two, three, four, five, six, six + _vector(self.tool, 0.0, 0.0)])


_AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], dtype=float)

COMPACT = Make(
    "compact",
    0.22,
    0.18,
    0.025,
    0.0,
    0.455,
    0.035,
    0.10,
    0.32,
    0.08,
    0.0,
    0.14,
    54.0,
    (-1, 1, 1, -1, 1, -1),
    "along-axes",
    (17.0, 16.0, 27.0, 62.0, 48.0, 95.0),
    (0.05, 0.06, 0.045, 0.05, 0.06, 0.06),
)
LARGE = Make(
    "large",
    0.42,
    0.26,
    0.35,
    -0.11,
    1.15,
    -0.04,
    0.42,
    0.80,
    0.215,
    0.0,
    0.38,
    1090.0,
    (1, 1, -1, -1, 1, -1),
    "along-axes",
    (13.0, 14.0, 22.0, 51.0, 38.0, 74.0),
    (0.04, 0.05, 0.045, 0.04, 0.05, 0.05),
)


def random_make(seed: int) -> Make:
    """Any size between compact and large, offset wrists among them."""
    rng = np.random.default_rng([seed, 0xA2])
    reach = float(np.exp(rng.uniform(np.log(0.8), np.log(2.8))))

    def part(low: float, high: float) -> float:
        return reach * float(rng.uniform(low, high))

    joint_hz = np.exp(rng.uniform(*np.log(_JOINT_HZ).T)) * (2.0 / reach) ** 0.3
    return Make(
        name=f"random{seed}",
        base=part(0.14, 0.24),
        column=part(0.08, 0.2),
        shoulder=part(0.02, 0.14),
        side=part(-0.08, 0.08),
        upper=part(0.4, 0.48),
        elbow=part(-0.03, 0.06),
        rear=part(0.08, 0.2),
        fore=part(0.26, 0.34),
        wrist=part(0.06, 0.1),
        wrist_shift=part(-0.05, 0.05) * float(rng.random() < 0.4),
        tool=part(0.12, 0.18),
        mass=float(1090 * (reach / 2.6) ** 2.7 * rng.uniform(0.8, 1.25)),
        sense=tuple(int(sign) for sign in rng.choice([-1, 1], 6)),
        frames=("parallel", "along-axes", "skew")[int(rng.integers(3))],
        joint_hz=tuple(joint_hz.tolist()),
        damping_ratio=tuple(rng.uniform(0.03, 0.07, 6).tolist()),
    )


def random_arm(seed: int) -> Arm:
    """An arm of a random make."""
    return build(random_make(seed), seed)


MAKES: dict[str, Callable[[int], Arm]] = {
    "compact": lambda seed: build(COMPACT, 6),
    "large": lambda seed: build(LARGE, 200),
    "random": random_arm,
}
"""Arms by name; the seed matters to the random one only."""


def build(make: Make, seed: int) -> Arm:
    """The arm of a make; the seed scatters masses by 15 %, turns frames and places points."""
    rng = np.random.default_rng([seed, 0xB3])
    origins = np.vstack([_ROOT, make.origins])
    axes = _AXES * np.array(make.sense)[:, None]
    turns = [np.eye(3), *(_frame(make.frames, axis, rng) for axis in axes)]
    masses = make.mass * _MASS_SHARE * rng.uniform(0.85, 1.15, 7)
    names = ["base_link", *(f"link{number}" for number in range(1, 7))]
    links = tuple(
        Link(name, body.seen_from(rotation.T, -rotation.T @ origin))
        for name, body, rotation, origin in zip(names, _bodies(make, masses), turns, origins[:7], strict=True)
    )
    joints = tuple(
        Joint(
            f"joint{number}",
            np.round(turns[number - 1].T @ (origins[number] - origins[number - 1]), 9),
            np.round(to_rpy(turns[number - 1].T @ turns[number]), 9),
            np.round(turns[number].T @ axes[number - 1], 9),
        )
        for number in range(1, 7)
    )
    home = np.array(make.sense) * np.array([0.0, 20.0, 5.0, 15.0, 45.0, 10.0])
    arm = Arm(
        make.name, links, joints, _points(make, names, turns, origins, rng), home, np.ones(6), np.zeros(6)
    )
    return _with_springs(arm, make)


def _with_springs(arm: Arm, make: Make) -> Arm:
    """Springs that put each joint on its own, all others locked, at its frequency and damping ratio in the
    home posture.
    """
    tree = at_posture(arm, arm.home)
    inertia = np.array(
        [tree.outboard_about(f"link{n}", joint.axis) for n, joint in enumerate(arm.joints, start=1)]
    )
    speed = 2 * np.pi * np.array(make.joint_hz)
    return replace(
        arm, stiffness=inertia * speed**2, damping=2 * np.array(make.damping_ratio) * inertia * speed
    )


def _frame(frames: Frames, axis: Array, rng: np.random.Generator) -> Array:
    """Axes of a link frame, as columns in the floor's."""
    if frames == "parallel":
        return np.eye(3)
    upright = frame_with_z(axis) @ turn([0, 0, 1], float(rng.integers(4)) * np.pi / 2)
    if frames == "along-axes":
        return np.round(upright)
    return np.asarray(upright @ turn(rng.normal(size=3), float(rng.uniform(0.1, 0.6))))


def _bodies(make: Make, masses: Array) -> list[Inertia]:
    """Seven bodies as solids, in the floor's axes at zero angles."""
    one, two, three, four, five, six, tool = make.origins
    thick = 0.075 * make.reach
    y = np.array([0.0, 1.0, 0.0])
    base, carousel, upper, elbow, forearm, wrist, hand = masses
    return [
        cylinder(0.7 * base, _ROOT, one, 1.6 * thick)
        + box(0.3 * base, [0, 0, 0.02 * make.reach], [5 * thick, 5 * thick, 0.4 * thick]),
        cylinder(0.55 * carousel, one, one + _vector(0, 0, make.column), 1.4 * thick)
        + cylinder(0.3 * carousel, two - 1.2 * thick * y, two + 1.2 * thick * y, thick)
        + box(
            0.15 * carousel,
            one + _vector(-1.2 * thick, 0.6 * thick, 0.5 * make.column),
            [thick, thick, 2 * thick],
        ),
        box(0.6 * upper, (two + three) / 2 + 0.5 * thick * y, [1.6 * thick, thick, make.upper])
        + cylinder(0.25 * upper, two, two + 1.5 * thick * y, 1.1 * thick)
        + cylinder(0.15 * upper, three - 0.3 * thick * y, three + thick * y, 0.8 * thick),
        box(0.65 * elbow, (three + four) / 2, [make.rear + thick, 1.4 * thick, 1.3 * thick])
        + box(
            0.35 * elbow,
            three + _vector(-1.5 * thick, 0.2 * thick, 0.5 * thick),
            [1.6 * thick, 1.5 * thick, thick],
        ),
        cylinder(0.8 * forearm, four, five, 0.6 * thick)
        + box(0.2 * forearm, five + 0.6 * thick * y, [1.2 * thick, 0.4 * thick, thick]),
        cylinder(0.7 * wrist, five, six, 0.5 * thick)
        + cylinder(0.3 * wrist, five - 0.5 * thick * y, five + 0.5 * thick * y, 0.4 * thick),
        cylinder(0.3 * hand, six, six + _vector(0.1 * make.tool, 0, 0), 0.5 * thick)
        + box(
            0.7 * hand,
            0.45 * six + 0.55 * tool + [0, 0.4 * thick, 0.5 * thick],
            [0.8 * make.tool, 0.9 * thick, 1.3 * thick],
        ),
    ]


def _points(
    make: Make, names: list[str], turns: list[Array], origins: Array, rng: np.random.Generator
) -> tuple[Point, ...]:
    """Two points on the skin of every link; the last, at the tool's end, well off axis 6."""
    points: list[Point] = []
    for number, name in enumerate(names):
        along = origins[number + 1] - origins[number]
        for which, share in ((1, rng.uniform(0.3, 0.5)), (2, rng.uniform(0.75, 0.95))):
            off = rng.uniform(0.04, 0.07, 3) * rng.choice([-1, 1], 3) * make.reach
            off -= 0.8 * (off @ along) / (along @ along) * along
            xyz = turns[number].T @ (share * along + off)
            points.append(
                Point(
                    len(points) + 1,
                    f"base{which}" if number == 0 else f"{name}_{which}",
                    name,
                    np.round(xyz, 6),
                )
            )
    return tuple(points)
