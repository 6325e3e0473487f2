"""Packed curves, unpacked by a second implementation."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from identify.reports.shared.page_data import MAGNITUDE_STEP, PHASE_STEP, pack, pack_frfs
from tests.reports.sample import frf_result


def unpack(packed: dict[str, Any]) -> np.ndarray:
    """The way back, number by number in Python's own integers."""
    raw = zlib.decompress(base64.b64decode(packed["data"]))
    size = len(raw) // 4
    curves = []
    for first in range(0, size, packed["n"]):
        words = [
            sum(raw[k + plane * size] << 8 * plane for plane in range(4))
            for k in range(first, first + packed["n"])
        ]
        steps = [(word >> 1) if word % 2 == 0 else -(word >> 1) - 1 for word in words]
        for _ in range(packed["order"]):
            steps = [sum(steps[: i + 1]) for i in range(len(steps))]
        wrapped = [(value + 2**31) % 2**32 - 2**31 for value in steps]
        curves.append([np.nan if value == -(2**31) else value * packed["step"] for value in wrapped])
    return np.array(curves)


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, st.tuples(st.integers(1, 4), st.integers(1, 12)), elements=st.floats(-500, 500)),
    st.integers(0, 2),
)
def test_round_trip_to_half_a_step(values: np.ndarray, order: int) -> None:
    assert unpack(pack(values, 1e-3, order)) == pytest.approx(values, abs=0.50001e-3)


def test_what_is_not_finite_comes_back_as_nan() -> None:
    values = np.array([[1.0, np.nan, 2.0], [-np.inf, 0.25, np.inf]])
    for order in (1, 2):
        assert unpack(pack(values, 0.25, order)) == pytest.approx(
            np.array([[1.0, np.nan, 2.0], [np.nan, 0.25, np.nan]]), nan_ok=True
        )


def test_frfs_keep_magnitude_and_phase() -> None:
    frf = frf_result(points=24).measurements["posture1"].frf
    assert frf is not None
    frf.measured[4, 70] = np.nan
    packed = pack_frfs(frf)
    assert len(packed["blocks"]) == 3
    block, pair = packed["blocks"][1], 70
    magnitude, phase = (
        unpack(block["measured"][part])[pair - packed["size"]] for part in ("magnitude", "phase")
    )
    found = 10**magnitude * np.exp(1j * phase)
    tolerance = 0.5 * np.hypot(np.log(10) * MAGNITUDE_STEP, PHASE_STEP)
    known = np.isfinite(frf.measured[:, pair])
    assert np.isnan(found[4])
    assert np.max(np.abs(found[known] / frf.measured[known, pair] - 1)) < 1.01 * tolerance
    still = packed["blocks"][0]["fitted"]
    assert np.isnan(unpack(still["magnitude"])[0]).all(), "a zero has no logarithm"
    assert np.isnan(unpack(still["phase"])[0]).all()
