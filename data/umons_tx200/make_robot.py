"""Makes robot.yaml and gripper.yaml of this folder: the inertias of a Staubli TX200 estimated from simple
solids (see SOURCE.md).

Run it where it lies: `python make_robot.py`.  Lengths in m, densities in kg/m^3; every solid is given in the
frame of its link.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
Solid = tuple[
    float, Array, Array
]  # mass, centre (3,), inertia (3, 3) about the centre, of a part or of a whole body

IRON, ALUMINIUM = 7200.0, 2700.0  # castings
DRIVE = 5000.0  # motor, brake and gear in one: steel and copper with the voids between them
GEAR = 4000.0  # gears, shafts and bearings in an aluminium housing
X, Y, Z = 0, 1, 2

# Modified Denavit-Hartenberg rows: alpha (deg), a, d, theta offset (deg), limits (deg).
TABLE: list[tuple[float, float, float, float, tuple[float, float]]] = [
    (0, 0, 0.642, 0, (-180, 180)),
    (-90, 0.250, 0, -90, (-120, 120)),
    (0, 0.950, 0, -90, (-140, 145)),
    (-90, 0, 0.800, 0, (-270, 270)),
    (90, 0, 0, 0, (-120, 120)),
    (-90, 0, 0.194, 180, (-270, 270)),
]


def cylinder(
    axis: int, length: float, outer: float, density: float, centre: Triple, wall: float | None = None
) -> Solid:
    """A cylinder along a frame axis, of outer diameter `outer`; hollow where a wall thickness is given."""
    radius = outer / 2
    inner = 0.0 if wall is None else radius - wall
    mass = density * np.pi * (radius**2 - inner**2) * length
    across = mass * (3 * (radius**2 + inner**2) + length**2) / 12
    moments = np.full(3, across)
    moments[axis] = mass * (radius**2 + inner**2) / 2
    return mass, np.array(centre), np.diag(moments)


def box(size: Triple, density: float, centre: Triple) -> Solid:
    """A full box."""
    squares = np.square(size)
    mass = density * float(np.prod(size))
    return mass, np.array(centre), mass / 12 * np.diag(squares.sum() - squares)


def together(solids: list[Solid]) -> Solid:
    """Mass, centre and inertia about it of solids fixed to each other."""
    mass = sum(solid[0] for solid in solids)
    centre = sum((solid[0] * solid[1] for solid in solids), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part, at, own in solids:
        shift = at - centre
        inertia += own + part * (shift @ shift * np.eye(3) - np.outer(shift, shift))
    return mass, centre, inertia


# The arm stands beside the plane of axis 1 and the forearm returns to it: side = -0.16 m along axis 2 is an
# estimate.
SIDE = -0.16
BODIES: dict[str, list[Solid]] = {
    "base": [  # z up from the floor of the robot
        box((0.62, 0.62, 0.05), IRON, (0, 0, 0.025)),
        cylinder(Z, 0.35, 0.50, IRON, (0, 0, 0.225), wall=0.025),
        cylinder(Z, 0.10, 0.40, DRIVE, (0, 0, 0.32)),  # gear of axis 1
    ],
    "shoulder_housing": [  # origin where axis 1 passes the height of axis 2; z up, x forward
        cylinder(Z, 0.06, 0.50, IRON, (0, 0, -0.24)),  # turntable
        cylinder(Z, 0.42, 0.52, IRON, (0.06, 0, 0), wall=0.022),
        cylinder(Z, 0.30, 0.20, DRIVE, (-0.08, 0, 0.02)),  # motor of axis 1
        cylinder(Y, 0.34, 0.26, DRIVE, (0.25, 0.10, 0)),  # drive of axis 2
    ],
    "arm": [  # x along the arm from axis 2 to axis 3, z along axis 2
        cylinder(Z, 0.16, 0.36, GEAR, (0, 0, SIDE)),  # hub on axis 2
        cylinder(X, 0.95, 0.26, ALUMINIUM, (0.475, 0, SIDE), wall=0.025),
        cylinder(Z, 0.16, 0.30, GEAR, (0.95, 0, SIDE)),  # hub on axis 3
        cylinder(X, 0.50, 0.16, DRIVE, (0.35, 0, SIDE), wall=0.020),  # balancing spring inside
    ],
    "proximal_forearm": [  # y along the forearm from axis 3 to the wrist, z along axis 3
        cylinder(Y, 0.45, 0.30, ALUMINIUM, (0, 0.03, 0), wall=0.025),
        cylinder(Z, 0.24, 0.24, DRIVE, (0, 0, -0.02)),  # drive of axis 3
        cylinder(Y, 0.24, 0.16, DRIVE, (0, -0.10, 0.08)),  # drive of axis 4
    ],
    "distal_forearm": [  # z along the forearm, origin at the wrist centre
        cylinder(Z, 0.50, 0.22, ALUMINIUM, (0, 0, -0.27), wall=0.018),
        cylinder(Z, 0.26, 0.16, DRIVE, (0, 0, -0.40)),  # drives of axes 5 and 6
    ],
    "wrist_housing": [  # origin at the wrist centre, z along axis 5, y along the forearm at zero angle
        cylinder(Z, 0.18, 0.16, GEAR, (0, 0, 0)),
        cylinder(Y, 0.13, 0.13, GEAR, (0, 0.10, 0)),
    ],
    "flange": [cylinder(Z, 0.03, 0.14, 7800.0, (0, 0, -0.015))],  # origin in the flange face, z outwards
}
GRIPPER = [
    cylinder(Z, 0.12, 0.15, 5.0 / (np.pi * 0.075**2 * 0.12), (0.01, 0, 0.06))
]  # 5 kg, off axis 6 as valves and hoses put it


def inertial(solids: list[Solid]) -> str:
    """The keys of a link in the YAML files."""
    mass, centre, inertia = together(solids)
    six = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    return f"mass_kg: {_number(mass)}, centre_m: [{_numbers(centre)}], inertia_kg_m2: [{_numbers(six)}]"


def robot_yaml() -> str:
    """The text of robot.yaml."""
    base, *links = BODIES
    lines = [
        "# Staubli TX200 without gripper.  Made by make_robot.py; inertias are estimates (see SOURCE.md).",
        "name: Staubli TX200",
        "convention: modified",
        "base_pose: {xyz_m: [0, 0, 0.6]}  # rigid pedestal of 600 mm",
        f"base: {{name: {base}, {inertial(BODIES[base])}}}",
        "joints:",
    ]
    for number, (alpha, a, d, offset, (lower, upper)) in enumerate(TABLE, start=1):
        geometry = (
            f"alpha_deg: {_number(alpha)}, a_m: {_number(a)}, d_m: {_number(d)}, theta_offset_deg:"
            f" {_number(offset)}"
        )
        lines.append(
            f"  - {{name: joint{number}, {geometry}, limits_deg: [{_number(lower)}, {_number(upper)}]}}"
        )
    lines.append("links:")
    lines += [f"  - {{name: {name}, {inertial(BODIES[name])}}}" for name in links]
    return "\n".join(lines) + "\n"


def gripper_yaml() -> str:
    """The text of gripper.yaml, a payload."""
    return (
        "# The gripper of 5 kg as a payload.  Made by make_robot.py.\n{link: flange,"
        f" {inertial(GRIPPER)}}}\n"
    )


def _number(value: float) -> str:
    return f"{round(float(value), 6) + 0.0:.6g}"


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(_number(value) for value in values)


if __name__ == "__main__":
    folder = Path(__file__).parent
    (folder / "robot.yaml").write_text(robot_yaml(), encoding="utf-8")
    (folder / "gripper.yaml").write_text(gripper_yaml(), encoding="utf-8")
