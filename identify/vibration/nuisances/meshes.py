"""How far bodies that were made of meshes are from the true ones.

Measured on links of robots whose bodies are known (docs/mesh_bodies.md): 68 % of them lie
within these numbers.
"""

from __future__ import annotations

import numpy as np

from identify.robot.description import Link, Robot

MASS, INERTIA = (0.29, 0.6), (0.4, 0.8)
"""Of logarithms: of ordinary links, and of light ones."""
LIGHT = 0.05
"""Part of the moving mass below which a link is light."""
CENTRE = 0.2
"""Along each axis, over the radius of gyration: 6 % of the length of a link."""


def made_of_mesh(robot: Robot, link: Link) -> dict[str, float]:
    """Standard deviations of a link whose body was made of its mesh, by the keys of `uncertainty.links`."""
    moving = sum(one.mass for one in robot.links[1:])
    light = int(link.mass < LIGHT * moving)
    gyration = float(np.sqrt(max(float(np.trace(link.inertia)), 0.0) / (2 * link.mass)))
    return {"mass": MASS[light], "centre_m": CENTRE * gyration, "inertia": INERTIA[light]}
