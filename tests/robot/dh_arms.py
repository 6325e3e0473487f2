"""Denavit-Hartenberg arms as YAML text, and the same arms rewritten as URDF or in the other convention."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
Table = dict[str, Any]


def random_table(seed: int, convention: str, joints: int = 6) -> Table:
    """A table with nothing aligned, every key in use."""
    rng = np.random.default_rng(seed)
    rows = [
        {
            "name": f"joint{number}",
            "theta_offset_deg": angle,
            "d_m": d,
            "a_m": a,
            "alpha_deg": twist,
            "limits_deg": [-170, 170],
        }
        for number, (angle, d, a, twist) in enumerate(
            (rng.uniform(-1, 1, (joints, 4)) * [180, 0.5, 0.5, 180]).tolist(), start=1
        )
    ]
    return {
        "name": f"table{seed}",
        "convention": convention,
        "gravity_m_s2": rng.normal(size=3).tolist(),
        "base_pose": {"xyz_m": rng.normal(size=3).tolist(), "rpy_deg": rng.uniform(-180, 180, 3).tolist()},
        "base": _link(rng, "base"),
        "joints": rows,
        "links": [_link(rng, f"link{number}") for number in range(1, joints + 1)],
        "frames": [
            {"name": "tool", "link": f"link{joints}", "xyz_m": [0.1, 0.2, 0.3], "rpy_deg": [10, 20, 30]}
        ],
    }


def write_table(folder: Path, table: Table) -> Path:
    """The table as a YAML file."""
    path = folder / "robot.yaml"
    with path.open("w", encoding="utf-8") as file:
        YAML(typ="safe").dump(table, file)
    return path


def link_transform(row: Table, convention: str, angle: float) -> Array:
    """Frame i in frame i-1, entry by entry as textbooks print it (Paul 1981; Craig 1986, Eq. 3.6)."""
    theta, alpha = angle + np.radians(row["theta_offset_deg"]), np.radians(row["alpha_deg"])
    a, d, ct, st, ca, sa = row["a_m"], row["d_m"], np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    if convention == "standard":
        return np.array(
            [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return np.array(
        [[ct, -st, 0, a], [st * ca, ct * ca, -sa, -d * sa], [st * sa, ct * sa, ca, d * ca], [0, 0, 0, 1]]
    )


def as_urdf(table: Table) -> str:
    """The same arm as URDF, without gravity and base_pose: each link's frame sits on its joint axis, so
    inertias move to other frames.
    """
    parts, after = [_urdf_link(table["base"], np.eye(4))], np.eye(4)
    parent = table["base"]["name"]
    for row, link in zip(table["joints"], table["links"], strict=True):
        turned = {**row, "a_m": 0.0, "alpha_deg": 0.0}
        if table["convention"] == "standard":
            origin, mount = after @ link_transform(turned, "standard", 0.0), _mount(row)
        else:
            origin, mount = link_transform(row, "modified", 0.0), np.eye(4)
        xyz, rpy = _origin(origin)
        lower, upper = np.radians(row["limits_deg"])
        parts.append(_urdf_link(link, mount))
        parts.append(
            f'<joint name="{row["name"]}" type="revolute"><parent link="{parent}"/><child'
            f' link="{link["name"]}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 2"/><limit'
            f' lower="{lower}" upper="{upper}"/></joint>'
        )
        parent, after = link["name"], mount
    return "\n".join(['<robot name="same">', *parts, "</robot>"])


def other_convention(table: Table) -> Table:
    """A standard table as a modified one: alpha and a move one row down, so that frames, and inertial data,
    move to the near end.
    """
    joints = table["joints"]
    rows, links = [], []
    for number, (row, link) in enumerate(zip(joints, table["links"], strict=True)):
        before = joints[number - 1] if number else {"a_m": 0.0, "alpha_deg": 0.0}
        rows.append({**row, "a_m": before["a_m"], "alpha_deg": before["alpha_deg"]})
        links.append(_moved(link, _mount(row)))
    return {**table, "convention": "modified", "joints": rows, "links": links, "frames": []}


def _mount(row: Table) -> Array:
    """The part of a standard row beyond its joint: Tx(a) Rx(alpha)."""
    return link_transform({**row, "theta_offset_deg": 0.0, "d_m": 0.0}, "standard", 0.0)


def _moved(link: Table, mount: Array) -> Table:
    turn = mount[:3, :3]
    inertia = turn @ np.array(link["inertia_kg_m2"]) @ turn.T
    centre = turn @ np.array(link["centre_m"]) + mount[:3, 3]
    return {**link, "centre_m": centre.tolist(), "inertia_kg_m2": ((inertia + inertia.T) / 2).tolist()}


def _link(rng: np.random.Generator, name: str) -> Table:
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    a, b, c = rng.uniform(0.1, 1, 3)
    inertia = turn @ np.diag([b + c, a + c, a + b]) @ turn.T
    return {
        "name": name,
        "mass_kg": float(rng.uniform(1, 50)),
        "centre_m": rng.uniform(-0.3, 0.3, 3).tolist(),
        "inertia_kg_m2": ((inertia + inertia.T) / 2).tolist(),
    }


def _urdf_link(link: Table, mount: Array) -> str:
    xyz, rpy = _origin(
        mount @ np.block([[np.eye(3), np.array(link["centre_m"])[:, None]], [np.zeros((1, 3)), 1]])
    )
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = link["inertia_kg_m2"]
    return (
        f'<link name="{link["name"]}"><inertial><origin xyz="{xyz}" rpy="{rpy}"/><mass'
        f' value="{link["mass_kg"]}"/><inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}"'
        f' iyz="{yz}"/></inertial></link>'
    )


def _origin(pose: Array) -> tuple[str, str]:
    rpy = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
    return " ".join(map(repr, map(float, pose[:3, 3]))), " ".join(map(repr, map(float, rpy)))
