"""What a report says of measured dynamic stiffnesses at several strengths of impacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.reports.discovery.curve import by_strength, sentences
from identify.results.curves import CurveTable


def _curve(peak_n: float, value: complex, std: float) -> CurveTable:
    """The same value at fifty lines, which scatter by as much as they are said to."""
    rng = np.random.default_rng(int(peak_n))
    noise = std * (rng.normal(size=(50, 2)) @ np.array([1.0, 1j]))
    return CurveTable(
        place=f"something beside the spring of joint2.rz, impacts of {peak_n:.0f} N",
        site="something beside the spring of joint2.rz",
        effect="",
        unit="N m/rad",
        gap=1.0,
        entries=("joint2.rz",),
        frequency_hz=np.linspace(3, 80, 50),
        value=(value + noise)[:, None],
        std_real=np.full((50, 1), std),
        std_imag=np.full((50, 1), std),
        law=np.full((50, 1), np.nan + 0j),
        sets=(),
        agreement=np.zeros(0),
        fitted=np.zeros(0, dtype=bool),
        laws=(),
        law_gap=np.zeros(0),
        law_log_odds=np.zeros(0),
        peak_n=peak_n,
    )


@pytest.mark.parametrize(
    ("strong", "said"),
    [
        (5e5 + 3e5j, ("real part", "lower", "slips")),
        (2e6 + 2e5j, ("real part", "higher", "hardens")),
        (1e6 + 5e4j, ("imaginary part", "lower", "dry friction")),
    ],
)
def test_what_becomes_of_the_curve_with_force_is_said(strong: complex, said: tuple[str, ...]) -> None:
    """From the weakest to the strongest impacts, whatever lies between."""
    curves = [_curve(60, 1e6 + 2e5j, 1e5), _curve(180, strong, 1e5), _curve(120, 5e7, 1e5)]
    [sentence] = by_strength(curves)
    assert all(word in sentence for word in (*said, "180 N in place of 60 N", "joint2.rz"))


def test_nothing_is_said_of_what_noise_may_do() -> None:
    """Nor of a single strength."""
    assert not by_strength([_curve(60, 1e6 + 2e5j, 1e5), _curve(180, 1.01e6 + 2e5j, 1e5)])
    assert not by_strength([_curve(60, 1e6, 1e5)])


def test_it_is_said_that_errors_of_what_was_told_are_held() -> None:
    curve = _curve(60, 1e6, 1e5)
    assert "held" not in sentences(curve)
    assert "Nuisance parameters are fixed as fitted" in sentences(replace(curve, errors_held=True))
