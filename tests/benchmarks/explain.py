"""How often `identify explain` is wrong on simulated motion: python -m tests.benchmarks.explain [--seeds N].

Two records of a three-joint arm (five for coupled wrists), by `tests.motion.hidden_drive`.  First nothing is
hidden but noise, white or hanging together over time: whatever is named is false.  Then one effect at a time:
right means that name and no other; "or a rival", that it is among those which the report says would do as
well in place of the one named.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pinocchio as pin

from identify.explain.run import run_explain
from identify.results.explain import EffectTable, ExplainResult
from tests.motion.hidden_drive import PAYLOAD_KG, RATE, RATIO, Array, Hidden, Motion, only, rigid_model, study

MEMORIES = (0.0, 0.5, 0.9, 0.95, 0.99)
"""What a torque sample keeps of the last one's noise, by turns."""
_NO_LINKS: dict[str, object] = {"links": False}


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.explain", description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="records with nothing hidden")
    given = parser.parse_args()
    print("nothing hidden\n seed  memory  named falsely", flush=True)
    false = [named_of_nothing(seed) for seed in range(given.seeds)]
    print(
        f"effects named falsely: {sum(map(len, false))}, in {sum(map(bool, false))} of {given.seeds} pairs of"
        " records\n"
    )
    print("one effect hidden", flush=True)
    verdicts = [
        named_of_one(name, hidden, 100 + number) for number, (name, hidden) in enumerate(cases().items())
    ]
    counts = {verdict: verdicts.count(verdict) for verdict in dict.fromkeys(verdicts)}
    print(f"of {len(verdicts)}: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()))


def null(seed: int) -> Hidden:
    """Noise alone, on torques, link positions and commands."""
    noise = np.random.default_rng([seed, 3])
    memory = MEMORIES[seed % len(MEMORIES)]
    return Hidden(memory=memory, seeds=_seeds(seed), error=lambda m: noise.normal(scale=1e-5, size=m.q.shape))


def named_of_nothing(seed: int) -> list[str]:
    """Names found where nothing is hidden; prints a row."""
    hidden = null(seed)
    result, seconds = explained(3, hidden)
    names = [name for found in result.targets.values() for name in found.effects.name]
    print(f"{seed:5d}  {hidden.memory:6.2f}  {', '.join(names) or 'nothing'}  ({seconds:.1f} s)", flush=True)
    return names


def named_of_one(name: str, hidden: Hidden, seed: int) -> str:
    """Whether the hidden effect was named, in words; prints a row."""
    joints = 5 if "coupling" in name else 3
    result, seconds = explained(
        joints, replace(hidden, seeds=_seeds(seed)), **({"joints": [4, 5]} if joints > 3 else {})
    )
    tables = [found.effects for found in result.targets.values()]
    verdict = judged(name, tables)
    shown = ", ".join(
        named + (f" (or {rivals})" if rivals else "")
        for t in tables
        for named, rivals in zip(t.name, t.rivals, strict=True)
    )
    print(f"  {name:36s} {verdict:18s} {shown or 'nothing'}  ({seconds:.1f} s)", flush=True)
    return verdict


def judged(truth: str, tables: list[EffectTable]) -> str:
    """`right`, `or a rival`, `with others` (it and more), `another` (not it) or `nothing`; of a truth of
    several names, ` + ` between.
    """
    names = [name for table in tables for name in table.name]
    rivals = [rival for table in tables for row in table.rivals for rival in row.split(", ")]
    wanted = set(truth.split(" + "))
    if wanted <= set(names):
        return "right" if len(names) == len(wanted) else "with others"
    if not names:
        return "nothing"
    return "or a rival" if len(names) == len(wanted) and wanted <= {*names, *rivals} else "another"


def explained(count: int, hidden: Hidden, **more: object) -> tuple[ExplainResult, float]:
    """The result for a pair of records, and how long it took, s."""
    with tempfile.TemporaryDirectory() as folder:
        config = study(Path(folder), count, hidden, **more)
        began = time.perf_counter()
        return run_explain(config, Path(folder) / "out.h5")[0], time.perf_counter() - began


def cases() -> dict[str, Hidden]:
    """One effect each by its name, and an integrator with the loop it needs; what refines another one
    (Stribeck, preload) is left out.
    """
    noise = np.random.default_rng(5)

    def error(size: Callable[[Motion], Array], m: Motion) -> Array:
        return np.asarray(only(m.q.shape[1], 1, size(m)) + noise.normal(scale=1e-5, size=m.q.shape))

    return {
        **{name: Hidden((torque,), memory=0.8, extra=_NO_LINKS) for name, torque in torques().items()},
        "payload-mass": Hidden(payload_kg=6.0, memory=0.8, extra=_NO_LINKS),
        **{name: Hidden(deflection=bend) for name, bend in deflections().items()},
        "joint1.sensor-latency": Hidden(latency_s=(0.002, 0.0, 0.0, 0.0, 0.0)),
        **{
            name: Hidden(error=partial(error, size), torque_noise=0.002, extra=_NO_LINKS)
            for name, size in errors().items()
        },
    }


def torques() -> dict[str, Callable[[Motion], Array]]:
    """Torques at the motors (samples, joints), by the name of what makes them."""
    return {
        "joint1.coulomb-friction": lambda m: only(m.q.shape[1], 1, 0.5 * np.sign(m.v[:, 0])),
        "joint2.viscous-friction": lambda m: only(m.q.shape[1], 2, 1.0 * m.v[:, 1]),
        "joint3.load-dependent-friction": lambda m: only(
            m.q.shape[1], 3, 0.2 * np.abs(m.rigid[:, 2]) / RATIO[2] * np.sign(m.v[:, 2])
        ),
        "joint2.gravity-balancer": lambda m: only(
            m.q.shape[1], 2, 900.0 * np.sin(m.q[:, 1] + 0.4) / RATIO[1]
        ),
        "link2.first-moment": lambda m: _body(
            m, 2, pin.Inertia(8.0, np.array([-0.2, 0.3, 0.0]), np.zeros((3, 3)))
        ),
        "link3.inertia": lambda m: _body(m, 3, pin.Inertia(0.0, np.zeros(3), np.diag([0.0, 0.0, 12.0]))),
        "joint1.rotor-inertia": lambda m: only(m.q.shape[1], 1, 0.01 * RATIO[0] * m.a[:, 0]),
        "joint2.torque-constant": lambda m: only(m.q.shape[1], 2, 0.1 * m.rigid[:, 1] / RATIO[1]),
        "joint3.torque-offset": lambda m: only(m.q.shape[1], 3, np.full(len(m.time), 0.3)),
        "joint1.torque-ripple.8": lambda m: only(
            m.q.shape[1], 1, 0.2 * np.cos(8 * RATIO[0] * m.q[:, 0] + 0.4)
        ),
        "joint4.gear-coupling.joint5": lambda m: only(m.q.shape[1], 4, 0.5 * m.rigid[:, -1] / RATIO[3]),
    }


def deflections() -> dict[str, Callable[[Motion], Array]]:
    """Motor less link position (samples, joints), rad."""

    def hardened(m: Motion) -> Array:
        bend = [
            float(np.real(r[np.abs(r.imag) < 1e-9][0]))
            for r in (np.roots([4e10, 0, 4e5, -t]) for t in m.rigid[:, 1])
        ]
        return only(m.q.shape[1], 2, np.array(bend))

    return {
        "joint2.joint-compliance": lambda m: only(m.q.shape[1], 2, m.rigid[:, 1] / 8e5),
        "joint2.hardening-stiffness": hardened,
        "joint1.backlash": lambda m: only(m.q.shape[1], 1, 1e-4 * np.sign(m.rigid[:, 0])),
        "joint1.lost-motion": lambda m: only(m.q.shape[1], 1, 5e-5 * np.sign(m.v[:, 0])),
        "joint3.angular-transmission-error.1": lambda m: only(
            m.q.shape[1], 3, 6e-5 * np.sin(2 * RATIO[2] * m.q[:, 2] + 0.5)
        ),
        "joint2.encoder-eccentricity": lambda m: only(m.q.shape[1], 2, 2e-4 * np.sin(m.q[:, 1] + 0.7)),
    }


def errors() -> dict[str, Callable[[Motion], Array]]:
    """Command less motor position of joint 1 (samples,), rad."""

    def integrated(m: Motion) -> Array:
        state, found = 0.0, np.empty(len(m.time))
        for row, torque in enumerate(m.rigid[:, 0] / RATIO[0]):
            found[row] = (torque / 40.0 + m.v[row, 0] - 2.0 * state) / 20.0
            state += (20.0 * found[row] - m.v[row, 0]) / RATE
        return found

    return {
        "joint1.position-lag": lambda m: 0.05 * m.v[:, 0],
        "joint1.acceleration-lag": lambda m: 2e-3 * m.a[:, 0],
        "joint1.servo-compliance": lambda m: 2e-3 * m.rigid[:, 0] / RATIO[0],
        "joint1.position-lag + joint1.servo-compliance + joint1.integral-action": integrated,
    }


def _body(m: Motion, joint: int, body: pin.Inertia) -> Array:
    """What a body more on the link that a joint moves asks of the motors."""
    model = rigid_model(m.q.shape[1], PAYLOAD_KG)
    model.inertias[joint] = model.inertias[joint] + body
    data = model.createData()
    whole = np.array([pin.rnea(model, data, *row) for row in zip(m.q, m.v, m.a, strict=True)])
    return np.asarray((whole - m.rigid) / RATIO[: m.q.shape[1]])


def _seeds(number: int) -> tuple[int, int]:
    return 1000 + 2 * number, 1001 + 2 * number


if __name__ == "__main__":
    main()
