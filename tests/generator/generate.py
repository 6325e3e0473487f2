"""The files of a test as its user gets them, and beside the folder the truth, for scoring only."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from tests.generator.estimate import Estimate
from tests.generator.linear import Linear, linearise
from tests.generator.measure import (
    draw_postures,
    make_chain,
    make_plant,
    stated_decay,
    strike_recorded,
    with_noise_of,
)
from tests.generator.rigid import Array
from tests.generator.spec import TestSpec
from tests.generator.structure import SoftMount
from tests.generator.universal import Function, dataset


def generate(spec: TestSpec, folder: Path, truth: Path | None = None, postures: Array | None = None) -> None:
    """Simulate a test and write robot.urdf, points.csv, test.json and the UFF files into `folder`.

    The truth goes to `truth`, by default NAME.truth.json beside the folder.  postures (n, joints), degrees:
    drawn where not given.
    """
    generate_recorded(spec, [folder], truth, postures)


def generate_recorded(
    spec: TestSpec, folders: Sequence[Path], truth: Path | None = None, postures: Array | None = None
) -> None:
    """The same for one test whose impacts are recorded several times, each with noise of its own: into the
    first folder what `generate` writes, into the others the same impacts as other noise leaves them.
    """
    postures = draw_postures(spec) if postures is None else postures
    plants = [make_plant(spec, posture) for posture in postures]
    linear = [linearise(plant, spec.hammer_points[0]) for plant in plants]
    decay = stated_decay(spec, linear)
    chain = make_chain(spec, decay, plants)
    for folder in folders:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in describe(spec, postures, decay).items():
            (folder / name).write_text(text, encoding="utf-8")
        (truth or folder.parent / f"{folder.name}.truth.json").write_text(
            tell(spec, postures, linear), encoding="utf-8"
        )
    for (number, plant), (rank, level) in product(enumerate(plants), enumerate(spec.levels)):
        seed = [spec.seed, number, rank, 0xE6]
        rng = np.random.default_rng(seed)
        noises = [rng, *(np.random.default_rng([*seed, n]) for n in range(1, len(folders)))]
        heard = with_noise_of(spec, chain, number)
        frfs = strike_recorded(spec, plant, heard, level, rng, noises)
        for folder, recorded in zip(folders, frfs, strict=True):
            (folder / _name(spec, number, level)).write_bytes(_universal(spec, recorded))


def describe(spec: TestSpec, postures: Array, decay: float) -> dict[str, str]:
    """What the user is told: text files by name."""
    files = [
        {
            "file": _name(spec, number, level),
            "posture_deg": posture.tolist(),
            "level_n": round(level * spec.peak_n, 6),
        }
        for (number, posture), level in product(enumerate(postures), spec.levels)
    ]
    return {
        "robot.urdf": (spec.told or spec.arm).urdf(),
        "points.csv": (spec.told or spec.arm).points_csv(),
        "test.json": _json(_test(spec, files, decay)),
    }


def tell(spec: TestSpec, postures: Array, linear: list[Linear]) -> str:
    """The truth as JSON."""
    return _json(_truth(spec, postures, linear))


def _name(spec: TestSpec, number: int, level: float) -> str:
    return f"posture{number + 1}{f'_level{level:g}' if len(spec.levels) > 1 else ''}.uff"


def _universal(spec: TestSpec, frfs: dict[tuple[str, int], Estimate]) -> bytes:
    """All FRFs, then all coherences."""
    functions, coherences = [], []
    for (struck, axis), estimate in frfs.items():
        for channel in range(estimate.h1.shape[1]):
            ends = (spec.arm.points[channel // 3], channel % 3, spec.arm.point(struck), axis)
            functions.append(Function(estimate.frequency_hz, estimate.h1[:, channel], *ends))
            coherences.append(Function(estimate.frequency_hz, estimate.coherence[:, channel], *ends))
    return b"".join(dataset(function, spec.binary) for function in functions + coherences)


def _test(spec: TestSpec, files: list[dict[str, Any]], decay: float) -> dict[str, Any]:
    rng = np.random.default_rng([spec.seed, 0xF7])
    low, high = np.log(spec.initial_range)
    guess = spec.arm.stiffness * np.exp(rng.uniform(low, high, 6))
    carried = [one.payload() for one in spec.effects if isinstance(one, SoftMount)]
    return {
        **({"payload": carried[0]} if carried else {}),
        "files": files,
        "reference": f"fixed accelerometers, hammer at {', '.join(spec.hammer_points)}",
        "exponential_window_decay_per_s": decay,
        "averages": spec.averages,
        "sample_rate_hz": spec.sample_rate_hz,
        "duration_s": spec.duration_s,
        "directions": "each point's axes are those of its link's URDF frame",
        "initial_stiffness_nm_per_rad": [float(f"{value:.4g}") for value in guess],
    }


def _truth(spec: TestSpec, postures: Array, linear: list[Linear]) -> dict[str, Any]:
    effects = [effect.truth() for effect in spec.effects]
    return {
        "case": spec.case,
        "effects": effects,
        "hidden": [effect.sentence for effect in spec.effects],
        "bad": next((effect["point"] for effect in effects if "point" in effect), None),
        "k": spec.arm.stiffness.tolist(),
        "c": spec.arm.damping.tolist(),
        "opt": {
            "arm": spec.arm.name,
            "seed": spec.seed,
            "levels": list(spec.levels),
            "noise_force_n": spec.noise_force,
            "noise_response_m_per_s2": spec.noise_response,
        },
        "modes": [_modes(posture, model) for posture, model in zip(postures, linear, strict=True)],
    }


def _modes(posture: Array, model: Linear) -> dict[str, Any]:
    """What small vibrations about a posture really are."""
    modulus = np.abs(model.poles)
    ratio = -model.poles.real / modulus
    return {
        "posture_deg": posture.tolist(),
        "frequency_hz": (modulus / 2 / np.pi).tolist(),
        "damping_ratio": ratio.tolist(),
    }


def _json(content: dict[str, Any]) -> str:
    return json.dumps(content, indent=1) + "\n"
