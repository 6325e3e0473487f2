"""The fit on simulated hammer tests made outside this project: nothing hidden must be found again, whatever
the first guess.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.vibration.run import run_fit
from tests.hidden import truth, write_config


@pytest.mark.parametrize(
    ("case", "guess"), [("none_101", 1), pytest.param("none_102", None, marks=pytest.mark.exam)]
)
def test_null_cases_from_any_first_guess(case: str, guess: int | None, tmp_path: Path) -> None:
    """The whole set of 20 guesses per case is in tests/benchmarks/first_guess.py."""
    known = truth(case)
    start = (
        None
        if guess is None
        else np.array(known["k"]) * 3.0 ** np.random.default_rng(guess).uniform(-1, 1, 6)
    )
    begun = None if start is None else start.tolist()
    result, _ = run_fit(write_config(case, tmp_path, begun, "starts: 4"), tmp_path / "r.h5", {})
    value = dict(zip(result.parameters.name, result.parameters.value, strict=True))
    k, c = (
        np.array([value[f"joint{n}.rz.{what}"] for n in range(1, 7)]) for what in ("stiffness", "damping")
    )
    assert k == pytest.approx(known["k"], rel=0.01)
    assert c == pytest.approx(known["c"], rel=0.05)
    assert 0.9 < result.gap < 1.15
    assert 0.9 < result.gap_validation < 1.15
    assert not result.notes


@pytest.mark.parametrize("case", [pytest.param("delay_101", marks=pytest.mark.exam), "tilt_j2_101"])
def test_a_missing_effect_is_never_quiet(case: str, tmp_path: Path) -> None:
    """Data with something that the model lacks must not give a tight interval around a wrong stiffness
    without a warning.
    """
    result, _ = run_fit(write_config(case, tmp_path, extra="starts: 1"), tmp_path / "r.h5", {})
    assert result.gap > 1.15
    assert any("structured" in note and "cannot be relied on" in note for note in result.notes)
    assert any("does not yet explain" in sentence for sentence in result.verdict)
