"""Pairing of modal tables: order, swaps, signs, unpaired modes."""

from __future__ import annotations

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.measured.modal_tables import ModalTable
from identify.modal.pairing import PairSettings, pair

CHANNELS = tuple(Channel(node, direction) for node in (1, 2, 3) for direction in (1, 3))
SHAPES = np.linalg.qr(np.random.default_rng(0).normal(size=(6, 6)))[0].astype(complex)


def table(
    frequency: list[float], shapes: np.ndarray | None = None, channels: tuple[Channel, ...] = CHANNELS
) -> ModalTable:
    modes = np.array(frequency)
    return ModalTable(modes, np.full(len(modes), 0.02), () if shapes is None else channels, shapes)


def test_modes_that_swapped_order_are_paired_by_shape() -> None:
    found = pair(table([10.0, 11.0, 20.0], SHAPES[:3]), table([10.2, 10.8, 21.0], SHAPES[[1, 0, 2]]))
    assert found.a.tolist() == [0, 1, 2]
    assert found.b.tolist() == [1, 0, 2]
    np.testing.assert_allclose(found.mac, 1)
    np.testing.assert_allclose(found.frequency_error, [0.08, 10.2 / 11 - 1, 0.05])
    assert len(found.unpaired_a) == len(found.unpaired_b) == 0


def test_without_shapes_the_order_decides() -> None:
    found = pair(table([10.0, 11.0, 20.0]), table([10.2, 10.8, 21.0], SHAPES[[1, 0, 2]]))
    assert found.b.tolist() == [0, 1, 2]
    assert np.isnan(found.mac).all()
    assert found.mac_matrix is None


def test_opposite_channel_signs_in_another_order_change_nothing() -> None:
    order = [4, 1, 0, 3, 5]
    channels = tuple(
        Channel(CHANNELS[i].node, -CHANNELS[i].direction if i % 2 else CHANNELS[i].direction) for i in order
    )
    signs = np.array([-1 if i % 2 else 1 for i in order])
    a = table([10.0, 11.0, 20.0], SHAPES[:3])
    straight = pair(a, table([10.0, 11.0, 20.0], SHAPES[:3][:, order], tuple(CHANNELS[i] for i in order)))
    turned = pair(a, table([10.0, 11.0, 20.0], SHAPES[:3][:, order] * signs, channels))
    np.testing.assert_allclose(turned.mac, straight.mac)
    np.testing.assert_allclose(turned.mac, 1)
    wrong = pair(a, table([10.0, 11.0, 20.0], SHAPES[:3][:, order], channels))
    assert np.min(np.diag(wrong.mac_matrix)) < 0.9  # negative control: the sign matters


def test_unpaired_modes_are_reported_on_both_sides() -> None:
    found = pair(table([10.0, 20.0, 90.0], SHAPES[:3]), table([5.0, 10.4, 20.5], SHAPES[[3, 0, 1]]))
    assert found.a.tolist() == [0, 1]
    assert found.b.tolist() == [1, 2]
    assert found.unpaired_a.tolist() == [2]
    assert found.unpaired_b.tolist() == [0]


def test_a_gate_refuses_a_pair_that_is_too_far() -> None:
    a, b = table([10.0]), table([14.0])
    assert len(pair(a, b)) == 1
    assert len(pair(a, b, PairSettings(max_frequency_error=0.3))) == 0
    assert len(pair(table([10.0], SHAPES[:1]), table([10.0], SHAPES[1:2]))) == 0


def test_damping_breaks_a_tie_and_unknown_damping_does_not_matter() -> None:
    a = ModalTable(np.array([10.0, 10.0]), np.array([0.01, 0.1]))
    b = ModalTable(np.array([10.0, 10.0]), np.array([0.1, 0.01]))
    assert pair(a, b).b.tolist() == [1, 0]
    unknown = ModalTable(np.array([10.0, 10.0]), np.array([np.nan, np.nan]))
    assert np.isnan(pair(a, unknown).damping_error).all()
    assert len(pair(a, unknown)) == 2


@pytest.mark.parametrize("size", [0, 3])
def test_an_empty_table_leaves_everything_unpaired(size: int) -> None:
    found = pair(table([]), table([10.0, 20.0, 30.0][:size]))
    assert len(found) == 0
    assert len(found.unpaired_b) == size
