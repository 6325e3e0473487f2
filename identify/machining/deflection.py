"""How far a force pushes the tool of a fitted model, and where to send it instead.

The static compliance of the tip is J K^-1 J', K with the gravity stiffness, J the tip's motion per
coordinate.  What the robot's own weight does is not in it: the force comes on top.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.interruption import check
from identify.core.thresholds import PERCENTILES_95, SIGMAS_95
from identify.model.frf import frf
from identify.model.modes import complex_modes
from identify.model.system import System
from identify.results.deflection import DeflectionRows, DynamicDeflection
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel

_SEED = 1
_LINES, _DRAWN = 400, 60


@dataclass(frozen=True)
class Loaded:
    """A tip on a fitted model; draws: of what is uncertain; errors (p,): what the model does not explain
    (`identify.vibration.misfit`).
    """

    model: FittedModel
    point: Point
    draws: int
    errors: Array

    def drawn(self, system: System, posture: Array) -> tuple[Array, Array, Array]:
        """M, C, K (draws, n, n) at a posture (joints,), rad."""
        rng = np.random.default_rng(_SEED)
        return self.model.drawn_matrices(system, posture, self.draws, rng, self.errors)

    def compliance(self, system: System, stiffness: Array) -> Array:
        """(..., 3, 3), m/N, in the base's axes, of stiffness matrices (..., n, n)."""
        out = system.base_jacobian(self.point.link, self.point.position)
        stiffness = stiffness.real
        moved = np.linalg.solve(stiffness, np.broadcast_to(out.T, (*stiffness.shape[:-1], 3)))
        return np.asarray(out @ moved)


def deflections(on: Loaded, names: Sequence[str], postures: Array, forces: Array) -> DeflectionRows:
    """The tip at postures (n, joints), rad, under forces (n, 3), N, in the base's axes."""
    rows = []
    for posture, force in zip(postures, forces, strict=True):
        check()
        rows.append(_row(on, posture, force))
    columns = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    return DeflectionRows(name=tuple(names), posture_deg=np.rad2deg(postures), force_n=forces, **columns)


def _row(on: Loaded, posture: Array, force: Array) -> dict[str, Array]:
    system = on.model.system(posture)
    tip = system.site.engine.position(on.point.link, on.point.position)
    here = on.compliance(system, system.matrices(on.model.values)[2])
    drawn = on.compliance(system, on.drawn(system, posture)[2])
    moved, spread = here @ force, drawn @ force
    low, high = np.percentile(spread, PERCENTILES_95, axis=0)
    size_low, size_high = np.percentile(np.linalg.norm(spread, axis=1), PERCENTILES_95)
    principal, directions = np.linalg.eigh((here + here.T) / 2)
    along = np.einsum("ik,dij,jk->dk", directions, drawn, directions)
    least, most = np.percentile(along, PERCENTILES_95, axis=0)
    return {
        "tip_m": tip,
        "deflection_m": moved,
        "low_95": low,
        "high_95": high,
        "size_m": np.linalg.norm(moved),
        "size_low_95": size_low,
        "size_high_95": size_high,
        "compliance": principal[::-1],
        "compliance_low_95": least[::-1],
        "compliance_high_95": most[::-1],
        "directions": directions.T[::-1],
        "target_m": tip - moved,
        "target_deg": np.rad2deg(posture + _turned(on, system, -moved)),
    }


def _turned(on: Loaded, system: System, shift: Array) -> Array:
    """(joints,), rad: what turns the rigid robot so that its tip moves by a shift (3,), m, in the base's
    axes, its direction kept where there are six joints or more; the least turn where several do.
    """
    site, point = system.site, on.point
    columns = [site.coordinates.index(f"joint{n}.rz") for n in range(1, len(on.model.robot.joints) + 1)]
    motion = site.jacobian(point.link, point.position, "points")[:, columns]
    axes = site.engine.axes(point.link)
    if len(columns) < 6:
        return np.asarray(np.linalg.lstsq(axes @ motion[:3], shift, rcond=1e-6)[0])
    wanted = np.concatenate([shift, np.zeros(3)])
    return np.asarray(
        np.linalg.lstsq(np.vstack([axes @ motion[:3], axes @ motion[3:]]), wanted, rcond=1e-6)[0]
    )


def dynamic_deflection(on: Loaded, posture: Array, force: Array) -> DynamicDeflection:
    """The tip's amplitude by a force (3,), N, that oscillates, up to half above the sixth mode."""
    system = on.model.system(posture)
    matrices = system.matrices(on.model.values)
    highest = complex_modes(*matrices).frequency_hz[:6].max()
    line_hz = np.linspace(0.0, 1.5 * float(highest), _LINES)
    out, s = (
        system.base_jacobian(on.point.link, on.point.position),
        np.asarray(2j * np.pi * line_hz, dtype=complex),
    )
    pushed = (out.T @ force)[:, None]
    here = np.abs(frf(*matrices, s, out, pushed, 0)[..., 0])
    mass, damping, stiffness = (one[:_DRAWN] for one in on.drawn(system, posture))
    many = np.broadcast_to(s, (len(stiffness), len(s)))
    drawn = np.abs(frf(mass, damping, stiffness, many, out, pushed, 0)[..., 0])
    return DynamicDeflection(line_hz, here, SIGMAS_95 * np.sqrt(np.mean((drawn - here) ** 2, axis=0)))
