"""The stabilisation diagram: poles of every order, and their automatic clustering over orders."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Index
from identify.modal import plscf
from identify.modal.layout import Layout
from identify.modal.mac import mpc, mpd
from identify.modal.poles import Band, PoleSet, moments, pole_set
from identify.modal.settings import ModalSettings

_ORDERS = 30
"""About how many orders a diagram has: more tell little more, and every one costs eigenvalues."""


@dataclass(frozen=True)
class Diagram:
    """Every decaying pole in the band, of every order, flat over n poles.

    order (n,); poles (n,), rad/s, exponential window corrected; participation (n, references) and shapes (n,
    responses) of unit length; mpc (n,); mpd (n,), rad; cluster (n,): number of the cluster, most present
    first, -1 for none; orders: all.
    """

    order: Index
    poles: Complex
    participation: Complex
    shapes: Complex
    mpc: Array
    mpd: Array
    cluster: Index
    orders: tuple[int, ...]

    @property
    def frequency_hz(self) -> Array:
        """|lambda| / 2 pi, (n,)."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def damping_ratio(self) -> Array:
        """-Re lambda / |lambda|, (n,)."""
        return np.asarray(-self.poles.real / np.abs(self.poles))


def orders_of(layout: Layout, settings: ModalSettings) -> range:
    """The orders of the diagram: by default up to 60, 240 poles, or a quarter of the lines, whichever is
    least.
    """
    refs, lines = len(layout.references), len(layout.frequency_hz)
    top = settings.max_order or max(min(60, 240 // refs, lines // 4), settings.min_order)
    top = min(top, (lines - 1) // 2)
    step = max(1, -(-(top - settings.min_order) // _ORDERS))
    return range(settings.min_order + (top - settings.min_order) % step, top + 1, step)


def stabilisation(layout: Layout, settings: ModalSettings) -> Diagram:
    """Poles of every order, clustered; poles growing in time after correction, too damped or out of the band
    are left out.
    """
    orders = orders_of(layout, settings)
    frf = layout.frf[:, layout.complete]
    frf = frf / np.sqrt(np.mean(np.abs(frf) ** 2))
    band = Band.of(layout.frequency_hz)
    places = band.places(layout.frequency_hz)
    coefficients = moments(frf, orders[-1], places)
    by_lsce = settings.estimator == "lsce"
    found = plscf.lsce_denominators(frf, orders) if by_lsce else plscf.denominators(frf, orders, places)
    # The window adds decay: what is too damped is judged after its correction.
    allowed = settings.max_damping_ratio + layout.decay / (2 * np.pi * layout.frequency_hz[0])
    sets = [pole_set(beta, coefficients, band, min(allowed, 0.999)) for beta in found]
    return clustered(sets, layout, settings, tuple(orders))


def clustered(
    sets: list[PoleSet], layout: Layout, settings: ModalSettings, orders: tuple[int, ...]
) -> Diagram:
    """The diagram of sets of poles that an exponential window on the FRFs has made decay faster."""
    flat = _flatten(sets, layout, settings, orders)
    return replace(flat, cluster=cluster(flat, settings.cluster_radius))


def _flatten(
    sets: list[PoleSet], layout: Layout, settings: ModalSettings, orders: tuple[int, ...]
) -> Diagram:
    order = np.concatenate([np.full(len(found.poles), found.order) for found in sets])
    poles = np.concatenate([found.poles for found in sets]) + layout.decay
    shapes = np.concatenate([found.shapes for found in sets])
    frequency, damping = np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)
    low, high = layout.frequency_hz[0], layout.frequency_hz[-1]
    size = np.linalg.norm(shapes, axis=1)
    kept = (
        (frequency >= low)
        & (frequency <= high)
        & (damping > 0)
        & (damping <= settings.max_damping_ratio)
        & (size > 0)
    )
    shapes = shapes[kept] / size[kept, None]
    return Diagram(
        order=order[kept],
        poles=poles[kept],
        participation=np.concatenate([found.participation for found in sets])[kept],
        shapes=shapes,
        mpc=mpc(shapes),
        mpd=mpd(shapes),
        cluster=np.full(int(kept.sum()), -1),
        orders=orders,
    )


def cluster(diagram: Diagram, radius: float) -> Index:
    """Cluster number of every pole, (n,), -1 for none; a cluster has at most one pole of each order.

    Two poles are |lambda_i - lambda_j| / (mean half-bandwidth) + 1 - MAC apart, so that the reach follows the
    damping: a pole that scatters by more than its own half-bandwidth is not identified.  The pole with
    neighbours in most orders founds a cluster with the nearest neighbour of each order; then the next, among
    what is left.
    """
    i, j, distance = _neighbours(diagram, radius)
    start = np.searchsorted(i, np.arange(len(diagram.poles) + 1))
    column = np.searchsorted(diagram.orders, diagram.order)
    count = np.zeros((len(diagram.poles), len(diagram.orders)), dtype=np.int32)
    np.add.at(count, (i, column[j]), 1)
    closeness = np.bincount(i, weights=radius - distance, minlength=len(diagram.poles)) / (
        1 + radius * len(i)
    )
    free = np.ones(len(diagram.poles), dtype=bool)
    labels = np.full(len(diagram.poles), -1)
    for number in range(len(diagram.poles)):
        score = np.where(free, np.sum(count > 0, axis=1) + closeness, -1.0)
        seed = int(np.argmax(score)) if len(score) else -1
        if seed < 0 or score[seed] < 2:
            break
        near = slice(start[seed], start[seed + 1])
        members = _one_per_order(seed, j[near], distance[near], column, free)
        labels[members], free[members] = number, False
        for member in members:
            count[j[start[member] : start[member + 1]], column[member]] -= 1
    return labels


def _one_per_order(seed: int, near: Index, distance: Array, column: Index, free: NDArray[np.bool_]) -> Index:
    """The seed and the nearest free pole of every other order."""
    near, distance = near[free[near]], distance[free[near]]
    near = near[np.argsort(distance, kind="stable")]
    _, first = np.unique(column[near], return_index=True)
    return np.append(near[first], seed)


def _neighbours(diagram: Diagram, radius: float) -> tuple[Index, Index, Array]:
    """Pairs of poles of different orders less than the radius apart, sorted by the first."""
    poles, shapes, order = diagram.poles, diagram.shapes, diagram.order
    half, size = -poles.real, poles.imag
    by_size = np.argsort(size, kind="stable")
    # |a - b| < radius (h_a + h_b) / 2 with h_b - h_a <= |a - b|: the own half-bandwidth bounds it.
    reach = radius / max(1 - radius / 2, 0.25) * half
    first = np.searchsorted(size[by_size], size - reach)
    last = np.searchsorted(size[by_size], size + reach, side="right")
    i = np.repeat(np.arange(len(poles)), last - first)
    within = np.arange(len(i)) - np.repeat(np.cumsum(last - first) - (last - first), last - first)
    j = by_size[np.repeat(first, last - first) + within]
    apart = np.abs(poles[i] - poles[j]) / ((half[i] + half[j]) / 2)
    near = (apart < radius) & (order[i] != order[j])
    i, j, apart = i[near], j[near], apart[near]
    distance = apart + 1 - _mac_of_pairs(shapes, i, j)
    near = distance < radius
    return i[near], j[near], distance[near]


def _mac_of_pairs(shapes: Complex, i: Index, j: Index) -> Array:
    """MAC of unit shapes i, sorted, with shapes j."""
    conjugate, mac = shapes.conj(), np.zeros(len(i))
    edges = np.flatnonzero(np.diff(i, prepend=-1, append=-1))
    for start, stop in pairwise(edges):
        mac[start:stop] = np.abs(conjugate[j[start:stop]] @ shapes[i[start]]) ** 2
    return mac
