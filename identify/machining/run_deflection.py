"""What `identify deflection` does, without the terminal: a fitted model and forces in, deflections out.

How far a force pushes the tool of a fitted model, and where to send it instead.

The static compliance of the tip is J K^-1 J', K with the gravity stiffness, J the tip's motion per
coordinate.  What the robot's own weight does is not in it: the force comes on top.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.batch.posture_table import read_postures
from identify.core import atomic
from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.interruption import check
from identify.core.text_input import csv_text
from identify.core.threads import one_thread
from identify.core.thresholds import PERCENTILES_95, SIGMAS_95
from identify.fitting.resume import held
from identify.machining.engagement import Engagement
from identify.machining.mounted import mounted
from identify.machining.sentences import of_model
from identify.machining.tool import Tool, read_tool
from identify.model.frf import frf
from identify.model.modes import complex_modes
from identify.model.system import System
from identify.results import file as result_file
from identify.results.deflection import DeflectionResult, DeflectionRows, DynamicDeflection
from identify.results.discovery import fit_of
from identify.results.fit import FitResult
from identify.results.provenance import provenance, sha256
from identify.robot.points import Point
from identify.robot.reach import placed
from identify.vibration.fitted_model import FittedModel, fitted_model, posture_of, tool_point
from identify.vibration.misfit import misfit
from identify.vibration.notes import of_fit, of_gap

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


_SEED = 1
_LINES, _DRAWN = 400, 60


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
        if not all(0 < value < np.inf for value in cut if value is not None):
            found = f"{self.depth_mm:g} mm and {self.feed_per_tooth_mm:g} mm"
            raise InputError("--depth, --feed-per-tooth", found, "two lengths above 0")
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
        "stiffness is that of small vibration about a posture: static friction and gears that are more"
        " compliant under small loads are not included",
    )


@dataclass(frozen=True)
class Loaded:
    """A tip on a fitted model; draws: of what is uncertain; errors (p,): what the model does not explain
    (`identify.vibration.misfit`).
    """

    model: FittedModel
    point: Point
    draws: int
    errors: Array

    def drawn(self, system: System, posture: Array) -> tuple[Array, Array, Array]:
        """M, C, K (draws, n, n) at a posture (joints,), rad."""
        rng = np.random.default_rng(_SEED)
        return self.model.drawn_matrices(system, posture, self.draws, rng, self.errors)

    def compliance(self, system: System, stiffness: Array) -> Array:
        """(..., 3, 3), m/N, in the base's axes, of stiffness matrices (..., n, n)."""
        out = system.base_jacobian(self.point.link, self.point.position)
        stiffness = stiffness.real
        moved = np.linalg.solve(stiffness, np.broadcast_to(out.T, (*stiffness.shape[:-1], 3)))
        return np.asarray(out @ moved)


def deflections(on: Loaded, names: Sequence[str], postures: Array, forces: Array) -> DeflectionRows:
    """The tip at postures (n, joints), rad, under forces (n, 3), N, in the base's axes."""
    rows = []
    for posture, force in zip(postures, forces, strict=True):
        check()
        rows.append(_row(on, posture, force))
    columns = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    return DeflectionRows(name=tuple(names), posture_deg=np.rad2deg(postures), force_n=forces, **columns)


def _row(on: Loaded, posture: Array, force: Array) -> dict[str, Array]:
    system = on.model.system(posture)
    tip = system.site.engine.position(on.point.link, on.point.position)
    here = on.compliance(system, system.matrices(on.model.values)[2])
    drawn = on.compliance(system, on.drawn(system, posture)[2])
    moved, spread = here @ force, drawn @ force
    low, high = np.percentile(spread, PERCENTILES_95, axis=0)
    size_low, size_high = np.percentile(np.linalg.norm(spread, axis=1), PERCENTILES_95)
    principal, directions = np.linalg.eigh((here + here.T) / 2)
    along = np.einsum("ik,dij,jk->dk", directions, drawn, directions)
    least, most = np.percentile(along, PERCENTILES_95, axis=0)
    return {
        "tip_m": tip,
        "deflection_m": moved,
        "low_95": low,
        "high_95": high,
        "size_m": np.linalg.norm(moved),
        "size_low_95": size_low,
        "size_high_95": size_high,
        "compliance": principal[::-1],
        "compliance_low_95": least[::-1],
        "compliance_high_95": most[::-1],
        "directions": directions.T[::-1],
        "target_m": tip - moved,
        "target_deg": np.rad2deg(posture + _turned(on, posture, -moved)),
    }


def _turned(on: Loaded, posture: Array, shift: Array) -> Array:
    """(joints,), rad: what turns the rigid robot so that its tip moves by a shift (3,), m, in the base's
    axes, its direction kept where there are six joints or more; the least turn where several do.
    """
    *_, motion = placed(on.model.robot, posture, on.point.link, on.point.position)
    kept = slice(6 if len(posture) >= 6 else 3)
    wanted = np.concatenate([shift, np.zeros(3)])
    return np.asarray(np.linalg.lstsq(motion[kept], wanted[kept], rcond=1e-6)[0])


def dynamic_deflection(on: Loaded, posture: Array, force: Array) -> DynamicDeflection:
    """The tip's amplitude by a force (3,), N, that oscillates, up to half above the sixth mode."""
    system = on.model.system(posture)
    matrices = system.matrices(on.model.values)
    highest = complex_modes(*matrices).frequency_hz[:6].max()
    line_hz = np.linspace(0.0, 1.5 * float(highest), _LINES)
    out, s = (
        system.base_jacobian(on.point.link, on.point.position),
        np.asarray(2j * np.pi * line_hz, dtype=complex),
    )
    pushed = (out.T @ force)[:, None]
    here = np.abs(frf(*matrices, s, out, pushed, 0)[..., 0])
    mass, damping, stiffness = (one[:_DRAWN] for one in on.drawn(system, posture))
    many = np.broadcast_to(s, (len(stiffness), len(s)))
    drawn = np.abs(frf(mass, damping, stiffness, many, out, pushed, 0)[..., 0])
    return DynamicDeflection(line_hz, here, SIGMAS_95 * np.sqrt(np.mean((drawn - here) ** 2, axis=0)))
