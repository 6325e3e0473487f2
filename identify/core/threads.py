"""Threads: one for linear algebra, because matrices here are small; several for many matrices or sets of
data, each thread with its own, but not in processes beside each other, which share the cores.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import scipy.linalg  # noqa: F401
from threadpoolctl import threadpool_limits

Part = TypeVar("Part")
Made = TypeVar("Made")
_MOST = 8


@dataclass
class _Share:
    """How many threads this process may work in."""

    threads: int


def one_thread() -> threadpool_limits:
    """Linear algebra in one thread from now on, or until the end of the context it is used as.

    A limit reaches only libraries that are loaded: scipy brings one of its own with `scipy.linalg`, which is
    therefore imported here.
    """
    return threadpool_limits(1)


def processors() -> int:
    """The processors that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1


_share = _Share(min(processors(), _MOST))


def threads() -> int:
    """How many this process may work in."""
    return _share.threads


def work_in(count: int) -> None:
    """From now on this process works in so many threads: one where others run beside it."""
    _share.threads = count


def each(work: Callable[[Part], Made], parts: Sequence[Part]) -> list[Made]:
    """What `work` makes of each part, in their order, in as many threads as this process may work in.

    It saves time only where `work` is mostly in long calls that let other threads run, as those of
    `numpy.linalg` do; many short calls wait for each other.
    """
    count = min(len(parts), threads())
    if count < 2:
        return [work(part) for part in parts]
    with ThreadPoolExecutor(count, thread_name_prefix="identify-part") as pool:
        return list(pool.map(work, parts))
