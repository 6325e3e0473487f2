"""What `identify map` does, without the terminal: a fitted model over many postures, in parts, by the workers
of a batch.
"""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from identify.batch.executor import open_executor
from identify.batch.index import BatchIndex, Entry
from identify.batch.job import Job
from identify.batch.loop import Watch, run_jobs
from identify.batch.posture_table import read_postures
from identify.core import atomic
from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.version import VERSION
from identify.fitting.resume import held
from identify.map.posture_map import map_postures
from identify.results import file as result_file
from identify.results import fit as results
from identify.results.fit import FitResult
from identify.results.map import MapPart, MapResult, PostureRows
from identify.results.provenance import provenance, sha256
from identify.vibration.fit_notes import of_fit
from identify.vibration.fitted_model import FittedModel, fitted_model, tool_point

PART = 50
"""Postures in a part: what a worker does at a time, about half a second."""
_PART = "identify.map.run:map_part"
_LIMIT_S = 600.0
_WITHOUT_BAND_HZ = (1.0, 100.0)


@dataclass(frozen=True)
class MapOptions:
    """What is mapped: postures from a table (`name`, `joint1_deg`, ...) or a grid (joint number: first, last,
    how many; the other joints as in the first fitted posture); for the point with a node (default: the last);
    lines over a band, Hz; how many modes.
    """

    postures: Path | None = None
    grid: tuple[tuple[int, float, float, int], ...] = ()
    tool: int | None = None
    band_hz: tuple[float, float] | None = None
    lines: int = 100
    modes: int = 6


def parse_grid(text: str) -> tuple[int, float, float, int]:
    """One axis of a grid from `JOINT:FIRST:LAST:COUNT`; InputError for another text."""
    try:
        joint, first, last, count = text.split(":")
        return int(joint), float(first), float(last), int(count)
    except ValueError as error:
        raise InputError(
            "--grid", f"{text!r}", "JOINT:FIRST:LAST:COUNT, degrees, such as 2:-60:60:9"
        ) from error


def run_map(
    model: Path,
    options: MapOptions,
    out: Path | None = None,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    resume: bool = False,
    progress: Watch | None = None,
) -> tuple[MapResult, list[Path]]:
    """Map a fitted model and write `<name>_map.h5` and a CSV beside it; workers, cluster, resume and progress
    as for `run_batch`.

    Returns the map and what was written, the HDF5 file first.  Raises InputError for a file that is no fit,
    for postures or a point that the robot does not have, and for a full disk.
    """
    begun = time.perf_counter()
    fit: results.FitResult = result_file.read(model, FitResult)
    path = out or model.with_name(f"{model.stem}_map.h5")
    table = path.with_suffix(".csv")
    result_file.check_new(path, "a map", [model, *filter(None, [options.postures])], [table])
    fitted = fitted_model(fit, str(model))
    names, postures = _postures(fitted, options)
    line_hz = _lines(fitted, options)
    tool_point(fitted, options.tool)  # an unknown point is refused now
    folder = path.with_name(f"{path.stem}_parts")
    asked: dict[str, object] = {
        "model": str(model.resolve()),
        "tool": options.tool,
        "lines": line_hz.tolist(),
        "modes": options.modes,
    }
    key = _key(sha256(model), names, postures, asked)
    files = [folder / f"part{number:05d}.h5" for number in range(1, -(-len(names) // PART) + 1)]
    jobs = _jobs(asked, names, postures, key, files)
    with held(path):
        if not resume:
            shutil.rmtree(folder, ignore_errors=True)
        with open_executor(workers, cluster) as executor:
            index = BatchIndex(
                folder / "index.json",
                {"map": fit.name, "workers": executor.about},
                {f.stem: Entry(result=f.name) for f in files},
            )
            run_jobs(jobs, executor, index, _LIMIT_S, progress or (lambda index: None))
            about = executor.about
        rows = _joined(index, files, key)
        seconds = time.perf_counter() - begun
        result = _result(fit, fitted, model, rows, line_hz, options.tool, about, seconds)
        result_file.write(result, path)
        atomic.write_text(table, table_of(rows))
        shutil.rmtree(folder, ignore_errors=True)
    return result, [path, table]


def _jobs(
    asked: dict[str, object], names: Sequence[str], postures: Array, key: str, files: Sequence[Path]
) -> Iterator[Job]:
    """The parts of a map, each with the file that it is written to."""
    for number, file in enumerate(files):
        part = slice(number * PART, (number + 1) * PART)
        given = {"asked": asked, "names": names[part], "postures": postures[part].tolist(), "key": key}
        yield Job(file.stem, _PART, {**given, "out": str(file.resolve())})


def _result(
    fit: results.FitResult,
    fitted: FittedModel,
    model: Path,
    rows: PostureRows,
    line_hz: Array,
    tool: int | None,
    about: str,
    seconds: float,
) -> MapResult:
    point = tool_point(fitted, tool)
    return MapResult(
        name=fit.name,
        verdict=_verdict(rows, seconds, about),
        notes=_notes(fit),
        seconds=seconds,
        workers=about,
        model=model.name,
        tool=f"{point.name or point.node} on {point.link}",
        joints=tuple(joint.name for joint in fitted.robot.joints),
        line_hz=line_hz,
        rows=rows,
        provenance=provenance(
            fit.provenance.config_path, fit.provenance.config, [(model.name, sha256(model))]
        ),
    )


def map_part(
    asked: Mapping[str, Any],
    names: Sequence[str],
    postures: Sequence[Sequence[float]],
    key: str,
    out: str,
    attempt: int,
) -> dict[str, bool]:
    """Map some postures (rad) and write them; a part of the same map that is there is kept.

    asked: the file of the `model`, the node of the `tool`, `lines` (Hz), and how many `modes`.
    """
    path, model = Path(out), str(asked["model"])
    if result_file.kind_of(path) == MapPart.KIND and result_file.read(path, MapPart).key == key:
        return {"kept": True}
    with threadpool_limits(1):
        fitted = _model(model, Path(model).stat().st_mtime_ns)
        point, lines = tool_point(fitted, asked["tool"]), np.array(asked["lines"])
        rows = map_postures(fitted, point, names, np.array(postures), lines, asked["modes"])
    result_file.write(MapPart(result_file.LAYOUT, MapPart.KIND, key, rows), path)
    return {"kept": False}


@lru_cache(maxsize=2)
def _model(path: str, changed: int) -> FittedModel:
    return fitted_model(result_file.read(Path(path), FitResult), path)


def _key(model: str, names: Sequence[str], postures: Array, asked: dict[str, object]) -> str:
    text = "\n".join([VERSION, model, repr(list(names)), repr(asked)])
    return hashlib.sha256(text.encode() + postures.tobytes()).hexdigest()


def _postures(fitted: FittedModel, options: MapOptions) -> tuple[list[str], Array]:
    """Names and postures (n, joints), rad, of the table or the grid."""
    if (options.postures is None) == (not options.grid):
        raise InputError(
            "identify map",
            "neither or both of a table and a grid",
            "`--postures table.csv` or `--grid 2:-60:60:9`",
        )
    joints = len(fitted.robot.joints)
    if options.postures is not None:
        return read_postures(options.postures, joints)[:2]
    axes = [np.rad2deg(fitted.posture)[joint : joint + 1] for joint in range(joints)]
    for joint, first, last, count in options.grid:
        if not 1 <= joint <= joints or count < 1:
            raise InputError(
                "--grid",
                f"joint {joint} in {count} steps",
                f"a joint from 1 to {joints} and at least one step",
            )
        axes[joint - 1] = np.linspace(first, last, count)
    found = np.deg2rad(np.array(list(itertools.product(*axes))))
    return [f"p{number:0{len(str(len(found)))}d}" for number in range(1, len(found) + 1)], found


def _lines(fitted: FittedModel, options: MapOptions) -> Array:
    low, high = options.band_hz or fitted.band_hz or _WITHOUT_BAND_HZ
    if not 0 <= low < high or options.lines < 2:
        raise InputError(
            "--band",
            f"{options.lines} lines from {low:g} to {high:g} Hz",
            "the lower frequency first and two lines or more",
        )
    return np.linspace(low, high, options.lines)


def _joined(index: BatchIndex, files: Sequence[Path], key: str) -> PostureRows:
    """All parts as one; InputError where one is missing."""
    failed = [entry.error for entry in index.jobs.values() if entry.state != "done"]
    if failed:
        raise InputError(
            str(index.path),
            f"{len(failed)} of {len(files)} parts failed: {failed[0].rstrip('.')}",
            fix="resume with `--resume`",
        )
    parts = [result_file.read(file, MapPart).rows for file in files]
    names = tuple(name for part in parts for name in part.name)
    arrays = {
        f.name: np.concatenate([getattr(part, f.name) for part in parts])
        for f in fields(PostureRows)
        if f.name != "name"
    }
    return PostureRows(name=names, **arrays)


def _verdict(rows: PostureRows, seconds: float, about: str) -> tuple[str, ...]:
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
        " resonance, along the softest axis of the base."
    )
    return done, f"{between}and {np.nanmax(damping):.2g} %.", softest


def _notes(fit: results.FitResult) -> tuple[str, ...]:
    return (
        *of_fit(fit),
        "intervals say what the noise of the fitted data leaves open; what the model lacks is not in them",
    )


def table_of(rows: PostureRows) -> str:
    """The CSV of a map: a line per posture with units in the header; FRFs are in the HDF5 file alone."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    angles = [f"joint{joint}_deg" for joint in range(1, rows.posture_deg.shape[1] + 1)]
    modes = [
        f"mode{mode}_{what}"
        for mode in range(1, rows.frequency_hz.shape[1] + 1)
        for what in ("hz", "hz_low", "hz_high", "damping", "damping_low", "damping_high")
    ]
    static, peak = ([f"{what}_{axis}_m_per_n" for axis in "xyz"] for what in ("static", "peak"))
    writer.writerow(["name", *angles, "tool_x_m", "tool_y_m", "tool_z_m", *modes, *static, *peak])
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
        np.hstack([rows.posture_deg, rows.tool_m, of_modes, diagonal, rows.peak_m_per_n]),
        strict=True,
    ):
        writer.writerow([name, *("" if np.isnan(value) else f"{value:.9g}" for value in numbers)])
    return stream.getvalue()
