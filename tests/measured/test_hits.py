"""One long record of hits, cut and estimated, against transfer functions in closed form."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray
from pydantic import ValidationError

from identify.core.arrays import Complex
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions
from identify.measured.hits import Hits, cut
from identify.measured.source import Estimation, read_source
from identify.measured.time_history import TimeHistory

Array = NDArray[np.float64]
RATE, NODES, EACH, BLOCK_S = 500.0, (3, 7, 11), 4, 2.0


def filters(node: int, axis: int) -> tuple[Array, Array]:
    """A mode of each channel as a digital filter, numerator and denominator."""
    omega, ratio = 2 * np.pi * (12 + node + 3 * axis), 0.06
    pole = np.exp((-ratio * omega + 1j * omega * np.sqrt(1 - ratio**2)) / RATE)
    return np.array([0.0, 1.0 + node, 0.0]), np.array([1.0, -2 * pole.real, abs(pole) ** 2])


def exact(node: int, axis: int, frequency_hz: Array, decay: float = 0.0) -> Complex:
    b, a = filters(node, axis)
    z = np.exp((decay + 2j * np.pi * frequency_hz) / RATE)
    return np.asarray(np.polyval(b[::-1], 1 / z) / np.polyval(a[::-1], 1 / z))


def record(seed: int = 4) -> dict[str, Array]:
    """Hits of unequal size at unequal times, with the sensor on each node in turn."""
    rng, parts = np.random.default_rng(seed), []
    for node in NODES:
        for _ in range(EACH):
            force = np.zeros(round((BLOCK_S + rng.uniform(0.2, 0.6)) * RATE))
            at = 20 + int(rng.integers(0, 40))
            force[at : at + 3] = rng.uniform(60, 100) * np.array([0.5, 1.0, 0.4])
            moved = [scipy.signal.lfilter(*filters(node, axis), force) for axis in (0, 1)]
            fixed = scipy.signal.lfilter(*filters(50, 2), force)
            parts.append(np.column_stack([force, *moved, fixed]))
    rows = np.concatenate(parts)
    return {"hammer": rows[:, 0], "ax": rows[:, 1], "ay": rows[:, 2], "fixed": rows[:, 3]}


SIGNALS = {"60:+Y [N]": "hammer", "1:+X [m/s^2]": "ax", "1:-Y [m/s^2]": "ay", "50:+Z [m/s^2]": "fixed"}
HITS = {"block_s": BLOCK_S, "each": EACH, "nodes": list(NODES), "moves": 1}


def estimated(path: Path, options: dict[str, Any] | None = None, **hits: Any) -> Any:
    told = {"excitation": "impacts", "hits": {**HITS, **hits}, "signals": SIGNALS, "sample_rate_hz": RATE}
    return read_source([path], FrfFileOptions(**options or {}), Estimation.model_validate(told))


@pytest.fixture
def mat(tmp_path: Path) -> Path:
    scipy.io.savemat(tmp_path / "hits.mat", record())
    return tmp_path / "hits.mat"


@pytest.mark.parametrize("decay", [0.0, 1.5])
def test_a_mat_of_many_hits_gives_the_frfs_of_all_points(mat: Path, decay: float) -> None:
    found = estimated(mat, {"window_decay_per_s": decay})
    assert found.averages == EACH
    assert [str(one) for one in found.outputs] == ["3:+X", "3:-Y", "50:+Z", "7:+X", "7:-Y", "11:+X", "11:-Y"]
    f = found.frequency_hz
    for row, channel in enumerate(found.outputs):
        h = exact(channel.node, abs(channel.direction) - 1, f, decay)
        np.testing.assert_allclose(found.frf[:, row, 0], h, rtol=2e-3, atol=2e-3 * np.abs(h).max())
    wrong = exact(7, 0, f, decay)
    assert np.abs(found.frf[:, 0, 0] - wrong).max() > 0.3 * np.abs(wrong).max()


def test_a_window_stated_by_what_it_leaves_is_its_decay(mat: Path) -> None:
    """1 % at the end of 2 s: exp(-sigma 2) = 0.01."""
    options = FrfFileOptions.model_validate({"window_decay_per_s": {"percent": 1, "at_s": 2}})
    assert options.window_decay_per_s == pytest.approx(2.302585)
    assert estimated(
        mat, {"window_decay_per_s": {"percent": 1, "at_s": 2}}
    ).window_decay_per_s == pytest.approx(2.302585)
    for wrong in (
        {"percent": 0, "at_s": 2},
        {"percent": 100, "at_s": 2},
        {"percent": 5},
        {"percent": 5, "s": 2},
    ):
        with pytest.raises(ValidationError):
            FrfFileOptions.model_validate({"window_decay_per_s": wrong})


def test_what_is_not_there_is_said(mat: Path) -> None:
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"nodes": [3, 7]}, "12 hits above 0.1 of the largest force; expected 8, 4 at each of 2 points"),
        ({"level": 0.95}, "hits above 0.95"),
        ({"moves": 2}, "no signal of node 2"),
        ({"before_s": 2.0}, "before the hit"),
        ({"block_s": 60.0}, "no hit with a whole block"),
    ]
    for hits, sentence in wrong:
        with pytest.raises(InputError, match=sentence):
            estimated(mat, **hits)
    for told, sentence in (
        ({"excitation": "impacts", "hits": {"block_s": 1, "each": 5}}, "go together"),
        ({"excitation": "impacts", "signals": SIGNALS}, "say by `hits`"),
        ({"excitation": "random", "hits": {"block_s": 1}}, "no meaning"),
    ):
        with pytest.raises(ValidationError, match=sentence):
            Estimation.model_validate(told)


def test_blocks_begin_before_each_hit_and_an_unfinished_one_is_left_out() -> None:
    force = np.zeros(1000)
    force[[100, 400, 950]] = [10.0, 5.0, 8.0]
    data = np.column_stack([force, np.arange(1000.0)])[None]
    history = TimeHistory(100.0, data, (Channel(1, 1), Channel(2, 1)), ("N", "m/s^2"))
    [blocks] = cut(history, Hits(block_s=2.0, before_s=0.1))
    np.testing.assert_array_equal(blocks.data[:, 0, 1], [90, 390])
    assert blocks.data.shape == (2, 200, 2)
    with pytest.raises(InputError, match=r"a hit at 4.000 s within 0.1 s of the block before it"):
        cut(history, Hits(block_s=3.05, before_s=0.1))
