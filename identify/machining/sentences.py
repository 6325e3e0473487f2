"""What is said of depth limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.machining.coupled import substructure
from identify.machining.tool import Tool
from identify.results.fit import FitResult
from identify.results.stability import DepthLimits, LimitChecks
from identify.vibration.fitted_model import FittedModel
from identify.vibration.notes import of_fit, of_gap


def verdict(
    limits: DepthLimits, checks: LimitChecks, coupling: Array, most: float, *, uneven: bool = False
) -> tuple[str, ...]:
    """What was found: the depth that is stable at all speeds, the best speed, mode coupling, and how well the
    methods agree; uneven: teeth at uneven angles.
    """
    agreement = _of_uneven(limits, checks) if uneven else _agreement(checks)
    over = f"From {limits.rpm[0]:,.0f} to {limits.rpm[-1]:,.0f} rpm the cut is stable"
    if np.isinf(limits.depth_m).all():
        first = f"{over} up to {1e3 * most:.3g} mm, the largest depth."
        return first, _coupled(coupling, most), agreement
    worst, best = int(np.argmin(limits.depth_m)), int(np.argmax(limits.low_95))
    first = (
        f"{over} at every speed up to {_mm(limits, worst, most)}; the least limit is at"
        f" {limits.rpm[worst]:,.0f} rpm, where the tool chatters at {limits.chatter_hz[worst]:.4g} Hz."
    )
    second = f"The deepest stable cut is at {limits.rpm[best]:,.0f} rpm: {_mm(limits, best, most)}."
    return first, second, _coupled(coupling, limits.depth_m[best]), agreement


def _mm(limits: DepthLimits, row: int, most: float) -> str:
    if np.isinf(limits.depth_m[row]):
        return f"no limit up to {1e3 * most:.3g} mm, the largest depth"
    depth, low, high = 1e3 * np.array([limits.depth_m[row], limits.low_95[row], limits.high_95[row]])
    return f"{depth:.3g} mm (95 % interval {low:.3g} to {high:.3g} mm)"


def _coupled(coupling: Array, deepest: float) -> str:
    """Mode coupling, beside the deepest stable cut, m."""
    depth, low, high, hz = coupling
    if np.isinf(depth):
        return "Mode coupling, without regeneration, limits no depth."
    how = "pulls the tool in without oscillating" if hz == 0 else f"begins at {hz:.4g} Hz"
    return (
        f"Mode coupling, without regeneration, {how} from {1e3 * depth:.3g} mm"
        f" (95 % interval {1e3 * low:.3g} to {1e3 * high:.3g} mm){_beside(depth, deepest)}."
    )


def _beside(depth: float, deepest: float) -> str:
    """Why cuts may be stable beyond the limit of mode coupling; empty where none are."""
    if deepest <= depth:
        return ""
    return (
        "; deeper cuts are stable only at speeds where the wave left by the last tooth stabilises them, and"
        " not where a tooth meets no wave"
    )


def _agreement(checks: LimitChecks) -> str:
    """How far the methods are apart."""
    apart = _apart(checks.multi_frequency, checks.zeroth_order)
    zeroth = f"the mean of the cut alone (zeroth order) is up to {100 * apart:.2g} % off"
    if checks.semi_discretization is None:
        return f"The limits are those of the multi-frequency solution; {zeroth}."
    between = _apart(checks.multi_frequency, checks.semi_discretization)
    return (
        f"Semi-discretisation and multi-frequency solution agree within {100 * between:.2g} % at"
        f" {len(checks.rpm)} speeds; {zeroth}."
    )


def _of_uneven(limits: DepthLimits, checks: LimitChecks) -> str:
    """How far the search over all frequencies is from the limits, those near the mean of the cut."""
    at = np.searchsorted(limits.rpm, checks.rpm)
    between = _apart(checks.multi_frequency, limits.depth_m[at])
    return (
        "The teeth are at uneven angles: the limits are looked for near those of the mean of the cut, and a"
        f" search with all harmonics comes within {100 * between:.2g} % at {len(checks.rpm)} speeds."
    )


def _apart(one: Array, other: Array) -> float:
    """Largest relative difference where both are finite."""
    both = np.isfinite(one) & np.isfinite(other)
    return float(np.max(np.abs(one[both] / other[both] - 1), initial=0.0))


def of_robot(fit: FitResult) -> tuple[str, ...]:
    """What a reader must be warned of a fit."""
    gap = of_gap(
        fit.gap, "which the bands include as errors of the stiffnesses, independent at each frequency"
    )
    return (*of_fit(fit), *gap)


def of_limits(
    limits: DepthLimits, band_hz: tuple[float, float] | None, tool: Tool, *, robot: bool
) -> tuple[str, ...]:
    """What a reader must be warned of the limits and their bands, where data are of a band; robot: whether
    angles of joints are in them.
    """
    said, unsure = list[str](), tool.uncertainty
    chatter = limits.chatter_hz[np.isfinite(limits.chatter_hz)]
    if band_hz is not None and chatter.size:
        outside = np.mean((chatter < band_hz[0]) | (chatter > band_hz[1]))
        if outside > 0:
            said.append(
                f"at {100 * outside:.2g} % of the speeds the chatter lies outside the"
                f" {'fitted' if robot else 'measured'} band ({band_hz[0]:g} to {band_hz[1]:g} Hz), where no"
                f" data speak for the {'model' if robot else 'tip'}"
            )
    stated = [("cutting coefficients", unsure.coefficients)]
    stated += [("joint angles", unsure.posture_deg)] if robot else []
    if exact := [what for what, std in stated if std == 0]:
        said.append(
            f"the bands take {' and '.join(exact)} as exact: state their standard deviations"
            " under `uncertainty`"
        )
    said.append(
        "the cut is linear: without run-out, process damping, teeth that leave the cut, and a stiffness of"
        " the arm that changes with amplitude"
    )
    return tuple(said)


def of_tool(real: bool, tool: Tool) -> tuple[str, ...]:
    """What spindle and tool on a robot are taken as; real: without hysteretic damping."""
    said = _of_spindle(tool)
    if not real:
        said.insert(0, "hysteretic damping has no equation in time, so that semi-discretisation is left out")
    return tuple(said)


def _of_spindle(tool: Tool) -> list[str]:
    """What spindle and tool are taken as."""
    if tool.coupling is None:
        rigid = (
            "spindle, holder and tool are rigid unless `modes` or `coupling` of the tool say otherwise; at"
        )
        return [f"{rigid} high speeds they set the limit"]
    on = substructure(tool.coupling)
    said = [
        f"spindle and tool are those of {Path(tool.coupling.file).name}, {on.line_hz[0]:.4g} to"
        f" {on.line_hz[-1]:.4g} Hz: above, they are a mass, and their noise is not in the bands; a cut"
        " through them has no equation in time, so that semi-discretisation is left out"
    ]
    if on.degrees == 3:
        said.append(
            "the file has no rotations of the flange, so that spindle and arm are coupled as by a ball joint"
        )
    return said


def of_model(model: FittedModel) -> tuple[str, ...]:
    """A warning where nuisance parameters were fitted along."""
    if model.off is None:
        return ()
    return (
        "nuisance parameters are as fitted; their uncertainty is in the intervals, except that errors of"
        " lengths and angles also turn the tool",
    )
