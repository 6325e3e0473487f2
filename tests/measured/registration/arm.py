"""An arm of boxes and cylinders, and a universal file with the geometry of a test on it, in another frame."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.registration import Arm, Nodes, draw_arm, draw_nodes, read_arm, rotation, write_uff

COUNT = 40


@dataclass(frozen=True)
class Test:
    """A robot, stated angles in degrees, where nodes 1, 2, ... really are, and the file of their geometry."""

    __test__ = False
    arm: Arm
    stated: np.ndarray
    nodes: Nodes
    uff: Path

    @property
    def posture(self) -> str:
        """As the command line takes it."""
        return ",".join(f"{angle:.3f}" for angle in self.stated)

    def pairs(self, folder: Path, rows: list[int], off_m: float = 0.03) -> Path:
        """A points file of some nodes, that far off along each axis."""
        lines = ["node,name,link,x_m,y_m,z_m"]
        for row in rows:
            x, y, z = self.nodes.local[row] + off_m * np.array([1, -1, 1])
            lines.append(f"{row + 1},,{self.arm.names[self.nodes.link[row]]},{x:.4f},{y:.4f},{z:.4f}")
        (folder / "pairs.csv").write_text("\n".join(lines) + "\n")
        return folder / "pairs.csv"


def simulated(folder: Path, seed: int, unit: str = "m", said: str = "m", off_deg: float = 3.0) -> Test:
    """Angles of alternating sign off; the file says a unit that may be wrong."""
    chance = np.random.default_rng(seed)
    arm = read_arm(draw_arm(folder, chance))
    stated = chance.uniform(-50, 50, 6)
    true = np.radians(stated + off_deg * np.array([1, -1, 1, -1, 1, -1]))
    nodes = draw_nodes(arm, true, COUNT, chance)
    cloud = nodes.base @ rotation(np.array([0.2, -0.3, 1.0]), 2.0).T + [1.0, -2.0, 0.5]
    cloud += chance.normal(0, 0.001, cloud.shape)
    write_uff(folder / "test.uff", cloud, unit, said)
    return Test(arm, stated, nodes, folder / "test.uff")


def widest(nodes: Nodes) -> list[int]:
    """Three nodes far from each other."""
    first = int(np.argmax(np.linalg.norm(nodes.base - nodes.base.mean(axis=0), axis=1)))
    second = int(np.argmax(np.linalg.norm(nodes.base - nodes.base[first], axis=1)))
    line = nodes.base[second] - nodes.base[first]
    third = int(np.argmax(np.linalg.norm(np.cross(nodes.base - nodes.base[first], line), axis=1)))
    return [first, second, third]
