"""Random serial arms as URDF text, seeded, for every test suite that needs a robot nobody has tuned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
INDUSTRIAL_AXES = ("0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1")


def industrial_arm(seed: int) -> str:
    """A six-axis arm of industrial proportions (reach 1 to 3 m, wrist axes through one point), upright on
    `base_link`.

    Links `base_link`, `link1` .. `link6`, joints `joint1` .. `joint6`; at zero angles the arm points straight
    up.
    """
    rng = np.random.default_rng(seed)
    reach = rng.uniform(1.0, 3.0)
    size = reach * rng.uniform(0.85, 1.15, 6) * [0.18, 0.12, 0.38, 0.14, 0.26, 0.08]
    mass = 400 * (reach / 2.5) ** 2.5 * rng.uniform(0.8, 1.2, 7) * [0.6, 0.8, 0.6, 0.35, 0.2, 0.08, 0.05]
    width = reach * rng.uniform(0.04, 0.07, 7)
    shift = reach * rng.uniform(0.08, 0.12)
    origins = [
        (0, 0, size[0]),
        (shift, 0, size[1]),
        (0, 0, size[2]),
        (0, 0, size[3]),
        (0, 0, size[4]),
        (0, 0, size[5]),
    ]
    heights = [*size, size[5]]
    sideways = reach * rng.uniform(-0.04, 0.04, 7)
    names = ["base_link", *(f"link{number}" for number in range(1, 7))]
    parts = []
    for number, name in enumerate(names):
        box = (2 * width[number], 2 * width[number], heights[number])
        parts.append(
            _link(
                name,
                mass[number],
                (0.5 * shift * (number == 1), sideways[number], heights[number] / 2),
                (0, 0, 0),
                box,
            )
        )
    for number, (xyz, axis) in enumerate(zip(origins, INDUSTRIAL_AXES, strict=True)):
        parts.append(
            _joint(f"joint{number + 1}", "revolute", names[number], names[number + 1], xyz, (0, 0, 0), axis)
        )
    return _robot(f"industrial{seed}", parts)


def general_arm(seed: int, joints: int = 6) -> str:
    """An arm with nothing aligned: any axes (not unit), frames, inertias and gravity direction; brackets and
    a tool held by fixed joints.

    The root `world` is turned against `base_link`; `bracketI` is fixed to `linkI` for odd I; `tool` is a
    frame on the last link.
    """
    rng = np.random.default_rng([seed, joints])
    parts = ['<link name="world"/>']
    names = ["base_link", *(f"link{number}" for number in range(1, joints + 1))]
    parts += [_random_link(rng, name, rng.uniform(5, 100)) for name in names]
    parts.append(_joint("stand", "fixed", "world", "base_link", *_random_pose(rng)))
    for number in range(1, joints + 1):
        axis = _words(rng.normal(size=3) * rng.uniform(0.1, 10))
        kind = "continuous" if rng.random() < 0.3 else "revolute"
        parts.append(
            _joint(f"joint{number}", kind, names[number - 1], names[number], *_random_pose(rng), axis)
        )
        if number % 2:
            parts.append(_random_link(rng, f"bracket{number}", rng.uniform(0.5, 10)))
            parts.append(
                _joint(f"screw{number}", "fixed", names[number], f"bracket{number}", *_random_pose(rng))
            )
    parts += ['<link name="tool"/>', _joint("flange", "fixed", names[-1], "tool", *_random_pose(rng))]
    return _robot(f"general{seed}", [parts[number] for number in rng.permutation(len(parts))])


def random_posture(seed: int, joints: int = 6) -> Array:
    """Joint angles (joints,), rad, anywhere in a turn."""
    return np.random.default_rng([seed, 1]).uniform(-np.pi, np.pi, joints)


def write(folder: Path, text: str) -> Path:
    """The URDF text as a file in `folder`."""
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return path


def _random_pose(rng: np.random.Generator) -> tuple[Array, Array]:
    return rng.uniform(-0.6, 0.6, 3), rng.uniform(-np.pi, np.pi, 3)


def _random_link(rng: np.random.Generator, name: str, mass: float) -> str:
    xyz, rpy = _random_pose(rng)
    return _link(name, mass, xyz / 2, rpy, rng.uniform(0.05, 0.6, 3))


def _link(name: str, mass: float, xyz: object, rpy: object, box: object) -> str:
    a, b, c = np.square(box)
    moments = mass / 12 * np.array([b + c, a + c, a + b])
    inertia = " ".join(f'i{axis}{axis}="{moment:.17g}"' for axis, moment in zip("xyz", moments, strict=True))
    return (
        f'<link name="{name}"><inertial><origin xyz="{_words(xyz)}" rpy="{_words(rpy)}"/><mass'
        f' value="{mass:.17g}"/><inertia {inertia} ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def _joint(name: str, kind: str, parent: str, child: str, xyz: object, rpy: object, axis: str = "") -> str:
    turning = (
        f'<axis xyz="{axis}"/><limit lower="-6.3" upper="6.3" effort="1e5" velocity="10"/>' if axis else ""
    )
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_words(xyz)}" rpy="{_words(rpy)}"/>{turning}</joint>'
    )


def _robot(name: str, parts: list[str]) -> str:
    return "\n".join([f'<robot name="{name}">', *parts, "</robot>"])


def _words(values: object) -> str:
    return " ".join(f"{value:.17g}" for value in np.asarray(values, dtype=float))
