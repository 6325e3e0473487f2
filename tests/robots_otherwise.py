"""One robot and its points described in other ways, none of which says anything else about them."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass
from xml.etree import ElementTree as ET

import numpy as np
import scipy

from identify.core.arrays import Array

Change = Callable[["Described"], None]
_NAMES = ("world", "base", "bearing", "joint1", "tool", "Süd *", "frf.1")
"""Links are called so, though `base`, `joint1` and `tool` have a meaning elsewhere."""


@dataclass
class Described:
    """A URDF (its root element), points as rows, and the angles of postures, degrees."""

    robot: ET.Element
    points: list[dict[str, str]]
    postures: list[list[float]]

    @classmethod
    def of(cls, urdf: str, points: str, postures: list[list[float]]) -> Described:
        """What two texts describe."""
        return cls(ET.fromstring(urdf), list(csv.DictReader(io.StringIO(points))), postures)

    def texts(self) -> tuple[str, str]:
        """The URDF and the points."""
        stream = io.StringIO()
        writer = csv.DictWriter(stream, list(self.points[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.points)
        return ET.tostring(self.robot, encoding="unicode"), stream.getvalue()

    def axis(self, joint: ET.Element) -> Array:
        """Along which a joint turns (3,), in the frame of the link it moves."""
        return _numbers(_child(joint, "axis").get("xyz"))


def renamed(one: Described) -> None:
    """Every link and joint has another name."""
    names = dict(zip((link.get("name", "") for link in one.robot.findall("link")), _NAMES, strict=True))
    for link in one.robot.findall("link"):
        link.set("name", names[link.get("name", "")])
    for number, joint in enumerate(one.robot.findall("joint")):
        joint.set("name", f"axis {6 - number}")
        for end in ("parent", "child"):
            _child(joint, end).set("link", names[_child(joint, end).get("link", "")])
    for row in one.points:
        row["link"] = names[row["link"]]


def reordered(one: Described) -> None:
    """Links and joints, and the points, stand in another order."""
    elements = list(one.robot)
    for element in elements:
        one.robot.remove(element)
    one.robot.extend([elements[n] for n in np.random.default_rng(3).permutation(len(elements))])
    one.points.reverse()


def turned_about(one: Described) -> None:
    """Joints 2 and 5 turn the other way round, and their angles have the other sign."""
    for n in (1, 4):
        joint = one.robot.findall("joint")[n]
        _child(joint, "axis").set("xyz", _text(-one.axis(joint)))
        for posture in one.postures:
            posture[n] *= -1


def with_frames(one: Described) -> None:
    """Links without a body below, at the end of and beside the arm; a third of a link is another link."""
    first, *_, last = (link.get("name", "") for link in one.robot.findall("link"))
    for name, parent, child in (
        ("floor", "floor", first),
        ("flange", last, "flange"),
        ("box", "link3", "box"),
    ):
        ET.SubElement(one.robot, "link", name=name)
        joint = ET.SubElement(one.robot, "joint", name=f"to {name}", type="fixed")
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
    links = {link.get("name"): link for link in one.robot.findall("link")}
    whole = _child(links["link3"], "inertial")
    part = ET.fromstring(ET.tostring(whole))
    links["box"].append(part)
    for body, share in ((whole, 2 / 3), (part, 1 / 3)):
        for tag in ("mass", "inertia"):
            for key, value in _child(body, tag).attrib.items():
                _child(body, tag).set(key, repr(share * float(value)))


def with_other_frames(turn: Callable[[Array], Array], along_m: float) -> Change:
    """The frame of every moving link is turned, by a rotation vector of its axis, and moved along that."""

    def change(one: Described) -> None:
        moved = {link.get("name", ""): np.eye(4) for link in one.robot.findall("link")}
        for joint in one.robot.findall("joint"):
            axis = one.axis(joint)
            new = moved[_child(joint, "child").get("link", "")]
            new[:3, :3] = scipy.spatial.transform.Rotation.from_rotvec(turn(axis)).as_matrix()
            new[:3, 3] = along_m * axis
        for link in one.robot.findall("link"):
            _place(_child(link, "inertial"), np.linalg.inv(moved[link.get("name", "")]), np.eye(4))
        for joint in one.robot.findall("joint"):
            parent, child = (moved[_child(joint, end).get("link", "")] for end in ("parent", "child"))
            _place(joint, np.linalg.inv(parent), child)
            _child(joint, "axis").set("xyz", _text(child[:3, :3].T @ one.axis(joint)))
        for row in one.points:
            back = np.linalg.inv(moved[row["link"]])
            at = back @ np.array([*(float(row[key]) for key in ("x_m", "y_m", "z_m")), 1.0])
            row |= dict(zip(("x_m", "y_m", "z_m"), map(repr, at[:3].tolist()), strict=True))
            angles = np.degrees(_rpy(back[:3, :3])).tolist()
            row |= dict(zip(("rx_deg", "ry_deg", "rz_deg"), map(repr, angles), strict=True))

    return change


OTHERWISE: dict[str, Change] = {
    "renamed": renamed,
    "reordered": reordered,
    "turned_about": turned_about,
    "with_frames": with_frames,
    "axes_turned_by_90": with_other_frames(lambda axis: np.pi / 2 * axis, 0.0),
    "axes_turned_by_30": with_other_frames(lambda axis: np.pi / 6 * axis, 0.0),
    "moved_along_axes": with_other_frames(lambda axis: 0 * axis, 0.1),
    "any_frames": with_other_frames(lambda axis: np.array([0.4, -1.1, 0.7]) + axis, 0.05),
}


def _place(element: ET.Element, before: Array, behind: Array) -> None:
    """An <origin> that is seen from another frame, and has another one behind it."""
    origin = element.find("origin")
    if origin is None:
        origin = ET.SubElement(element, "origin")
    pose = np.eye(4)
    angles = _numbers(origin.get("rpy", "0 0 0"))
    pose[:3, :3] = scipy.spatial.transform.Rotation.from_euler("xyz", angles).as_matrix()
    pose[:3, 3] = _numbers(origin.get("xyz", "0 0 0"))
    pose = before @ pose @ behind
    origin.set("xyz", _text(pose[:3, 3]))
    origin.set("rpy", _text(_rpy(pose[:3, :3])))


def _rpy(rotation: Array) -> Array:
    """Roll, pitch and yaw, without a warning where the pitch is a right angle."""
    pitch = np.arcsin(np.clip(-rotation[2, 0], -1, 1))
    if abs(rotation[2, 0]) > 1 - 1e-9:
        return np.array([np.arctan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0])
    roll, yaw = np.arctan2(rotation[2, 1], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[0, 0])
    return np.array([roll, pitch, yaw])


def _child(element: ET.Element, tag: str) -> ET.Element:
    found = element.find(tag)
    assert found is not None
    return found


def _numbers(text: str | None) -> Array:
    return np.array([float(word) for word in (text or "").split()])


def _text(values: Array) -> str:
    return " ".join(f"{value:.15g}" for value in values)
