"""Structures that work, recorded by their responses alone: shares no code with identify.

A cutter pushes at the tool with the pulses of its teeth, at a speed that wanders, one tooth more than
another, and with the noise of the chips; servos and the floor push with noise elsewhere.  The linear model
answers exactly for forces that are held from sample to sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from tests.generator.linear import Complex, Linear
from tests.generator.rigid import Array


@dataclass(frozen=True)
class Work:
    """rate_hz and seconds of the record; rpm and teeth of the cutter, wander: relative standard deviation of
    its speed; pulses: RMS of the teeth's force over that of the chips' noise; noise: of the sensors, over the
    RMS of each.
    """

    rate_hz: float = 512.0
    seconds: float = 300.0
    rpm: float = 1500.0
    teeth: int = 2
    wander: float = 5e-4
    pulses: float = 1.0
    noise: float = 0.02

    @property
    def samples(self) -> int:
        """Of the record."""
        return round(self.rate_hz * self.seconds)


def cutting(work: Work, rng: np.random.Generator) -> Array:
    """Forces (samples, 3), N, of a cutter: pulses of its teeth and noise."""
    chips = rng.normal(size=(work.samples, 3))
    if not work.pulses:
        return np.asarray(chips)
    slow = scipy.ndimage.gaussian_filter1d(rng.normal(size=work.samples), work.rate_hz)
    speed = work.rpm / 60 * (1 + work.wander * slow / np.std(slow))
    turned = np.cumsum(speed) / work.rate_hz
    series = np.fft.rfft(_revolution(work.teeth, rng), axis=0)
    pulses = np.zeros_like(chips)
    for k in range(1, int(0.45 * work.rate_hz / (work.rpm / 60)) + 1):  # what the recorder lets through
        pulses += np.outer(np.exp(2j * np.pi * k * turned), series[k]).real
    return np.asarray(chips + work.pulses * pulses / np.sqrt(np.mean(pulses**2)))


def _revolution(teeth: int, rng: np.random.Generator) -> Array:
    """The force (2048, 3) over a turn of the cutter."""
    turned = np.arange(2048) / 2048 * teeth
    angle = 2 * np.pi * (turned % 1)
    cut = np.where(angle < 0.6 * np.pi, np.sin(angle / 0.6), 0.0)
    cut = cut * (1 + 0.2 * rng.normal(size=teeth))[turned.astype(int)]
    return np.stack([cut * np.cos(angle), cut * np.sin(angle), 0.3 * cut], axis=1)


def recorded(models: list[tuple[Linear, Array]], work: Work, rng: np.random.Generator) -> Array:
    """Accelerations (samples, outputs) of one structure under forces (samples, 3) at several places, as
    sensors with noise record them.
    """
    clean = sum(_answer(model, forces, work.rate_hz) for model, forces in models)
    return np.asarray(clean + work.noise * clean.std(axis=0) * rng.normal(size=clean.shape))


def _answer(model: Linear, forces: Array, rate_hz: float) -> Array:
    poles, vectors = np.linalg.eig(model.a)
    moved = np.exp(poles / rate_hz)
    push = np.linalg.solve(vectors, model.b.astype(complex)) * ((moved - 1) / poles)[:, None]
    states = [scipy.signal.lfilter([0, 1], [1, -z], forces @ row) for z, row in zip(moved, push, strict=True)]
    return np.asarray((np.array(states).T @ (model.c @ vectors).T).real + forces @ model.d.T)


def truth(model: Linear) -> tuple[Complex, Complex]:
    """Poles (m,), rad/s, by rising modulus, and shapes (m, outputs)."""
    poles, vectors = np.linalg.eig(model.a)
    kept = np.flatnonzero(poles.imag > 0)
    kept = kept[np.argsort(np.abs(poles[kept]))]
    return np.asarray(poles[kept]), np.asarray((model.c @ vectors[:, kept]).T)


def visible(models: list[Linear], least: float) -> Array:
    """Which modes make at least that part of the power at their own frequency, all forces alike, (m,)."""
    first = models[0]
    poles, vectors = np.linalg.eig(first.a)
    kept = np.flatnonzero(poles.imag > 0)
    kept = kept[np.argsort(np.abs(poles[kept]))]
    whole = [np.sum(np.abs(model.accelerance(1j * poles[kept].imag)) ** 2, axis=(1, 2)) for model in models]
    own = np.zeros(len(kept))
    for model in models:
        push = np.linalg.solve(vectors, model.b.astype(complex))[kept]
        shape = (model.c @ vectors[:, kept]).T
        residue = np.linalg.norm(shape, axis=1) * np.linalg.norm(push, axis=1)
        own += (residue / np.abs(poles[kept].real)) ** 2
    return np.asarray(own / np.sum(whole, axis=0) > least)


def with_mass(model: Linear, at: Linear, sensor: int, mass_kg: float) -> Linear:
    """The same structure with a point mass at a sensor (0, 1, ...): at is the model pushed there.

    The mass pushes with -m y, y being the acceleration that it feels itself, so y is solved for.
    """
    rows = slice(3 * sensor, 3 * sensor + 3)
    felt = np.linalg.inv(np.eye(3) + mass_kg * at.d[rows])
    by_state, by_force = (-mass_kg * felt @ part for part in (at.c[rows], model.d[rows]))
    return Linear(
        model.a + at.b @ by_state,
        model.b + at.b @ by_force,
        model.c + at.d @ by_state,
        model.d + at.d @ by_force,
    )


def modal_masses(model: Linear, pushed: Array, channels: Array) -> Array:
    """Modal masses (m,), kg, of shapes whose largest component at these outputs (channels,) is 1, by rising
    modulus of the poles; pushed (3,): the outputs at which the model is pushed.

    From the residue of the accelerance where it is pushed, over lambda squared.
    """
    poles, vectors = np.linalg.eig(model.a)
    kept = np.flatnonzero(poles.imag > 0)
    kept = kept[np.argsort(np.abs(poles[kept]))]
    shapes = (model.c @ vectors[:, kept]).T
    entry = np.linalg.solve(vectors, model.b.astype(complex))[kept]
    along = np.argmax(np.abs(shapes[:, pushed]), axis=1)
    rows = np.arange(len(kept))
    largest = shapes[rows, channels[np.argmax(np.abs(shapes[:, channels]), axis=1)]]
    psi = shapes[:, pushed][rows, along] / largest
    residue = shapes[:, pushed][rows, along] * entry[rows, along] / poles[kept] ** 2
    return np.asarray(np.abs(psi**2 / (2 * poles[kept].imag * residue)))
