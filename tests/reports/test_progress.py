"""What a run shows while it goes on."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from identify.fitting.fit import Progress
from identify.reports import shown
from identify.reports.progress import StartCount, progress_bar, story
from identify.reports.shown import Lines, working


class Clock:
    """A time that is set."""

    def __init__(self) -> None:
        self.time = 0.0

    def __call__(self) -> float:
        """Now, s."""
        return self.time


def test_a_stage_is_a_line_and_silence_is_broken_after_ten_seconds() -> None:
    said: list[str] = []
    clock = Clock()
    lines = Lines(said.append, clock)
    lines.tell("reading", stage="reading")
    lines.tell("trying: 1 of 30", 1, 30, "trying")
    lines.tell("trying: 2 of 30", 2, 30, "trying")
    assert said == ["reading", "trying: 1 of 30"], "one line per stage"
    clock.time = 9.9
    lines.beat()
    assert len(said) == 2, "not silent for long enough"
    clock.time = 10.0
    lines.beat()
    assert said[2:] == ["trying: 2 of 30 (10 s)"]
    clock.time = 15.0
    lines.say("found")
    clock.time = 20.0
    lines.beat()
    assert said[3:] == ["found"]


def test_the_beat_is_heard_from_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shown, "SILENCE_S", 0.01)
    heard = threading.Event()
    said: list[str] = []

    def write(text: str) -> None:
        said.append(text)
        heard.set()

    with Lines(write).alive("reading"):
        assert heard.wait(30)
    assert said[0].startswith("reading (")


def test_only_the_cost_of_the_result_is_shown() -> None:
    said: list[str] = []
    count = StartCount(Lines(said.append))
    for evaluations, best in ((1, np.nan), (2, np.nan), (1, 60.0), (2, 48.9)):
        count(0, 10, "gauss-newton", evaluations, best)
    assert said == ["start 1 of 10, gauss-newton", "start 1 of 10, gauss-newton, best cost 60"]
    for start in range(1, 11):
        count(start, 10, "gauss-newton", 1, np.nan)
    assert said[-2:] == [
        "start 10 of 10, gauss-newton, best cost 48.9",
        "one more start, gauss-newton, best cost 48.9",
    ]
    count.ended()
    assert said[-1] == "intervals and modes of the best start, best cost 48.9"


def test_a_bar_is_never_full_before_the_end() -> None:
    seen: list[tuple[int | None, int | None]] = []

    class Bar:
        """Keeps what it is told."""

        def tell(
            self, what: str, done: int | None = None, total: int | None = None, stage: object = ""
        ) -> None:
            """Keep it."""
            seen.append((done, total))

        def say(self, sentence: str) -> None:
            """Nothing."""

    count = StartCount(Bar())
    for start in range(11):
        count(start, 10, "gauss-newton", 1, 1.0)
    assert all(done is not None and total is not None and done < total for done, total in seen)
    assert seen[-1] == (10, 11)


def test_what_has_no_parts_to_count_gives_a_sign_of_life(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(shown, "SILENCE_S", 0.01)
    said = ""
    with working(quiet=False, what="finding depth limits"):
        while not said:
            said = capfd.readouterr().err
    assert said.startswith("finding depth limits (0 s)")
    capfd.readouterr()  # what came before it ended
    ended = threading.Event()
    monkeypatch.setattr(shown, "Lines", lambda write: ended.set())
    with working(quiet=True, what="finding depth limits"):
        assert not ended.is_set()
    assert capfd.readouterr().err == ""


def test_a_pipe_gets_lines_and_quiet_gets_none(capfd: pytest.CaptureFixture[str]) -> None:
    with progress_bar(quiet=False) as bar:
        bar.show(0, 3, "hybrid", 1, 2.0)
    with story(quiet=False) as told:
        told.say("The present model: gap 8.")
        told.done(1, 2)
        told.done(2, 2)
    assert capfd.readouterr().err.splitlines() == [
        "start 1 of 3, hybrid, best cost 2",
        "The present model: gap 8.",
        "trying candidates: 1 of 2",
        "comparing the best candidates",
    ]
    with progress_bar(quiet=True) as bar, story(quiet=True) as told:
        bar.show(0, 3, "hybrid", 1, 2.0)
        told.say("nothing")
    assert capfd.readouterr().err == ""
    assert isinstance(bar, Progress)
