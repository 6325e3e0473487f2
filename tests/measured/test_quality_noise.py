"""A bad channel is named before all others, and clean tests name none, whatever hardly moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.measured.finding import Finding
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.measured.quality import check
from identify.reports.kinds import print_findings

DATA = Path(__file__).parents[2] / "data"
CLEAN = [DATA / name / f"posture{n}.uff" for name in ("arm_hammer_test", "umons_open") for n in (1, 2, 3)]


def read(path: Path) -> FrfSet:
    return load_frf_set(path, FrfFileOptions(averages=4)).band(3, 80)


def findings(frf_set: FrfSet) -> list[Finding]:
    return check(frf_set, {channel.node: "" for channel in frf_set.outputs})


def with_bad_cable(frf_set: FrfSet, output: int, times: float, seed: int = 1) -> FrfSet:
    """One channel with white noise of its own, in amplitude so many times that of the others' median."""
    assert frf_set.coherence is not None and frf_set.averages
    frf, coherence = frf_set.frf.copy(), frf_set.coherence.copy()
    power = np.abs(frf) ** 2 * (1 - coherence) / coherence
    added = times**2 * np.median(power, axis=1)
    draw = np.random.default_rng(seed).normal(size=(2, *added.shape)) / np.sqrt(2)
    frf[:, output] += np.sqrt(added / frf_set.averages) * (draw[0] + 1j * draw[1])
    energy = np.abs(frf[:, output]) ** 2
    coherence[:, output] = energy / (energy + power[:, output] + added)
    return replace(frf_set, frf=frf, coherence=coherence)


@pytest.mark.parametrize("path", CLEAN, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_in_a_clean_test_no_channel_is_named(path: Path) -> None:
    frf_set = read(path)
    found = [one for one in findings(frf_set) if one.level != "info"]
    assert [one.check for one in found if one.check in ("noisy-channel", "coherence")] == []
    said = " ".join(one.sentence for one in findings(frf_set) if one.check == "coherence")
    assert "channels with a low coherence" in said and ":+" not in said


@pytest.mark.parametrize("output", [1, 5, 13, 26])
def test_a_bad_cable_is_named_first_and_alone(output: int) -> None:
    """Of a sensor that stands still as of one that moves: 1 is on the base, 26 at the flange."""
    frf_set = read(CLEAN[0])
    found = findings(with_bad_cable(frf_set, output, 30.0))
    assert (found[0].level, found[0].check) == ("warn", "noisy-channel")
    assert found[0].channels == (frf_set.outputs[output],)
    assert [one.check for one in found].count("noisy-channel") == 1


def test_of_several_bad_channels_the_worst_is_first_and_the_rest_are_counted(
    capsys: pytest.CaptureFixture[str],
) -> None:
    spoilt = frf_set = read(CLEAN[0])
    for output, times in ((5, 8.0), (9, 40.0), (13, 20.0), (17, 12.0), (21, 15.0)):
        spoilt = with_bad_cable(spoilt, output, times)
    found = [one for one in findings(spoilt) if one.check == "noisy-channel"]
    assert [one.channels[0] for one in found][:2] == [frf_set.outputs[9], frf_set.outputs[13]]
    print_findings({"posture1": found})
    said = capsys.readouterr().out
    assert said.count("times as noisy") == 3
    assert f"... and {len(found) - 3} more of this kind" in said


def test_without_averages_noise_is_told_apart_too() -> None:
    found = findings(replace(with_bad_cable(read(CLEAN[0]), 5, 30.0), averages=None))
    assert "noisy-channel" in [one.check for one in found]
