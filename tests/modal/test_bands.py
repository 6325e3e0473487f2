"""A band with more modes than one model can hold is analysed in parts; corrections by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.modal.analysis import analyse
from identify.modal.bands import _whole
from identify.modal.layout import arrange
from identify.modal.mac import mac
from identify.modal.settings import ModalSettings
from tests.modal.systems import chain, measure

CROWDED = chain(np.geomspace(20.0, 900.0, 24).tolist(), [0.02] * 24, seed=5)
ALL = measure(CROWDED, np.arange(1.0, 1000.0), [0], noise=1e-4)
WIDE = replace(ALL, frf=ALL.frf[:, :6], outputs=ALL.outputs[:6])
"""The response of 6 points to one, with modes close together where lines are few."""
FEW = ModalSettings(max_order=16)


def test_a_wide_band_is_split_where_one_model_does_not_do() -> None:
    whole = _whole(arrange(WIDE, FEW), FEW)
    assert len(whole.verified.modes) < 16
    found = analyse(WIDE, FEW)
    assert len(found.bands_hz) > 1
    assert found.bands_hz[0][0] == 1 and found.bands_hz[-1][1] == 999
    truth = np.abs(CROWDED.poles) / (2 * np.pi)
    assert found.table.frequency_hz == pytest.approx(truth, rel=1e-3)
    assert found.table.damping_ratio == pytest.approx(0.02, rel=0.05)
    assert np.min(np.diag(mac(found.table.shapes, CROWDED.shapes[:, :6]))) > 0.99
    assert found.total_error < 0.05


def test_a_band_that_one_model_explains_is_not_split() -> None:
    few = chain([20.0, 90.0, 400.0], [0.02] * 3, seed=1)
    found = analyse(measure(few, np.arange(0.5, 1000.0, 0.5), [0], noise=0.01))
    assert found.bands_hz == ((0.5, 999.5),)
    assert len(found.table) == 3


def test_noise_is_not_split_for() -> None:
    """What is left is large, and no model of a part would explain it."""
    few = chain([20.0, 90.0, 400.0], [0.02] * 3, seed=1)
    found = analyse(measure(few, np.arange(0.5, 1000.0, 0.5), [0], noise=0.8))
    assert found.total_error > 0.5
    assert len(found.bands_hz) == 1


PAIR = measure(chain([20.0, 50.0, 51.5], [0.02] * 3, seed=2), np.arange(2.0, 80.0, 0.25), [0], noise=0.01)


def test_a_mode_is_dropped_and_another_kept_by_hand() -> None:
    automatic = analyse(PAIR).table.frequency_hz
    assert automatic == pytest.approx([20.0, 50.0, 51.5], rel=5e-3)
    fewer = analyse(PAIR, ModalSettings(drop_hz=(20.0,)))
    assert fewer.table.frequency_hz == pytest.approx(automatic[1:], rel=5e-3)
    assert "dropped by hand" in [mode.reason for mode in fewer.rejected]
    deaf = ModalSettings(max_frequency_spread=1e-9)
    assert len(analyse(PAIR, deaf).table) == 0
    kept = analyse(PAIR, deaf.model_copy(update={"keep_hz": (20.0,)}))
    assert kept.table.frequency_hz == pytest.approx([20.0], rel=5e-3)


@pytest.mark.parametrize("key", ["keep_hz", "drop_hz"])
def test_a_frequency_at_which_nothing_is_is_refused(key: str) -> None:
    with pytest.raises(InputError, match=f"{key}: no cluster of poles near 33 Hz"):
        analyse(PAIR, ModalSettings(**{key: (33.0,)}))


def test_all_by_hand_and_corrections_exclude_each_other() -> None:
    with pytest.raises(ValueError, match="names all modes"):
        ModalSettings(modes_hz=(20.0,), drop_hz=(50.0,))
