"""The loop over jobs with every fault, on local processes and on Dask alike."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import pytest

from identify.batch import child as child_module
from identify.batch import loop as index_module
from identify.batch import loop as loop_module
from identify.batch.executor import Executor, open_executor, processors
from identify.batch.job import Job, JobOutcome, failure
from identify.batch.loop import BatchIndex, Entry, run_jobs
from identify.core.errors import InputError
from identify.core.version import VERSION
from identify.results.provenance import computing
from tests.batch.conftest import Opener

LIMIT_S = 20.0


def _job(name: str, call: str, **arguments: object) -> Job:
    return Job(name, f"tests.batch.jobs:{call}", arguments)


def _index(folder: Path, jobs: list[Job]) -> BatchIndex:
    return BatchIndex(
        folder / "index.json", {"batch": "test", "workers": "some"}, {job.name: Entry() for job in jobs}
    )


def _run(jobs: list[Job], executor: Executor, folder: Path, limit_s: float = LIMIT_S) -> BatchIndex:
    index = _index(folder, jobs)
    run_jobs(jobs, executor, index, limit_s)
    return index


def test_every_fault_is_told_and_the_rest_is_done(opener: Opener, tmp_path: Path) -> None:
    good = [_job(f"good{n}", "square", x=n) for n in range(4)]
    bad = [_job(name, name) for name in ("wrong", "dies", "dies_at_first", "fails_at_first")]
    unknown = [_job("unknown", "no_such_function"), Job("nowhere", "no.such.module:f", {})]
    with opener() as executor:
        index = _run([*bad[:2], *good, *bad[2:], *unknown], executor, tmp_path)
    assert all(index.jobs[job.name].state == "done" and index.jobs[job.name].attempts == 1 for job in good)
    assert index.jobs["wrong"] == Entry(
        "failed", 2, "", index.jobs["wrong"].seconds, "ValueError: the numbers do not add up"
    )
    assert index.jobs["dies"].state == "failed"
    assert "worker process died (signal 9)" in index.jobs["dies"].error
    assert (index.jobs["dies_at_first"].state, index.jobs["dies_at_first"].attempts) == ("done", 3)
    assert (index.jobs["fails_at_first"].state, index.jobs["fails_at_first"].attempts) == ("done", 2)
    assert "no_such_function" in index.jobs["unknown"].error
    assert "ModuleNotFoundError" in index.jobs["nowhere"].error
    assert json.loads(index.path.read_text())["counts"] == {
        "waiting": 0,
        "running": 0,
        "done": 6,
        "failed": 4,
    }


def test_a_job_that_never_returns_is_ended_and_its_worker_replaced(opener: Opener, tmp_path: Path) -> None:
    jobs = [_job("endless", "endless"), *(_job(f"good{n}", "square", x=n) for n in range(3))]
    with opener() as executor:
        index = _run(jobs, executor, tmp_path, limit_s=0.5)
    assert index.jobs["endless"].state == "failed"
    assert index.jobs["endless"].attempts == 2
    assert "time limit of 0.5 s" in index.jobs["endless"].error
    assert all(index.jobs[f"good{n}"].state == "done" for n in range(3))


def test_a_full_disk_stops_the_batch_and_loses_nothing(opener: Opener, tmp_path: Path) -> None:
    room = tmp_path / "room"
    jobs = [
        _job("first", "square", x=1),
        _job("full", "no_room_until", there=str(room)),
        *(_job(f"s{n}", "slow", seconds=0.3) for n in range(40)),
    ]
    index = _index(tmp_path, jobs)
    with opener() as executor:
        with pytest.raises(InputError, match=r"the disk is full.*--resume"):
            run_jobs(jobs, executor, index, LIMIT_S)
        counts = index.counts()
        assert counts["failed"] == 0
        assert counts["waiting"] > 10, "the rest is not begun"
        assert json.loads(index.path.read_text())["state"].startswith("stopped: ")
        room.touch()
        waiting = [job for job in jobs if index.jobs[job.name].state == "waiting"]
        assert "full" in [job.name for job in waiting]
        again = _run([job for job in waiting if job.name == "full"], executor, tmp_path)
    assert again.jobs["full"].state == "done"


def test_interrupted_jobs_wait_and_the_workers_end(tmp_path: Path) -> None:
    jobs = [_job(f"slow{n}", "slow", seconds=60.0, mark=str(tmp_path / f"slow{n}")) for n in range(3)]
    index, seen = _index(tmp_path, jobs), []

    def interrupt(shown: BatchIndex) -> None:
        seen.append(shown.counts())
        raise KeyboardInterrupt

    with open_executor(2) as executor, pytest.raises(KeyboardInterrupt):
        run_jobs([_job("quick", "square", x=2.0), *jobs], executor, _with(index, "quick"), None, interrupt)
    assert not list(tmp_path.glob("slow*")), "nobody waits for the slow ones"
    kept = json.loads(index.path.read_text())
    assert kept["state"] == "interrupted"
    assert kept["counts"]["running"] == 0
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("identify-worker")]


def _with(index: BatchIndex, name: str) -> BatchIndex:
    index.jobs = {name: Entry(), **index.jobs}
    return index


def test_one_blas_thread_and_one_worker_per_processor() -> None:
    with open_executor() as executor:
        assert executor.slots() == processors() >= 1
        told = executor.submit(_job("x", "of_threads"), 1, LIMIT_S).result().value
        assert told == {"OMP_NUM_THREADS": "1", "own": 1}


def test_a_result_that_never_arrives_ends_the_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where the disk is not shared: what is written on the worker is not here."""
    monkeypatch.setattr(loop_module, "_ARRIVES_S", 0.3)
    jobs = [_job(f"j{n}", "square", x=n) for n in range(3)]
    index = BatchIndex(
        tmp_path / "index.json", {}, {job.name: Entry(result=f"{job.name}.h5") for job in jobs}
    )
    with open_executor(1) as executor:
        with pytest.raises(InputError, match=r"j0 is done, and its result is not there.*same path on every"):
            run_jobs(jobs, executor, index, LIMIT_S)
        (tmp_path / "j0.h5").touch()
        run_jobs(jobs, executor, index, LIMIT_S)
    assert index.counts()["done"] == 3


def test_a_worker_of_other_versions_does_nothing(tmp_path: Path) -> None:
    other = (f"identify {VERSION}", "numpy 0.1", *computing()[2:])
    outcome = child_module.perform("tests.batch.jobs:square", {"x": 2.0}, 1, LIMIT_S, "", other)
    child_module.close_all()
    assert outcome.ended == "lost"
    assert outcome.error == (f"a worker has {computing()[1]}; the batch is computed with numpy 0.1")


def test_an_error_is_full_only_when_the_disk_is() -> None:
    """Negative control of the full disk, and a cause behind a sentence."""
    assert failure(OSError(13, "Permission denied")).ended == "failed"
    wrapped = InputError("a.h5", "cannot be written", "room")
    wrapped.__cause__ = OSError(28, "No space left on device")
    assert failure(wrapped) == JobOutcome("full", "a.h5: cannot be written; expected room.")


def test_the_index_of_many_jobs_is_written_now_and_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thousand changes while a write takes as long as they need must not be a thousand writes."""
    now, written = [0.0], []
    monkeypatch.setattr(index_module.time, "monotonic", lambda: now[0])

    def slowly(path: Path, text: str, fix: str) -> None:
        written.append(path)
        now[0] += 0.05

    monkeypatch.setattr(index_module, "write_text", slowly)
    index = BatchIndex(
        tmp_path / "index.json", {"batch": "many"}, {f"j{n}": Entry() for n in range(50)}, began=0.0
    )
    for _ in range(1000):
        now[0] += 0.1
        index.changed()
    assert 50 < len(written) <= 1 + 100 / 1.0 * 1.05, "a twentieth of the time at most"
