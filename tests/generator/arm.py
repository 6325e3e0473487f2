"""What a six-axis arm is: links, joints, measurement points and the true joint springs and dampers; and its
files for the user.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from tests.generator.rigid import Array, Inertia, from_rpy, turn


@dataclass(frozen=True)
class Link:
    """A rigid link; its inertia is in its own frame."""

    name: str
    inertia: Inertia


@dataclass(frozen=True)
class Joint:
    """A revolute joint: the child's frame in the parent's at zero angle (xyz in m, rpy in rad) and the axis
    in the child's frame.
    """

    name: str
    xyz: Array
    rpy: Array
    axis: Array

    def rotation(self, angle: float) -> Array:
        """The child's axes in the parent's (3, 3) at an angle (rad)."""
        return np.asarray(from_rpy(self.rpy) @ turn(self.axis, angle))


@dataclass(frozen=True)
class Point:
    """A triaxial accelerometer at `xyz` (3,), m, of a link's frame, measuring along the link's axes."""

    node: int
    name: str
    link: str
    xyz: Array


@dataclass(frozen=True)
class Arm:
    """links[0] is the base, joints[i] carries links[i + 1]; stiffness (N m/rad) and damping (N m s/rad) are
    the truth, one per joint.

    home (joints,), degrees, is the middle of the postures in which it is tested; the last point is where the
    hammer hits.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    points: tuple[Point, ...]
    home: Array
    stiffness: Array
    damping: Array

    def point(self, name: str) -> Point:
        """The point of that name."""
        return next(point for point in self.points if point.name == name)

    def number(self, link: str) -> int:
        """Index of a link."""
        return [item.name for item in self.links].index(link)

    def at_points(self, nodes: ArrayLike) -> Arm:
        """The arm with only the points of these node numbers."""
        return replace(self, points=tuple(point for point in self.points if point.node in np.asarray(nodes)))

    def urdf(self) -> str:
        """The robot as its user knows it."""
        lines = [f'<robot name="{self.name}">', _link(self.links[0])]
        for parent, joint, child in zip(self.links, self.joints, self.links[1:], strict=False):
            lines += [_link(child), _joint(joint, parent.name, child.name)]
        return "\n".join([*lines, "</robot>", ""])

    def points_csv(self) -> str:
        """Nodes, names, links and positions of the points."""
        rows = [
            f"{p.node},{p.name},{p.link},{','.join(f'{value:.6f}' for value in p.xyz)}" for p in self.points
        ]
        return "\n".join(["node,name,link,x_m,y_m,z_m", *rows, ""])


def _link(link: Link) -> str:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia.tensor
    moments = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), (xx, xy, xz, yy, yz, zz), strict=True)
    inertia = " ".join(f'{name}="{value:.10g}"' for name, value in moments)
    return (
        f'<link name="{link.name}"><inertial><origin xyz="{_words(link.inertia.centre)}"/>'
        f'<mass value="{link.inertia.mass:.10g}"/><inertia {inertia}/></inertial></link>'
    )


def _joint(joint: Joint, parent: str, child: str) -> str:
    return (
        f'<joint name="{joint.name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_words(joint.xyz)}" rpy="{_words(joint.rpy)}"/><axis xyz="{_words(joint.axis)}"/>'
        '<limit lower="-6.2832" upper="6.2832" effort="1e5" velocity="10"/></joint>'
    )


def _words(values: Array) -> str:
    return " ".join(f"{value + 0.0:.10g}" for value in np.round(values, 12))
