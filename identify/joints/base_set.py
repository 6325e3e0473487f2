"""Which combinations of inertial parameters the torques of a rigid arm depend on: base parameters by QR
(Gautier 1991).

Of each link, in its own frame: mass m, first moments mx, my, mz, inertia xx, xy, xz, yy, yz, zz about the
frame's origin; of each joint inertia of the rotor (ia), viscous (fv) and Coulomb (fc) friction, an offset.
Torques are linear in all (Atkeson, An and Hollerbach 1986). Columns that depend on those before them are
dropped, and what they stand for goes to those.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.robot.description import Link, Robot
from identify.robot.inverse_dynamics import NAMES, PAIRS, link_columns
from identify.robot.pseudo_inertia import pseudo_inertia

_TOLERANCE = 1e-9
_STATES = 60
_ORDER = ("zz", "xx", "xy", "xz", "yz", "yy", "mx", "my", "mz")
"""Of each link; masses come last, so that they are what is put together with others."""
UNITS = {"m": "kg", **dict.fromkeys(("mx", "my", "mz"), "kg m"), **dict.fromkeys((*PAIRS, "ia"), "kg m^2")}
UNITS |= {"fc": "N m", "fv": "N m s/rad", "offset": "N m"}


def standard_names(robot: Robot) -> list[str]:
    """Names of the inertial parameters of all moving links, in the order of `standard_columns`."""
    links = [link.name for link in robot.links[1:]]
    return [f"{link}.{what}" for link in links for what in _ORDER] + [f"{link}.m" for link in links]


def standard_columns(robot: Robot, position: Array, velocity: Array, acceleration: Array) -> Array:
    """(samples, joints, parameters): torque per unit of each inertial parameter."""
    columns = link_columns(robot, position, velocity, acceleration)
    places = [NAMES.index(what) for what in _ORDER]
    inertial = columns[..., places].reshape(*position.shape, -1)
    return np.concatenate([inertial, columns[..., NAMES.index("m")]], axis=2)


def parameters_of(link: Link) -> dict[str, float]:
    """What a body's inertial parameters are, by their names with its own before them."""
    matrix = pseudo_inertia(link)
    inertia = np.trace(matrix[:3, :3]) * np.eye(3) - matrix[:3, :3]
    found = {what: inertia[pair] for what, pair in PAIRS.items()}
    found |= dict(zip(("mx", "my", "mz", "m"), matrix[3], strict=True))
    return {f"{link.name}.{what}": float(found[what]) for what in (*_ORDER, "m")}


def pseudo_inertia_basis() -> Array:
    """(10, 4, 4): pseudo-inertia per unit of each inertial parameter, in the order of `parameters_of`."""
    found = []
    for what in (*_ORDER, "m"):
        matrix = np.zeros((4, 4))
        if what in PAIRS:
            a, b = PAIRS[what]
            matrix[a, b] = matrix[b, a] = -1.0
            matrix[:3, :3] += np.eye(3) / 2 * (a == b)
        else:
            axis = ("mx", "my", "mz", "m").index(what)
            matrix[3, axis] = matrix[axis, 3] = 1.0
        found.append(matrix)
    return np.array(found)


def standard_values(robot: Robot) -> Array:
    """What the robot's description says of the inertial parameters (parameters,)."""
    found = {name: value for link in robot.links[1:] for name, value in parameters_of(link).items()}
    return np.array([found[name] for name in standard_names(robot)])


@dataclass(frozen=True)
class BaseSet:
    """kept: numbers (b,) of the parameters that stay; regrouping (b, parameters): base values from all
    parameters' values.
    """

    names: tuple[str, ...]
    kept: tuple[int, ...]
    regrouping: Array

    @property
    def meanings(self) -> list[str]:
        """What each base parameter is made of."""
        found = []
        for kept, row in zip(self.kept, self.regrouping, strict=True):
            terms = [(number, part) for number, part in enumerate(row) if abs(part) > 1e-6 and number != kept]
            found.append(
                self.names[kept]
                + "".join(
                    f" {'+' if part > 0 else '-'} {_times(abs(part))}{self.names[n]}" for n, part in terms
                )
            )
        return found


def base_set(names: Sequence[str], columns: Array) -> BaseSet:
    """The base parameters of columns (rows, parameters), earlier names kept before later ones."""
    scale = np.sqrt((columns**2).sum(axis=0))
    seen = [number for number in range(len(names)) if scale[number] > _TOLERANCE * scale.max()]
    triangle = scipy.linalg.qr(columns[:, seen] / scale[seen], mode="r", check_finite=False)[0][: len(seen)]
    kept: list[int] = []
    dropped: list[int] = []
    for row, number in enumerate(
        seen
    ):  # a column is new where something of it is left below what those before it span
        (kept if abs(triangle[row, row]) > _TOLERANCE * len(columns) else dropped).append(number)
    basis = columns[:, np.array(kept)] / scale[kept]
    links = (
        np.linalg.lstsq(basis, columns[:, np.array(dropped, dtype=int)], rcond=None)[0] / scale[kept][:, None]
    )
    regrouping = np.zeros((len(kept), len(names)))
    regrouping[np.arange(len(kept)), kept] = 1.0
    regrouping[:, dropped] = np.where(np.abs(links) > 1e-8, links, 0.0)
    return BaseSet(tuple(names), tuple(kept), regrouping)


OF_JOINT = ("ia", "fv", "fc", "offset")
OF_MOTOR = OF_JOINT[:3]


def coupled(coupling: Array | None) -> list[int]:
    """The motors (from 0) that turn with more than their own joint."""
    if coupling is None:
        return []
    return [int(row) for row in np.flatnonzero((coupling != np.eye(len(coupling))).any(axis=1))]


def all_names(robot: Robot, rows: Sequence[int], coupling: Array | None = None) -> list[str]:
    """Names of the inertial parameters, of those of the joints (from 0) in rows, and of coupled motors."""
    own = [f"joint{row + 1}.{what}" for row in rows for what in OF_JOINT]
    motors = [f"motor{row + 1}.{what}" for row in coupled(coupling) for what in OF_MOTOR]
    return standard_names(robot) + own + motors


def motor_columns(
    drive: int, rows: Sequence[int], coupling: Array, velocity: Array, acceleration: Array
) -> Array:
    """(samples, rows, 3): torque at the joints (from 0) in rows of inertia, viscous and Coulomb friction of a
    motor that turns with more than one of them.
    """
    speed = velocity @ coupling[drive]
    parts = np.stack([acceleration @ coupling[drive], speed, np.sign(speed)], axis=1)
    return np.asarray(parts[:, None, :] * coupling[drive][list(rows)][None, :, None])


def all_columns(
    robot: Robot,
    rows: Sequence[int],
    position: Array,
    velocity: Array,
    acceleration: Array,
    coupling: Array | None = None,
) -> Array:
    """(samples, rows, parameters) in the order of `all_names`: torque at the joints (from 0) in rows.

    The rotor of a coupled motor does not turn with its own joint alone, so that joint has none of its own.
    """
    links = standard_columns(robot, position, velocity, acceleration)[:, list(rows), :]
    own = np.zeros((len(position), len(rows), len(rows), len(OF_JOINT)))
    for place, row in enumerate(rows):
        parts = (acceleration[:, row], velocity[:, row], np.sign(velocity[:, row]), np.ones(len(position)))
        own[:, place, place] = np.stack(parts, axis=1)
        if row in coupled(coupling):
            own[:, place, place, 0] = 0.0
    found = [links, own.reshape(len(position), len(rows), -1)]
    if coupling is not None:
        found += [motor_columns(row, rows, coupling, velocity, acceleration) for row in coupled(coupling)]
    return np.concatenate(found, axis=2)


def of_robot(
    robot: Robot,
    rows: Sequence[int],
    rotors: bool = True,
    coupling: Array | None = None,
    stances: Array | None = None,
) -> BaseSet:
    """What the torques of the joints (from 0) in rows depend on, by states at random; rotors: whether their
    inertias are to be found.

    stances (runs, joints), rad: where joints stand all through a run, NaN of those that move; by default all
    move.  What only they would tell is no column then, whatever the noise of their signals makes of it.
    """
    count = len(robot.joints)
    held = np.full((1, count), np.nan) if stances is None else np.unique(stances, axis=0)
    held, rng = np.repeat(held, _STATES, axis=0), np.random.default_rng(1)
    position, velocity, acceleration = (rng.uniform(-reach, reach, held.shape) for reach in (3.0, 2.0, 5.0))
    moves = np.isnan(held)
    states = np.where(moves, position, held), np.where(moves, velocity, 0), np.where(moves, acceleration, 0)
    return at_states(robot, rows, states, rotors, coupling)


def at_states(
    robot: Robot,
    rows: Sequence[int],
    states: tuple[Array, Array, Array],
    rotors: bool = True,
    coupling: Array | None = None,
) -> BaseSet:
    """What they depend on by these states: position, velocity, acceleration (states, joints)."""
    names = all_names(robot, rows, coupling)
    columns = all_columns(robot, rows, *states, coupling)
    if not rotors:
        columns[:, :, [number for number, name in enumerate(names) if name.endswith(".ia")]] = 0.0
    return base_set(names, columns.reshape(-1, len(names)))


def _times(part: float) -> str:
    return "" if abs(part - 1) < 1e-6 else f"{part:.4g} "
