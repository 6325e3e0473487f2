"""The forces of a cut and of a path."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.batch.posture_table import read_postures
from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text_input import csv_text
from identify.machining.engagement import Engagement
from identify.results.deflection import DeflectionRows

_FORCES = ("fx_n", "fy_n", "fz_n")


def mean_force(cut: Engagement, depth: float, feed_per_tooth: float) -> Array:
    """(3,), N, along feed, normal and spindle axis: of a cut at rest, averaged over a turn; depth and feed
    per tooth, m (Altintas, Manufacturing Automation, Eq. 2.22; the chip is feed_per_tooth sin phi thick).
    """
    phi = np.linspace(cut.entry, cut.exit, 2001)
    sin, cos, zero = np.sin(phi), np.cos(phi), np.zeros_like(phi)
    edges = cut.cutting.tangential_edge * np.stack([-cos, sin, zero], axis=-1)
    edges += cut.cutting.radial_edge * np.stack([-sin, -cos, zero], axis=-1)
    each = cut.factors(phi) @ np.array([feed_per_tooth, 0.0, 0.0]) + edges
    return np.asarray(depth * cut.teeth / (2 * np.pi) * np.trapezoid(each, phi, axis=0))


def parse_force(text: str) -> Array:
    """(3,), N, from `FX,FY,FZ`; InputError for another text."""
    try:
        force = np.array([float(part) for part in text.split(",")])
    except ValueError:
        force = np.array([])
    if force.shape != (3,) or not np.isfinite(force).all():
        raise InputError(
            "--force", repr(text), "FX,FY,FZ in newtons along the base's axes, such as 100,0,-50"
        )
    return force


def read_path(path: Path, joints: int) -> tuple[list[str], Array, Array]:
    """Names, postures (n, joints), rad, and forces (n, 3), N, of a CSV with joint1_deg, ..., fx_n, fy_n,
    fz_n, and name if wanted; InputError for another one.
    """
    return read_postures(path, joints, _FORCES)


def path_text(rows: DeflectionRows) -> str:
    """The compensated path as CSV: per place the joint angles and tip to command, and what was expected."""
    angles = [f"joint{joint}_deg" for joint in range(1, rows.posture_deg.shape[1] + 1)]
    heads = [f"{what}_{axis}" for what in ("target", "wanted") for axis in ("x_m", "y_m", "z_m")]
    moved = [f"deflection{which}_{axis}_m" for which in ("", "_low", "_high") for axis in "xyz"]
    columns = (
        rows.target_deg,
        rows.target_m,
        rows.tip_m,
        rows.force_n,
        rows.deflection_m,
        rows.low_95,
        rows.high_95,
    )
    lines = (
        [name, *(f"{value:.9g}" for value in numbers)]
        for name, numbers in zip(rows.name, np.hstack(columns), strict=True)
    )
    return csv_text([["name", *angles, *heads, *_FORCES, *moved], *lines])
