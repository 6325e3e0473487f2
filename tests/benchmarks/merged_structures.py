"""Plates and trusses drawn at random, measured in several setups by accelerometers that weigh something.

A plate is a Ritz model of a rectangular plate with lumps of mass on it, measured across; a truss is a space
frame of pin-jointed bars, measured in all three directions.  Every setup solves the structure with the masses
of its own sensors at every line.  True modes are those without roved masses.  Nothing here comes from
identify.modal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet

_LINES = 1200


@dataclass(frozen=True)
class Body:
    """mass, damping, stiffness (n, n), SI; at (channels, n): the motion of each channel; node, direction
    (channels,): what they are called; position_m (nodes, 3).
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    at: np.ndarray
    node: np.ndarray
    direction: np.ndarray
    position_m: np.ndarray

    def loaded(self, nodes: np.ndarray, kg: float) -> np.ndarray:
        """The mass matrix with a sensor at each node, which moves with it in all directions there are."""
        rows = self.at[np.isin(self.node, nodes)]
        return np.asarray(self.mass + kg * rows.T @ rows)

    def modes(self, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Poles (m,), rad/s, of the body with this mass matrix, by size, and their shapes (m, channels)."""
        n = len(mass)
        lower = -np.linalg.solve(mass, np.concatenate([self.stiffness, self.damping], axis=1))
        values, vectors = np.linalg.eig(np.concatenate([np.eye(n, 2 * n, n), lower]))
        kept = np.flatnonzero(values.imag > 1e-9 * np.abs(values))
        kept = kept[np.argsort(np.abs(values[kept]))]
        return values[kept], (self.at @ vectors[:n, kept]).T


@dataclass(frozen=True)
class Test:
    """A test of a body: force channels, and for each setup the nodes that its roved sensors (kg each) and its
    fixed ones (0 kg: what stays belongs to the structure) are at; frequency_hz (L,) of the lines.
    """

    body: Body
    forces: np.ndarray
    fixed: np.ndarray
    roved: tuple[np.ndarray, ...]
    kg: float
    frequency_hz: np.ndarray

    def frf(self, setup: int) -> tuple[np.ndarray, np.ndarray]:
        """Exact accelerances (L, responses, forces) of a setup, and the channels of its responses."""
        body, nodes = self.body, self.roved[setup]
        rows = np.flatnonzero(np.isin(body.node, np.concatenate([self.fixed, nodes])))
        s = 2j * np.pi * self.frequency_hz[:, None, None]
        dynamic = s**2 * body.loaded(nodes, self.kg) + s * body.damping + body.stiffness
        motion = np.linalg.solve(dynamic, body.at[self.forces].T[None].astype(complex))
        return s**2 * (body.at[rows] @ motion), rows

    def measured(self, setup: int, noise: float, rng: np.random.Generator) -> FrfSet:
        """The FRFs of a setup with noise of that part of the RMS of each, independent from line to line."""
        frf, rows = self.frf(setup)
        white = (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape)) / np.sqrt(2)
        rms = np.sqrt(np.mean(np.abs(frf) ** 2, axis=0, keepdims=True))
        return FrfSet(
            self.frequency_hz,
            frf + noise * rms * white,
            tuple(self.channel(row) for row in rows),
            tuple(self.channel(row) for row in self.forces),
            "accelerance",
            source=f"setup {setup + 1}",
        )

    def channel(self, row: int) -> Channel:
        """What a channel is called."""
        return Channel(int(self.body.node[row]), int(self.body.direction[row]))

    def row(self, channel: Channel) -> int:
        """Where a channel stands among those of the body."""
        here = (self.body.node == channel.node) & (self.body.direction == channel.direction)
        return int(np.flatnonzero(here)[0])


def draw(rng: np.random.Generator, *, each: bool = False) -> Test:
    """A test: one to four roved sensors in a setup that weigh 30 to 50 g together (or each), one or two
    forces, some with a fixed sensor beside them.
    """
    body = _plate(rng) if rng.random() < 0.5 else _truss(rng)
    nodes = np.unique(body.node)
    hit = rng.choice(nodes, size=int(rng.integers(1, 3)), replace=False)
    forces = np.array([rng.choice(np.flatnonzero(body.node == node)) for node in hit])
    fixed = rng.choice(nodes, size=int(rng.integers(0, 2)), replace=False)
    # In every third test no sensor comes to where the forces are, so that nothing tells modal masses.
    barred = np.concatenate([fixed, hit]) if rng.random() < 1 / 3 else fixed
    free = rng.permutation(np.setdiff1d(nodes, barred))
    sensors = int(rng.integers(1, 5))
    setups = -(-len(free) // sensors)
    poles, _ = body.modes(body.mass)
    hz = np.abs(poles) / (2 * np.pi)
    high = 0.5 * (hz[min(12, len(hz) - 2)] + hz[min(13, len(hz) - 1)])
    low = 0.6 * hz[hz > 1.0][0]
    roved = tuple(np.sort(part) for part in np.array_split(free, setups))
    kg = rng.uniform(0.03, 0.05) / (1 if each else sensors)
    return Test(body, forces, fixed, roved, kg, np.linspace(low, high, _LINES))


def _damped(rng: np.random.Generator, mass: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Of 0.3 to 1.5 % in the modes, a little different in each."""
    omega2, shapes = np.linalg.eigh(
        np.linalg.solve(np.linalg.cholesky(mass), np.eye(len(mass)))
        @ stiffness
        @ np.linalg.solve(np.linalg.cholesky(mass), np.eye(len(mass))).T
    )
    root = np.linalg.cholesky(mass) @ shapes
    zeta = np.exp(rng.uniform(np.log(0.003), np.log(0.015), size=len(mass)))
    return np.asarray(root * (2 * zeta * np.sqrt(np.maximum(omega2, 0.0)))) @ root.T


def _plate(rng: np.random.Generator) -> Body:
    """A plate of 2 to 8 kg on soft edges: products of cosines (free edges) with lumps and springs."""
    a, b = rng.uniform(0.4, 1.0), rng.uniform(0.3, 0.8)
    kg, terms = rng.uniform(2, 8), 7
    i, j = (index.ravel() for index in np.indices((terms, terms)))

    def motion(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.asarray(np.cos(np.pi * i * x[:, None] / a) * np.cos(np.pi * j * y[:, None] / b))

    size = np.where(i, 0.5, 1.0) * np.where(j, 0.5, 1.0)
    mass = np.diag(kg * size)
    bend = rng.uniform(20, 120) ** 2 * kg * (a / np.pi) ** 4
    waves = (np.pi * i / a) ** 2 + (np.pi * j / b) ** 2
    stiffness = np.diag(bend * waves**2 * size)
    for _ in range(4):
        row = motion(a * rng.uniform(size=1), b * rng.uniform(size=1))
        mass = mass + rng.uniform(0.02, 0.1) * kg * row.T @ row
    for x, y in ((0.0, 0.0), (a, 0.0), (0.0, b), (a, b)):
        row = motion(np.array([x]), np.array([y]))
        stiffness = stiffness + kg * rng.uniform(50, 150) ** 2 * row.T @ row
    across, up = int(rng.integers(4, 7)), int(rng.integers(3, 5))
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0, a, across), np.linspace(0, b, up)))
    node = np.arange(1, len(x) + 1)
    place = np.stack([x, y, np.zeros(len(x))], axis=1)
    return Body(mass, _damped(rng, mass, stiffness), stiffness, motion(x, y), node, np.full(len(x), 3), place)


def _truss(rng: np.random.Generator) -> Body:
    """A mast of three to five storeys of four corners, 3 to 10 kg, its lowest corners held."""
    storeys, wide = int(rng.integers(3, 6)), rng.uniform(0.2, 0.4)
    corner = wide * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    place = np.array([[*xy, 0.35 * k] for k in range(storeys + 1) for xy in corner])
    n = len(place)
    bars = [
        (a, b)
        for a in range(n)
        for b in range(a)
        if np.linalg.norm(place[a] - place[b]) < 1.45 * 0.35 + wide / 3
    ]
    stiffness = np.zeros((3 * n, 3 * n))
    for p, q in bars:
        along = (place[p] - place[q]) / np.linalg.norm(place[p] - place[q])
        row = np.zeros(3 * n)
        row[3 * p : 3 * p + 3], row[3 * q : 3 * q + 3] = along, -along
        stiffness += rng.uniform(0.4, 2.0) * 4e5 * np.outer(row, row)
    kg = rng.uniform(3, 10) / n * rng.uniform(0.5, 2.0, size=n)
    held = np.arange(12, 3 * n)
    mass, stiffness = np.diag(np.repeat(kg, 3))[np.ix_(held, held)], stiffness[np.ix_(held, held)]
    node = np.repeat(np.arange(1, n - 3), 3)
    direction = np.tile([1, 2, 3], n - 4)
    return Body(mass, _damped(rng, mass, stiffness), stiffness, np.eye(len(held)), node, direction, place[4:])
