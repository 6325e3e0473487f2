"""Named cases: what is hidden where, with sizes drawn by seed for the arm at hand; add a function to `CASES`
for a new one.

A case is a name and, where it sits on a joint or link, its number: `none`, `base_rocking`, `tilt_j2`,
`link2_flex`, `payload`; several are joined by +: `base_rocking+tilt_j3`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np

from tests.generator import faults, nonlinear, structure
from tests.generator.arm import Arm
from tests.generator.effect import Effect, TorqueEffect
from tests.generator.linear import linearise
from tests.generator.plant import Plant
from tests.generator.rigid import Array, frame_with_z
from tests.generator.spec import TestSpec
from tests.generator.structure import CLASSES
from tests.generator.tree import Tree, at_posture

_PULSE = 2 / np.pi * 6.5e-3
"""Impulse of a usual impact per its peak, s."""
_LEVELS = (0.3, 1.0, 3.0)


@dataclass(frozen=True)
class Draw:
    """What sizes are drawn from; `strength` 1 is clearly visible, 2 twice as compliant, heavy or wrong."""

    arm: Arm
    tree: Tree
    rng: np.random.Generator
    number: int
    strength: float
    peak_n: float

    @property
    def reference_hz(self) -> float:
        """The lowest frequency of joints 1 to 3 on their own."""
        joints = enumerate(self.arm.joints[:3], start=1)
        inertia = [self.tree.outboard_about(f"link{number}", joint.axis) for number, joint in joints]
        return float(np.sqrt(np.min(self.arm.stiffness[:3] / inertia)) / (2 * np.pi))

    @property
    def total_mass(self) -> float:
        """Mass of the arm, kg."""
        return sum(link.inertia.mass for link in self.arm.links)

    def spring(self, inertia: float, low: float, high: float) -> tuple[float, float]:
        """Stiffness and damping that put `inertia` at low to high times the reference frequency, damped by 2
        to 5 %.
        """
        speed = 2 * np.pi * self.reference_hz * self.rng.uniform(low, high) / np.sqrt(self.strength)
        return inertia * speed**2, 2 * self.rng.uniform(0.02, 0.05) * inertia * speed

    def springs(self, inertias: list[float], low: float, high: float) -> dict[str, tuple[float, ...]]:
        """`stiffness` and `damping` of several springs."""
        pairs = [self.spring(inertia, low, high) for inertia in inertias]
        return {"stiffness": tuple(k for k, _ in pairs), "damping": tuple(c for _, c in pairs)}

    def along(self, number: int) -> Array:
        """From a link's origin to the next joint, or the link's last point, in the link's frame (3,), m."""
        return self.arm.joints[number].xyz if number < 6 else self.arm.points[-1].xyz

    def channel(self) -> tuple[str, str]:
        """A point of links 2 to 6 and an axis."""
        points = [
            point.name
            for point in self.arm.points
            if point.link in ("link2", "link3", "link4", "link5", "link6")
        ]
        return str(self.rng.choice(points)), str(self.rng.choice(list("xyz")))

    def amplitude(self) -> tuple[float, float]:
        """Largest deflection (rad) and rate (rad/s) of the joint after a usual impact, mean of three
        directions.
        """
        linear = linearise(Plant(self.tree), self.arm.points[-1].name)
        values, vectors = np.linalg.eig(linear.a)
        start = np.linalg.solve(vectors, linear.b * _PULSE * self.peak_n)
        times = np.linspace(0.0, 0.3, 601)
        motion = np.einsum("sm,tm,md->tsd", vectors, np.exp(np.outer(times, values)), start).real
        angle, rate = (
            float(np.abs(motion[:, state]).max(axis=0).mean()) for state in (self.number - 1, self.number + 5)
        )
        return angle, rate


def _base(axes: tuple[str, ...], low: float, high: float) -> Callable[[Draw], Effect]:
    def make(draw: Draw) -> Effect:
        whole = draw.tree.outboard(0)
        inertias = [
            whole.mass if axis[0] == "t" else whole.about_axis(np.zeros(3), np.eye(3)["xyz".index(axis[1])])
            for axis in axes
        ]
        return structure.BaseCompliance(axes, **draw.springs(inertias, low, high))

    return make


def _joint(axes_class: str, low: float, high: float) -> Callable[[Draw], Effect]:
    def make(draw: Draw) -> Effect:
        body, frame = draw.tree.outboard(draw.number), frame_with_z(draw.arm.joints[draw.number - 1].axis)
        axes = CLASSES[axes_class]
        inertias = [
            body.mass if axis[0] == "t" else body.about_axis(np.zeros(3), frame[:, "xyz".index(axis[1])])
            for axis in axes
        ]
        return structure.JointCompliance(draw.number, axes_class, **draw.springs(inertias, low, high))

    return make


def _turned(make: Callable[[Draw], Effect]) -> Callable[[Draw], Effect]:
    """What `make` makes, its axes anywhere about z."""

    def turned(draw: Draw) -> Effect:
        effect = make(draw)
        assert isinstance(effect, structure.BaseCompliance | structure.JointCompliance)
        return replace(effect, turned_deg=float(draw.rng.uniform(10, 80)))

    return turned


def _relaxing(law: str, count: int) -> Callable[[Draw], Effect]:
    """Elements whose relaxation frequencies lie over the band, softer ones slower."""

    def make(draw: Draw) -> Effect:
        body, frame = draw.tree.outboard(draw.number), frame_with_z(draw.arm.joints[draw.number - 1].axis)
        inertia = body.about_axis(np.zeros(3), frame[:, 0])
        stiffness, _ = draw.spring(inertia, 1.5, 2.2)
        hertz = np.geomspace(6.0, 60.0, count) if count > 1 else np.array([20.0])
        share = np.linspace(1.2, 0.6, count) if law == "viscoelastic-pad" else np.geomspace(1.0, 0.25, count)
        own = stiffness * (1 + share.sum()) / share
        dampers = own / (2 * np.pi * hertz)
        first = stiffness * (1 + share.sum())
        return structure.RelaxingJoint(
            draw.number,
            "tilt",
            (float(first), *(float(k) for k in own)),
            (float(0.02 * first / (2 * np.pi * 20)), *(float(c) for c in dampers)),
            float(inertia),
            law,
        )

    return make


def _flexible(draw: Draw) -> Effect:
    along, body, segments = draw.along(draw.number), draw.tree.outboard(draw.number), 4
    frame = frame_with_z(along)
    bending = draw.spring(body.about_axis(np.zeros(3), frame[:, 0]), 1.3, 2.0)
    torsion = draw.spring(body.about_axis(np.zeros(3), frame[:, 2]), 2.0, 3.0)
    pairs = zip(bending, torsion, strict=True)
    (kb, kt), (cb, ct) = ((segments * b, segments * t) for b, t in pairs)
    cast = 0.25  # damping of a casting beside that of joints
    return structure.LinkFlexibility(
        f"link{draw.number}", (along[0], along[1], along[2]), kb, kt, cast * cb, cast * ct, segments
    )


def _resonator(draw: Draw) -> Effect:
    link, axis = f"link{draw.number}", str(draw.rng.choice(list("xyz")))
    x, y, z = 0.5 * draw.along(draw.number) + draw.rng.uniform(-0.05, 0.05, 3)
    mass = draw.strength * draw.rng.uniform(0.015, 0.03) * draw.total_mass
    return structure.AppendedResonator(
        link, axis, (x, y, z), mass, draw.rng.uniform(12.0, 30.0), draw.rng.uniform(0.02, 0.05)
    )


def _payload(draw: Draw) -> Effect:
    x, y, z = 0.7 * draw.arm.points[-1].xyz
    return structure.AddedMass(
        "link6", (x, y, z), draw.strength * draw.rng.uniform(0.2, 0.5) * draw.arm.links[6].inertia.mass
    )


def _gripper(draw: Draw) -> Effect:
    """On a mount somewhere between the last link's frame and its end, which turns about its three axes."""
    end, size = draw.along(6), 0.02 * draw.total_mass ** (1 / 3)
    sideways = draw.rng.normal(size=3) * 0.1 * size
    beyond = end / np.linalg.norm(end) * size * draw.rng.uniform(0.3, 1.0) + sideways
    rigid = structure.SoftMount(
        "link6",
        _three(draw.rng.uniform(0.3, 1.0) * end),
        _three(beyond),
        draw.rng.uniform(0.02, 0.05) * draw.total_mass,
        0.4 * size,
    )
    inertias = np.diag(rigid.body.about(np.zeros(3))).tolist()
    return replace(rigid, **draw.springs(inertias, 1.5, 3.5))


def _three(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def _sensor_mass(draw: Draw) -> Effect:
    return structure.SensorMass(draw.strength * draw.rng.uniform(0.001, 0.002) * draw.total_mass)


def _ground_spring(draw: Draw) -> Effect:
    x, y, z = draw.along(draw.number)
    inertia = draw.tree.outboard_about("link2", draw.arm.joints[1].axis)
    stiffness, damping = draw.spring(
        inertia / float(np.sum(draw.along(2) ** 2)), 0.5 * draw.strength, 0.8 * draw.strength
    )
    lean = draw.rng.uniform(-0.5, 0.5, 2)
    return structure.SpringToGround(
        f"link{draw.number}", (x, y, z), (lean[0], lean[1], 1.0), stiffness, damping
    )


def _rotor(draw: Draw) -> Effect:
    inertia = draw.tree.outboard_about(f"link{draw.number}", draw.arm.joints[draw.number - 1].axis)
    return structure.RotorInertia(draw.number, draw.strength * draw.rng.uniform(0.15, 0.35) * inertia)


def _held(draw: Draw) -> Effect:
    """A third as compliant as the drive, and as heavy as what it drives at most."""
    joint = draw.arm.joints[draw.number - 1]
    inertia = draw.tree.outboard_about(f"link{draw.number}", joint.axis)
    stiffness = draw.arm.stiffness[draw.number - 1] / (draw.strength * draw.rng.uniform(0.2, 0.5))
    late = draw.rng.uniform(6e-3, 20e-3)
    rotor = draw.rng.uniform(0.1, 0.8) * inertia
    return structure.HeldRotor(draw.number, float(rotor), float(stiffness), float(late * stiffness))


def _friction(draw: Draw) -> Effect:
    angle, rate = draw.amplitude()
    torque = draw.strength * draw.rng.uniform(0.08, 0.15) * draw.arm.stiffness[draw.number - 1] * angle
    return nonlinear.JointFriction(draw.number, torque, 0.02 * rate)


def _friction_springs(draw: Draw) -> Effect:
    """Half as stiff as the joint's spring or more, giving way one after the other in usual motion."""
    angle, _ = draw.amplitude()
    each = draw.strength * draw.rng.uniform(0.5, 1.0) * draw.arm.stiffness[draw.number - 1] / 4
    torques = each * angle * np.geomspace(0.1, 1.5, 4)
    return nonlinear.FrictionSprings(draw.number, (float(each),) * 4, tuple(float(t) for t in torques))


def _hardening(draw: Draw) -> Effect:
    stiffness = draw.arm.stiffness[draw.number - 1]
    angle, _ = draw.amplitude()
    return nonlinear.HardeningStiffness(
        draw.number, draw.strength * draw.rng.uniform(0.05, 0.12) * stiffness / angle**2
    )


def _swap(draw: Draw) -> Effect:
    first, second = draw.rng.choice(list("xyz"), 2, replace=False)
    return faults.ChannelSwap(draw.channel()[0], (str(first), str(second)))


def _gain(draw: Draw) -> Effect:
    factor = np.exp(draw.strength * draw.rng.uniform(0.15, 0.4) * draw.rng.choice([-1, 1]))
    return faults.ChannelGain(*draw.channel(), float(factor))


CASES: dict[str, Callable[[Draw], Effect]] = {
    "base_rocking": _base(("rx", "ry"), 1.2, 2.0),
    "base_turning": _base(("rz",), 1.2, 2.0),
    "base_sliding": _base(("tx", "ty"), 2.0, 3.5),
    "base_lifting": _base(("tz",), 2.0, 3.5),
    "tilt": _joint("tilt", 1.2, 2.0),
    "radial": _joint("radial", 2.0, 3.5),
    "axial": _joint("axial", 2.0, 3.5),
    "turned_rocking": _turned(_base(("rx", "ry"), 1.2, 2.0)),
    "turned_tilt": _turned(_joint("tilt", 1.2, 2.0)),
    "turned_radial": _turned(_joint("radial", 2.0, 3.5)),
    "flex": _flexible,
    "pad": _relaxing("viscoelastic-pad", 2),
    "fractional": _relaxing("fractional-damper", 4),
    "absorber": _resonator,
    "payload": _payload,
    "gripper": _gripper,
    "sensor_mass": _sensor_mass,
    "ground_spring": _ground_spring,
    "rotor": _rotor,
    "held": _held,
    "friction": _friction,
    "hardening": _hardening,
    "friction_springs": _friction_springs,
    "delay": lambda draw: faults.TimeDelay(draw.strength * draw.rng.uniform(0.5e-3, 1.5e-3)),
    "polarity": lambda draw: faults.ChannelPolarity(*draw.channel()),
    "gain": _gain,
    "swap": _swap,
    "turned": lambda draw: faults.TurnedSensor(
        *draw.channel(), float(draw.strength * draw.rng.uniform(10, 30) * draw.rng.choice([-1, 1]))
    ),
    "window": lambda draw: faults.WindowDecay(draw.strength * draw.rng.uniform(3.0, 6.0)),
}
"""What can be hidden, by the first part of a case's name."""
_NAME = re.compile(r"(?:link(?P<link>[1-6])_(?P<flex>flex)|(?P<kind>[a-z_]+?)(?:_[jl](?P<number>[1-6]))?)")


def hide(spec: TestSpec, case: str, strength: float = 1.0) -> TestSpec:
    """The test with a case hidden in it, at three force levels where it depends on them; ValueError for a
    name that is not known.
    """
    names = [] if case == "none" else case.split("+")
    effects = tuple(_effect(name, spec, strength) for name in names)
    varies = any(isinstance(effect, TorqueEffect) for effect in effects)
    return replace(spec, case=case, effects=effects, levels=_LEVELS if varies else spec.levels)


def _effect(name: str, spec: TestSpec, strength: float) -> Effect:
    match = _NAME.fullmatch(name)
    kind = (match["flex"] or match["kind"]) if match else None
    if match is None or kind not in CASES:
        raise ValueError(
            f"unknown case {name!r}; known: none, {', '.join(CASES)} (with _j2 or _l3 for the place;"
            " link2_flex)"
        )
    rng = np.random.default_rng([spec.seed, crc32(name.encode())])
    number = int(match["link"] or match["number"] or 2)
    return CASES[kind](
        Draw(spec.arm, at_posture(spec.arm, spec.arm.home), rng, number, strength, spec.peak_n)
    )
