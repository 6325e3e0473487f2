"""A few of the troubles of `python -m tests.benchmarks.kills`, each told by what has been done, not by the
clock: whatever befalls a run, it is resumed to the same datasets, and what is finished stays.
"""

from __future__ import annotations

import re
import signal
import sys
import time
from multiprocessing.context import ForkServerContext
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError, InputErrors
from identify.core.part_file import DamagedPart, PartFile
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.vibration.run import run_fit
from tests.benchmarks.kills import Case, fits
from tests.programs import Trouble, begun, differences, part_of, programs, wait_for_more

KILLS, EVALUATIONS = 6, 1000

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends signals as POSIX has them")


@pytest.fixture(scope="module")
def context() -> ForkServerContext:
    """Where programs come from."""
    return programs()


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    """A fit of some seconds."""
    [found] = [
        one for one in fits(tmp_path_factory.mktemp("study"), EVALUATIONS) if "differential" in one.name
    ]
    return found


@pytest.fixture(scope="module")
def calm(case: Case) -> Path:
    """Its undisturbed result."""
    config = Path(case.words[1])
    return run_fit(config, config.with_name("calm.h5"), {})[1][0]


def _words(case: Case, out: Path, *more: str) -> list[str]:
    return [*case.words, "--out", str(out), "--no-report", "--quiet", *more]


def _resumed(case: Case, out: Path, calm: Path) -> None:
    run_fit(Path(case.words[1]), out, {}, resume=True)
    assert differences(calm, out) == []
    assert [path.name for path in out.parent.iterdir() if path.name.startswith(out.name[:3])] == [out.name]
    assert not list(out.parent.glob(".*"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_signal_in_the_middle_of_a_write(
    context: ForkServerContext, case: Case, calm: Path, tmp_path: Path, number: signal.Signals
) -> None:
    out, said = tmp_path / "out.h5", tmp_path / "said.txt"
    run = begun(context, _words(case, out), said, Trouble((number, 1), each_record=True))
    assert run.ended() == (-9 if number == signal.SIGKILL else 130)
    assert said.read_text().endswith(
        "" if number == signal.SIGKILL else "interrupted; resume with `--resume`\n"
    )
    assert not out.exists()
    _resumed(case, out, calm)


def test_twice_in_a_row(context: ForkServerContext, case: Case, calm: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.h5"
    run = begun(context, _words(case, out), tmp_path / "said.txt", Trouble(each_record=True))
    wait_for_more(run, part_of(out))
    run.signal(signal.SIGINT)
    run.signal(signal.SIGINT)
    assert run.ended() == 130
    assert PartFile.read(part_of(out)) is not None
    _resumed(case, out, calm)


def test_killed_again_and_again_at_any_moment(
    context: ForkServerContext, case: Case, calm: Path, tmp_path: Path
) -> None:
    out, rng, kept = tmp_path / "out.h5", np.random.default_rng(7), [0]
    for number in range(KILLS):
        run = begun(context, _words(case, out, "--resume"), tmp_path / "said.txt", Trouble(each_record=True))
        if number % 2:
            wait_for_more(run, part_of(out))
        time.sleep(rng.uniform(0.0, 0.2))
        run.signal(signal.SIGTERM if number % 4 == 3 else signal.SIGKILL)
        assert run.ended() in (0, 4, 130, -signal.SIGKILL)
        found = PartFile.read(part_of(out))
        kept += [] if found is None else [len(found.records)]
    assert kept == sorted(kept), "no work that was saved is lost"
    assert kept[-1] > 0, "the kills must hit runs that are under way"
    _resumed(case, out, calm)


def test_a_finished_result_stays_until_the_new_one_is_finished(
    context: ForkServerContext, case: Case, calm: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.h5"
    out.write_bytes(calm.read_bytes())
    run = begun(context, _words(case, out), tmp_path / "said.txt", Trouble(each_record=True))
    wait_for_more(run, part_of(out))
    run.signal(signal.SIGINT)
    assert run.ended() == 130
    assert out.read_bytes() == calm.read_bytes()


def test_a_full_disk_is_a_sentence(
    context: ForkServerContext, case: Case, calm: Path, tmp_path: Path
) -> None:
    out, said = tmp_path / "out.h5", tmp_path / "said.txt"
    largest = calm.stat().st_size - 1000
    assert begun(context, _words(case, out), said, Trouble(largest_file=largest)).ended() == 2
    assert "out.h5: cannot be written" in said.read_text()
    part = PartFile.read(part_of(out))
    assert part is not None and len(part.records) > 10
    assert not out.exists()
    _resumed(case, out, calm)


def test_a_disk_that_fills_during_the_journal_is_a_sentence_and_keeps_its_whole_records(
    context: ForkServerContext, case: Case, calm: Path, tmp_path: Path
) -> None:
    out, said = tmp_path / "out.h5", tmp_path / "said.txt"
    trouble = Trouble(largest_file=3000, each_record=True)
    assert begun(context, _words(case, out), said, trouble).ended() == 2
    assert "out.h5.part: cannot be written" in said.read_text()
    part = PartFile.read(part_of(out))
    assert part is not None and len(part.records) > 3
    _resumed(case, out, calm)


def test_a_second_run_is_refused_and_the_first_is_not_disturbed(
    context: ForkServerContext, case: Case, calm: Path, tmp_path: Path
) -> None:
    out, said = tmp_path / "out.h5", tmp_path / "second.txt"
    first = begun(context, _words(case, out), tmp_path / "said.txt", Trouble(each_record=True))
    wait_for_more(first, part_of(out))
    first.signal(signal.SIGSTOP)  # or it might have ended before the second has begun
    assert begun(context, _words(case, out), said).ended() == 2
    assert "another run is writing it" in said.read_text()
    first.signal(signal.SIGCONT)
    assert first.ended() in (0, 4)
    assert differences(calm, out) == []


def test_an_altered_cost_is_computed_again(case: Case, calm: Path, tmp_path: Path) -> None:
    """And so is all that follows it; a run that replays an altered cost as it is would end elsewhere."""
    out, config = tmp_path / "out.h5", Path(case.words[1])
    part = PartFile(part_of(out), "")
    _interrupted(config, out, 40)
    whole = part.path.read_bytes()
    at = len(whole) // 2
    part.path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])
    with pytest.warns(DamagedPart, match="damaged"):
        run_fit(config, out, {}, resume=True)
    assert differences(calm, out) == []


def _interrupted(config: Path, out: Path, steps: int) -> None:
    from identify.fitting.fit import Progress

    seen = [0]

    def stop(*_: object) -> None:
        seen[0] += 1
        if seen[0] == steps:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_fit(config, out, {}, Progress(stop))


def test_every_input_is_in_the_key(case: Case, tmp_path: Path) -> None:
    """A run is not resumed once a file that the study names has changed; with a comment more it has."""
    config, out = tmp_path / "study.yaml", tmp_path / "out.h5"
    for path in Path(case.words[1]).parent.glob("*.[cu]*"):
        (tmp_path / path.name).write_text(path.read_text())
    again = re.sub(r"(\d)\n", lambda digit: f"{9 - int(digit[1])}\n", (tmp_path / "p1.csv").read_text())
    (tmp_path / "again.csv").write_text(again)
    reference = tmp_path / "reference.yaml"
    reference.write_text("source: somebody\nparameters: {joint1.rz.stiffness: 1.0e+5}\n")
    text = Path(case.words[1]).read_text().replace("{file: p1.csv,", "{file: p1.csv, repeats: [again.csv],")
    config.write_text(f"{text}reference: reference.yaml\n")
    _interrupted(config, out, 3)
    for name in ("robot.urdf", "points.csv", "p1.csv", "again.csv", "reference.yaml"):
        before = (tmp_path / name).read_text()
        (tmp_path / name).write_text(before + "\n")
        with pytest.raises(InputError, match="another config, data or version"):
            run_fit(config, out, {}, resume=True)
        (tmp_path / name).write_text(before)
    with pytest.raises(InputError, match="another config, data or version"):
        run_fit(config, out, {"seed": 99}, resume=True)
    assert part_of(out).exists(), "nothing is lost by a refusal"


@pytest.mark.parametrize("name", ["day1/posture 1", ".", "a%2Fb"])
def test_any_name_of_a_measurement_comes_back(case: Case, tmp_path: Path, name: str) -> None:
    config = Path(case.words[1]).with_name("named.yaml")
    text = Path(case.words[1]).read_text().replace(f"evaluations: {EVALUATIONS}", "evaluations: 20")
    config.write_text(text.replace("{file: p1.csv,", f"{{file: p1.csv, name: '{name}',"))
    out = tmp_path / "out.h5"
    CliRunner().invoke(app, ["fit", str(config), "--out", str(out), "--quiet"], catch_exceptions=False)
    assert list(result_file.read(out, FitResult).measurements) == [name]
    assert name in out.with_suffix(".html").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--profile", "joint9.rz.stiffness"], "no free parameter 'joint9.rz.stiffness'"),
        (["--seed", "-1"], "greater than or equal to 0"),
        (["--seed", str(10**30)], "less than 9223372036854775808"),
        (["--out", "{folder}/taken.h5"], "no result of identify"),
        (["--out", "{folder}"], "is a folder"),
        (["--out", "{folder}/page.h5"], "where a report will be written"),
        (["--out", "{folder}/out.pdf"], "where a report will be written"),
        (["--out", "{folder}/taken.h5/out.h5"], "cannot be written"),
    ],
)
def test_what_can_be_refused_is_refused_before_the_work(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], said: str
) -> None:
    (tmp_path / "taken.h5").write_text("measured, and nobody's result")
    (tmp_path / "page.html").mkdir()
    monkeypatch.setattr("identify.vibration.run.fit", lambda *_: pytest.fail("the work has begun"))
    words = [word.format(folder=tmp_path) for word in words]
    words = words if "--out" in words else [*words, "--out", str(tmp_path / "out.h5")]
    with pytest.raises((InputError, InputErrors), match=said):
        CliRunner().invoke(app, [*case.words, *words, "--no-report"], catch_exceptions=False)
    assert (tmp_path / "taken.h5").read_text() == "measured, and nobody's result"


@pytest.mark.parametrize(("off_deg", "advised"), [(8.0, True), (0.0, False)])
def test_a_large_gap_says_what_to_do_next(case: Case, tmp_path: Path, off_deg: float, advised: bool) -> None:
    """A joint stands elsewhere than stated."""
    config = Path(case.words[1]).with_name("advised.yaml")
    angle = re.compile(r"posture_deg: \[([-\d.]+), ([-\d.]+)")
    text = angle.sub(
        lambda m: f"posture_deg: [{m[1]}, {float(m[2]) + off_deg}", Path(case.words[1]).read_text(), count=1
    )
    config.write_text(
        text.replace(f"kind: differential-evolution, evaluations: {EVALUATIONS}", "kind: gauss-newton")
    )
    out = tmp_path / "out.h5"
    done = CliRunner().invoke(app, ["fit", str(config), "--out", str(out)], catch_exceptions=False)
    assert (f"next: identify discover {config}" in done.output) is advised
    assert ("identify discover advised.yaml" in out.with_suffix(".html").read_text()) is advised
