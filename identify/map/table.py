"""The CSV of a map."""

from __future__ import annotations

import csv
import io

import numpy as np

from identify.core.arrays import Array
from identify.results.map import LimitRows, PostureRows


def table_of(rows: PostureRows, limit: LimitRows | None = None) -> str:
    """The CSV of a map: a line per posture with units in the header; FRFs are in the HDF5 file alone."""
    heads, of_limit = _limit_columns(rows, limit)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    angles = [f"joint{joint}_deg" for joint in range(1, rows.posture_deg.shape[1] + 1)]
    modes = [
        f"mode{mode}_{what}"
        for mode in range(1, rows.frequency_hz.shape[1] + 1)
        for what in ("hz", "hz_low", "hz_high", "damping", "damping_low", "damping_high")
    ]
    static, peak = ([f"{what}_{axis}_m_per_n" for axis in "xyz"] for what in ("static", "peak"))
    writer.writerow(["name", *angles, "tool_x_m", "tool_y_m", "tool_z_m", *modes, *static, *peak, *heads])
    mode_columns = (
        rows.frequency_hz,
        rows.frequency_low_95,
        rows.frequency_high_95,
        rows.damping_ratio,
        rows.damping_low_95,
        rows.damping_high_95,
    )
    of_modes = np.stack(mode_columns, axis=2).reshape(len(rows.name), -1)
    diagonal = rows.compliance_m_per_n[:, range(3), range(3)]
    for name, numbers in zip(
        rows.name,
        np.hstack([rows.posture_deg, rows.tool_m, of_modes, diagonal, rows.peak_m_per_n, of_limit]),
        strict=True,
    ):
        writer.writerow([name, *("" if np.isnan(value) else f"{value:.9g}" for value in numbers)])
    return stream.getvalue()


def _limit_columns(rows: PostureRows, limit: LimitRows | None) -> tuple[list[str], Array]:
    """Heads and numbers (n, c) of a limit: of each feed, where there are several."""
    if limit is None:
        return [], np.zeros((len(rows.name), 0))
    unit = "hz" if limit.kind == "frequency" else "m"
    feeds = [f"_feed{angle:.0f}" if len(limit.feed_deg) > 1 else "" for angle in limit.feed_deg]
    heads = [f"{limit.kind}_{unit}{side}{feed}" for feed in feeds for side in ("", "_low", "_high")]
    columns = np.stack([limit.value, limit.low_95, limit.high_95], axis=-1)
    return heads, columns.reshape(len(rows.name), -1)
