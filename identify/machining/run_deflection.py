"""What `identify deflection` does, without the terminal: a fitted model and forces in, deflections out."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core import atomic
from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.threads import one_thread
from identify.fitting.resume import held
from identify.machining.deflection import Loaded, deflections, dynamic_deflection
from identify.machining.force import mean_force, parse_force, path_text, read_path
from identify.machining.mounted import mounted
from identify.machining.place import posture_of
from identify.machining.sentences import of_model
from identify.machining.tool import Tool, read_tool
from identify.results import file as result_file
from identify.results.deflection import DeflectionResult, DeflectionRows
from identify.results.discovery import fit_of
from identify.results.fit import FitResult
from identify.results.provenance import provenance, sha256
from identify.robot.points import Point
from identify.vibration.fit_notes import of_fit, of_gap
from identify.vibration.fitted_model import FittedModel, fitted_model, tool_point
from identify.vibration.misfit import misfit


@dataclass(frozen=True)
class Load:
    """What pushes: a force `FX,FY,FZ`, N, in the base's axes, or a path with forces, or a cut: the file of a
    tool with depth and feed per tooth, mm, whose mean force it is.

    node, or the tool, says where; posture: of a force or cut (`posture_of`).
    """

    force: str | None = None
    path: Path | None = None
    tool: Path | None = None
    depth_mm: float | None = None
    feed_per_tooth_mm: float | None = None
    node: int | None = None
    posture: str | None = None

    def check(self) -> None:
        """InputError where it is not one of the three, or not whole."""
        cut = [self.depth_mm, self.feed_per_tooth_mm]
        several = [self.force is not None, self.path is not None, any(value is not None for value in cut)]
        if sum(several) != 1:
            expected = (
                "`--force 100,0,-50`, `--path path.csv`, or `--tool` with `--depth` and `--feed-per-tooth`"
            )
            raise InputError("identify deflection", "no force or several", f"one of {expected}")
        if several[2] and (self.tool is None or None in cut):
            raise InputError(
                "identify deflection", "a cut that is not whole", "`--tool`, `--depth` and `--feed-per-tooth`"
            )
        if self.path is not None and self.posture is not None:
            raise InputError("--posture", "with a path, which has its own", "one of the two")
        if self.tool is not None and self.node is not None:
            raise InputError("--node", "with a tool, which says where it is", "one of the two")


def run_deflection(
    model: Path, load: Load, out: Path | None = None, *, draws: int = 400
) -> tuple[DeflectionResult, list[Path]]:
    """Deflections of a fitted model's tool; writes `<model>_deflection.h5` and the compensated path as CSV.

    draws: of the uncertain parameters, for the intervals.  Raises InputError or InputErrors for files, forces
    and places that cannot be, and a result that cannot be written.
    """
    begun = time.perf_counter()
    load.check()
    fit = fit_of(model)
    fitted = fitted_model(fit, str(model))
    path = out or model.with_name(f"{model.stem}_deflection.h5")
    inputs, table = [one for one in (load.path, load.tool) if one is not None], path.with_suffix(".csv")
    result_file.check_new(path, "deflections", [model, *inputs], [table])
    tool = None if load.tool is None else read_tool(load.tool).study
    if tool is not None and tool.coupling is not None:
        found = "a coupling, whose FRFs say nothing of rest"
        raise InputError(f"{load.tool}: coupling", found, "a tool without, at the place where forces act")
    with held(path), one_thread():
        point = (
            tool_point(fitted, load.node, "--node") if tool is None else tool.point(fitted, str(load.tool))
        )
        on = Loaded(fitted, point, draws, misfit(fit, fitted))
        names, postures, forces = _places(load, tool, fit, fitted)
        rows = deflections(on, names, postures, forces)
        dynamic = dynamic_deflection(on, postures[0], forces[0])
        said = load.force or ""
        result = DeflectionResult(
            name=fit.name,
            verdict=_verdict(rows, point),
            notes=_notes(fit) + of_model(fitted),
            seconds=time.perf_counter() - begun,
            provenance=provenance(
                "", said, [(model.name, sha256(model)), *((one.name, sha256(one)) for one in inputs)]
            ),
            model=model.name,
            place=f"{point.name or point.node} on {point.link}",
            joints=tuple(joint.name for joint in fitted.robot.joints),
            draws=draws,
            rows=rows,
            dynamic=dynamic,
        )
        result_file.write(result, path)
        atomic.write_text(table, path_text(rows))
    return result, [path, table]


def _places(
    load: Load, tool: Tool | None, fit: FitResult, fitted: FittedModel
) -> tuple[list[str], Array, Array]:
    """Names, postures (n, joints), rad, and forces (n, 3), N, in the base's axes."""
    if load.path is not None:
        return read_path(load.path, len(fitted.robot.joints))
    posture = posture_of(load.posture, fit, fitted)
    if load.force is not None:
        return ["force"], posture[None], parse_force(load.force)[None]
    assert tool is not None and load.depth_mm is not None and load.feed_per_tooth_mm is not None
    on = mounted(fitted, tool, posture, str(load.tool))
    force = mean_force(on.cut, load.depth_mm / 1e3, load.feed_per_tooth_mm / 1e3)
    return ["cut"], posture[None], (on.axes.T @ force)[None]


def _verdict(rows: DeflectionRows, point: Point) -> tuple[str, ...]:
    most = int(np.argmax(rows.size_m))
    force = float(np.linalg.norm(rows.force_n[most]))
    along = ", ".join(f"{1e6 * value:.4g}" for value in rows.deflection_m[most])
    size, low, high = (1e6 * one[most] for one in (rows.size_m, rows.size_low_95, rows.size_high_95))
    where = f" at {rows.name[most]}, the most of {len(rows.name)} places" if len(rows.name) > 1 else ""
    moved = (
        f"A force of {force:.4g} N moves {point.name or 'the tip'} by {size:.4g} µm (95 % interval"
        f" {low:.4g} to {high:.4g} µm){where}: ({along}) µm along the base's axes."
    )
    soft, stiff = rows.compliance[most, 0], rows.compliance[most, 2]
    softest = ", ".join(f"{value:.2f}" for value in np.round(rows.directions[most, 0], 2) + 0.0)
    return moved, (
        f"There it is most compliant along ({softest}): {1e6 * soft:.3g} µm/N, and least,"
        f" {1e6 * stiff:.3g} µm/N, across it."
    )


def _notes(fit: FitResult) -> tuple[str, ...]:
    return (
        *of_fit(fit),
        *of_gap(fit.gap, "which the intervals include as errors of the stiffnesses"),
        "stiffness is that of vibration, small and about a posture: friction that sticks and gears that are"
        " softer under small loads are not in it",
    )
