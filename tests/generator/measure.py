"""One posture tested: every impact simulated, recorded and averaged into FRFs and coherences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from tests.generator.chain import Chain
from tests.generator.effect import MeasurementEffect, StructureEffect, TorqueEffect
from tests.generator.estimate import Estimate, h1
from tests.generator.hammer import swing
from tests.generator.linear import Linear, linearise
from tests.generator.plant import Plant
from tests.generator.rigid import Array, turn
from tests.generator.spec import TestSpec
from tests.generator.structure import LinkFlexibility
from tests.generator.tree import at_posture

_REMAINDER = 0.002
_LEAST_DECAY = 0.692914140326007
_STABLE = 1.5
"""Largest product of pole and time step; RK4 is stable up to 2.7."""


def draw_postures(spec: TestSpec) -> Array:
    """Joint angles (postures, joints), degrees, around the arm's home, rounded to a tenth."""
    rng = np.random.default_rng([spec.seed, 0xD5])
    spread = np.array([20.0, 12.0, 20.0, 25.0, 20.0, 35.0])
    return np.asarray(np.round(spec.arm.home + rng.uniform(-spread, spread, (spec.postures, 6)), 1))


def make_plant(spec: TestSpec, posture_deg: ArrayLike) -> Plant:
    """The arm at a posture with everything hidden in it; links are cut last, so that all they carry goes
    along.
    """
    tree = at_posture(spec.arm, posture_deg)
    structure = [effect for effect in spec.effects if isinstance(effect, StructureEffect)]
    for effect in sorted(structure, key=lambda item: isinstance(item, LinkFlexibility)):
        effect.build(tree)
    return Plant(tree, [effect for effect in spec.effects if isinstance(effect, TorqueEffect)], spec.weighed)


def stated_decay(spec: TestSpec, linear: list[Linear]) -> float:
    """The window decay (1/s) that the user is told."""
    if spec.window_decay_per_s is not None:
        return spec.window_decay_per_s
    slowest = min(float(-model.poles.real.max()) for model in linear)
    return max(_LEAST_DECAY, round(float(-np.log(_REMAINDER)) / spec.duration_s - slowest, 3))


def make_chain(spec: TestSpec, decay: float, plants: list[Plant]) -> Chain:
    """The measurement chain with its hidden faults, sampled finely enough for the fastest pole, that of
    sticking friction among them.
    """
    fastest = max(linearise(plant, spec.hammer_points[0], torques=True).fastest for plant in plants)
    oversampling = spec.oversampling
    while not spec.linear and fastest / (spec.sample_rate_hz * oversampling) > _STABLE:
        oversampling *= 2
    chain = Chain(
        spec.sample_rate_hz,
        spec.duration_s,
        oversampling,
        spec.noise_force,
        spec.noise_response,
        decay,
        sensors=spec.sensors,
    )
    for effect in spec.effects:
        if isinstance(effect, MeasurementEffect):
            chain = effect.alter(chain)
    return chain


def with_noise_of(spec: TestSpec, chain: Chain, number: int) -> Chain:
    """The chain with the noise that it has in the posture of this number."""
    times = dict(enumerate(spec.noisier)).get(number, 1.0)
    return replace(chain, noise_force=times * chain.noise_force, noise_response=times * chain.noise_response)


def strike_all(
    spec: TestSpec, plant: Plant, chain: Chain, level: float, rng: np.random.Generator
) -> dict[tuple[str, int], Estimate]:
    """FRFs of all sensor channels by (struck point, axis); outputs are x, y, z of each sensor in turn."""
    [frfs] = strike_recorded(spec, plant, chain, level, rng, [rng])
    return frfs


def strike_recorded(
    spec: TestSpec,
    plant: Plant,
    chain: Chain,
    level: float,
    rng: np.random.Generator,
    noises: Sequence[np.random.Generator],
) -> list[dict[tuple[str, int], Estimate]]:
    """The same, of the same impacts, as recorded once for each of `noises`, which may be `rng` itself."""
    recorded: list[dict[tuple[str, int], Estimate]] = [{} for _ in noises]
    for where in product(spec.hammer_points, range(3)):
        estimates = _strike(spec, plant, chain, where, level, rng, noises)
        for frfs, estimate in zip(recorded, estimates, strict=True):
            frfs[where] = estimate.band(*spec.band_hz)
    return recorded


def _strike(
    spec: TestSpec,
    plant: Plant,
    chain: Chain,
    where: tuple[str, int],
    level: float,
    rng: np.random.Generator,
    noises: Sequence[np.random.Generator],
) -> list[Estimate]:
    """All averages of one drive direction, recorded with each noise: where names the point and the axis."""
    times, window, names = chain.step * np.arange(chain.steps), chain.window(), plant.sensors
    records: list[list[tuple[Array, Array]]] = [[] for _ in noises]
    linear = linearise(plant, where[0]) if spec.linear else None
    held = np.eye(3)
    if spec.held_askew_deg > 0:
        vector = np.radians(spec.held_askew_deg) * rng.normal(size=3)
        held = turn(vector, float(np.linalg.norm(vector)))
    for _ in range(spec.averages):
        impact = swing(rng, where[1], level * spec.peak_n, spec.direction_error_deg, chain.step)
        impact = replace(impact, along=held @ impact.along, start=impact.start + spec.pre_trigger_s)
        if linear is None:
            motion = plant.respond(where[0], impact.force, impact.end, chain.step, chain.steps)
        else:
            motion = linear.respond(impact.forces, impact.end, chain.step, chain.steps)
        for record, noise in zip(records, noises, strict=True):
            force = window * chain.force(impact.reading(times), noise)
            response = window[:, None] * chain.responses(motion, names, noise).reshape(chain.samples, -1)
            record.append((force, response))
    return [
        h1(np.array([f for f, _ in record]), np.array([x for _, x in record]), spec.sample_rate_hz)
        for record in records
    ]
