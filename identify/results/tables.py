"""What several kinds of results hold: parameters, starts, geometry, modes, settings, provenance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Texts


@dataclass(frozen=True)
class ParameterTable:
    """All parameters (p of them), fixed ones too; std on the search scale (ln value where log), NaN where
    fixed.  The limits may be wider: they hold what the ends of links that bend leave open of joints, too.
    """

    name: Annotated[Texts, "name"]
    unit: Annotated[Texts, "name"]
    initial: Annotated[Array, "name", "$unit"]
    value: Annotated[Array, "name", "$unit"]
    lower: Annotated[Array, "name", "$unit"]
    upper: Annotated[Array, "name", "$unit"]
    log: Annotated[NDArray[np.bool_], "name"]
    free: Annotated[NDArray[np.bool_], "name"]
    std: Annotated[Array, "name", "see log"]
    low_95: Annotated[Array, "name", "$unit"]
    high_95: Annotated[Array, "name", "$unit"]
    status: Annotated[Texts, "name"]


@dataclass(frozen=True)
class StartTable:
    """One row per start: initial and final values (starts, p), cost, evaluations, seconds, and how it
    ended.
    """

    initial: Annotated[Array, "start parameter", "see parameters/unit"]
    final: Annotated[Array, "start parameter", "see parameters/unit"]
    cost: Annotated[Array, "start"]
    evaluations: Annotated[Array, "start"]
    seconds: Annotated[Array, "start"]
    converged: Annotated[NDArray[np.bool_], "start"]
    sentence: Annotated[Texts, "start"]


@dataclass(frozen=True)
class Bodies:
    """What the links of a robot look like at a posture: triangles (t, 3), rows of vertices (v, 3), m, each in
    the axes of its link, by number (v,); of the links their names and poses (b, 4, 4) in the base's axes.

    bare (k - 1,): parts of the skeleton for which no triangles stand; missing: why, in sentences.
    """

    links: Annotated[Texts, "links"]
    pose: Annotated[Array, "links row column"]
    vertices: Annotated[Array, "vertex axis", "m"]
    of_link: Annotated[NDArray[np.int_], "vertex"]
    triangles: Annotated[NDArray[np.int_], "triangle corner"]
    bare: Annotated[NDArray[np.bool_], "skeleton_part"]
    missing: Annotated[Texts, "missing"] = ()

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

    nodes: Annotated[NDArray[np.int_], "nodes"]
    point_names: Annotated[Texts, "nodes"]
    point_links: Annotated[Texts, "nodes"]
    points: Annotated[Array, "nodes axis", "m"]
    skeleton: Annotated[Array, "skeleton_place axis", "m"]
    segments: Annotated[NDArray[np.int_] | None, "segment end"] = None
    axes: Annotated[Array | None, "nodes direction axis"] = None
    skeleton_links: Annotated[Texts | None, "skeleton_part"] = None
    bodies: Bodies | None = None


@dataclass(frozen=True)
class Modes:
    """Modes of the model (m): frequency, damping ratio, shapes at the points (m, n, 3) and at the skeleton
    (m, k, 3), base axes; of each drawn body (m, b, 6) the shift of its middle and its turn, base axes.
    """

    frequency_hz: Annotated[Array, "frequency_hz"]
    damping_ratio: Annotated[Array, "frequency_hz"]
    point_shapes: Annotated[Complex, "frequency_hz point axis"]
    skeleton_shapes: Annotated[Complex, "frequency_hz skeleton_place axis"]
    body_shapes: Annotated[Complex | None, "frequency_hz body shift_and_turn"] = None


@dataclass(frozen=True)
class SettingTable:
    """Every setting of a run: its key, its value as text, and where the value came from
    (`identify.results.setting_table`).
    """

    key: Annotated[Texts, "key"]
    value: Annotated[Texts, "key"]
    source: Annotated[Texts, "key"]


@dataclass(frozen=True)
class Provenance:
    """Where a result comes from; settings: None in files written before they were kept."""

    identify: str
    python: str
    platform: str
    packages: Annotated[Texts, "package"]
    written: str
    config_path: str
    config_sha256: str
    config: str
    input_files: Annotated[Texts, "input_files"]
    input_sha256: Annotated[Texts, "input_files"]
    settings: SettingTable | None = None
