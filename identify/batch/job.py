"""A job and how it ended: plain data, so that both may go to another process or another machine as JSON."""

from __future__ import annotations

import errno
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any, Literal, Self

from identify.core.errors import InputError, InputErrors

Ended = Literal["done", "failed", "lost", "full"]
"""done; failed: it said why, or took too long; lost: its worker died; full: there is no room on the disk."""
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT)


@dataclass(frozen=True)
class Job:
    """A named call: `call` is `module:function`, its keyword arguments and what it returns are JSON.

    The function is given `attempt` (1, 2, ...) besides: a later attempt may find what an earlier one left.
    """

    name: str
    call: str
    arguments: Mapping[str, Any]


@dataclass(frozen=True)
class JobOutcome:
    """How a job ended: why it failed (a sentence), what it returned, and how long it took, s."""

    ended: Ended
    error: str = ""
    value: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0


def performed(call: str, arguments: Mapping[str, Any], attempt: int) -> JobOutcome:
    """What a call `module:function` comes to, in this process."""
    began = time.perf_counter()
    with _Attempt() as tried:
        module, name = call.split(":")
        value = getattr(import_module(module), name)(**arguments, attempt=attempt)
        tried.outcome = JobOutcome("done", value=dict(value or {}))
    return replace(tried.outcome, seconds=time.perf_counter() - began)


class _Attempt:
    """A job under way: whatever goes wrong in it is its outcome, and does not end the process."""

    outcome = JobOutcome("lost")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if isinstance(error, Exception):
            self.outcome = failure(error)
        return isinstance(error, Exception)


def failure(error: BaseException) -> JobOutcome:
    """The outcome of a job that raised: input errors speak for themselves, others are named."""
    known = isinstance(error, (InputError, InputErrors))
    sentence = str(error) if known else f"{type(error).__name__}: {error}"
    return JobOutcome("full" if no_room(error) else "failed", " ".join(sentence.split()))


def no_room(error: BaseException) -> bool:
    """Whether an error, or what caused it, is a full disk."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and (
            cause.errno in _NO_ROOM or "No space left on device" in str(cause)
        ):
            return True
        cause = cause.__cause__ or cause.__context__
    return False
