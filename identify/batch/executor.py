"""Who does the jobs: processes of this machine, or the workers of a Dask scheduler, behind one interface.

Either way `identify.batch.child.perform` runs in a thread, with a worker process of its own: a thread of this
process, or of a Dask worker.  So the time limit, a killed worker and a crash are handled in one place.

The workers of a Dask scheduler are found, checked, and left without work of ours.  What cannot be right is
reported before Dask tries it: it would try for long, and say it in a traceback.
"""

from __future__ import annotations

import logging
import re
import socket
import ssl
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor as Pool
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from identify.batch.child import close_all, end, kill_all, perform
from identify.batch.job import Job, JobOutcome, performed
from identify.core.errors import InputError
from identify.core.threads import processors
from identify.results.provenance import computing, differing

_CONNECT_S, _ANSWER_S = 5.0, 20.0
"""Seconds in which a scheduler, and then all of its workers, must answer."""
_ADDRESS = re.compile(r"(?P<how>tcp|tls)://(\[(?P<six>[^\]]+)\]|(?P<host>[^:/\s]+)):(?P<port>\d{1,5})/?")
_EXPECTED = "the address of a running Dask scheduler, such as tls://10.0.0.5:8786"
_SEE = "see docs/cluster.md"
_LOGS = ("distributed", "distributed.client")
_SILENT = "what listens there is no scheduler, or one that asks for certificates, with an address of tls://"


@dataclass(frozen=True)
class Cluster:
    """A scheduler that answers; token: what its workers know this batch by."""

    client: Any
    pool: Pool
    token: str

    def submit(self, call: str, arguments: Any, attempt: int, limit_s: float | None) -> Future[Any]:
        """Begin a job on a worker of the versions that are here."""
        return self.pool.submit(perform, call, arguments, attempt, limit_s, self.token, computing())

    def threads(self) -> int:
        """Of all workers."""
        return int(sum(self.client.nthreads().values()))


@contextmanager
def joined(address: str) -> Iterator[Cluster]:
    """The cluster of a scheduler; at the end no worker goes on with what was begun here.

    InputError where Dask is not installed, no scheduler answers, or a worker has other versions.
    """
    client = _client(address)
    pool, token = client.get_executor(pure=False), uuid.uuid4().hex
    with _in_our_words():
        try:
            _check_versions(client)
            yield Cluster(client, pool, token)
        finally:
            with suppress(Exception):  # of a scheduler that is gone: its workers end by themselves
                pool.shutdown(wait=False)
            _asked(client, end, token)
            client.close()


@contextmanager
def _in_our_words() -> Iterator[None]:
    """Inside, Dask does not log what goes wrong, in tracebacks: it is reported in a sentence."""
    loggers = [logging.getLogger(name) for name in _LOGS]
    before = [one.level for one in loggers]
    for one in loggers:
        one.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for one, level in zip(loggers, before, strict=True):
            one.setLevel(level)


def _client(address: str) -> Any:
    try:
        dask = import_module("distributed")  # an optional extra
    except ImportError as error:
        fix = 'run `pip install ".[cluster]"` in the folder of identify'
        raise InputError("--cluster", "Dask is not installed", fix=fix) from error
    _check_answers(address, dask)
    try:
        return dask.Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError, RuntimeError) as error:
        found = f"no scheduler answers at {address} ({error})"
        raise InputError("--cluster", found, _EXPECTED, _SEE) from error


def _check_answers(address: str, dask: Any) -> None:
    """InputError unless something answers there, with certificates where these are asked for."""
    parts = _ADDRESS.fullmatch(address)
    if parts is None or int(parts["port"]) > 65535:
        raise InputError("--cluster", f"{address!r} is no address", _EXPECTED, _SEE)
    tls = _certificates(address, dask) if parts["how"] == "tls" else None
    try:
        _greeted(parts["six"] or parts["host"], int(parts["port"]), tls)
    except (ssl.SSLError, ConnectionResetError) as error:
        found = f"{address} does not take the certificates of this machine, or has others ({error})"
        raise InputError("--cluster", found, "the same certificates on all machines", _SEE) from error
    except OSError as error:
        found = f"no scheduler answers at {address} ({error})"
        raise InputError("--cluster", found, _EXPECTED, _SEE) from error


def _greeted(host: str, port: int, tls: ssl.SSLContext | None) -> None:
    """Wait for the first words of a scheduler, which speaks first; OSError where none comes.

    Of what listens and says nothing, as a scheduler that waits for certificates, Dask itself waits for ever.
    """
    with socket.create_connection((host, port), _CONNECT_S) as plain:
        there = plain if tls is None else tls.wrap_socket(plain, server_hostname=host)
        with there:
            try:
                said = there.recv(1)
            except TimeoutError as error:
                raise OSError(_SILENT) from error
            if not said:
                raise OSError(_SILENT)


def _certificates(address: str, dask: Any) -> ssl.SSLContext:
    """What Dask is told of TLS on this machine."""
    expected = "`ca-file`, and `cert` and `key` of the client, in the settings of Dask"
    try:
        parts = dask.Security().get_connection_args("client").get("ssl_context")
    except (OSError, ValueError) as error:
        found = f"the certificates for {address} cannot be read ({error})"
        raise InputError("--cluster", found, expected, _SEE) from error
    if not isinstance(parts, ssl.SSLContext):
        raise InputError("--cluster", f"{address} needs certificates, and none are set", expected, _SEE)
    return parts


def _check_versions(client: Any) -> None:
    """InputError for a worker that computes with other versions than this process."""
    here = computing()
    for worker, there in _asked(client, computing).items():
        if not isinstance(there, tuple):
            found = f"the worker at {worker} has another identify ({type(there).__name__}: {there})"
            raise InputError("--cluster", found, here[0], "install the same identify everywhere")
        if there != here:
            found = f"the worker at {worker} has {differing(there, here)}"
            raise InputError(
                "--cluster", found, differing(here, there), "install the same versions everywhere"
            )


def _asked(client: Any, what: Callable[..., Any], *arguments: Any) -> dict[str, Any]:
    """What every worker answers, or what went wrong there; nothing where they do not in time, because Dask
    waits for a worker that is lost for minutes.
    """
    answers: dict[str, Any] = {}

    def ask() -> None:
        with suppress(Exception):
            answers.update(client.run(what, *arguments, on_error="return"))

    asking = threading.Thread(target=ask, daemon=True)
    asking.start()
    asking.join(_ANSWER_S)
    return dict(answers)


_ASK_S = 2.0
_LEAST_ON_CLUSTER = 8
"""Jobs kept in the queue of a cluster without workers, so that one that grows with its queue begins to."""


@dataclass(frozen=True)
class Executor:
    """begin: starts a call with its arguments, attempt and time limit, as `perform` has them; slots: how many
    jobs to keep under way, which may change; about: what it is, for people.
    """

    begin: Callable[[str, Mapping[str, Any], int, float | None], Future[JobOutcome]]
    slots: Callable[[], int]
    about: str

    def submit(self, job: Job, attempt: int, limit_s: float | None) -> Future[JobOutcome]:
        """Begin a job; the future never raises but where the workers themselves are gone."""
        return self.begin(job.call, job.arguments, attempt, limit_s)


def here() -> Executor:
    """An executor that does each job at once, in this process: for what takes less time than to start
    another.
    """

    def begin(
        call: str, arguments: Mapping[str, Any], attempt: int, limit_s: float | None
    ) -> Future[JobOutcome]:
        done = Future[JobOutcome]()
        done.set_result(performed(call, arguments, attempt))
        return done

    return Executor(begin, lambda: 1, "this process")


@contextmanager
def open_executor(workers: int | None = None, cluster: str | None = None) -> Iterator[Executor]:
    """An executor with that many local workers (default: one per processor), or on the Dask scheduler at an
    address.

    At the end its workers are ended; those of a cluster are left, without what they were doing.  InputError
    where there is no scheduler, or no Dask, or workers of other versions.
    """
    if cluster is not None:
        with _dask(cluster) as executor:
            yield executor
        return
    count = workers or processors()
    pool = ThreadPoolExecutor(count, thread_name_prefix="identify-worker")
    try:
        about = f"{count} local worker{'s' if count > 1 else ''}"
        yield Executor(lambda *job: pool.submit(perform, *job), lambda: count, about)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        kill_all()
        pool.shutdown(wait=True)
        close_all()


@contextmanager
def _dask(address: str) -> Iterator[Executor]:
    with joined(address) as cluster:
        seen = [-_ASK_S, 0.0]

        def slots() -> int:
            if time.monotonic() - seen[0] > _ASK_S:
                seen[:] = [time.monotonic(), cluster.threads()]
            return max(_LEAST_ON_CLUSTER, 2 * int(seen[1]))

        about = f"Dask at {address}, {cluster.threads()} workers at the start"
        yield Executor(cluster.submit, slots, about)
