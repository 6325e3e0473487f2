"""The benchmark of mutants sees what it looks for."""

from __future__ import annotations

import faulthandler
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks import hostile
from tests.hostile.kinds import Facts, Kind
from tests.hostile.mutate import Mutant

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="mutants are read in forked processes")


def _whole(path: Path) -> Facts:
    return {"a": np.frombuffer(path.read_bytes().ljust(9)[:9], np.uint8).copy()}


def _broken(path: Path) -> Facts:
    if path.stem == "mutant":
        raise KeyError(path)
    return _whole(path)


def _dying(path: Path) -> Facts:
    if path.stem == "mutant":
        faulthandler.disable()  # the test is to see it die, not to print where
        os.kill(os.getpid(), 11)
    return _whole(path)


def _hanging(path: Path) -> Facts:
    if path.stem == "mutant":
        time.sleep(60)
    return _whole(path)


def _wrong(path: Path) -> Facts:
    return {"a": _whole(path)["a"] + (path.stem == "mutant")}


@pytest.mark.parametrize(
    ("read", "verdict"), [(_broken, "traceback"), (_dying, "crash"), (_hanging, "hang"), (_wrong, "silent")]
)
def test_each_class_is_seen(
    read: Callable[[Path], Facts], verdict: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hostile, "LIMIT_S", 0.2)
    monkeypatch.setattr(hostile, "mutant_of", lambda *_: Mutant("bit", b"\n234567890", 5, 6))
    file = tmp_path / "whole.txt"
    file.write_bytes(b"\n23456789")
    kind = Kind("x", file, read, exact=True)
    assert [outcome[:2] for outcome in hostile.run(kind, [0, 1], 1, tmp_path)] == [(0, verdict), (1, verdict)]
