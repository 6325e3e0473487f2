"""What several kinds of results hold: parameters, starts, geometry, modes, settings, provenance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Texts


@dataclass(frozen=True)
class ParameterTable:
    """All parameters (p of them), fixed ones too; std on the search scale (ln value where log), NaN where
    fixed.  The limits may be wider: they hold what the ends of links that bend leave open of joints, too.
    """

    name: Texts
    unit: Texts
    initial: Array
    value: Array
    lower: Array
    upper: Array
    log: NDArray[np.bool_]
    free: NDArray[np.bool_]
    std: Array
    low_95: Array
    high_95: Array
    status: Texts


@dataclass(frozen=True)
class StartTable:
    """One row per start: initial and final values (starts, p), cost, evaluations, seconds, and how it
    ended.
    """

    initial: Array
    final: Array
    cost: Array
    evaluations: Array
    seconds: Array
    converged: NDArray[np.bool_]
    sentence: Texts


@dataclass(frozen=True)
class Bodies:
    """What the links of a robot look like at a posture: triangles (t, 3), rows of vertices (v, 3), m, each in
    the axes of its link, by number (v,); of the links their names and poses (b, 4, 4) in the base's axes.

    bare (k - 1,): parts of the skeleton for which no triangles stand; missing: why, in sentences.
    """

    links: Texts
    pose: Array
    vertices: Array
    of_link: NDArray[np.int_]
    triangles: NDArray[np.int_]
    bare: NDArray[np.bool_]
    missing: Texts = ()

    @property
    def placed(self) -> Array:
        """(v, 3): the vertices in the base's axes."""
        pose = self.pose[self.of_link]
        return np.asarray(np.einsum("vij,vj->vi", pose[:, :3, :3], self.vertices) + pose[:, :3, 3])

    @property
    def middle(self) -> Array:
        """(b, 3): the middle of the vertices of each link, in the base's axes."""
        count = np.bincount(self.of_link, minlength=len(self.links))
        sums = [np.bincount(self.of_link, axis, len(self.links)) for axis in self.placed.T]
        return np.stack(sums, axis=1) / np.maximum(count, 1)[:, None]


@dataclass(frozen=True)
class Geometry:
    """Where things are at a posture, in the base's axes, m: points (n, 3) with their nodes, and the skeleton
    of joint origins (k, 3).

    segments (j, 2): rows of points that a measurement's trace lines join; axes (n, 3, 3): rows are the
    directions of the channels X, Y and Z of each point, None in files written before they were kept, as are
    skeleton_links (k - 1,): the link that lies between each place of the skeleton and the next; bodies: what
    the links look like, where the robot's description says it.
    """

    nodes: NDArray[np.int_]
    point_names: Texts
    point_links: Texts
    points: Array
    skeleton: Array
    segments: NDArray[np.int_] | None = None
    axes: Array | None = None
    skeleton_links: Texts | None = None
    bodies: Bodies | None = None


@dataclass(frozen=True)
class Modes:
    """Modes of the model (m): frequency, damping ratio, shapes at the points (m, n, 3) and at the skeleton
    (m, k, 3), base axes; of each drawn body (m, b, 6) the shift of its middle and its turn, base axes.
    """

    frequency_hz: Array
    damping_ratio: Array
    point_shapes: Complex
    skeleton_shapes: Complex
    body_shapes: Complex | None = None


@dataclass(frozen=True)
class SettingTable:
    """Every setting of a run: its key, its value as text, and where the value came from
    (`identify.results.setting_table`).
    """

    key: Texts
    value: Texts
    source: Texts


@dataclass(frozen=True)
class Provenance:
    """Where a result comes from; settings: None in files written before they were kept."""

    identify: str
    python: str
    platform: str
    packages: Texts
    written: str
    config_path: str
    config_sha256: str
    config: str
    input_files: Texts
    input_sha256: Texts
    settings: SettingTable | None = None
