"""Modes that a modal model misses, from what it leaves of the FRFs: noise is independent from line to line, a
missing mode is not.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from identify.core.arrays import Array, Complex, Index
from identify.modal.gram import Columns, gram, products, right
from identify.modal.refine import Fit
from identify.modal.weights import independent, residual

_CLEAR = 6.0
"""Standard deviations by which neighbouring lines must agree."""
_OFFSETS, _WIDTHS = np.linspace(-3, 3, 9), np.array([0.35, 0.7, 1.4, 2.8])
"""Poles that are tried around a place, in block lengths: distance from it, and half-bandwidth."""


def places(found: Fit, most: int) -> list[tuple[int, int]]:
    """Where what is left agrees from line to line: (line, lines of a block), clearest first.

    Blocks of 1, 2, 4, ... lines are averaged and multiplied with the next: the length that shows it best is
    about the half-bandwidth of what is missing.
    """
    error = residual(found).reshape(len(found.equations.s), -1)
    variance = independent(error)
    error = error / np.sqrt(variance)[:, None]
    heights, centres, lengths = [], [], []
    length = 1
    while 16 * length <= len(error):
        for start in (0, length // 2):
            height, centre = _agreement(error[start:], length)
            heights.append(height)
            centres.append(centre + start)
            lengths.append(np.full(len(height), length))
        length *= 2
    height, centre, block = np.concatenate(heights), np.concatenate(centres), np.concatenate(lengths)
    picked: list[tuple[int, int]] = []
    for k in np.argsort(-height):
        if height[k] < _CLEAR or len(picked) == most:
            break
        if all(abs(centre[k] - c) > 4 * max(block[k], b) for c, b in picked):
            picked.append((int(centre[k]), int(block[k])))
    return picked


def _agreement(error: Complex, length: int) -> tuple[Array, Index]:
    """Agreement of blocks with the next, in standard deviations of noise, over three pairs, and its middle
    line.
    """
    count = len(error) // length
    blocks = error[: count * length].reshape(count, length, -1).sum(axis=1) / np.sqrt(length)
    pairs = np.sum((blocks[1:].conj() * blocks[:-1]).real, axis=1) / np.sqrt(blocks.shape[1] / 2)
    height = uniform_filter1d(pairs, 3, mode="constant") * np.sqrt(3) if count > 3 else pairs
    return height, (np.arange(count - 1) + 1) * length


def proposal(found: Fit, place: tuple[int, int]) -> tuple[complex, Complex]:
    """The pole near a place that explains most of what is left there, with its participation."""
    line, block = place
    s = found.equations.s
    spacing = (s[-1].imag - s[0].imag) / (len(s) - 1)
    middle = s[0].imag + spacing * line
    offset, width = np.meshgrid(_OFFSETS, _WIDTHS)
    tried = (-width + 1j * offset).ravel() * block * spacing + 1j * middle
    tried = np.maximum(tried.real + s[0].real, 1e3 * tried.real) + 1j * tried.imag
    tried = tried[(tried.real < 0) & (tried.imag > 0)]
    gains, residues = _gains(found, np.asarray(tried))
    best = int(np.argmax(gains))
    u, _, _ = np.linalg.svd(residues[best])
    return complex(tried[best]), u[:, 0]


def _gains(found: Fit, tried: Complex) -> tuple[Array, Complex]:
    """Fall of the cost by a pole with a residue of its own in every FRF, (n,), and these (n, references,
    responses), one pole at a time.
    """
    equations = found.equations
    refs = found.participation.shape[1]
    vectors = np.concatenate([np.eye(refs), 1j * np.eye(refs)])
    functions, mirrors = equations.functions(found.poles, found.poles[:0])
    new, turned = equations.functions(tried, tried[:0])
    new, turned = new[:, : len(tried)], turned[:, : len(tried)]
    same, across = products(new, turned, functions, mirrors)
    own_same = np.sum(np.abs(new) ** 2 + np.abs(turned) ** 2, axis=0)[:, None, None]
    own_across = 2 * np.sum(new.conj() * turned, axis=0)[:, None, None]
    own = (own_same * (vectors.conj() @ vectors.T) + own_across * (vectors.conj() @ vectors.conj().T)).real
    data = right(new, turned, equations.weighted)
    basis = equations.basis(found.participation)
    gains, residues = np.zeros(len(tried)), np.zeros((len(tried), refs, data.shape[2]), dtype=complex)
    for k in range(len(tried)):
        columns = Columns(np.full(2 * refs, k), vectors)
        overlap = gram(same, across, columns, basis) / found.size
        normal = own[k] - overlap @ found.inverse @ overlap.T + 1e-9 * np.eye(2 * refs) * own_same[k]
        rest = np.einsum("cj,jo->co", vectors.conj(), data[k]).real - overlap @ found.solution
        x = np.linalg.solve(normal, rest)
        gains[k] = np.sum(rest * x)
        residues[k] = x[:refs] + 1j * x[refs:]
    return gains, residues
