"""Result files of version 0.1, written by that version, are read by this one."""

from __future__ import annotations

import lzma
from pathlib import Path

import h5py
import numpy as np
import pytest

from identify.results.discovery import DiscoveryResult
from identify.results.file import read
from identify.results.header import Header

OLD = Path(__file__).parent / "old_results"


@pytest.fixture(scope="module")
def discovery(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A delay of 1 ms, hidden in the FRFs of a planar arm of three joints and found by 0.1."""
    path = tmp_path_factory.mktemp("old") / "discovery.h5"
    path.write_bytes(lzma.decompress((OLD / "discovery_0.1.h5.xz").read_bytes()))
    return path


def test_a_discovery_of_0_1_is_read_whole(discovery: Path) -> None:
    result = read(discovery, DiscoveryResult)
    assert isinstance(result, Header)
    assert result.added.sentence == ("time delay of all responses",)
    assert result.added.parameters == ("responses.delay",)
    assert result.after.parameters.name[-1] == "responses.delay"
    assert result.after.parameters.value[-1] == pytest.approx(9.75e-4, rel=0.01)
    assert result.before.gap > result.after.gap == pytest.approx(result.added.gap[0])
    assert list(result.steps) == ["0", "1"]


def test_its_evidence_is_twice_the_log_odds(discovery: Path) -> None:
    """0.1 kept twice the logarithm of the odds, and called it evidence."""
    result = read(discovery, DiscoveryResult)
    with h5py.File(discovery) as file:
        assert file.attrs["layout"] == 1
        assert np.array_equal(2 * result.added.log_odds, file["added/evidence"][:])
        of_options = file["steps/0/options/evidence"][:]
    assert np.array_equal(2 * result.steps["0"].options.log_odds, of_options, equal_nan=True)
    assert np.isfinite(of_options).any()
