"""A Dask scheduler: what is wrong with it in a sentence and at once, its workers' versions, and nothing left
behind; the commands of the documentation, run as they stand.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace

import pytest

from identify.batch import executor as cluster_module
from identify.batch.child import close_all, end, perform
from identify.batch.executor import open_executor
from identify.batch.job import Job
from identify.batch.loop import BatchIndex, Entry, run_jobs
from identify.core.errors import InputError
from identify.results.provenance import computing

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
BIN = Path(sys.executable).parent


@pytest.fixture(autouse=True)
def _with_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "_CONNECT_S", 2.0)
    pytest.importorskip("distributed", reason="Dask is not installed (the extra `cluster`)")


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("nonsense", "'nonsense' is no address; expected the address of a running Dask scheduler"),
        ("127.0.0.1:8786", "is no address"),
        ("http://127.0.0.1:8786", "is no address"),
        ("tcp://127.0.0.1:99999", "is no address"),
        ("tcp://127.0.0.1:9", r"no scheduler answers at tcp://127\.0\.0\.1:9 "),
        ("tcp://nowhere.invalid:8786", "no scheduler answers at tcp://nowhere.invalid"),
        ("tls://127.0.0.1:9", "needs certificates, and none are set; expected `ca-file`"),
    ],
)
def test_a_wrong_address_is_one_sentence_before_dask_tries_it(
    address: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import distributed

    monkeypatch.setattr(distributed, "Client", lambda *some, **more: pytest.fail("Dask was asked"))
    with pytest.raises(InputError, match=f"--cluster: .*{said}") as told, open_executor(cluster=address):
        pass
    assert str(told.value).count("\n") == 0


def test_what_listens_and_says_nothing_is_no_scheduler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "_CONNECT_S", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(InputError, match="asks for certificates"), open_executor(cluster=address):
            pass


def _client(answer: object) -> SimpleNamespace:
    """Of one worker that answers so."""
    return SimpleNamespace(run=lambda what, *arguments, on_error: {"tcp://10.0.0.6:1": answer})


def test_workers_of_other_versions_are_refused() -> None:
    here = computing()
    assert {one.split()[0] for one in here} >= {"identify", "numpy", "scipy"}
    cluster_module._check_versions(_client(here))
    for number in range(len(here)):
        name = here[number].split()[0]
        there = (*here[:number], f"{name} 0.0.1", *here[number + 1 :])
        said = f"worker at tcp://10.0.0.6:1 has {name} 0.0.1; expected {re.escape(here[number])}"
        with pytest.raises(InputError, match=said):
            cluster_module._check_versions(_client(there))
    with pytest.raises(InputError, match=r"another identify .AttributeError: computing"):
        cluster_module._check_versions(_client(AttributeError("computing")))


def test_workers_are_asked_for_the_versions_of_the_client(
    cluster: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours = ("identify 99", *computing()[1:])
    asked = cluster_module.computing
    monkeypatch.setattr(cluster_module, "computing", lambda: ours)
    told = list[object]()
    monkeypatch.setattr(cluster_module, "_check_versions", told.append)  # as of one that comes later
    with open_executor(cluster=cluster) as executor:
        outcome = executor.submit(Job("j", "tests.batch.jobs:square", {"x": 2.0}), 1, 30.0).result()
    assert len(told) == 1, "those that are there are asked at once"
    assert outcome.ended == "lost"
    assert f"a worker has {asked()[0]}; the batch is computed with identify 99" in outcome.error


def test_an_interrupted_batch_leaves_nothing_on_the_cluster(cluster: str, tmp_path: Path) -> None:
    """Fits that went on would hold the files of the batch that is resumed."""
    marks = [tmp_path / f"mark{n}" for n in range(2)]
    jobs = [Job(one.name, "tests.batch.jobs:held_up", {"mark": str(one)}) for one in marks]
    index = BatchIndex(tmp_path / "index.json", {}, {job.name: Entry() for job in jobs})

    def interrupt(shown: BatchIndex) -> None:
        if all(one.is_file() and one.read_text() for one in marks):
            raise KeyboardInterrupt

    with open_executor(cluster=cluster) as executor, pytest.raises(KeyboardInterrupt):
        run_jobs(jobs, executor, index, None, interrupt)
    pids = [int(one.read_text()) for one in marks]
    late = time.monotonic() + 10
    while any(_lives(pid) for pid in pids) and time.monotonic() < late:
        time.sleep(0.05)
    assert not any(_lives(pid) for pid in pids)
    with open_executor(cluster=cluster) as executor:  # the workers themselves go on
        done = executor.submit(Job("j", "tests.batch.jobs:square", {"x": 3.0}), 1, 30.0).result()
        assert logging.getLogger("distributed.client").level == logging.CRITICAL, "no tracebacks of Dask's"
    assert logging.getLogger("distributed.client").level < logging.CRITICAL
    assert done.value == {"value": 9.0}


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_no_job_of_a_batch_that_has_ended_begins() -> None:
    end("over")
    try:
        assert perform("tests.batch.jobs:square", {"x": 2.0}, 1, 30.0, "over").error == "its batch has ended"
        assert perform("tests.batch.jobs:square", {"x": 2.0}, 1, 30.0, "other").value == {"value": 4.0}
    finally:
        close_all()


def _blocks(title: str) -> list[str]:
    """The shell commands of a chapter of the page."""
    chapter = PAGE[PAGE.index(f"## {title}") :].split("\n## ")[0]
    return re.findall(r"```sh\n(.*?)```", chapter, flags=re.DOTALL)


@contextlib.contextmanager
def _started(commands: str, home: Path, port: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    """The scheduler and the worker of some commands; ended afterwards."""
    environment = {**os.environ, "HOME": str(home), "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}
    lines = [line.split() for line in commands.splitlines() if line.startswith("dask ")]
    with (home / "log").open("wb") as log, contextlib.ExitStack() as stack:
        begun = []
        for words in lines:
            one = subprocess.Popen(
                words, env=environment, cwd=home, stdout=log, stderr=log, start_new_session=True
            )
            stack.callback(_end, one)
            begun.append(one)
        late = time.monotonic() + 60
        while not _answers(port) and time.monotonic() < late:
            assert all(one.poll() is None for one in begun), (home / "log").read_text()
            time.sleep(0.1)
        yield begun


def _end(one: subprocess.Popen[bytes]) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(one.pid, signal.SIGKILL)
    one.wait()


def _answers(port: int) -> bool:
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
        return True
    return False


def _square(address: str) -> object:
    with open_executor(cluster=address) as executor:
        return executor.submit(Job("j", "tests.batch.jobs:square", {"x": 3.0}), 1, 60.0).result().value


def _listening(begun: Sequence[subprocess.Popen[bytes]]) -> set[str]:
    """The addresses at which these processes and those below them listen."""
    import psutil  # comes with Dask

    every = [psutil.Process(one.pid) for one in begun]
    every += [child for one in every for child in one.children(recursive=True)]
    return {c.laddr.ip for one in every for c in one.net_connections("tcp") if c.status == "LISTEN"}


@pytest.mark.skipif(sys.platform != "linux", reason="the commands of the page are run in a shell of Linux")
@pytest.mark.parametrize("title", ["On one machine", "On several machines"])
def test_the_commands_of_the_page_work_and_listen_on_this_machine_only(title: str, tmp_path: Path) -> None:
    import dask.config

    blocks, settings = _blocks(title), tmp_path / ".config" / "dask"
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    if len(blocks) == 2:
        environment = {**os.environ, "HOME": str(tmp_path)}
        subprocess.run(["sh", "-ec", blocks[0]], check=True, env=environment, capture_output=True)
        assert (settings / "key.pem").stat().st_mode & 0o077 == 0, "nobody else reads the key"
    commands = re.sub(r"--nworkers \d+", "--nworkers 1", blocks[-1].replace("8786", str(port)))
    commands = re.sub(r"10\.0\.0\.[56]", "127.0.0.1", commands)
    address = re.findall(r"--cluster (\S+)", commands)[0]
    with _started(commands, tmp_path, port) as begun:
        told = dask.config.merge(dask.config.config, dask.config.collect([str(settings)], {}))
        with dask.config.set(told):
            assert _square(address) == {"value": 9.0}, (tmp_path / "log").read_text()
        assert _listening(begun) == {"127.0.0.1"}
        if address.startswith("tls"):
            for other, said in (
                (address, "none are set"),
                (address.replace("tls", "tcp"), "asks for certif"),
            ):
                with pytest.raises(InputError, match=said):
                    _square(other)
