"""A run that is killed at random moments and resumed ends bit for bit where an undisturbed one does, and its
file is always whole.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app, main
from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.results.file import read
from identify.results.fit import FitResult

CONFIG = Path(__file__).parents[1] / "configs" / "umons_tx200.yaml"
KILLS = 8


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """The TX200 study with a global search that takes some seconds."""
    text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
    text = text.replace(
        "{kind: nelder-mead, evaluations: 20000}",
        "[{kind: differential-evolution, evaluations: 6000}, nelder-mead]",
    )
    path = tmp_path / "long.yaml"
    path.write_text(
        text.replace("target_cost: 1.0e-3 ", "target_cost: 1.0e-12 ").replace("starts: 10", "starts: 4")
    )
    return path


@pytest.fixture(scope="module")
def programs() -> ForkServerContext:
    """Starts processes that have imported the program already, so that kills hit its work and not its
    imports.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(
        [
            "identify.cli",
            "identify.vibration.run",
            "identify.reports.show",
            "scipy.stats",
            "tests.test_resume",
        ]
    )
    return context


def _main(words: list[str]) -> None:
    sys.argv, sys.stderr = ["identify", *words], open(os.devnull, "w")  # noqa: SIM115 - as long as the process
    main()


def _begun(programs: ForkServerContext, config: Path, out: Path, *options: str) -> BaseProcess:
    """A fit in a process of its own."""
    words = ["fit", str(config), "--out", str(out), "--no-report", "--quiet", *options]
    process = programs.Process(target=_main, args=(words,))
    process.start()
    return process


def _signal(process: BaseProcess, number: signal.Signals) -> None:
    assert process.pid is not None
    os.kill(process.pid, number)


def _ended(process: BaseProcess) -> int | None:
    """Its exit code, or the signal that ended it, negative."""
    process.join(timeout=300)
    return process.exitcode


def _part(out: Path) -> Path:
    return out.with_name(f"{out.name}.part")


def _wait_until_under_way(process: BaseProcess, out: Path) -> None:
    """Until the run has put something new into its part file."""
    part = _part(out)
    before, end = part.stat().st_size if part.exists() else 0, time.monotonic() + 60
    while (
        process.is_alive() and time.monotonic() < end and not (part.exists() and part.stat().st_size > before)
    ):
        time.sleep(0.02)


def _same(one: FitResult, other: FitResult) -> None:
    assert np.array_equal(one.parameters.value, other.parameters.value)
    assert np.array_equal(one.parameters.std, other.parameters.std, equal_nan=True)
    assert one.cost == other.cost
    assert np.array_equal(one.history[:, :4], other.history[:, :4])  # the last column is time
    for name in ("initial", "final", "cost", "evaluations"):
        assert np.array_equal(getattr(one.starts, name), getattr(other.starts, name))


def test_killed_eight_times_and_resumed(programs: ForkServerContext, config: Path, tmp_path: Path) -> None:
    undisturbed, disturbed = tmp_path / "undisturbed.h5", tmp_path / "disturbed.h5"
    assert _ended(_begun(programs, config, undisturbed)) in (0, 4)
    rng, kept = np.random.default_rng(7), [0]
    for number in range(KILLS):
        process = _begun(programs, config, disturbed, "--resume")
        if number % 2:
            _wait_until_under_way(process, disturbed)
        time.sleep(rng.uniform(0.0, 0.5))
        _signal(process, signal.SIGTERM if number % 4 == 3 else signal.SIGKILL)
        code = _ended(process)
        found = PartFile.read(_part(disturbed))
        if found is not None:
            kept.append(len(found.records))
        assert code in (0, 4, 130, -signal.SIGKILL)
    assert kept == sorted(kept), "no work that was saved is lost"
    assert kept[-1] > 0, "the kills must hit runs that are under way"
    assert _ended(_begun(programs, config, disturbed, "--resume")) in (0, 4)
    _same(read(undisturbed, FitResult), read(disturbed, FitResult))


def test_an_unfinished_run_is_no_result_and_belongs_to_its_study(
    programs: ForkServerContext, config: Path, tmp_path: Path
) -> None:
    out = tmp_path / "run.h5"
    process = _begun(programs, config, out)
    _wait_until_under_way(process, out)
    _signal(process, signal.SIGINT)
    assert _ended(process) == 130
    assert not out.exists(), "what is not finished is beside it"
    other = CliRunner().invoke(
        app, ["fit", str(config), "--out", str(out), "--no-report", "--quiet", "--resume", "--seed", "99"]
    )
    assert isinstance(other.exception, InputError)
    assert "another config, data or version" in str(other.exception)
    assert _part(out).exists(), "nothing is lost by the refusal"
