"""The draw of `tests.benchmarks.discovery_nulls`: other noise on the same impacts, effects that a study has,
and a run that goes on.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from identify.measured.loaders import load_frf_set
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.benchmarks.discovery_nulls import KINDS, Drawn, Row, remembered, table, written
from tests.generator.cases import hide
from tests.generator.generate import generate, generate_recorded
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

QUICK = TestSpec(
    MAKES["random"](5).at_points([5, 9, 14]),
    postures=1,
    duration_s=0.3,
    oversampling=8,
    averages=2,
    window_decay_per_s=3.0,
    binary=True,
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A test recorded three times, and simulated once more."""
    folder = tmp_path_factory.mktemp("recorded")
    generate_recorded(QUICK, [folder / name for name in ("first", "second", "third")])
    generate(QUICK, folder / "alone")
    return folder


def test_the_first_record_is_that_of_a_test_alone(recorded: Path) -> None:
    """Byte by byte, all files."""
    for file in (recorded / "alone").iterdir():
        assert (recorded / "first" / file.name).read_bytes() == file.read_bytes()


def test_records_differ_in_noise_alone_and_by_as_much_as_coherence_says(recorded: Path) -> None:
    """A difference of two has twice the variance of noise; the same noise twice would be none."""
    sets = [load_frf_set(recorded / name / "posture1.uff") for name in ("first", "second", "third")]
    coherence = sets[0].coherence
    assert coherence is not None
    spread = np.abs(sets[0].frf) * np.sqrt((1 - coherence) / coherence / QUICK.averages)
    for one, other in ((0, 1), (0, 2), (1, 2)):
        distance = np.abs(sets[one].frf - sets[other].frf)
        assert 0.3 < np.median(distance) / np.median(spread) < 3.0
        assert np.median(distance) < 0.05 * np.median(np.abs(sets[0].frf))


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_in_the_study(recorded: Path, tmp_path: Path, kind: str) -> None:
    """Once beside the drives; a fault of the measurement at a point that is there."""
    [effect] = hide(QUICK, kind).effects
    problem = load_problem(read_study(config_of(recorded / "first", tmp_path, extra=written(effect))))
    _, known = problem.file.study.effects
    assert known.kind == {"turned-axes": "sensor-rotation"}.get(effect.kind, effect.kind)


def test_an_arm_is_the_same_in_every_draw() -> None:
    """Its seed, make and what acts in it; other arms and halves are others, and half hide nothing."""
    one, other, null = Drawn(3, 1, 4), Drawn(3, 1, 4 + len(KINDS)), Drawn(3, 0, 4)
    assert one.spec.case == Drawn(3, 1, 4).spec.case
    assert one.spec.seed not in (other.spec.seed, null.spec.seed)
    assert null.spec.effects == () and len(one.spec.effects) == 1
    assert len({Drawn(3, 1, n).spec.effects[0].truth()["kind"] for n in range(len(KINDS))}) == 13


def test_a_row_that_was_cut_short_is_done_anew(tmp_path: Path) -> None:
    """What a killed run leaves: whole rows stay, half a row goes."""
    kept = tmp_path / "rows.jsonl"
    assert remembered(kept) == []
    kept.write_text('{"test": [1, 0, 0, 0]}\n{"test": [1, 0,')
    assert remembered(kept) == [{"test": [1, 0, 0, 0]}]
    assert kept.read_text() == '{"test": [1, 0, 0, 0]}\n'


def test_the_table_tells_every_addition_error_and_first_fit_far_off() -> None:
    """Beside a test where all is well, which has no row of its own."""
    plain: Row = {
        **{"test": [1, 0, 0, 0], "arm": "compact 7", "case": "none", "noise": 0.01, "error": ""},
        **{"gap_first": 1.0, "additions": [], "seconds": 2.0, "seconds_simulated": 1.0},
    }
    one = {"sentence": "a strut", "before": 1.5, "after": 1.1}
    rows = [
        plain,
        {**plain, "gap_first": 1.5, "additions": [one]},
        {**plain, "error": "no", "gap_first": None},
    ]
    text = table(json.loads(json.dumps(rows)))
    assert "nothing hidden | 3 | 1 | 1 | 1.250, 1.500 | 3.0" in text
    assert "a strut, gap 1.500 -> 1.100" in text and text.count("not near") == 1 and text.endswith(": no")
