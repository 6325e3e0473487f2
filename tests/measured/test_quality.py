"""Each check fires on what it is for and is silent on clean data: a simulated structure, and hammer tests
made elsewhere.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.measured.finding import Finding
from identify.measured.frf_set import POWER, FrfSet, Quantity
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.measured.quality import check
from tests.measured.simulate import random_structure
from tests.shared import shared

ARM = Path(__file__).parents[2] / "data" / "arm_hammer_test"
POINTS = {1: "base", 2: "elbow", 3: "wrist"}
DECAY = 0.7


def clean(quantity: Quantity = "accelerance") -> FrfSet:
    """Three points in three directions, hit at point 3 in x, y and z; the closed form with good coherence."""
    frequency = np.arange(5.0, 80.0, 0.5)
    s = DECAY + 2j * np.pi * frequency
    frf = random_structure(4, 9).receptance(s)[:, :, 6:] * s[:, None, None] ** POWER[quantity]
    channels = tuple(Channel(node, axis) for node in POINTS for axis in (1, 2, 3))
    coherence = np.random.default_rng(1).uniform(0.985, 0.995, frf.shape)
    return FrfSet(
        frequency,
        0.1 * frf,
        channels,
        channels[6:],
        quantity,
        coherence,
        averages=4,
        window_decay_per_s=DECAY,
    )


def named(findings: list[Finding], name: str) -> list[Finding]:
    return [finding for finding in findings if finding.check == name]


def scaled(
    frf_set: FrfSet,
    factor: complex | np.ndarray,
    output: int | slice = slice(None),
    input_: int | slice = slice(None),
) -> FrfSet:
    frf = frf_set.frf.copy()
    frf[:, output, input_] = (
        (factor * frf[:, output, input_].T).T
        if isinstance(factor, np.ndarray)
        else factor * frf[:, output, input_]
    )
    return replace(frf_set, frf=frf)


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_clean_data_raise_nothing(quantity: Quantity) -> None:
    assert check(clean(quantity), POINTS) == []
    assert check(clean(quantity), POINTS, (10, 70)) == []


@pytest.mark.parametrize(("decimals", "said"), [(0, "is 1 at every line"), (2, "is rounded to 0.01:")])
def test_a_coherence_that_does_not_tell_the_noise_is_named(decimals: int, said: str) -> None:
    whole = clean()
    coarse = replace(whole, coherence=np.round(np.asarray(whole.coherence), decimals))
    [finding] = check(coarse, POINTS)
    assert (finding.check, finding.level) == ("rounded-coherence", "warn")
    assert said in finding.sentence
    low = replace(whole, coherence=np.round(np.asarray(whole.coherence) - 0.11, 2))
    assert named(check(low, POINTS), "rounded-coherence") == []


def with_signs(frf_set: FrfSet, output: int, input_: int) -> FrfSet:
    """The same measurement with sensor and hammer turned round and said so."""
    outputs, inputs = list(frf_set.outputs), list(frf_set.inputs)
    outputs[output] = Channel(outputs[output].node, -outputs[output].direction)
    inputs[input_] = Channel(inputs[input_].node, -inputs[input_].direction)
    return replace(
        scaled(scaled(frf_set, -1, output), -1, slice(None), input_),
        outputs=tuple(outputs),
        inputs=tuple(inputs),
    )


def test_signs_that_are_written_down_are_no_fault() -> None:
    for output, input_ in ((6, 0), (6, 1), (8, 2), (0, 0)):
        assert check(with_signs(clean(), output, input_), POINTS) == []


def without_pair(frf_set: FrfSet) -> FrfSet:
    return scaled(frf_set, np.nan, 2, 1)


def delayed(frf_set: FrfSet) -> FrfSet:
    return scaled(frf_set, np.exp(-4e-3 * frf_set.s), 7)


def swapped(frf_set: FrfSet) -> FrfSet:
    return replace(frf_set, frf=frf_set.frf[:, [0, 1, 2, 3, 4, 5, 7, 6, 8]])


def poor(frf_set: FrfSet, output: int = 3, level: float = 1.0) -> FrfSet:
    coherence = np.full(frf_set.frf.shape, 0.99)
    coherence[:, output] = 0.3
    return replace(scaled(frf_set, level, output), coherence=coherence)


def poor_under_one_force(frf_set: FrfSet) -> FrfSet:
    coherence = np.full(frf_set.frf.shape, 0.99)
    coherence[:, 3, 1] = 0.3
    return replace(frf_set, coherence=coherence)


def partly_nan(frf_set: FrfSet) -> FrfSet:
    frf = frf_set.frf.copy()
    frf[7, 2, 1] = np.nan
    return replace(frf_set, frf=frf)


def copied(frf_set: FrfSet) -> FrfSet:
    frf = frf_set.frf.copy()
    frf[:, 4] = -frf[:, 1]
    return replace(frf_set, frf=frf)


def doubled(frf_set: FrfSet) -> FrfSet:
    outputs = (*frf_set.outputs[:1], Channel(1, -1), *frf_set.outputs[2:])
    return replace(frf_set, outputs=outputs)


FAULTS: list[tuple[str, str, Callable[[FrfSet], FrfSet], str]] = [
    (
        "unknown-point",
        "fail",
        lambda s: replace(s, outputs=(Channel(17, 1), *s.outputs[1:])),
        r"No point explains 17:\+X",
    ),
    (
        "unused-point",
        "info",
        lambda s: s.pairs([0, 1, 2, 6, 7, 8], [0, 1, 2]),
        "Nothing was measured at point 2",
    ),
    ("missing-pair", "warn", without_pair, r"FRF 1:\+Z/3:\+Y was not measured"),
    ("not-a-number", "fail", partly_nan, r"FRF 1:\+Z/3:\+Y has values that are not numbers"),
    ("missing-direction", "warn", lambda s: s.pairs([0, 1, 3, 4, 5, 6, 7, 8], [0, 1, 2]), "point 1 in fewer"),
    ("doubled-channel", "warn", doubled, r"1:\+X and 1:-X are the same output"),
    ("identical-channels", "fail", copied, r"1:\+Y and 2:\+Y have the same values"),
    ("dead-channel", "fail", lambda s: scaled(s, 0, 4), r"Output 2:\+Y is zero or constant"),
    ("dead-channel", "fail", lambda s: scaled(s, 0, slice(None), 1), r"Input 3:\+Y is zero or constant"),
    ("noisy-channel", "warn", poor, r"2:\+X is 1\d times as noisy as channels that move as much"),
    ("noisy-channel", "warn", poor_under_one_force, r"2:\+X is 1\d times as noisy under 3:\+Y as"),
    ("coherence", "warn", lambda s: replace(s, coherence=np.full(s.frf.shape, 0.6)), "double hits"),
    ("coherence", "info", lambda s: poor(s, level=1e-3), r"1 of 9 channels with a low .* which is no fault"),
    ("coherence", "fail", lambda s: replace(s, coherence=np.full(s.frf.shape, 0.2)), "mostly noise"),
    ("no-coherence", "warn", lambda s: replace(s, coherence=None), "no coherence"),
    ("no-averages", "warn", lambda s: replace(s, averages=None), "say averages"),
    ("drive-point", "fail", lambda s: scaled(s, -1, 6), r"3:\+X/3:\+X gives power back at nearly all lines"),
    ("drive-point", "fail", lambda s: scaled(s, -1), "gives power back at nearly all lines"),
    ("drive-point", "fail", delayed, r"3:\+Y/3:\+Y gives power back"),
    ("drive-point", "fail", lambda s: replace(s, quantity="mobility"), "quantity or time delay"),
    ("no-drive-point", "info", lambda s: s.pairs([0, 1, 2, 3, 4, 5], [0, 1, 2]), "no drive point"),
    ("reciprocity", "fail", lambda s: scaled(s, -1, 6), "equal with opposite signs"),
    ("reciprocity", "fail", lambda s: scaled(s, 3, 6), "differ by 100 %"),
    ("reciprocity", "warn", lambda s: scaled(s, 1.5, 6), "differ by 40 %"),
    ("reciprocity", "fail", swapped, "should be equal"),
    ("size", "warn", lambda s: scaled(s, 1e6), r"apparent mass of .* kg: is the unit"),
    ("size", "warn", lambda s: scaled(s, 1e-7), r"dynamic stiffness of .* N/m: is the unit"),
    (
        "uneven-frequency",
        "warn",
        lambda s: s.lines(np.arange(len(s.frequency_hz)) != 40),
        r"from 0\.5 to 1 Hz, the widest above 24\.5 Hz",
    ),
    ("few-lines", "warn", lambda s: s.band(5, 12), "Only 15 frequency lines"),
]


@pytest.mark.parametrize(
    ("name", "level", "spoil", "sentence"), FAULTS, ids=[f"{name}-{i}" for i, (name, *_) in enumerate(FAULTS)]
)
def test_each_fault_is_found_and_said(
    name: str, level: str, spoil: Callable[[FrfSet], FrfSet], sentence: str
) -> None:
    findings = named(check(spoil(clean()), POINTS), name)
    assert level in {finding.level for finding in findings}
    said = [finding.sentence for finding in findings if finding.level == level]
    with pytest.raises(AssertionError, match=sentence):
        raise AssertionError("\n".join(said))


def test_findings_come_worst_first() -> None:
    levels = [
        finding.level
        for finding in check(poor(scaled(clean().pairs([0, 1, 2, 6, 7, 8], [0, 1, 2]), -1, 3), 0), POINTS)
    ]
    assert levels == sorted(levels, key=["fail", "warn", "info"].index) and {"fail", "warn", "info"} == set(
        levels
    )


def test_no_data_in_the_band_is_the_only_thing_said() -> None:
    (finding,) = check(clean(), POINTS, (200, 300))
    assert (finding.level, finding.check) == ("fail", "no-data-in-band")
    assert "from 200 to 300 Hz: the data have 5 to 79.5 Hz" in finding.sentence


def test_a_set_without_any_whole_frf_fails() -> None:
    assert named(check(scaled(clean(), np.nan), POINTS), "no-data")


@pytest.mark.parametrize("case", ["none_101", "none_102"])
@pytest.mark.parametrize("posture", [1, 2, 3])
def test_a_hammer_test_without_fault_raises_only_that_its_base_stands_still(case: str, posture: int) -> None:
    path = shared("hidden", case, f"posture{posture}.uff")
    with (path.parent / "points.csv").open() as file:
        points = {int(row["node"]): row["name"] for row in csv.DictReader(file)}
    findings = check(
        load_frf_set(path, FrfFileOptions(averages=4, window_decay_per_s=0.693)), points, (3, 80)
    )
    assert [(finding.level, finding.check) for finding in findings] == [("info", "coherence")]
    assert {channel.node for channel in findings[0].channels} == {1, 2, 3, 4}


def test_noise_alone_gives_no_power_back() -> None:
    """Below its first resonance a robot takes next to no power in: the sign of its real parts is chance."""
    options = FrfFileOptions(averages=4, window_decay_per_s=1.226)
    names = {node: str(node) for node in range(1, 15)}
    for number in (1, 2, 3):
        data = load_frf_set(ARM / f"posture{number}.uff", options)
        turned = scaled(data, -1, list(data.outputs).index(data.inputs[0]))
        for one in (data, turned):
            assert named(check(one, names, (3.0, 3.5)), "drive-point") == []
        assert len(named(check(turned, names, (3.0, 80.0)), "drive-point")) == 1


def askew(frf_set: FrfSet, degrees: float) -> FrfSet:
    """The sensor at point 3 is turned about its Z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    frf = frf_set.frf.copy()
    frf[:, 6:9] = np.einsum("ab,fbi->fai", np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), frf_set.frf[:, 6:9])
    return replace(frf_set, frf=frf)


def nearly_apart(frf_set: FrfSet) -> FrfSet:
    """The axes of point 3 have little to do with each other, as at a flange."""
    weak = np.where(np.eye(3, dtype=bool), 1.0, 0.02)
    frf = frf_set.frf.copy()
    frf[:, 6:9] *= weak
    return replace(frf_set, frf=frf)


def test_a_sensor_a_little_askew_is_no_fault_of_weak_cross_terms() -> None:
    plain = nearly_apart(clean())
    found = named(check(askew(plain, 2.0), POINTS), "reciprocity")
    assert found and {one.level for one in found} == {"info"}
    assert all((one.value or 0.0) > 0.2 and "as is usual" in one.sentence for one in found)
    assert "fail" in {one.level for one in named(check(askew(plain, 20.0), POINTS), "reciprocity")}


def test_friction_shows_as_missing_reciprocity_in_a_weak_hammer_test() -> None:
    path = shared("hidden", "friction_j2_101", "posture1_level0.3.uff")
    findings = check(
        load_frf_set(path, FrfFileOptions(averages=4, window_decay_per_s=0.693)),
        {i: str(i) for i in range(1, 15)},
        (3, 80),
    )
    assert named(findings, "reciprocity")
