"""What `identify stability` does, without the terminal: a fitted model and a tool in, depth limits out."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core.config import ConfigFile
from identify.core.threads import one_thread
from identify.fitting.resume import held
from identify.machining import sentences
from identify.machining.mounted import Mounted, mounted
from identify.machining.place import posture_of
from identify.machining.stability import (
    coupling,
    limits,
    nominal,
    over_feeds,
    tip_receptance,
)
from identify.machining.tool import Tool, read_tool
from identify.model.modes import complex_modes
from identify.results import file as result_file
from identify.results.discovery import fit_of
from identify.results.fit import FitResult
from identify.results.provenance import provenance, sha256
from identify.results.stability import StabilityResult, TipReceptance
from identify.vibration.fitted_model import FittedModel, fitted_model
from identify.vibration.misfit import misfit

_LINES = 300


@dataclass(frozen=True)
class Read:
    """What was read: the fit, its model, and the tool."""

    path: Path
    fit: FitResult
    model: FittedModel
    file: ConfigFile[Tool]


def read_both(model: Path, tool: Path) -> Read:
    """Raises InputError or InputErrors for a file that is no fit or no tool."""
    fit = fit_of(model)
    return Read(model, fit, fitted_model(fit, str(model)), read_tool(tool))


def run_stability(
    model: Path,
    tool: Path,
    out: Path | None = None,
    posture: str | None = None,
    *,
    speeds: int = 61,
    draws: int = 2000,
) -> tuple[StabilityResult, list[Path]]:
    """Depth limits of a tool on a fitted model; writes `<model>_stability.h5`.

    posture: see `posture_of`; speeds: how many spindle speeds; draws: of the uncertain, for bands.  Raises
    InputError or InputErrors for a file that is no fit or no tool, a tool that does not fit the robot, and a
    result that cannot be written.
    """
    begun = time.perf_counter()
    read = read_both(model, tool)
    path = out or model.with_name(f"{model.stem}_stability.h5")
    result_file.check_new(path, "depth limits", [model, tool])
    with held(path), one_thread():
        on = mounted(
            read.model,
            read.file.study,
            posture_of(posture, read.fit, read.model),
            str(tool),
            speeds,
            draws,
            misfit(read.fit, read.model),
        )
        result = _result(read, on, begun)
        result_file.write(result, path)
    return result, [path]


def _result(read: Read, on: Mounted, begun: float) -> StabilityResult:
    found, coupled = nominal(on)
    depth, compared = limits(on, found)
    structure = on.here
    modes = complex_modes(structure.mass, structure.damping, structure.stiffness)
    line_hz = np.unique(np.linspace(0.0, 1.5 * float(modes.frequency_hz[:6].max()), _LINES))
    tip, spread = tip_receptance(on, line_hz)
    feed, feed_depth = over_feeds(on)
    without = coupling(on, coupled)
    tool, cutting = on.tool, on.cut.cutting
    band_hz = read.model.band_hz
    said = sentences.verdict(depth, compared, without, tool.max_depth_mm / 1e3)
    text = read.file
    return StabilityResult(
        name=read.fit.name,
        verdict=said,
        notes=sentences.notes(depth, band_hz, read.fit, structure.real, tool)
        + sentences.of_model(read.model),
        seconds=time.perf_counter() - begun,
        provenance=provenance(
            text.path.name, text.text, [(read.path.name, sha256(read.path)), (text.path.name, text.sha256)]
        ),
        model=read.path.name,
        tool=tool.name,
        place=f"{on.point.name or on.point.node} on {on.point.link}",
        source=cutting.source,
        joints=tuple(joint.name for joint in on.model.robot.joints),
        posture_deg=np.rad2deg(on.posture),
        tip_m=on.tip_m,
        axes=on.axes,
        engagement_deg=np.rad2deg(tool.engagement),
        cutting=np.array([cutting.tangential, cutting.radial, cutting.axial]),
        max_depth_m=tool.max_depth_mm / 1e3,
        draws=on.draws,
        limits=depth,
        checks=compared,
        coupling=without,
        feed_deg=feed,
        feed_depth_m=feed_depth,
        mode_hz=modes.frequency_hz,
        mode_damping=modes.damping_ratio,
        tip=TipReceptance(line_hz, tip.astype(np.complex64), spread.astype(np.float32)),
    )
