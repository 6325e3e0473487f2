"""What `identify batch` does, without the terminal: every fit of a batch by its workers, the index, and their
summary.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from identify.batch.executor import Executor, open_executor
from identify.batch.job import Job
from identify.batch.loop import BatchIndex, Entry, Watch, run_jobs
from identify.batch.settings import Batch, Item, read_batch
from identify.batch.summary import summarise
from identify.batch.work import derived
from identify.core.errors import InputError
from identify.fitting.resume import held
from identify.results import file as result_file
from identify.results.batch import BatchResult
from identify.results.provenance import provenance, sha256

INDEX = "index.json"
_FIT = "identify.batch.work:fit"


def run_batch(
    config: Path,
    out: Path | None = None,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    resume: bool = False,
    progress: Watch | None = None,
) -> tuple[BatchResult, list[Path]]:
    """Fit all that a batch names and write `<name>.h5`, the summary, beside the folder `<name>/` with each
    fit and `index.json`.

    workers: local processes (default: one per processor); cluster: address of a Dask scheduler, in their
    place; resume: keep what is finished of the same study, data and versions, and resume what was
    interrupted; progress is shown the index after every change. Returns the summary and what was written,
    the summary first.  Raises InputError for a batch that cannot be read, where nothing can be written, for a
    full disk, and where every fit failed; Interrupted after the index was written.
    """
    begun, batch = time.perf_counter(), read_batch(config)
    path = out or Path("reports") / f"{batch.settings.name}.h5"
    _check(batch, path)
    files = {item.name: path.with_suffix("") / f"{item.name}.h5" for item in batch.items}
    joint = None if batch.joint is None else path.with_suffix("") / f"{batch.joint.name}.h5"
    with held(path):
        with open_executor(workers, cluster) as executor:
            index = _index(batch, files, joint, path, executor)
            _run(batch, files, joint, executor, index, resume, progress or (lambda index: None))
            about = executor.about
        _tidy(index.path.parent)
        if not any(index.jobs[name].state == "done" for name in files):
            name, entry = next((name, index.jobs[name]) for name in files)
            found = f"none of the {len(files)} fits completed; {name}: {entry.error.rstrip('.')}"
            raise InputError(str(config), found, fix=f"see {index.path}")
        fitted_together = joint if joint is not None and index.jobs["joint"].state == "done" else None
        came_from = provenance(
            config.name, batch.text, [(study.name, sha256(study)) for study in _studies(batch)]
        )
        result = summarise(
            batch.settings.name,
            index,
            files,
            fitted_together,
            about,
            time.perf_counter() - begun,
            came_from,
            batch.settings.shared,
        )
        result_file.write(result, path)
    return result, [path, index.path]


def _tidy(folder: Path) -> None:
    """Take away what workers were writing, and held, when they were killed."""
    for pattern in (".*.h5", ".*.h5.lock"):
        for left in folder.glob(pattern):
            left.unlink(missing_ok=True)


def _studies(batch: Batch) -> list[Path]:
    """The studies of a batch that are there."""
    return [study for study in dict.fromkeys(item.study for item in batch.items) if study.exists()]


def _index(
    batch: Batch, files: dict[str, Path], joint: Path | None, path: Path, executor: Executor
) -> BatchIndex:
    folder = path.with_suffix("")
    index = BatchIndex(
        folder / INDEX, {"batch": batch.settings.name, "config": batch.path.name, "workers": executor.about}
    )
    if joint is not None:
        index.jobs["joint"] = Entry(result=joint.name)
    index.jobs.update({name: Entry(result=file.name) for name, file in files.items()})
    return index


def _run(
    batch: Batch,
    files: dict[str, Path],
    joint: Path | None,
    executor: Executor,
    index: BatchIndex,
    resume: bool,
    watch: Watch,
) -> None:
    """All fits, the joint one first because it takes longest."""

    def jobs() -> Iterator[Job]:
        if batch.joint is not None and joint is not None:
            yield _job(batch.joint, joint, resume)
        for item in batch.items:
            yield _job(item, files[item.name], resume)

    run_jobs(jobs(), executor, index, batch.settings.time_limit_s, watch)


def _job(item: Item, path: Path, resume: bool) -> Job:
    measurements = None if item.measurements is None else list(item.measurements)
    study, out = str(item.study.resolve()), str(path.resolve())
    return Job(
        item.name,
        _FIT,
        {"study": study, "name": item.name, "measurements": measurements, "out": out, "resume": resume},
    )


def _check(batch: Batch, path: Path) -> None:
    """Raise now what would fail every fit: a base study that is wrong, a place that cannot be written."""
    result_file.check_new(path, "a batch", [batch.path])
    base = next((item.study for item in batch.items if item.measurements is not None), None)
    if base is not None:
        derived(base, base.stem, [{"file": "data.uff", "posture_deg": [0.0]}])
