"""A planar three-joint arm for batches: its FRFs from closed forms written here, with noise, and the files
that a user would have.

All axes are vertical, so gravity has no part.  Links are rods along their x axis; at every joint a spring and
a damper.

    M = sum m_i Jc_i' Jc_i + I_i w_i w_i',   H = s^2 J_out (K + s C + s^2 M)^-1 J_in'
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

LENGTH, MASS = np.array([0.5, 0.4, 0.3]), np.array([20.0, 12.0, 8.0])
INERTIA = MASS * LENGTH**2 / 12
STIFFNESS, DAMPING = np.array([4.0e5, 1.5e5, 4.0e4]), np.array([120.0, 40.0, 10.0])
NODES = {1: (2, 0.4), 2: (3, 0.3)}
"""Node: (link, place along it, m)."""
NOISE = 0.02
LINES = np.linspace(4.0, 64.0, 61)
Law = Callable[[np.ndarray], np.ndarray]


def constant(q: np.ndarray) -> np.ndarray:
    """The stiffness of the joints at a posture q (3,), rad: the same everywhere."""
    return STIFFNESS


def with_posture(q: np.ndarray) -> np.ndarray:
    """One that depends on posture: joint 2 is 15 % stiffer for every radian of joint 3."""
    return STIFFNESS * np.array([1.0, 1.0 + 0.15 * q[2], 1.0])


def postures(count: int, seed: int = 1) -> np.ndarray:
    """Random postures (count, 3), rad, away from the stretched arm."""
    return np.random.default_rng(seed).uniform([-1.5, 0.4, -1.2], [1.5, 1.6, 1.2], (count, 3))


def _jacobian(q: np.ndarray, link: int, along: float) -> np.ndarray:
    """(2, 3): motion of a point on a link (from 1) in the base's axes."""
    angles = np.cumsum(q)
    joints = np.vstack(
        [np.zeros(2), np.cumsum(LENGTH[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1), axis=0)]
    )
    point = joints[link - 1] + along * np.array([np.cos(angles[link - 1]), np.sin(angles[link - 1])])
    away = point - joints[:link]
    columns = np.zeros((2, 3))
    columns[:, :link] = np.stack([-away[:, 1], away[:, 0]])
    return columns


def mass_matrix(q: np.ndarray) -> np.ndarray:
    """(3, 3), kg m^2."""
    total = np.zeros((3, 3))
    for link in range(1, 4):
        centre = _jacobian(q, link, LENGTH[link - 1] / 2)
        turns = (np.arange(3) < link).astype(float)
        total += MASS[link - 1] * centre.T @ centre + INERTIA[link - 1] * np.outer(turns, turns)
    return total


def channels(q: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Names and rows (4, 3) of the channels, which look along x and y of their link."""
    names, rows = [], []
    for node, (link, along) in NODES.items():
        angle = np.sum(q[:link])
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        rows.append(turn @ _jacobian(q, link, along))
        names += [f"{node}:+X", f"{node}:+Y"]
    return names, np.concatenate(rows)


def accelerance(q: np.ndarray, law: Law = constant) -> np.ndarray:
    """(lines, 4, 2): all channels by forces at the tool along its x and y, m/s^2/N."""
    _, rows = channels(q)
    s = 2j * np.pi * LINES[:, None, None]
    z = np.diag(law(q)) + s * np.diag(DAMPING) + s**2 * mass_matrix(q)
    return np.asarray(s**2 * (rows @ np.linalg.solve(z, np.broadcast_to(rows[2:].T, (len(LINES), 3, 2)))))


def frf_csv(q: np.ndarray, law: Law, rng: np.random.Generator) -> str:
    """A measurement in the long layout, with noise in proportion to the RMS of each FRF."""
    h, (names, _) = accelerance(q, law), channels(q)
    size = np.sqrt(np.mean(np.abs(h) ** 2, axis=0))
    h = h + NOISE / np.sqrt(2) * size * (rng.normal(size=h.shape) + 1j * rng.normal(size=h.shape))
    lines = ["# unit: m/s^2/N", "frequency_hz,output,input,real,imag"]
    for output, out in enumerate(names):
        for entry, force in enumerate(names[2:]):
            lines += [
                f"{f:.6g},{out},{force},{v.real:.9g},{v.imag:.9g}"
                for f, v in zip(LINES, h[:, output, entry], strict=True)
            ]
    return "\n".join(lines) + "\n"


def urdf() -> str:
    """The arm as a user describes it."""
    parts = ['<robot name="planar">', '<link name="base"/>']
    for n in range(3):
        low = 0.01 * INERTIA[n]
        inertial = f'<origin xyz="{LENGTH[n] / 2} 0 0"/><mass value="{MASS[n]}"/>'
        inertia = f'<inertia ixx="{low}" iyy="{INERTIA[n]}" izz="{INERTIA[n]}" ixy="0" ixz="0" iyz="0"/>'
        parts.append(f'<link name="link{n + 1}"><inertial>{inertial}{inertia}</inertial></link>')
        parent, at = ("base", 0.0) if n == 0 else (f"link{n}", LENGTH[n - 1])
        ends = (
            f'<parent link="{parent}"/><child link="link{n + 1}"/><origin xyz="{at} 0 0"/><axis xyz="0 0 1"/>'
        )
        limit = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
        parts.append(f'<joint name="joint{n + 1}" type="revolute">{ends}{limit}</joint>')
    return "\n".join([*parts, "</robot>"])


def write_study(
    folder: Path, angles: np.ndarray, law: Law = constant, seed: int = 1, starts: int = 1
) -> Path:
    """The base study, without measurements, its robot and points, a file of FRFs per posture (p01.csv, ...)
    and a table of them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(urdf())
    points = [f"{node},p{node},link{link},{along},0,0" for node, (link, along) in NODES.items()]
    (folder / "points.csv").write_text("\n".join(["node,name,link,x_m,y_m,z_m", *points]))
    rows = ["file,joint1_deg,joint2_deg,joint3_deg"]
    for number, q in enumerate(angles, 1):
        name = f"p{number:0{len(str(len(angles)))}d}.csv"
        (folder / name).write_text(frf_csv(q, law, np.random.default_rng([seed, number])))
        rows.append(f"{name},{','.join(f'{a:.6f}' for a in np.rad2deg(q))}")
    (folder / "postures.csv").write_text("\n".join(rows))
    (folder / "study.yaml").write_text(STUDY.format(starts=starts))
    return folder / "study.yaml"


STUDY = """schema: identify/1   # the base of a batch: its measurements are those of the batch
name: planar
robot: {{urdf: robot.urdf}}
points: points.csv
starts: {starts}
effects:
  - kind: joint-compliance
    axes: [rz]
    stiffness: {{initial: [3.0e5, 2.0e5, 5.0e4], bounds: [1.0e3, 1.0e7]}}
    damping: {{initial: [80.0, 60.0, 15.0], bounds: [0.1, 1.0e4]}}
"""


def write_batch(folder: Path, lines: Sequence[str] = ()) -> Path:
    """batch.yaml over the table; further lines are added to it."""
    each = f"each: {{noise: {{relative: {NOISE}}}}}"
    path = folder / "batch.yaml"
    path.write_text(
        "\n".join(
            [
                "schema: identify-batch/1",
                "name: planar",
                "study: study.yaml",
                "table: postures.csv",
                each,
                *lines,
            ]
        )
        + "\n"
    )
    return path
