"""A run that is killed at random moments and resumed ends bit for bit where an undisturbed one does, and its file is always whole."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from identify.errors import InputError
from identify.results import UNFINISHED, Result, Unfinished, kind_of, read

CONFIG = Path(__file__).parents[1] / "configs" / "umons_tx200.yaml"
KILLS = 20


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """The TX200 study with a global search that takes some seconds."""
    text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
    text = text.replace("{kind: nelder-mead, evaluations: 20000}", "[{kind: differential-evolution, evaluations: 6000}, nelder-mead]")
    path = tmp_path / "long.yaml"
    path.write_text(text.replace("target_cost: 1.0e-3 ", "target_cost: 1.0e-12 ").replace("starts: 10", "starts: 4"))
    return path


def _command(config: Path, out: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "identify", "fit", str(config), "--out", str(out), "--no-report", "--quiet", *options]


def _wait_until_under_way(process: subprocess.Popen[bytes], out: Path) -> None:
    """Until the run has written its file once more."""
    before, end = out.stat().st_mtime_ns if out.exists() else 0, time.monotonic() + 30
    while process.poll() is None and time.monotonic() < end and not (out.exists() and out.stat().st_mtime_ns > before):
        time.sleep(0.02)


def _same(one: Result, other: Result) -> None:
    assert np.array_equal(one.parameters.value, other.parameters.value)
    assert np.array_equal(one.parameters.std, other.parameters.std, equal_nan=True)
    assert one.cost == other.cost
    assert np.array_equal(one.history[:, :4], other.history[:, :4])  # the last column is time
    for name in ("initial", "final", "cost", "evaluations"):
        assert np.array_equal(getattr(one.starts, name), getattr(other.starts, name))


def test_killed_twenty_times_and_resumed(config: Path, tmp_path: Path) -> None:
    undisturbed, disturbed = tmp_path / "undisturbed.h5", tmp_path / "disturbed.h5"
    subprocess.run(_command(config, undisturbed), check=False, timeout=300)
    rng, kept = np.random.default_rng(7), [0]
    for number in range(KILLS):
        process = subprocess.Popen(_command(config, disturbed, "--resume"), stderr=subprocess.DEVNULL)
        if number % 2:
            _wait_until_under_way(process, disturbed)
        time.sleep(rng.uniform(0.0, 1.0))
        process.send_signal(signal.SIGTERM if number % 4 == 3 else signal.SIGKILL)
        code = process.wait(timeout=60)
        if kind_of(disturbed) == UNFINISHED:
            kept.append(len(read(disturbed, Unfinished).costs))
        assert code in (0, 4, 130, -signal.SIGKILL, -signal.SIGTERM, -signal.SIGINT)
    assert kept == sorted(kept), "no work that was saved is lost"
    assert kept[-1] > 0, "the kills must hit runs that are under way"
    subprocess.run(_command(config, disturbed, "--resume"), check=False, timeout=300)
    _same(read(undisturbed), read(disturbed))


def test_an_unfinished_run_is_no_result_and_belongs_to_its_study(config: Path, tmp_path: Path) -> None:
    out = tmp_path / "run.h5"
    process = subprocess.Popen(_command(config, out), stderr=subprocess.DEVNULL)
    while not out.exists() and process.poll() is None:
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 130
    with pytest.raises(InputError, match="interrupted"):
        read(out)
    other = subprocess.run(_command(config, out, "--resume", "--seed", "99"), check=False, capture_output=True, text=True)
    assert other.returncode == 2
    assert "another config, data or version" in other.stderr
    assert kind_of(out) == UNFINISHED, "nothing is lost by the refusal"
