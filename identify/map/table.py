"""The CSV of a map."""

from __future__ import annotations

import csv
import io

import numpy as np

from identify.core.arrays import Array
from identify.results.map import CorrectionRows, LimitRows, PostureRows


def table_of(
    rows: PostureRows, limit: LimitRows | None = None, correction: CorrectionRows | None = None
) -> str:
    """The CSV of a map: a line per posture with units in the header; FRFs are in the HDF5 file alone."""
    (heads, of_limit), (more, moved) = _limit_columns(rows, limit), _corrected_columns(rows, correction)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    angles = [f"joint{joint}_deg" for joint in range(1, rows.posture_deg.shape[1] + 1)]
    modes = [
        f"mode{mode}_{what}"
        for mode in range(1, rows.frequency_hz.shape[1] + 1)
        for what in ("hz", "hz_low", "hz_high", "damping", "damping_low", "damping_high")
    ]
    static, peak = ([f"{what}_{axis}_m_per_n" for axis in "xyz"] for what in ("static", "peak"))
    writer.writerow(
        ["name", *angles, "tool_x_m", "tool_y_m", "tool_z_m", *modes, *static, *peak, *heads, *more]
    )
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
        np.hstack([rows.posture_deg, rows.tool_m, of_modes, diagonal, rows.peak_m_per_n, of_limit, moved]),
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


def _corrected_columns(rows: PostureRows, correction: CorrectionRows | None) -> tuple[list[str], Array]:
    """Heads and numbers (n, c) of what was corrected by measured postures."""
    if correction is None:
        return [], np.zeros((len(rows.name), 0))
    c = correction
    modes = range(1, rows.frequency_hz.shape[1] + 1)
    of = {
        **{f"mode{mode}_hz": (c.frequency_hz, c.frequency_low_95, c.frequency_high_95) for mode in modes},
        **{f"mode{mode}_damping": (c.damping_ratio, c.damping_low_95, c.damping_high_95) for mode in modes},
        **{f"peak_{axis}_m_per_n": (c.peak_m_per_n, c.peak_low_95, c.peak_high_95) for axis in "xyz"},
    }
    heads = [f"corrected_{name}{side}" for name in of for side in ("", "_low", "_high")]
    numbers = [(*modes, *modes, 1, 2, 3)[k] - 1 for k in range(len(of))]
    columns = [one[:, at] for at, sides in zip(numbers, of.values(), strict=True) for one in sides]
    return heads, np.stack(columns, axis=1)
