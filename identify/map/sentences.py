"""What is said of a map."""

from __future__ import annotations

import numpy as np

from identify.core.text import count
from identify.results.fit import FitResult
from identify.results.map import Learnt, LimitRows, MapResult, PostureRows
from identify.vibration.notes import of_fit

_NAMES = {"depth": "depth limit", "deflection": "static deflection", "frequency": "frequency of mode 1"}
_HOLDS = {
    "depth": "include the misfit, but not other lobes: see `identify stability` where it matters",
    "deflection": "include the misfit, too",
    "frequency": "include the noise only, too",
}


_QUANTITIES = {"frequency": "natural frequencies", "damping": "damping ratios", "peak": "peaks of the tool"}


def verdict(result: MapResult) -> tuple[str, ...]:
    """How many postures, what the modes do, where the tool is softest, the best and the worst place, and what
    measured postures say of it.
    """
    rows, limit, seconds, about = result.rows, result.limit, result.seconds, result.workers
    first, damping, peak = (
        rows.frequency_hz[:, 0],
        100 * rows.damping_ratio[:, 0],
        rows.peak_m_per_n.max(axis=1),
    )
    weak = int(np.argmax(peak))
    done = f"{len(rows.name)} postures were mapped in {seconds:.1f} s on {about}."
    between = (
        f"The first mode lies between {np.nanmin(first):.2f} and {np.nanmax(first):.2f} Hz, its damping"
        f" between {np.nanmin(damping):.2g} "
    )
    angles = ", ".join(f"{angle:.4g}" for angle in rows.posture_deg[weak])
    softest = (
        f"The tool is most compliant at {rows.name[weak]} ({angles})°: {1e6 * peak[weak]:.3g} µm/N at a"
        " resonance, along the most compliant axis of the base."
    )
    of_limit = () if limit is None else best_and_worst(rows, limit)
    told = () if result.learnt is None else tuple(map(str, of_processes(result.learnt)))
    return done, *of_limit, f"{between}and {np.nanmax(damping):.2g} %.", softest, *told


def of_processes(learnt: Learnt) -> list[str]:
    """Of each quantity, whether the map is corrected, and what leaving measured postures out says of it."""
    table = learnt.processes
    said, silent = list[str](), list[str]()
    for row, quantity in enumerate(table.quantity):
        name, chance = _QUANTITIES[quantity], 1 / (1 + np.exp(-table.log_odds[row]))
        if chance > 0.5:
            postures, told = _postures(learnt, row), _left_out(learnt, quantity)
            said.append(f"The {name} are corrected by {postures} (probability {chance:.2g}){told}.")
        else:
            silent.append(f"{name} (probability {chance:.2g}, scatter {100 * table.scatter[row]:.2g} %)")
    if silent:
        postures = _postures(learnt, int(np.argmax(table.postures)))
        said.append(
            f"Whether errors go with the posture is not determined by {postures}: {', '.join(silent)}."
        )
    return said


def _postures(learnt: Learnt, row: int) -> str:
    return count(int(learnt.processes.postures[row]), "measured posture")


def _left_out(learnt: Learnt, quantity: str) -> str:
    """How well each measured posture is predicted by the others."""
    table = learnt.left_out
    kept = np.array(table.quantity) == quantity
    if not kept.any():
        return ""
    right = table.measured[kept]
    before, after = (
        100 * np.sqrt(np.mean(np.log(right / one[kept]) ** 2)) for one in (table.model, table.corrected)
    )
    inside = int(np.sum((table.low_95[kept] <= right) & (right <= table.high_95[kept])))
    return (
        f": predicted by the others alone, each is off by {after:.3g} % in place of {before:.3g} %, and"
        f" {inside} of {len(right)} numbers lie in their 95 % intervals"
    )


def best_and_worst(rows: PostureRows, limit: LimitRows) -> tuple[str, ...]:
    """Where a limit is best and where worst: depths and frequencies are the better the larger they are."""
    value = np.where(np.isnan(limit.value), np.inf, limit.value)
    order = np.argsort(value if limit.kind == "deflection" else -value, axis=None, kind="stable")
    feeds = len(limit.feed_deg)
    best, worst = (divmod(int(order[k]), feeds) for k in (0, -1))
    said = [
        f"The {_NAMES[limit.kind]} of {limit.about} is best at {_place(rows, limit, *best)}, and worst at"
        f" {_place(rows, limit, *worst)}."
    ]
    if len(limit.feed_deg) > 1:
        gain = value.max(axis=1) / value.min(axis=1)
        said.append(
            f"The best feed cuts {np.median(gain):.3g} times deeper than the worst at the median place."
        )
    return tuple(said)


def _place(rows: PostureRows, limit: LimitRows, row: int, feed: int) -> str:
    tip = ", ".join(f"{one:.3f}" for one in rows.tool_m[row])
    turned = f", feed turned by {limit.feed_deg[feed]:.0f}°" if len(limit.feed_deg) > 1 else ""
    return f"{rows.name[row]} (tip at {tip} m{turned}): {amount(limit, row, feed)}"


def amount(limit: LimitRows, row: int, feed: int) -> str:
    """A limit with its 95 % interval, in mm, µm or Hz."""
    scale, unit = {"depth": (1e3, "mm"), "deflection": (1e6, "µm"), "frequency": (1.0, "Hz")}[limit.kind]
    value, low, high = (scale * one[row, feed] for one in (limit.value, limit.low_95, limit.high_95))
    if np.isinf(value):
        return f"none up to {scale * limit.most:.3g} {unit}"
    return f"{value:.4g} {unit} (95 % interval {low:.4g} to {high:.4g} {unit})"


def notes(fit: FitResult, result: MapResult) -> tuple[str, ...]:
    """What a reader must be warned of."""
    limit = result.limit
    said = [
        *of_fit(fit),
        "intervals include the noise of the fitted data, but not what is missing from the model",
    ]
    if result.learnt is not None:
        said.append("those of corrected values include the errors of the model that measured postures show")
    if limit is not None:
        said.append(f"those of the {_NAMES[limit.kind]} {_HOLDS[limit.kind]}")
    return tuple(said)
