"""What `identify map` does, without the terminal: a fitted model over many postures, in parts, by the
workers of a batch; and the CSV of its result.
"""

from __future__ import annotations

import hashlib
import itertools
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from identify.batch.executor import here, open_executor
from identify.batch.job import Job
from identify.batch.loop import BatchIndex, Entry, Watch, run_jobs
from identify.core import atomic
from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text_input import csv_text
from identify.core.threads import one_thread
from identify.fitting.resume import held
from identify.map.asked import Asked, MapOptions, asked_of
from identify.map.limits import Wanted, map_limits
from identify.map.posture_map import look, rows_of
from identify.map.sentences import notes, verdict
from identify.map.unknown import Unknown, corrected, hit_node, learnt_of, unknown
from identify.results import file as result_file
from identify.results import fit as results
from identify.results.discovery import fit_of
from identify.results.map import SAME, CorrectionRows, LimitRows, MapPart, MapResult, PostureRows
from identify.results.provenance import computing, provenance, sha256
from identify.robot.points import Point
from identify.vibration.fitted_model import FittedModel, fitted_model
from identify.vibration.misfit import misfit

PART = 100
"""Postures in a part: what a worker does at a time, about half a second."""
_PART = "identify.map.run:map_part"
_LIMIT_S = 600.0
R = TypeVar("R", PostureRows, LimitRows, CorrectionRows)


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
    fit = fit_of(model)
    path = out or model.with_name(f"{model.stem}_map.h5")
    table = path.with_suffix(".csv")
    result_file.check_new(path, "a map", [model, *filter(None, [options.postures])], [table])
    fitted = fitted_model(fit, str(model))
    found = asked_of(fitted, options)
    like, node = [str(one.resolve()) for one in (model, *options.like)], hit_node(fitted, found.point)
    what = _learned(tuple(like), node, model.stat().st_mtime_ns)  # once, where this process maps too
    names, postures = found.names, found.postures
    folder = path.with_name(f"{path.stem}_parts")
    asked: dict[str, object] = {
        "model": str(model.resolve()),
        "point": {"link": found.point.link, "position": found.point.position.tolist()},
        "lines": found.line_hz.tolist(),
        "modes": options.modes,
        "limit": None if found.wanted is None else found.wanted.given,
        "like": None if what is None else like,
        "node": node,
    }
    key = _key([sha256(one) for one in (model, *options.like)], names, postures, asked)
    files = [folder / f"part{number:05d}.h5" for number in range(1, -(-len(names) // PART) + 1)]
    jobs = _jobs(asked, names, postures, key, files)
    with held(path):
        if not resume:
            shutil.rmtree(folder, ignore_errors=True)
        short = len(files) == 1 and found.wanted is None
        alone = short and workers is None and cluster is None
        with nullcontext(here()) if alone else open_executor(workers, cluster) as executor:
            index = BatchIndex(
                folder / "index.json",
                {"map": fit.name, "workers": executor.about},
                {f.stem: Entry(result=f.name) for f in files},
            )
            run_jobs(jobs, executor, index, _LIMIT_S, progress or (lambda index: None))
            about = executor.about
        rows, limit, correction = _joined(index, files)
        learnt = None if what is None else learnt_of(what, options.like)
        seconds = time.perf_counter() - begun
        result = _result(fit, fitted, model, found, rows, limit)
        result = replace(result, seconds=seconds, workers=about, correction=correction, learnt=learnt)
        result = replace(result, verdict=verdict(result), notes=notes(fit, result) + found.notes)
        result_file.write(result, path)
        atomic.write_text(table, table_of(rows, limit, correction))
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
    found: Asked,
    rows: PostureRows,
    limit: LimitRows | None,
) -> MapResult:
    point = found.point
    return MapResult(
        name=fit.name,
        verdict=(),
        notes=(),
        seconds=0.0,
        workers="",
        model=model.name,
        tool=f"{point.name or point.node} on {point.link}",
        joints=tuple(joint.name for joint in fitted.robot.joints),
        line_hz=found.line_hz,
        rows=rows,
        limit=limit,
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

    asked: the file of the `model`, the `point` that is looked at, `lines` (Hz), how many `modes`, what
    `limit`, and the files of the robot and those `like` it whose measured postures tell what the model lacks,
    with the `node` of the point, if it was measured; None where they tell nothing.
    """
    path, model = Path(out), str(asked["model"])
    if result_file.kind_of(path) == MapPart.KIND and result_file.read(path, MapPart).key == key:
        return {"kept": True}
    with one_thread():
        changed = Path(model).stat().st_mtime_ns
        fitted = _model(model, changed)
        tip = asked["point"]
        point = Point(0, "tip", tip["link"], np.array(tip["position"]), np.eye(3), "")
        lines, angles = np.array(asked["lines"]), np.array(postures)
        systems = [fitted.system(one) for one in angles]
        there = zip(systems, angles, strict=True)
        looked = [look(fitted, system, point, one, lines, asked["modes"]) for system, one in there]
        rows = rows_of(looked, names, angles)
        limit = None
        if asked["limit"] is not None:
            wanted = Wanted.of(asked["limit"])
            errors = _errors(model, changed)
            limit = map_limits(wanted, fitted, errors, point, angles, systems, rows)
        correction = None
        if asked["like"] is not None:
            what = _learned(tuple(asked["like"]), asked["node"], changed)
            correction = None if what is None else corrected(what, fitted, systems, looked, rows)
    result_file.write(MapPart(result_file.LAYOUT, MapPart.KIND, key, rows, limit, correction), path)
    return {"kept": False}


@lru_cache(maxsize=2)
def _model(path: str, changed: int) -> FittedModel:
    return fitted_model(fit_of(Path(path)), path)


@lru_cache(maxsize=2)
def _errors(path: str, changed: int) -> Array:
    return misfit(fit_of(Path(path)), _model(path, changed))


@lru_cache(maxsize=2)
def _learned(files: tuple[str, ...], node: int | None, changed: int) -> Unknown | None:
    return unknown(files, node)


def _key(models: Sequence[str], names: Sequence[str], postures: Array, asked: dict[str, object]) -> str:
    text = "\n".join([*computing(), *models, repr(list(names)), repr(asked)])
    return hashlib.sha256(text.encode() + postures.tobytes()).hexdigest()


def _joined(
    index: BatchIndex, files: Sequence[Path]
) -> tuple[PostureRows, LimitRows | None, CorrectionRows | None]:
    """All parts as one; InputError where one is missing."""
    failed = [entry.error for entry in index.jobs.values() if entry.state != "done"]
    if failed:
        raise InputError(
            str(index.path),
            f"{len(failed)} of {len(files)} parts failed: {failed[0].rstrip('.')}",
            fix="resume with `--resume`",
        )
    parts = [result_file.read(file, MapPart) for file in files]
    limits = [part.limit for part in parts if part.limit is not None]
    moved = [part.correction for part in parts if part.correction is not None]
    rows = _stacked([part.rows for part in parts])
    return rows, _stacked(limits) if limits else None, _stacked(moved) if moved else None


def _stacked(parts: Sequence[R]) -> R:
    """Rows of all parts, one after the other: texts and arrays with a row a posture; the rest is the same in
    all.
    """
    found: dict[str, Any] = {}
    for field in fields(parts[0]):
        values = [getattr(part, field.name) for part in parts]
        if isinstance(values[0], tuple):
            found[field.name] = tuple(itertools.chain(*values))
        elif isinstance(values[0], np.ndarray) and field.name not in SAME:
            found[field.name] = np.concatenate(values)
    return replace(parts[0], **found)


def table_of(
    rows: PostureRows, limit: LimitRows | None = None, correction: CorrectionRows | None = None
) -> str:
    """The CSV of a map: a line per posture with units in the header; FRFs are in the HDF5 file alone."""
    (heads, of_limit), (more, moved) = _limit_columns(rows, limit), _corrected_columns(rows, correction)
    angles = [f"joint{joint}_deg" for joint in range(1, rows.posture_deg.shape[1] + 1)]
    modes = [
        f"mode{mode}_{what}"
        for mode in range(1, rows.frequency_hz.shape[1] + 1)
        for what in ("hz", "hz_low", "hz_high", "damping", "damping_low", "damping_high")
    ]
    static, peak = ([f"{what}_{axis}_m_per_n" for axis in "xyz"] for what in ("static", "peak"))
    header = ["name", *angles, "tool_x_m", "tool_y_m", "tool_z_m", *modes, *static, *peak, *heads, *more]
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
    columns = (rows.posture_deg, rows.tool_m, of_modes, diagonal, rows.peak_m_per_n, of_limit, moved)
    lines = (
        [name, *("" if np.isnan(value) else f"{value:.9g}" for value in numbers)]
        for name, numbers in zip(rows.name, np.hstack(columns), strict=True)
    )
    return csv_text([header, *lines])


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
