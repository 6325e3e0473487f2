"""What several kinds of results hold: parameters, starts, geometry, modes, settings, provenance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex, Texts


@dataclass(frozen=True)
class ParameterTable:
    """All parameters (p of them), fixed ones too; std on the search scale (ln value where log), NaN where
    fixed.
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
class Geometry:
    """Where things are at a posture, in the base's axes, m: points (n, 3) with their nodes, and the skeleton
    of joint origins (k, 3).

    segments (j, 2): rows of points that a measurement's trace lines join; axes (n, 3, 3): rows are the
    directions of the channels X, Y and Z of each point, None in files written before they were kept, as are
    skeleton_links (k - 1,): the link that lies between each place of the skeleton and the next.
    """

    nodes: NDArray[np.int_]
    point_names: Texts
    point_links: Texts
    points: Array
    skeleton: Array
    segments: NDArray[np.int_] | None = None
    axes: Array | None = None
    skeleton_links: Texts | None = None


@dataclass(frozen=True)
class Modes:
    """Modes of the model (m): frequency, damping ratio, shapes at the points (m, n, 3) and at the skeleton
    (m, k, 3), base axes.
    """

    frequency_hz: Array
    damping_ratio: Array
    point_shapes: Complex
    skeleton_shapes: Complex


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
