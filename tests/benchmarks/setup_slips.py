"""Slips of practice, put into a simulated hammer test and what is stated of it: nothing here knows
`identify`.

A slip changes the files as a person would have got them wrong, and says by which words it is named right: the
code of its kind, and what its sentence has to have.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.generator.arm import Arm
from tests.generator.linear import linearise
from tests.generator.measure import (
    make_chain,
    make_plant,
    stated_decay,
    strike_all,
    with_noise_of,
)
from tests.generator.rigid import Array, from_rpy, turn
from tests.generator.spec import TestSpec
from tests.generator.structure import AddedMass
from tests.generator.universal import Function, dataset

POUND = 0.45359237
Named = tuple[str, str]
"""Code of a kind, and a part of its sentence."""


@dataclass
class Told:
    """A test as its user tells it: frfs and coherences (lines, points, 3, 3) by posture; extra: lines of the
    config under `robot`; uncertainty: what it states; labels: node of each point in the FRF files.
    """

    arm: Arm
    postures: list[list[float]]
    frequency_hz: Array
    frfs: list[Any]
    coherences: list[Array]
    decay: float
    urdf: str
    points: list[list[str]]
    labels: list[int]
    extra: str = ""
    uncertainty: str = ""
    true: list[list[float]] = field(default_factory=list)

    @property
    def hammer(self) -> int:
        """Number of the point that is hit."""
        return len(self.arm.points) - 1


def told(spec: TestSpec) -> Told:
    """A test, simulated, and told as its user knows it."""
    postures = bent(spec)
    plants = [make_plant(spec, posture) for posture in postures]
    decay = stated_decay(spec, [linearise(plant, spec.hammer_points[0]) for plant in plants])
    chain, frfs, coherences = make_chain(spec, decay, plants), [], []
    frequency = np.zeros(0)
    for number, plant in enumerate(plants):
        rng = np.random.default_rng([spec.seed, number, 0, 0xE6])
        struck = strike_all(spec, plant, with_noise_of(spec, chain, number), 1.0, rng)
        estimates = [struck[(spec.hammer_points[0], axis)] for axis in range(3)]
        frequency = estimates[0].frequency_hz
        shape = (len(frequency), len(spec.arm.points), 3)
        frfs.append(np.stack([one.h1.reshape(shape) for one in estimates], axis=-1))
        coherences.append(np.stack([one.coherence.reshape(shape) for one in estimates], axis=-1))
    known = spec.told or spec.arm
    rows = [[str(p.node), p.name, p.link, *(f"{x:.6f}" for x in p.xyz)] for p in known.points]
    angles = [list(map(float, posture)) for posture in postures]
    labels = [p.node for p in known.points]
    true = deepcopy(angles)
    return Told(known, angles, frequency, frfs, coherences, decay, known.urdf(), rows, labels, true=true)


def bent(spec: TestSpec) -> Array:
    """Postures (postures, joints), degrees, far from zero, where a sign is seen."""
    rng = np.random.default_rng([spec.seed, 0x5E])
    size = rng.uniform([5, 12, 12, 20, 25, 10], [60, 40, 45, 70, 75, 80], (spec.postures, 6))
    return np.round(size * rng.choice([-1, 1], (spec.postures, 6)), 1)


def write(test: Told, folder: Path) -> Path:
    """The files of a test, and its config."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(test.urdf)
    head = "node,name,link,x_m,y_m,z_m"
    (folder / "points.csv").write_text("\n".join([head, *map(",".join, test.points), ""]))
    lines = [
        "schema: identify/1",
        f"name: {folder.name}",
        "robot:",
        "  urdf: robot.urdf",
        *test.extra.splitlines(),
    ]
    lines += ["points: points.csv", "band_hz: [3, 80]", "starts: 4"]
    lines += [f"uncertainty: {test.uncertainty}"] if test.uncertainty else []
    lines += ["measurements:"]
    for number, posture in enumerate(test.postures, start=1):
        (folder / f"posture{number}.uff").write_bytes(_universal(test, number - 1))
        window = f", window_decay_per_s: {test.decay}" if test.decay else ""
        angles = ", ".join(f"{angle:.6g}" for angle in posture)
        lines.append(f"  - {{file: posture{number}.uff, posture_deg: [{angles}], averages: 4{window}}}")
    path = folder / "study.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


def _universal(test: Told, number: int) -> bytes:
    named = {label: point for label, point in zip(test.labels, test.arm.points, strict=True)}
    points = [_relabelled(point, label) for label, point in named.items()]
    hit, sets = points[test.hammer], []
    for values in (test.frfs[number].astype(complex), test.coherences[number]):
        for axis in range(3):
            for place, point in enumerate(points):
                for along in range(3):
                    ends = point, along, hit, axis
                    sets.append(
                        dataset(Function(test.frequency_hz, values[:, place, along, axis], *ends), True)
                    )
    return b"".join(sets)


def _relabelled(point: Any, label: int) -> Any:
    return type(point)(label, point.name, point.link, point.xyz)


def rotations(test: Told, posture: list[float]) -> dict[str, Array]:
    """Axes of each link in the base's, (3, 3), as columns."""
    found, here = {test.arm.links[0].name: np.eye(3)}, np.eye(3)
    for joint, link, angle in zip(test.arm.joints, test.arm.links[1:], np.radians(posture), strict=True):
        here = here @ from_rpy(joint.rpy) @ turn(joint.axis, angle)
        found[link.name] = here
    return found


Slip = Callable[[Told, np.random.Generator], list[Named]]


def scaled(factor: float, word: str) -> Slip:
    """All FRFs times a factor."""

    def slip(test: Told, rng: np.random.Generator) -> list[Named]:
        test.frfs = [factor * one for one in test.frfs]
        return [("factor", word)]

    return slip


def integrated(times: int, word: str) -> Slip:
    """Velocities or displacements under the name of accelerations."""

    def slip(test: Told, rng: np.random.Generator) -> list[Named]:
        s = (2j * np.pi * test.frequency_hz)[:, None, None, None]
        test.frfs = [one / s**times for one in test.frfs]
        return [("quantity", word)]

    return slip


def inverted(test: Told, rng: np.random.Generator) -> list[Named]:
    """Forces over responses, one by one."""
    test.frfs = [1 / one for one in test.frfs]
    return [("inverse", "1/H")]


def rad_per_s(test: Told, rng: np.random.Generator) -> list[Named]:
    """Frequencies in rad/s under the name of Hz."""
    test.frequency_hz = test.frequency_hz * 2 * np.pi
    return [("frequency", "rad/s")]


def world_axes(test: Told, rng: np.random.Generator) -> list[Named]:
    """All sensors and the hammer along the axes of the room."""
    hit = test.arm.points[test.hammer].link
    for number, posture in enumerate(test.true):
        axes = rotations(test, posture)
        for place, point in enumerate(test.arm.points):
            test.frfs[number][:, place] = np.einsum(
                "ij,ljk->lik", axes[point.link], test.frfs[number][:, place]
            )
        test.frfs[number] = np.einsum("lpjk,ik->lpji", test.frfs[number], axes[hit])
    return [("axes", "base")]


def nodes_exchanged(test: Told, rng: np.random.Generator) -> list[Named]:
    """Two sensors on different links under each other's names."""
    links = [point.link for point in test.arm.points]
    moving = [n for n in range(test.hammer) if links[n] != "base_link"]
    pairs = [(a, b) for a in moving for b in moving if a < b and links[a] != links[b]]
    one, other = pairs[rng.integers(len(pairs))]
    for values in (*test.frfs, *test.coherences):
        values[:, [one, other]] = values[:, [other, one]]
    a, b = sorted((test.labels[one], test.labels[other]))
    return [("points-exchanged", f"{a} and {b}")]


def nodes_shifted(test: Told, rng: np.random.Generator) -> list[Named]:
    """Every sensor under the name of the next one."""
    test.frfs = [np.roll(one, -1, axis=1) for one in test.frfs]
    test.coherences = [np.roll(one, -1, axis=1) for one in test.coherences]
    return [("points-shifted", "higher")]


def links_shifted(test: Told, rng: np.random.Generator) -> list[Named]:
    """Every point on the link before its own."""
    names = [link.name for link in test.arm.links]
    for row in test.points:
        row[2] = names[max(names.index(row[2]) - 1, 0)]
    return [("links-shifted", "next")]


def wrong_link(test: Told, rng: np.random.Generator) -> list[Named]:
    """One point on another link than it is."""
    names = [link.name for link in test.arm.links]
    place = int(rng.choice([n for n in range(test.hammer) if test.points[n][2] != "base_link"]))
    right = test.points[place][2]
    test.points[place][2] = str(
        rng.choice([name for name in names[1:] if abs(names.index(name) - names.index(right)) in (1, 2)])
    )
    return [("wrong-link", f"point {test.points[place][0]} is on {right}")]


def _moving(test: Told, rng: np.random.Generator) -> int:
    return int(
        rng.choice([n for n in range(test.hammer) if test.arm.points[n].link not in ("base_link", "link1")])
    )


def cube_turned(test: Told, rng: np.random.Generator) -> list[Named]:
    """A sensor glued on turned by a right angle."""
    place, axis = _moving(test, rng), int(rng.integers(3))
    quarter = turn(np.eye(3)[axis], np.pi / 2 * int(rng.choice([-1, 1]))).round()
    for one in test.frfs:
        one[:, place] = np.einsum("ij,ljk->lik", quarter, one[:, place])
    return [("sensor-turned", f"point {test.labels[place]} ")]


def channel_sign(test: Told, rng: np.random.Generator) -> list[Named]:
    """One channel the other way round."""
    place, axis = _moving(test, rng), int(rng.integers(3))
    for one in test.frfs:
        one[:, place, axis] *= -1
    return [("sensor-sign|sign", f"{test.labels[place]}:+{'XYZ'[axis]}")]


def cables_exchanged(test: Told, rng: np.random.Generator) -> list[Named]:
    """Two cables of one sensor exchanged."""
    place, axis = _moving(test, rng), int(rng.integers(3))
    other = (axis + 1) % 3
    for one in test.frfs:
        one[:, place, [axis, other]] = one[:, place, [other, axis]]
    return [("channel-exchange", f"{test.labels[place]}:+{'XYZ'[min(axis, other)]}")]


def sensor_size(test: Told, rng: np.random.Generator) -> list[Named]:
    """One sensor with a sensitivity that is wrong by ten."""
    place = _moving(test, rng)
    for one in test.frfs:
        one[:, place] *= 10.0
    return [("size", f"point {test.labels[place]} reads 10")]


def channel_size(test: Told, rng: np.random.Generator) -> list[Named]:
    """One channel in g."""
    place, axis = _moving(test, rng), int(rng.integers(3))
    for one in test.frfs:
        one[:, place, axis] /= 9.80665
    return [("size", f"{test.labels[place]}:+{'XYZ'[axis]} reads 0.102")]


def force_sign(test: Told, rng: np.random.Generator) -> list[Named]:
    """Hit from the other side in one direction."""
    axis = int(rng.integers(3))
    for one in test.frfs:
        one[..., axis] *= -1
    return [("sign", f"force at {test.labels[test.hammer]}:+{'XYZ'[axis]}")]


def force_size(test: Told, rng: np.random.Generator) -> list[Named]:
    """The hammer's range changed before one direction."""
    axis = int(rng.integers(3))
    for one in test.frfs:
        one[..., axis] *= 10.0
    return [("size", f"force at {test.labels[test.hammer]}:+{'XYZ'[axis]}")]


def one_file(test: Told, rng: np.random.Generator) -> list[Named]:
    """One file in g."""
    number = int(rng.integers(len(test.frfs)))
    test.frfs[number] = test.frfs[number] / 9.80665
    return [("one-measurement", f"posture{number + 1}.uff")]


def postures_mixed(test: Told, rng: np.random.Generator) -> list[Named]:
    """Files under other postures."""
    test.postures = test.postures[1:] + test.postures[:1]
    return [("postures", "mixed up")]


def signed(number: int) -> Slip:
    """A joint counted the other way."""

    def slip(test: Told, rng: np.random.Generator) -> list[Named]:
        for posture in test.postures:
            posture[number - 1] *= -1
        return [("joint-sign", f"joint {number} ")]

    return slip


def all_signs(test: Told, rng: np.random.Generator) -> list[Named]:
    """All joints counted the other way."""
    test.postures = [[-angle for angle in posture] for posture in test.postures]
    return [("joint-sign", "all joint")]


def zeroed(turns: dict[int, float]) -> Slip:
    """Joints whose zero is elsewhere."""

    def slip(test: Told, rng: np.random.Generator) -> list[Named]:
        for posture in test.postures:
            for number, angle in turns.items():
                posture[number - 1] -= angle
        joints = " and ".join(str(number) for number in turns)
        return [("joint-zero|joint-offset", f"{joints} ")]

    return slip


def in_radians(test: Told, rng: np.random.Generator) -> list[Named]:
    """Angles in radians."""
    test.postures = [np.radians(posture).tolist() for posture in test.postures]
    return [("radians", "radians")]


def reversed_order(test: Told, rng: np.random.Generator) -> list[Named]:
    """From the last joint to the first."""
    test.postures = [posture[::-1] for posture in test.postures]
    return [("joint-order", "last joint")]


def neighbours(test: Told, rng: np.random.Generator) -> list[Named]:
    """Two joints exchanged."""
    first = int(rng.integers(1, 5))
    for posture in test.postures:
        posture[first], posture[first + 1] = posture[first + 1], posture[first]
    return [("joint-order", f"{first + 1} and {first + 2}")]


def from_ground(sense: float) -> Slip:
    """Joint 3 counted from the ground."""

    def slip(test: Told, rng: np.random.Generator) -> list[Named]:
        for posture in test.postures:
            posture[2] += sense * posture[1]
        return [("from-ground", "ground")]

    return slip


def urdf(what: str, factor: float, *named: Named) -> Slip:
    """Numbers of some attributes of the robot file times a factor."""

    def slip(test: Told, rng: np.random.Generator) -> list[Named]:
        def times(found: re.Match[str]) -> str:
            return f'{found[1]}="{" ".join(f"{factor * float(n):.12g}" for n in found[2].split())}"'

        test.urdf = re.sub(rf'\b({what})="([^"]*)"', times, test.urdf)
        return list(named)

    return slip


def both(first: Slip, second: Slip) -> Slip:
    """Two changes that are one slip: the first says its name."""

    def slip(test: Told, rng: np.random.Generator) -> list[Named]:
        second(test, rng)
        return first(test, rng)

    return slip


def placeholders(test: Told, rng: np.random.Generator) -> list[Named]:
    """Inertias nobody knew."""
    value = 'ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"'
    test.urdf = re.sub(r'ixx="[^/]*"', value, test.urdf)
    return [("placeholder", "same inertia")]


def no_window(test: Told, rng: np.random.Generator) -> list[Named]:
    """An exponential window that is not told."""
    test.decay = 0.0
    return [("window", "window")]


def magnitudes(test: Told, rng: np.random.Generator) -> list[Named]:
    """Magnitudes as complex numbers, with the imaginary parts of an export."""
    test.frfs = [np.abs(one) * (1 + 1e-7j) for one in test.frfs]
    return [("magnitude", "magnitude")]


def decibels(test: Told, rng: np.random.Generator) -> list[Named]:
    """Decibels as complex numbers."""
    test.frfs = [20 * np.log10(np.abs(one)) * (1 + 1e-7j) for one in test.frfs]
    return [("decibels", "dB")]


def real_parts(test: Told, rng: np.random.Generator) -> list[Named]:
    """Real parts alone."""
    test.frfs = [one.real * (1 + 1e-7j) for one in test.frfs]
    return [("real-part", "real")]


def carrying(spec: TestSpec) -> tuple[TestSpec, AddedMass]:
    """The test of an arm that carries half to all of its hand's mass more, off its axes, and that mass."""
    rng = np.random.default_rng([spec.seed, 0xCA])
    hand = spec.arm.links[-1]
    away = hand.inertia.centre + 0.4 * np.linalg.norm(spec.arm.points[-1].xyz) * rng.uniform(0.3, 1.0, 3)
    x, y, z = (float(f"{one:.4f}") for one in away)
    body = AddedMass(hand.name, (x, y, z), float(rng.uniform(0.5, 1.0)) * hand.inertia.mass)
    return replace(spec, effects=(*spec.effects, body)), body


def no_payload(spec: TestSpec) -> tuple[Told, list[Named]]:
    """A payload that nobody told."""
    return told(carrying(spec)[0]), [("payload", "carries a payload")]


def payload_elsewhere(spec: TestSpec) -> tuple[Told, list[Named]]:
    """A payload whose centre is told in the axes of a flange that is turned by a right angle or two."""
    there, body = carrying(spec)
    test = told(there)
    x, y, z = body.position
    turned = [[z, x, y], [-y, x, z], [-x, -y, z]][spec.seed % 3]
    centre = ", ".join(f"{one:.6g}" for one in turned)
    test.extra = f"  payload: [{{link: {body.link}, mass_kg: {body.mass_kg:.6g}, centre_m: [{centre}]}}]"
    return test, [("payload-frame", "other axes")]


def braked(spec: TestSpec) -> tuple[Told, list[Named]]:
    """A brake on in one file, behind which a drive of joints 2 to 5 is six times as stiff."""
    test, joint = told(spec), 2 + spec.seed % 4
    stiff = np.array(spec.arm.stiffness)
    stiff[joint - 1] *= 6.0
    stiffer = replace(spec.arm, stiffness=stiff)
    other = told(replace(spec, arm=stiffer, window_decay_per_s=test.decay))
    test.frfs[1], test.coherences[1] = other.frfs[1], other.coherences[1]
    return test, [("brake", f"joint {joint} ")]


SIMULATED: dict[str, Callable[[TestSpec], tuple[Told, list[Named]]]] = {
    "no_payload": no_payload,
    "payload_elsewhere": payload_elsewhere,
    "braked": braked,
}
"""Slips that a test has to be simulated for."""
_MASS, _INERTIA, _LENGTH = "value", "ixx|ixy|ixz|iyy|iyz|izz", "xyz"
SLIPS: dict[str, Slip] = {
    "g_for_ms2": scaled(1 / 9.80665, "0.102"),
    "ms2_for_g": scaled(9.80665, "9.807"),
    "hammer_x10": scaled(10.0, "10 times"),
    "hammer_10th": scaled(0.1, "0.1 times|0.102"),
    "mm_for_m": scaled(1000.0, "1000"),
    "pound_force": scaled(4.4482216, "4.448"),
    "inches": scaled(1 / 0.0254, "39.37"),
    "hammer_x2": scaled(2.0, "2 times"),
    "velocity": integrated(1, "velocities"),
    "displacement": integrated(2, "displacements"),
    "inverted": inverted,
    "rad_per_s": rad_per_s,
    "world_axes": world_axes,
    "nodes_exchanged": nodes_exchanged,
    "nodes_shifted": nodes_shifted,
    "links_shifted": links_shifted,
    "wrong_link": wrong_link,
    "cube_turned": cube_turned,
    "channel_sign": channel_sign,
    "cables_exchanged": cables_exchanged,
    "sensor_x10": sensor_size,
    "channel_in_g": channel_size,
    "force_sign": force_sign,
    "force_x10": force_size,
    "one_file_in_g": one_file,
    "postures_mixed": postures_mixed,
    "sign_j2": signed(2),
    "sign_j3": signed(3),
    "sign_j4": signed(4),
    "sign_j5": signed(5),
    "all_signs": all_signs,
    "zero_j2_90": zeroed({2: 90.0}),
    "zero_j3_-90": zeroed({3: -90.0}),
    "zero_j4_180": zeroed({4: 180.0}),
    "zero_j23": zeroed({2: -90.0, 3: 90.0}),
    "zero_j5_25": zeroed({5: 25.0}),
    "radians": in_radians,
    "order_reversed": reversed_order,
    "order_neighbours": neighbours,
    "from_ground": from_ground(1.0),
    "from_ground_against": from_ground(-1.0),
    "masses_lb": urdf(_MASS, 1 / POUND, ("robot-units", "pounds")),
    "robot_lb": both(urdf(_MASS, 1 / POUND, ("factor", "2.205")), urdf(_INERTIA, 1 / POUND)),
    "robot_g_gmm2": both(urdf(_MASS, 1e3, ("robot-units", "g and g mm2")), urdf(_INERTIA, 1e9)),
    "inertia_kg_mm2": urdf(_INERTIA, 1e6, ("robot-units", "kg mm2")),
    "inertia_kg_cm2": urdf(_INERTIA, 1e4, ("robot-units", "kg cm2")),
    "lengths_mm": urdf(_LENGTH, 1e3, ("robot-units", "mm")),
    "placeholders": placeholders,
    "window": no_window,
    "magnitudes": magnitudes,
    "decibels": decibels,
    "real_parts": real_parts,
}
"""By name."""
