"""Simulated geometries of tests, laid on robots: how many nodes get the right link, and how far off they are.

    python -m tests.benchmarks.registration --seed N [--robots FOLDER] [--count 60] [--pairs 3]

Each geometry is of 25 to 60 nodes on surfaces that nothing covers, 15 mm or more from other links, as a
sensor needs; joint angles are 3 degrees (standard deviation) other than stated, three nodes are paired with
places 30 mm (of each coordinate) off, nodes are 2 mm off and lie up to 12 mm above the surface, and of one in
ten the file says a wrong unit.  Kinematics, meshes, rays and universal files are written here once more, so
that no mistake is made twice; only `identify points` is asked, through its files.

FOLDER: descriptions with meshes (STL) somewhere below; without it, arms of boxes and cylinders are drawn.
"""

from __future__ import annotations

import argparse
import csv
import json
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from identify.api import commands as api

ANGLE_DEG, PAIR_M, NODE_M, HEIGHT_M, CLEAR_M = 3.0, 0.03, 0.002, 0.012, 0.015
WRONG_UNIT = 0.1
UNITS = {"m": 1.0, "mm": 1e-3, "in": 0.0254, "cm": 1e-2}
"""Lengths in m."""
RESULTS = Path(__file__).parent / "results"


@dataclass
class Arm:
    """Links in a row; of each its triangles (t, 3, 3) in its frame, m, and the poses in it of all links that
    are fixed to it, by name; origin and axis of each joint.
    """

    file: Path
    names: list[str] = field(default_factory=list)
    joints: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    solids: list[np.ndarray] = field(default_factory=list)
    fixed: list[dict[str, np.ndarray]] = field(default_factory=list)

    def poses(self, angles: np.ndarray) -> list[np.ndarray]:
        """Of the links, base first."""
        found = [np.eye(4)]
        for (origin, axis), angle in zip(self.joints, angles, strict=True):
            found.append(found[-1] @ origin @ moved(rotation(axis, angle)))
        return found


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """(3, 3), by Euler's formula of a quaternion."""
    w, (x, y, z) = np.cos(angle / 2), np.sin(angle / 2) * axis / np.linalg.norm(axis)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def moved(turn: np.ndarray, shift: Any = (0, 0, 0)) -> np.ndarray:
    """(4, 4)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, shift
    return pose


def placed(pose: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Places (..., 3) in another frame."""
    return places @ pose[:3, :3].T + pose[:3, 3]


def read_arm(file: Path) -> Arm:
    """A chain of a URDF file; ValueError for what is none."""
    root = ElementTree.parse(file).getroot()
    joints = root.findall("joint")
    children = {j.find("child").get("link"): j for j in joints}  # type: ignore[union-attr]
    solid = {link.get("name"): _solid(link, file) for link in root.findall("link")}
    name = next(link.get("name") for link in root.findall("link") if link.get("name") not in children)
    arm, pose, parts = Arm(file), np.eye(4), []
    ahead = [(name, np.eye(4))]
    held: dict[str, np.ndarray] = {}
    arm.names.append(str(name))
    while ahead:
        name, pose = ahead.pop()
        held[str(name)] = pose
        parts.append(placed(pose, solid[name]))
        leaving = [j for j in joints if j.find("parent").get("link") == name]  # type: ignore[union-attr]
        for joint in leaving:
            child = joint.find("child").get("link")  # type: ignore[union-attr]
            there = pose @ _origin(joint)
            if joint.get("type") == "fixed":
                ahead.append((child, there))
            elif joint.get("type") in ("revolute", "continuous") and joint.find("mimic") is None:
                tip = (child, there, _numbers(joint.find("axis"), "xyz", "1 0 0"))
            else:
                raise ValueError(f"{file.name}: joint {joint.get('name')}")
        if not ahead:
            arm.solids.append(np.concatenate(parts))
            arm.fixed.append(held)
            parts, held = [], {}
            if "tip" in locals() and tip is not None:
                arm.joints.append((tip[1], tip[2]))
                arm.names.append(str(tip[0]))
                ahead, tip = [(tip[0], np.eye(4))], None
    return arm


def _numbers(element: ElementTree.Element | None, key: str, default: str) -> np.ndarray:
    return np.array([float(x) for x in (default if element is None else element.get(key, default)).split()])


def _origin(element: ElementTree.Element) -> np.ndarray:
    at = element.find("origin")
    roll, pitch, yaw = _numbers(at, "rpy", "0 0 0")
    x, y, z = np.eye(3)
    return moved(rotation(z, yaw) @ rotation(y, pitch) @ rotation(x, roll), _numbers(at, "xyz", "0 0 0"))


def _solid(link: ElementTree.Element, file: Path) -> np.ndarray:
    """Triangles of its visual bodies, or of its collision bodies where those are no STL."""
    for tag in ("visual", "collision"):
        found = []
        for body in link.findall(tag):
            shape = body.find("geometry")[0]  # type: ignore[index]
            if shape.tag == "mesh":
                path = _mesh_file(file, str(shape.get("filename")))
                if path is None:
                    break
                corners = _stl(path) * _numbers(shape, "scale", "1 1 1")
            elif shape.tag == "box":
                corners = _box() * _numbers(shape, "size", "")
            else:
                radius, length = (float(str(shape.get(key))) for key in ("radius", "length"))
                corners = _cylinder() * [radius, radius, length]
            found.append(placed(_origin(body), corners))
        else:
            if found:
                return np.concatenate(found)
    return np.zeros((0, 3, 3))


def _mesh_file(file: Path, name: str) -> Path | None:
    tail = name.rsplit("://", 1)[-1]
    if not tail.lower().endswith(".stl"):
        return None
    places = [Path(tail), *(above / tail for above in file.resolve().parents)]
    return next((place for place in places if place.is_file()), None)


def _stl(path: Path) -> np.ndarray:
    content = path.read_bytes()
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    return np.frombuffer(content[84:], record)["corners"].astype(float)


def _box() -> np.ndarray:
    found = []
    for axis in range(3):
        u, v = np.eye(3)[(axis + 1) % 3] / 2, np.eye(3)[(axis + 2) % 3] / 2
        for side in (-0.5, 0.5):
            c = side * np.eye(3)[axis]
            found += [[c - u - v, c + u - v, c + u + v], [c - u - v, c + u + v, c - u + v]]
    return np.array(found)


def _cylinder(sides: int = 24) -> np.ndarray:
    a = 2 * np.pi * np.arange(sides + 1) / sides
    low, high = (np.stack([np.cos(a), np.sin(a), np.full_like(a, z)], axis=1) for z in (-0.5, 0.5))
    top, foot = np.array([0, 0, 0.5]), np.array([0, 0, -0.5])
    found = []
    for k in range(sides):
        found += [[low[k], low[k + 1], high[k + 1]], [low[k], high[k + 1], high[k]]]
        found += [[top, high[k], high[k + 1]], [foot, low[k], low[k + 1]]]
    return np.array(found)


def draw_arm(folder: Path, chance: np.random.Generator) -> Path:
    """An arm of boxes and cylinders, its links of random sizes and offsets, as a URDF file."""
    size = chance.uniform(0.7, 1.6)
    length = size * np.array([0.35, 0.25, 0.75, 0.25, 0.65, 0.2, 0.1]) * chance.uniform(0.8, 1.25, 7)
    wide = size * np.array([0.40, 0.32, 0.22, 0.24, 0.16, 0.13, 0.09]) * chance.uniform(0.8, 1.25, 7)
    side = size * np.array([0, 0.05, 0.12, -0.08, 0.0, 0.05, 0.0]) * chance.uniform(0.5, 1.5, 7)
    axes = ("0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1")
    text = '<robot name="drawn">\n'
    for n in range(7):
        beam = f"{wide[n] * 0.8:.4f} {wide[n] * 0.6:.4f} {length[n]:.4f}"
        hub = f'radius="{wide[n] / 2:.4f}" length="{wide[n]:.4f}"'
        turned = "1.5708 0 0" if n < 6 and axes[n] == "0 1 0" else "0 0 0"
        text += f"""<link name="l{n}">
<inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="{0.1 * wide[n]:.4f} {side[n]:.4f} {length[n] / 2:.4f}"/>
<geometry><box size="{beam}"/></geometry></visual>
<visual><origin xyz="0 {side[n]:.4f} {length[n]:.4f}" rpy="{turned}"/>
<geometry><cylinder {hub}/></geometry></visual></link>
"""
        if n:
            text += f"""<joint name="j{n}" type="revolute"><parent link="l{n - 1}"/><child link="l{n}"/>
<origin xyz="0 {side[n - 1]:.4f} {length[n - 1]:.4f}"/><axis xyz="{axes[n - 1]}"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
"""
    file = folder / f"drawn_{chance.integers(10**9)}.urdf"
    file.write_text(text + "</robot>\n")
    return file


@dataclass
class Nodes:
    """The truth: link of each node, its place in the link's frame (n, 3) and in the base's frame, and the
    normal of the surface there, in the base's frame.
    """

    link: np.ndarray
    local: np.ndarray
    base: np.ndarray
    normal: np.ndarray


def draw_nodes(arm: Arm, angles: np.ndarray, count: int, chance: np.random.Generator) -> Nodes:
    """Nodes on surfaces that nothing covers, more on links with more of them, but some on each."""
    poses = arm.poses(angles)
    world = [placed(pose, solid) for pose, solid in zip(poses, arm.solids, strict=True)]
    every = np.concatenate(world)
    area = [np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1) for t in world]
    clouds = [
        _scattered(t, a, 4000, chance)[0] if len(t) else np.zeros((0, 3))
        for t, a in zip(world, area, strict=True)
    ]
    total = np.sqrt([a.sum() for a in area])
    height = chance.uniform(0, HEIGHT_M)
    links, places, normals = [], [], []
    while len(links) < count:
        link = int(chance.choice(len(world), p=total / total.sum()))
        where, normal = (one[0] for one in _scattered(world[link], area[link], 1, chance))
        if _covered(where, normal, every):
            normal = -normal
            if _covered(where, normal, every):
                continue
        others = np.concatenate([cloud for n, cloud in enumerate(clouds) if n != link])
        if np.min(np.linalg.norm(others - where, axis=1)) < CLEAR_M:
            continue
        links.append(link)
        places.append(where + height * normal)
        normals.append(normal)
    base = np.array(places)
    local = np.array([(p - poses[n][:3, 3]) @ poses[n][:3, :3] for p, n in zip(base, links, strict=True)])
    return Nodes(np.array(links), local, base, np.array(normals))


def _scattered(
    triangles: np.ndarray, area: np.ndarray, count: int, chance: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    some = triangles[chance.choice(len(triangles), count, p=area / area.sum())]
    u, v = np.sort(chance.random((2, count)), axis=0)
    places = some[:, 0] * u[:, None] + some[:, 1] * (v - u)[:, None] + some[:, 2] * (1 - v)[:, None]
    normal = np.cross(some[:, 1] - some[:, 0], some[:, 2] - some[:, 0])
    return places, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _covered(where: np.ndarray, way: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether a ray from a place meets a triangle (Moeller and Trumbore 1997)."""
    a, p, q = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    h = np.cross(way, q)
    det = np.einsum("nc,nc->n", p, h)
    with np.errstate(all="ignore"):  # triangles along the ray
        s = where + 1e-5 * way - a
        u = np.einsum("nc,nc->n", s, h) / det
        k = np.cross(s, p)
        v = k @ way / det
        far = np.einsum("nc,nc->n", q, k) / det
        met = (u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0) & (np.abs(det) > 1e-14)
    return bool(met.any())


def write_uff(file: Path, places: np.ndarray, unit: str, said: str) -> None:
    """Datasets 164 and 15 of places in a unit, where the file says another."""
    text = f"    -1\n   164\n{1:10d}{'units':20s}{2:10d}\n"
    text += f"{1 / UNITS[said]:25.17E}{1.0:25.17E}{1.0:25.17E}\n{273.15:25.17E}\n    -1\n    -1\n    15\n"
    for number, place in enumerate(places / UNITS[unit], start=1):
        text += f"{number:10d}{0:10d}{0:10d}{1:10d}" + "".join(f"{x:13.5E}" for x in place) + "\n"
    file.write_text(text + "    -1\n")


def draw(number: int, arm: Arm, chance: np.random.Generator, pairs: int, folder: Path) -> dict[str, Any]:
    """One geometry, drawn, laid on the robot and scored."""
    joints = len(arm.joints)
    stated = chance.uniform(-60, 60, joints)
    true = np.radians(stated + chance.normal(0, ANGLE_DEG, joints))
    nodes = draw_nodes(arm, true, int(chance.integers(25, 61)), chance)
    upright = chance.random() < 0.5
    turn = rotation(np.eye(3)[2] if upright else chance.normal(size=3), chance.uniform(-np.pi, np.pi))
    cloud = nodes.base @ turn.T + chance.uniform(-3, 3, 3) + chance.normal(0, NODE_M, nodes.base.shape)
    unit, said = chance.choice(list(UNITS), 2, replace=False)
    if chance.random() >= WRONG_UNIT:
        said = unit
    uff, out = folder / f"{number}.uff", folder / f"{number}.csv"
    write_uff(uff, cloud, unit, said)
    options: dict[str, Any] = {"posture": ",".join(f"{x:.3f}" for x in stated), "out": out}
    if pairs:
        options["pairs"] = _write_pairs(folder / f"{number}_pairs.csv", arm, nodes, pairs, chance)
    began = time.perf_counter()
    found = api.points(arm.file, [uff], **options)
    took = time.perf_counter() - began
    doubted = set(found.doubts or ()) | ({*range(1, len(cloud) + 1)} if _uncertain(found) else set())
    score = _score(arm, nodes, out, doubted)
    wrong = said != unit
    return {"arm": arm.file.stem, "nodes": len(cloud), "wrong_unit": bool(wrong), **score, "seconds": took}


def _uncertain(found: Any) -> bool:
    return bool(found.registration.rivals)


def _write_pairs(file: Path, arm: Arm, nodes: Nodes, count: int, chance: np.random.Generator) -> Path:
    """The widest of some random triples, as a person would choose them, roughly placed."""
    some = [chance.choice(len(nodes.link), count, replace=False) for _ in range(20)]
    rows = max(some, key=lambda r: _width(nodes.base[r]))
    with file.open("w") as stream:
        stream.write("node,name,link,x_m,y_m,z_m\n")
        for row in rows:
            x, y, z = nodes.local[row] + chance.normal(0, PAIR_M, 3)
            stream.write(f"{row + 1},,{arm.names[nodes.link[row]]},{x:.4f},{y:.4f},{z:.4f}\n")
    return file


def _width(places: np.ndarray) -> float:
    size = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    return float(size[1]) if len(places) > 2 else float(size[0])


def _score(arm: Arm, nodes: Nodes, out: Path, doubted: set[int]) -> dict[str, Any]:
    """Right links, of all nodes and of those that nothing was said of, and distances, mm."""
    with out.open() as stream:
        rows = {int(row["node"]): row for row in csv.DictReader(stream)}
    right, away, silent = [], [], []
    for n, link in enumerate(nodes.link):
        row = rows.get(n + 1)
        same = row is not None and row["link"] in arm.fixed[link]
        right.append(same)
        if row is not None and same:
            place = np.array([float(row[key]) for key in ("x_m", "y_m", "z_m")])
            there = placed(arm.fixed[link][row["link"]], place)
            away.append(1000 * float(np.linalg.norm(there - nodes.local[n])))
        if row is not None and n + 1 not in doubted:
            silent.append(same)
    return {
        "right": int(sum(right)),
        "away_mm": [round(x, 2) for x in away],
        "said_sure": len(silent),
        "sure_right": int(sum(silent)),
    }


def summary(drawn: list[dict[str, Any]]) -> dict[str, Any]:
    """The numbers that are aimed at."""
    away = np.concatenate([one["away_mm"] for one in drawn])
    medians = [float(np.median(one["away_mm"])) if one["away_mm"] else np.inf for one in drawn]
    return {
        "geometries": len(drawn),
        "nodes": int(sum(one["nodes"] for one in drawn)),
        "wrong_units": int(sum(one["wrong_unit"] for one in drawn)),
        "right_links": float(sum(one["right"] for one in drawn) / sum(one["nodes"] for one in drawn)),
        "right_links_where_sure": float(
            sum(one["sure_right"] for one in drawn) / max(sum(one["said_sure"] for one in drawn), 1)
        ),
        "sure": float(sum(one["said_sure"] for one in drawn) / sum(one["nodes"] for one in drawn)),
        "median_mm": float(np.median(away)),
        "p90_mm": float(np.quantile(away, 0.9)),
        "geometries_over_10_mm": int(sum(m > 10 for m in medians)),
        "seconds_median": float(np.median([one["seconds"] for one in drawn])),
    }


def main() -> None:
    """Draw, lay, score, print and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--robots", type=Path)
    parser.add_argument("--store", help="name of a file in tests/benchmarks/results")
    asked = parser.parse_args()
    chance = np.random.default_rng(asked.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arms = _arms(asked.robots, folder, chance)
        drawn = []
        for number in range(asked.count):
            one = draw(number, arms[number % len(arms)], chance, asked.pairs, folder)
            drawn.append(one)
            median = np.median(one["away_mm"]) if one["away_mm"] else np.nan
            print(
                f"{one['arm']:24s} {one['right']:3d} of {one['nodes']:3d} right, {median:6.1f} mm,"
                f" {one['seconds']:5.1f} s{', wrong unit' if one['wrong_unit'] else ''}",
                flush=True,
            )
    found = summary(drawn)
    print(json.dumps(found, indent=1))
    if asked.store:
        kept = {"seed": asked.seed, "pairs": asked.pairs, "summary": found, "drawn": drawn}
        (RESULTS / asked.store).write_text(json.dumps(kept, indent=1) + "\n")


def _arms(robots: Path | None, folder: Path, chance: np.random.Generator) -> list[Arm]:
    if robots is None:
        return [read_arm(draw_arm(folder, chance)) for _ in range(12)]
    found = []
    for file in sorted(robots.rglob("*.urdf")):
        try:
            arm = read_arm(file)
        except (ValueError, KeyError, OSError):
            continue
        if sum(len(solid) > 0 for solid in arm.solids) >= 5:
            found.append(arm)
    return found


if __name__ == "__main__":
    main()
