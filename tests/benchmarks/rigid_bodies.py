"""Bodies of random six-axis arms from simulated motion: python -m tests.benchmarks.rigid_bodies --seed N.

Of each arm every body is drawn around the one of its description, masses and second moments some 20 % off
(its pseudo-inertia between a random matrix near one and its transpose, so that it stays a body).  Torques are
Pinocchio's along random Fourier series, with friction, and noise of 1 % of each torque's size.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
from numpy.typing import NDArray

from identify.joints.base import parse_curve
from identify.joints.data import JointTestData
from identify.joints.study import JointFile, JointStudy, bench_of
from identify.robot.description import Link, Robot
from identify.robot.engine import Engine
from identify.robot.posture import at_posture
from identify.robot.pseudo_inertia import body_of, pseudo_inertia
from identify.robot.read import read_robot
from identify.robot.rewrite import with_bodies
from identify.robot.settings import RobotSettings
from tests.robot.random_arm import industrial_arm

Array = NDArray[np.float64]
OFF, NOISE, RATE, SECONDS = 0.1, 0.01, 100.0, 20.0


def motion(rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Angles, speeds, accelerations (samples, 6) of five harmonics of a tenth of a hertz."""
    time, turn = np.arange(round(SECONDS * RATE) + 1) / RATE, 2 * np.pi / 10
    q, v, a = np.zeros((3, len(time), 6))
    for joint in range(6):
        for k in range(1, 6):
            size, phase, w = rng.uniform(0.2, 0.6) / k, rng.uniform(0, 2 * np.pi), turn * k
            q[:, joint] += size * np.sin(w * time + phase)
            v[:, joint] += size * w * np.cos(w * time + phase)
            a[:, joint] -= size * w**2 * np.sin(w * time + phase)
    return q, v, a


def mass_error(robot: Robot, truth: Robot, rng: np.random.Generator) -> float:
    """Relative error of the drives' mass matrix, over ten postures."""
    found = []
    for posture in rng.uniform(-1.5, 1.5, (10, 6)):
        both = []
        for one in (robot, truth):
            mechanism = at_posture(one, posture)
            drives = [mechanism.coordinates.index(f"joint{n}.rz") for n in range(1, 7)]
            both.append(Engine(mechanism).mass_matrix()[np.ix_(drives, drives)])
        found.append(np.linalg.norm(both[0] - both[1]) / np.linalg.norm(both[1]))
    return float(np.median(found))


def score(number: int, seed: int, folder: Path) -> tuple[float, float, int, int, int, int, float]:
    """Error of the mass matrix as described and as identified; of values that torques determine and of all,
    how many there are and how many intervals hold the truth; the least eigenvalue of all bodies.
    """
    rng = np.random.default_rng([seed, number])
    path = folder / "robot.urdf"
    path.write_text(industrial_arm(1000 * seed + number))
    settings = RobotSettings(urdf=path)
    robot = read_robot(settings, folder)
    bodies = []
    for link in robot.links[1:]:
        mixed = np.eye(4) + OFF * rng.normal(size=(4, 4))
        second = np.diag(pseudo_inertia(replace(link, centre=np.zeros(3))))
        scale = np.diag(np.sqrt(second / link.mass))
        shift = np.eye(4)
        shift[:3, 3] = link.centre
        near = shift @ scale @ mixed
        bodies.append(body_of(link.mass * near @ near.T, link.name))
    true_path = folder / "truth.urdf"
    true_path.write_text(with_bodies(settings, folder, robot, bodies))
    truth = read_robot(RobotSettings(urdf=true_path), folder)
    model = pinocchio.buildModelFromUrdf(str(true_path))
    data, (q, v, a) = model.createData(), motion(rng)
    torque = np.array([pinocchio.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
    rub = 0.05 * torque.std(axis=0)
    torque += rub * np.sign(v) + rub * v
    torque += NOISE * torque.std(axis=0) * rng.normal(size=torque.shape)
    names = ["time_s", *(f"joint{n}.{what}" for what in ("q", "t") for n in range(1, 7))]
    table = np.column_stack([np.arange(len(q)) / RATE, q, torque])
    np.savetxt(folder / "run.csv", table, delimiter=",", header=",".join(names), comments="")
    found = parse_curve({"kind": "rigid-bodies", "files": ["run.csv"], "rotor_inertia_kg_m2": [0.0] * 6})
    result = found.identify(_bench(folder))
    new = folder / "new.urdf"
    new.write_text(result.robot)
    identified = read_robot(RobotSettings(urdf=new), folder)
    values = result.values
    true = np.concatenate([_listed(link) for link in truth.links[1:]])
    inside = np.abs(values.value - true) <= (values.high_95 - values.low_95) / 2
    told = np.array(values.status) == "determined"
    least = min(float(np.linalg.eigvalsh(pseudo_inertia(link))[0]) for link in identified.links[1:])
    again = np.random.default_rng([seed, number, 1])
    errors = mass_error(robot, truth, again), mass_error(identified, truth, again)
    return (*errors, int(told.sum()), int(inside[told].sum()), len(inside), int(inside.sum()), least)


def _listed(link: Link) -> Array:
    return np.array([link.mass, *link.centre, *link.inertia[np.triu_indices(3)]])


def _bench(folder: Path) -> JointTestData:
    signals: dict[str, Any] = {
        "motor_position": {"at": "joint{joint}.q", "unit": "rad"},
        "motor_torque": {"at": "joint{joint}.t", "unit": "N m"},
    }
    study = JointStudy.model_validate(
        {
            "schema": "identify-joints/1",
            "robot": {"urdf": "robot.urdf"},
            "gear_ratio": [1.0] * 6,
            "signals": signals,
            "lowpass_hz": 10,
            "curves": [{"kind": "rigid-bodies", "files": ["run.csv"]}],
        }
    )
    return bench_of(JointFile.of(folder / "study.yaml", study, ""))


def main() -> None:
    """A row per arm, and the sums."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.rigid_bodies", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--arms", type=int, default=20)
    given = parser.parse_args()
    rows = []
    for number in range(given.arms):
        with tempfile.TemporaryDirectory() as folder:
            rows.append(score(number, given.seed, Path(folder)))
        text = "arm {}: masses off by {:.3f}, now {:.4f}; determined {}, inside {}; all {}, inside {}; {:.1g}"
        print(text.format(number, *rows[-1]), flush=True)
    total = np.array(rows)
    gain, nearer = np.median(total[:, 0] / total[:, 1]), int((total[:, 1] < total[:, 0]).sum())
    told, held, count, inside = total[:, 2:6].sum(axis=0).astype(int)
    print(
        f"mass matrices {gain:.3g} times nearer the truth at the median, in {nearer} of {len(rows)} arms;"
        f" of {told} determined values {held} within their interval, of all {count} {inside};"
        f" all bodies possible: {bool((total[:, 6] > 0).all())}"
    )


if __name__ == "__main__":
    main()
