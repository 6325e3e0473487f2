"""What a file says wrongly, put right: factors, names, quantity, frequencies, axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.correction import Correction, turned
from identify.measured.frf_set import FrfSet


def data() -> FrfSet:
    rng = np.random.default_rng(3)
    outputs = tuple(Channel(node, axis) for node in (1, 2) for axis in (1, 2, 3))
    inputs = tuple(Channel(2, axis) for axis in (1, 2, 3))
    frf = rng.normal(size=(4, 6, 3)) + 1j * rng.normal(size=(4, 6, 3))
    return FrfSet(np.arange(1.0, 5.0), frf, outputs, inputs, "accelerance", noise=np.full((4, 6, 3), 0.1))


def test_factors_of_all_of_a_point_a_channel_and_a_force() -> None:
    told = Correction(factor=2.0, outputs={1: 10, "2:+Z": -1}, inputs={"2:+X": 3.0})
    found = told.applied(data(), "a.uff")
    expected = np.full((6, 3), 2.0)
    expected[:3] *= 10
    expected[5] *= -1
    expected[:, 0] *= 3
    np.testing.assert_allclose(found.frf, data().frf * expected)
    assert found.noise is not None
    np.testing.assert_allclose(found.noise, 0.1 * np.abs(expected) * np.ones((4, 1, 1)))


def test_forces_over_responses_are_turned_over() -> None:
    told, right = Correction(inverse=True, factor=2.0), data()
    assert right.noise is not None
    over = replace(right, frf=1 / right.frf, noise=right.noise / np.abs(right.frf) ** 2)
    found = told.applied(over, "a.uff")
    np.testing.assert_allclose(found.frf, 2 * right.frf)
    np.testing.assert_allclose(found.noise, 2 * right.noise)
    over.frf[0, 0, 0] = 0.0
    assert np.isnan(told.applied(over, "a.uff").frf[0, 0, 0]), "no number, and no warning"


def test_points_channels_quantity_and_frequency() -> None:
    told = Correction(
        nodes={1: 2, 2: 1}, outputs={"2:+X": "2:-Y", "2:+Y": "2:+X"}, quantity="mobility", frequency="rad/s"
    )
    found = told.applied(data(), "a.uff")
    assert [str(one) for one in found.outputs] == ["2:-Y", "2:+X", "2:+Z", "1:+X", "1:+Y", "1:+Z"]
    assert [one.node for one in found.inputs] == [1, 1, 1]
    assert found.quantity == "mobility"
    np.testing.assert_allclose(found.frequency_hz, data().frequency_hz / (2 * np.pi))


@pytest.mark.parametrize(
    ("told", "said"),
    [
        (Correction(nodes={7: 1}), "no point 7"),
        (Correction(outputs={"9": 2.0}), "no point or channel 9"),
        (Correction(outputs={"1:+X": "1:+Y"}), "two channels become 1:+Y"),
    ],
)
def test_what_is_not_there_is_refused(told: Correction, said: str) -> None:
    with pytest.raises(InputError, match=said.replace("+", r"\+")):
        told.applied(data(), "a.uff")


def test_axes_turn_responses_forces_and_noise() -> None:
    one, two = (
        scipy.spatial.transform.Rotation.from_rotvec(v).as_matrix() for v in ([0.3, 1, 0], [0, 0.5, 2])
    )
    found = turned(data(), {1: one, 2: two}, "a")
    there = np.einsum("ij,ljk,mk->lim", one, data().frf[:, :3], two)
    np.testing.assert_allclose(found.frf[:, :3], there)
    np.testing.assert_allclose(found.noise, 0.1, err_msg="equal noise of three axes stays what it is")


def test_two_axes_cannot_be_turned() -> None:
    with pytest.raises(InputError, match="without all three directions"):
        turned(data().pairs([0, 1, 3, 4, 5], [0, 1, 2]), {1: np.eye(3), 2: np.eye(3)}, "a")
