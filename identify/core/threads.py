"""One thread for linear algebra: matrices here are small, and processes beside each other share the cores."""

from __future__ import annotations

import scipy.linalg  # noqa: F401
from threadpoolctl import threadpool_limits


def one_thread() -> threadpool_limits:
    """Linear algebra in one thread from now on, or until the end of the context it is used as.

    A limit reaches only libraries that are loaded: scipy brings one of its own with `scipy.linalg`, which is
    therefore imported here.
    """
    return threadpool_limits(1)
