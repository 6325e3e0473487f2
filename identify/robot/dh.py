"""Read a serial arm from a Denavit-Hartenberg table in YAML.

    name: two-link arm
    convention: standard            # or modified
    gravity_m_s2: [0, 0, -9.81]     # in the axes of the ground; this is the default
    base_pose: {xyz_m: [0, 0, 0.6], rpy_deg: [0, 0, 0]}   # frame 0 on the frame `ground`; default: there
    # the inertia of the base may be left out
    base: {name: base, mass_kg: 90, centre_m: [0, 0, 0.1], inertia_kg_m2: [2, 2, 3, 0, 0, 0]}
    joints:                         # one row of the table each
      - {name: joint1, theta_offset_deg: 0, d_m: 0.5, a_m: 0.2, alpha_deg: -90, limits_deg: [-170, 170]}
      - {name: joint2, theta_offset_deg: -90, d_m: 0, a_m: 0.7, alpha_deg: 0}
    links:                          # link i is moved by joint i; its inertial data are in its frame i
      - {name: shoulder, mass_kg: 60, centre_m: [0, 0.1, 0], inertia_kg_m2: [1.5, 1.2, 1.1, 0, 0, 0]}
      - {name: arm, mass_kg: 40, centre_m: [-0.3, 0, 0], inertia_kg_m2: [[0.4,0,0], [0,1.9,0], [0,0,1.9]]}
    frames:                         # further frames, each fixed to a link
      - {name: flange, link: arm, xyz_m: [0, 0, 0.1], rpy_deg: [0, 90, 0]}

Row i of the table takes frame i-1 to frame i at joint angle q by Rz(q + theta_offset) Tz(d) Tx(a) Rx(alpha)
in the standard convention (Denavit and Hartenberg 1955; Paul 1981), and by Rx(alpha) Tx(a) Rz(q +
theta_offset) Tz(d) in the modified one (Craig 1986), where alpha and a of row i are alpha_(i-1) and a_(i-1).
An inertia is about the centre of mass, as a matrix or as [xx, yy, zz, xy, xz, yz] with the products as the
matrix has them. The angles of rpy_deg are about the fixed x, y, z axes in that order, as in URDF.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from reprlib import repr as shortened
from typing import Any

import numpy as np
from pydantic import ValidationError

from identify.core.errors import InputError, InputErrors
from identify.core.yaml_input import line_of, plain, read_yaml_file
from identify.robot.description import Joint, Robot
from identify.robot.dh_table import GROUND, DhRow, DhTable, Key, faults
from identify.robot.pose import inverse, pose
from identify.robot.units import SI, RobotUnits


def read_dh(
    path: Path,
    *,
    unknown_bodies: bool = False,
    gravity: Sequence[float] | None = None,
    units: RobotUnits = SI,
) -> Robot:
    """The arm in a Denavit-Hartenberg file; a base without inertia gets mass 0.

    unknown_bodies: masses and inertias of zero are allowed, of bodies that are not known; gravity: in the
    axes of the ground, m/s^2, in place of that of the file; units: those of the file.

    Raises InputError for a file that cannot be read and InputErrors with every other fault: key, line, what
    was found and expected.
    """
    data = read_yaml_file(path, "a Denavit-Hartenberg table in YAML")
    try:
        table = DhTable.model_validate(plain(data))
    except ValidationError as error:
        raise InputErrors(
            [
                _explain(_where(path, data, fault["loc"]), fault["msg"], fault["input"])
                for fault in error.errors()
            ]
        ) from error
    found_faults = [
        InputError(_where(path, data, key), found, expected)
        for key, found, expected in faults(table, unknown_bodies=unknown_bodies)
    ]
    if found_faults:
        raise InputErrors(found_faults)
    pulled = table if gravity is None else table.model_copy(update={"gravity_m_s2": gravity})
    return units.robot(_robot(pulled))


def _robot(table: DhTable) -> Robot:
    base = table.base
    names = (base.name, *(link.name for link in table.links))
    joints = tuple(
        _joint(table.convention, row, *names[number : number + 2]) for number, row in enumerate(table.joints)
    )
    at = table.base_pose.matrix()
    frames = {GROUND: (base.name, inverse(at))} if base.name != GROUND else {}
    frames.update({frame.name: (frame.link, frame.matrix()) for frame in table.frames})
    links = (base.link(), *(link.link() for link in table.links))
    return Robot(table.name, links, joints, frames, at[:3, :3].T @ np.array(table.gravity_m_s2))


def _joint(convention: str, row: DhRow, parent: str, child: str) -> Joint:
    offset, twist = np.radians(row.theta_offset_deg), np.radians(row.alpha_deg)
    lower, upper = np.radians(row.limits_deg) if row.limits_deg else (-np.inf, np.inf)
    turned, twisted = pose((0, 0, row.d_m), (0, 0, offset)), pose((row.a_m, 0, 0), (twist, 0, 0))
    # Rz and Tz commute, so the joint may turn after the shift d; Rx and Tx too.
    if convention == "modified":
        return Joint(
            row.name, parent, child, twisted @ turned, np.array([0.0, 0.0, 1.0]), lower=lower, upper=upper
        )
    return Joint(row.name, parent, child, turned, np.array([0.0, 0.0, 1.0]), twisted, lower, upper)


def _explain(where: str, message: str, value: object) -> InputError:
    if message == "Field required":
        return InputError(where, "this key is missing", fix="add it")
    if message == "Extra inputs are not permitted":
        return InputError(where, "unknown key", fix="remove it or correct its spelling")
    return InputError(where, shortened(value), message.removeprefix("Input should be "))


def _where(path: Path, data: Any, key: Key) -> str:
    """File, line and key; the line is that of the innermost part of the key that the file has."""
    line = line_of(data, list(key)) or " line 1"
    return f"{path.name}{line}, {'.'.join(str(part) for part in key)}"
