"""Draw arms with many small effects for `tests.benchmarks.hall`: python -m tests.benchmarks.hall_draw OUT
--seed N [--count 20] [--dirt careful|typical].

Each arm has six bearings (tilt, radial and axial, each of a stiffness of its own), a base, one of its effects
much stronger than the others, and by the seed up to two bending links, three hoses, drives whose rotors are
held by servos and a gripper, told as payload, on a soft mount; with dirt, all that is told of the arm is a
little wrong. Motions are the exact ones of small vibrations (`tests.generator.linear`), which shares no code
with the fit. NAME.truth.json has how much each effect matters: by how many noises the noise-free FRFs move
when it alone is taken away, nothing refitted. NAME.heldout.npz is as `tests.benchmarks.hall` reads it. Draw
after the work is done, and score once.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.benchmarks.discovery import true_labels
from tests.benchmarks.discovery_draw import DIRT, of_draws
from tests.generator.cases import hide
from tests.generator.dirt import soil
from tests.generator.effect import Effect
from tests.generator.generate import generate
from tests.generator.linear import Linear, linearise
from tests.generator.makes import MAKES
from tests.generator.measure import draw_postures, make_plant, stated_decay
from tests.generator.rigid import Array
from tests.generator.spec import TestSpec
from tests.generator.structure import JointCompliance, SoftMount

_BEARINGS = tuple(f"{kind}_j{number}" for kind in ("tilt", "radial", "axial") for number in range(1, 7))
_BASE = ("base_rocking", "base_sliding", "base_turning")
_LINKS, _HOSES = ("link2_flex", "link4_flex"), ("absorber_l2", "absorber_l3", "absorber_l4", "absorber_l5")
_ROTORS = tuple(f"held_j{number}" for number in range(1, 7))
_SMALL, _SCATTER, _STRONG = 0.15, 0.5, 5.0
"""Median strength of an effect beside one that is clearly visible, its spread (ln), and how many times that
the strongest is.
"""
_CARRIES, _SERVED = 0.5, 0.3
"""Share of arms with a gripper, which is told, on a soft mount, which is not; and of those whose rotors are
held by servos.
"""
_UNROUND = 0.1
"""By how much bearings differ from one direction to the other (ln)."""
_FITTED, _UNSEEN = 2, 2


def many(spec: TestSpec, rng: np.random.Generator) -> TestSpec:
    """The test with all its effects."""
    names = [
        *_BEARINGS,
        *_BASE,
        *rng.choice(_LINKS, rng.integers(0, 3), replace=False),
        *rng.choice(_HOSES, rng.integers(0, 4), replace=False),
    ]
    strengths = _SMALL * np.exp(_SCATTER * rng.normal(size=len(names)))
    strengths[rng.integers(len(names))] *= _STRONG
    if rng.random() < _CARRIES:
        names, strengths = [*names, "gripper"], np.append(strengths, 1.0)
    if rng.random() < _SERVED:
        names, strengths = [*names, *_ROTORS], np.append(strengths, np.ones(len(_ROTORS)))
    effects = [
        _round(one, rng)
        for name, strength in zip(names, strengths, strict=True)
        for one in hide(spec, str(name), float(strength)).effects
    ]
    return replace(spec, effects=tuple(effects), case="hall")


def _round(effect: Effect, rng: np.random.Generator) -> Effect:
    """A bearing across its axis nearly alike in both directions, as bearings are, whatever hangs on it."""
    if not isinstance(effect, JointCompliance) or len(effect.stiffness) < 2:
        return effect
    middle = np.exp(np.mean(np.log(effect.stiffness)) + _UNROUND * rng.normal(size=2))
    times = np.array(effect.damping) / np.array(effect.stiffness)
    return replace(effect, stiffness=tuple(middle.tolist()), damping=tuple((times * middle).tolist()))


def write(spec: TestSpec, folder: Path) -> None:
    """The test's files, its truth and its noise-free FRFs."""
    measured = draw_postures(spec)
    unseen = draw_postures(replace(spec, seed=spec.seed + 1, postures=_UNSEEN))
    generate(spec, folder, postures=measured)
    truth = folder.parent / f"{folder.name}.truth.json"
    told = json.loads(truth.read_text())
    models = [_linear(spec, q) for q in measured]
    decay = stated_decay(spec, models)
    told["importance"] = importance(spec, measured[:_FITTED], models[:_FITTED], decay)
    truth.write_text(json.dumps(told, indent=1) + "\n")
    frequencies = np.arange(spec.band_hz[0], spec.band_hz[1], 1 / spec.duration_s)
    s = decay + 2j * np.pi * frequencies
    held: dict[str, Array] = {"f": frequencies}
    everywhere = [*models, *(_linear(spec, q) for q in unseen)]
    for number, (posture, model) in enumerate(zip([*measured, *unseen], everywhere, strict=True)):
        ratio = -model.poles.real / np.abs(model.poles)
        held[f"q{number}"] = posture
        held[f"H{number}"] = model.accelerance(s)  # type: ignore[assignment]
        held[f"modes{number}"] = np.array([np.abs(model.poles) / (2 * np.pi), ratio])
    np.savez(folder.parent / f"{folder.name}.heldout.npz", **held)  # type: ignore[arg-type]


def importance(spec: TestSpec, postures: Array, models: Sequence[Linear], decay: float) -> dict[str, float]:
    """Root mean square, in standard deviations of H1's noise, by which FRFs move without one effect each;
    models: of the test at these postures.
    """
    frequencies = np.arange(3.0, spec.band_hz[1], 1 / spec.duration_s)
    s = decay + 2j * np.pi * frequencies
    noise = _noise(spec, frequencies)[:, None, None]
    whole = [model.accelerance(s) for model in models]

    def moved(without: Effect) -> float:
        held = [replace(one, stiffness=(), damping=()) for one in [without] if isinstance(one, SoftMount)]
        rest = replace(spec, effects=(*(one for one in spec.effects if one is not without), *held))
        parts = [_linear(rest, q).accelerance(s) - h for q, h in zip(postures, whole, strict=True)]
        return float(np.sqrt(np.mean(np.abs(np.array(parts) / noise) ** 2)))

    by_name = {next(true_labels(one.truth())): moved(one) for one in spec.effects}
    return dict(sorted(by_name.items(), key=lambda item: -item[1]))


def _noise(spec: TestSpec, frequencies: Array) -> Array:
    """Standard deviation of H1 (lines,), m/s^2/N: of white noise over the spectrum of a usual impact, half a
    sine of 6.5 ms.
    """
    times = np.linspace(0.0, 6.5e-3, 200)
    pulse = spec.peak_n * np.sin(np.pi * times / times[-1])
    force = np.abs(np.trapezoid(pulse * np.exp(-2j * np.pi * frequencies[:, None] * times), times))
    samples = spec.duration_s * spec.sample_rate_hz
    return np.asarray(spec.noise_response * np.sqrt(samples / spec.averages) / spec.sample_rate_hz / force)


def _linear(spec: TestSpec, posture: Array) -> Linear:
    return linearise(make_plant(spec, posture), spec.hammer_points[0])


def main() -> None:
    """Draw."""
    given = of_draws("hall_draw", __doc__, 20).parse_args()
    rng = np.random.default_rng(given.seed)
    for number in range(given.count):
        one = int(rng.integers(1, 10**6))
        make = list(MAKES)[number % len(MAKES)]
        spec = many(TestSpec(MAKES[make](one), seed=one, binary=True, linear=True), rng)
        folder = given.out / f"{number:02d}_{make}"
        write(soil(spec, DIRT[given.dirt]) if given.dirt else spec, folder)
        print(folder.name, flush=True)


if __name__ == "__main__":
    main()
