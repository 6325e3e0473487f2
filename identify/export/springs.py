"""What a model has beside its rigid bodies: springs, dampers and inertia, as other programs want them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.export.linear import LinearModel

NOTHING = 1e-9
"""Of the entries and eigenvalues of a matrix, over its largest, what is rounding."""
_ROUNDING = 1e-12


def moved_body(model: LinearModel, coordinate: str) -> tuple[int | None, str] | None:
    """The number of the body that a free coordinate moves and along which of its axes; (None, "") where it
    moves none, and None where it does anything else.
    """
    site = model.system.site
    number = int(model.system.free[model.coordinates.index(coordinate)])
    moved = np.flatnonzero(site.shapes[:, number])
    if number in site.deformations or len(moved) > 1:
        return None
    if not len(moved):
        return None, ""
    if site.shapes[moved[0], number] != 1.0:
        return None
    name, _, axis = site.engine.mechanism.coordinates[moved[0]].rpartition(".")
    return [body.name for body in site.engine.mechanism.bodies].index(name), axis


def added_matrices(model: LinearModel) -> dict[str, Array]:
    """(n, n) each: what rigid bodies and their weight do not bring of M (`armature`), K and C."""
    site, free = model.system.site, model.system.free
    shapes = site.shapes[:, free]
    mass = model.mass - shapes.T @ site.engine.mass_matrix() @ shapes
    stiffness = model.stiffness - shapes.T @ site.engine.gravity_stiffness() @ shapes
    size = max(float(np.abs(mass).max()), float(np.abs(np.diag(model.mass)).min()))
    mass[np.abs(mass) < NOTHING * size] = 0.0
    return {"armature": mass, "stiffness": stiffness, "damping": model.damping}


def parted(matrix: Array) -> tuple[Array, list[tuple[float, Array]]]:
    """Of a positive matrix the diagonal of the coordinates that are alone, else 0, and values and vectors of
    the rest.
    """
    scale = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
    beside = np.abs(matrix) > NOTHING * np.maximum(scale, 1e-300)
    np.fill_diagonal(beside, False)
    alone = ~beside.any(axis=0)
    single = np.where(alone, np.maximum(np.diag(matrix), 0.0), 0.0)
    block = np.flatnonzero(~alone)
    coupled = []
    if len(block):
        # Scaled first, because coordinates are metres and radians; the sum is exact all the same.
        root = np.sqrt(np.maximum(np.diag(matrix)[block], 1e-300))
        values, vectors = np.linalg.eigh(matrix[np.ix_(block, block)] / np.outer(root, root))
        for value, vector in zip(values, vectors.T, strict=True):
            if value > _ROUNDING:
                whole = np.zeros(len(matrix))
                whole[block] = vector * root
                size = float(np.linalg.norm(whole))
                coupled.append((float(value) * size**2, whole / size))
    return single, coupled


@dataclass(frozen=True)
class JointSprings:
    """stiffness, damping (n,): springs and dampers of single coordinates, by the parameters that say them;
    others: names of the parameters that say anything else.
    """

    stiffness: Array
    damping: Array
    others: tuple[str, ...]


def joint_springs(model: LinearModel) -> JointSprings:
    """The springs and dampers of a model that are each on one coordinate."""
    system, values = model.system, model.model.values
    stiffness, damping = np.zeros((2, len(model.coordinates)))
    others = []
    for number, parameter in enumerate(system.parameters):
        k, c, m = (system.terms[role][number] for role in ("stiffness", "damping", "mass"))
        if m.any() or np.count_nonzero(k) > 1 or np.count_nonzero(c) > 1:
            others.append(parameter.name)
        else:
            stiffness += values[number] * np.diag(k)
            damping += values[number] * np.diag(c)
    if system.compliances is not None:
        k, c = system.compliances.stiff(values, model.mass)
        stiffness, damping = stiffness + parted(k)[0], damping + parted(c)[0]
    viscous = np.diag(model.damping - system.matrices(values)[1])
    return JointSprings(stiffness, damping + viscous, tuple(others))


def beside(matrix: Array, own: Array) -> tuple[Array, list[tuple[float, Array]]]:
    """A positive matrix as `parted`, with most of own (n,) left where it is.

    What is beside it must be positive too, so own gives as much of itself as that takes.
    """
    rest, kept = matrix - np.diag(own), np.flatnonzero(own > 0)
    root = np.sqrt(own[kept])
    least = (
        float(np.linalg.eigvalsh(rest[np.ix_(kept, kept)] / np.outer(root, root))[0]) if len(kept) else 0.0
    )
    share = max(0.0, -least) * (1 + NOTHING) + NOTHING
    if share >= 1:
        return parted(matrix)
    given = own * share
    try:
        np.linalg.cholesky(rest + np.diag(given) + NOTHING * np.diag(np.diag(matrix)))
    except np.linalg.LinAlgError:
        return parted(matrix)
    small = np.abs(rest) <= NOTHING * np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
    if small.all():
        return np.maximum(np.diag(matrix), 0.0), []
    single, coupled = parted(rest + np.diag(given))
    return own - given + single, coupled
