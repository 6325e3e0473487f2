"""What `identify stability` does, without the terminal: what carries a tool, and the tool, in, depth limits
out.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.config import ConfigFile
from identify.core.errors import InputError
from identify.core.files import sha256_of
from identify.core.threads import one_thread
from identify.fitting.resume import held
from identify.machining import sentences
from identify.machining.mounted import Cutting, mounted
from identify.machining.stability import (
    coupling,
    limits,
    nominal,
    over_feeds,
    tip_receptance,
)
from identify.machining.tapped import Tapped, of_frfs, of_modes
from identify.machining.tool import Tool, read_tool
from identify.measured.frf_records import FrfFileOptions
from identify.measured.loaders import load_frf_set
from identify.model.modes import complex_modes
from identify.results import file as result_file
from identify.results.discovery import fit_of
from identify.results.modes import ModesResult
from identify.results.provenance import provenance
from identify.results.stability import DepthLimits, StabilityResult, TipReceptance
from identify.vibration.fitted_model import fitted_model, posture_of
from identify.vibration.misfit import misfit

_LINES = 300


@dataclass(frozen=True)
class Held:
    """A tool in its cut, and what a result says of what carries it; notes of the limits come with these."""

    on: Cutting
    name: str
    place: str
    line_hz: Array
    band_hz: tuple[float, float] | None
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    posture_deg: Array = field(default_factory=lambda: np.zeros(0))
    tip_m: Array = field(default_factory=lambda: np.full(3, np.nan))
    mode_hz: Array = field(default_factory=lambda: np.zeros(0))
    mode_damping: Array = field(default_factory=lambda: np.zeros(0))


def run_stability(
    model: Path,
    tool: Path,
    out: Path | None = None,
    posture: str | None = None,
    *,
    speeds: int = 61,
    draws: int = 2000,
    options: FrfFileOptions | None = None,
) -> tuple[StabilityResult, list[Path]]:
    """Depth limits of a tool on a fitted model, or by FRFs of its tip or the modes found in them; writes
    `<model>_stability.h5`.

    posture: see `posture_of`, or the name of a measurement of modes; speeds: how many spindle speeds; draws:
    of the uncertain, for bands; options: what FRFs leave open.  Raises InputError or InputErrors for a file
    that is none of these or no tool, a tool that does not fit, and a result that cannot be written.
    """
    begun = time.perf_counter()
    kind, file = result_file.kind_of(model), read_tool(tool)
    path = out or model.with_name(f"{model.stem}_stability.h5")
    result_file.check_new(path, "depth limits", [model, tool])
    with held(path), one_thread():
        common = file.study, str(tool), speeds, draws
        if kind == "":
            carried = _by_frfs(model, posture, options or FrfFileOptions(), *common)
        elif kind == ModesResult.KIND:
            carried = _by_modes(model, posture, *common)
        else:
            carried = _on_robot(model, posture, *common)
        result = _result(carried, model, file, begun)
        result_file.write(result, path)
    return result, [path]


def _on_robot(path: Path, posture: str | None, tool: Tool, where: str, speeds: int, draws: int) -> Held:
    fit = fit_of(path)
    model = fitted_model(fit, str(path))
    at = posture_of(posture, fit, model)
    on = mounted(model, tool, at, where, speeds, draws, misfit(fit, model))
    here = on.here
    modes = complex_modes(here.mass, here.damping, here.stiffness)
    return Held(
        on,
        fit.name,
        f"{on.point.name or on.point.node} on {on.point.link}",
        np.unique(np.linspace(0.0, 1.5 * float(modes.frequency_hz[:6].max()), _LINES)),
        model.band_hz,
        sentences.of_robot(fit),
        (*sentences.of_tool(here.real, tool), *sentences.of_model(model)),
        tuple(joint.name for joint in model.robot.joints),
        np.rad2deg(at),
        on.tip_m,
        modes.frequency_hz,
        modes.damping_ratio,
    )


def _by_frfs(
    path: Path,
    posture: str | None,
    options: FrfFileOptions,
    tool: Tool,
    where: str,
    speeds: int,
    draws: int,
) -> Held:
    if posture is not None:
        found = f"{posture!r}, of FRFs of a tip, which have the posture that they were measured in"
        raise InputError("--posture", found, "none", "leave it out")
    return _tapped(of_frfs(load_frf_set(path, options), tool, where, speeds, draws), path, path.stem)


def _by_modes(path: Path, name: str | None, tool: Tool, where: str, speeds: int, draws: int) -> Held:
    result = result_file.read(path, ModesResult)
    names = list(result.measurements)
    if name not in (*names, None):
        raise InputError("--posture", repr(name), "one of " + ", ".join(names))
    found = result.measurements[name or names[0]]
    carried = _tapped(of_modes(found, tool, where, speeds, draws), path, result.name)
    return replace(carried, mode_hz=found.modes.frequency_hz, mode_damping=found.modes.damping_ratio)


def _tapped(on: Tapped, path: Path, name: str) -> Held:
    line_hz = on.known.line_hz
    band = float(line_hz[0]), float(line_hz[-1])
    return Held(on, name, f"point {on.node} of {path.name}", line_hz, band, on.said)


def _result(carried: Held, model: Path, file: ConfigFile[Tool], begun: float) -> StabilityResult:
    on, tool = carried.on, file.study
    found, coupled = nominal(on)
    depth, compared = limits(on, found)
    tip, spread = tip_receptance(on, carried.line_hz)
    feed, feed_depth = over_feeds(on)
    without, cutting = coupling(on, coupled), on.cut.cutting
    return StabilityResult(
        name=carried.name,
        verdict=sentences.verdict(
            depth, compared, without, tool.max_depth_mm / 1e3, uneven=bool(tool.pitches)
        ),
        notes=_notes(carried, depth),
        seconds=time.perf_counter() - begun,
        provenance=provenance(
            file.path.name,
            file.text,
            [(model.name, sha256_of(model, "what carries the tool")), (file.path.name, file.sha256)],
        ),
        model=model.name,
        tool=tool.name,
        place=carried.place,
        source=cutting.source,
        joints=carried.joints,
        posture_deg=carried.posture_deg,
        tip_m=carried.tip_m,
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
        mode_hz=carried.mode_hz,
        mode_damping=carried.mode_damping,
        tip=TipReceptance(carried.line_hz, tip.astype(np.complex64), spread.astype(np.float32)),
    )


def _notes(carried: Held, depth: DepthLimits) -> tuple[str, ...]:
    own = sentences.of_limits(depth, carried.band_hz, carried.on.tool, robot=bool(carried.joints))
    return (*carried.before, *own, *carried.after)
