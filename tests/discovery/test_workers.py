"""Processes that try models end with the run that started them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


def _children(pid: int) -> list[int]:
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="needs /proc to see the processes")
def test_a_killed_run_leaves_no_processes(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "identify",
        "discover",
        str(CONFIG),
        "--workers",
        "2",
        "--out",
        str(tmp_path / "r.h5"),
        "--quiet",
    ]
    run = subprocess.Popen(command)
    try:
        end = time.monotonic() + 60
        while (
            len(_children(run.pid)) < 3 and time.monotonic() < end
        ):  # two workers and the tracker of shared resources
            time.sleep(0.05)
        children = _children(run.pid)
        time.sleep(1.0)
        assert len(children) >= 3
    finally:
        run.send_signal(signal.SIGKILL)
        run.wait()
    end = time.monotonic() + 30
    while any(_alive(pid) for pid in children) and time.monotonic() < end:
        time.sleep(0.05)
    assert not any(_alive(pid) for pid in children)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return (
        Path(f"/proc/{pid}/stat").exists()
        and Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    )
