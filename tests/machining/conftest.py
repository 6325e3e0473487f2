"""Small matrices: threads of BLAS cost more than they bring, as in the commands, which use one."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="package", autouse=True)
def one_thread() -> Iterator[None]:
    """One thread of BLAS."""
    with threadpool_limits(1):
        yield
