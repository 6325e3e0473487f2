"""What all tests share."""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import settings

from identify.core.threads import work_in

# No test depends on how fast the machine is.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

# Tests interrupt processes of their own, which would inherit the deafness of a test run that was started in
# the background.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Processes that run tests side by side share the processors, as those of a run do.
if "PYTEST_XDIST_WORKER" in os.environ:
    work_in(1)


_LONG = (
    *("test_every_command.py", "test_discover.py", "test_missing.py", "test_kinds.py", "test_at_once.py"),
    *("test_registration.py", "test_cli.py", "test_beside_springs.py", "test_bodies.py", "test_explain.py"),
    *("test_hypotheses.py", "test_nonlinear.py", "test_near_lanes.py", "test_kills.py", "test_batch.py"),
    *("test_stated_uncertainty.py", "test_decide.py", "test_optimizers.py", "test_borders.py"),
    *("test_contract.py", "test_house.py", "test_mistakes.py"),
)
"""Names of files that take long, or have many tests that do, the longest first."""


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files first, because one at the end keeps other processes waiting: those of the list, then files
    of few tests, which are longer than others.
    """
    tests = Counter(item.path for item in items)
    first = {name: number - len(_LONG) for number, name in enumerate(_LONG)}
    items.sort(key=lambda item: (first.get(item.path.name, 0), tests[item.path], str(item.path)))


def pytest_collection_finish() -> None:
    """Spare the garbage collector what stays until the end: all modules and tests."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Memory that a file's tests have freed goes back to the system: glibc keeps what lies between small
    things that stay, and a long run would grow to gigabytes.
    """
    if sys.platform == "linux" and (nextitem is None or nextitem.path != item.path):
        with suppress(OSError, AttributeError):  # of another C library
            ctypes.CDLL(None).malloc_trim(0)


@pytest.fixture(scope="session")
def planar_fit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result file of a fitted planar arm, with `tool.yaml` beside it."""
    from tests.machining.planar_fit import write_fit

    return write_fit(tmp_path_factory.mktemp("planar"))


@pytest.fixture(scope="module")
def no_measured_modes() -> Iterator[None]:
    """The modes of measured FRFs are not looked for, which takes a third of a small run: tests of them are in
    tests/vibration/test_measured_modes.py and tests/modal.
    """
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("identify.vibration.measured_modes._identified", lambda *_: None)
        yield
