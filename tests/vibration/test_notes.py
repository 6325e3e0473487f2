"""A reversed or exchanged channel, also off the drive point, is seen once a model is there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.arrays import Array, Complex
from identify.vibration.costs.target import FrfTarget
from identify.vibration.notes import channel_faults, fault_notes
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


@pytest.fixture(scope="module")
def target() -> FrfTarget:
    return load_problem(read_study(CONFIG)).targets().frf[0]


@pytest.fixture(scope="module")
def rough(target: FrfTarget) -> Array:
    """Parameters that are not yet right: 3 % from those with which the measurement below was made."""
    truth = load_problem(read_study(CONFIG)).initial
    return truth * np.exp(0.03 * np.random.default_rng(4).normal(size=len(truth)))


def measured(target: FrfTarget, change: Callable[[Complex], None]) -> FrfTarget:
    """The target with FRFs of the start values, 2 % of noise, and something done to them."""
    rng = np.random.default_rng(3)
    h = target.predict(load_problem(read_study(CONFIG)).initial)
    h = h * (1 + 0.02 * (rng.normal(size=h.shape) + 1j * rng.normal(size=h.shape)))
    change(h)
    return replace(target, data=replace(target.data, frf=h), noise=0.02 * np.abs(h))


def _reverse(h: Complex) -> None:
    h[:, 8] *= -1


def _exchange(h: Complex) -> None:
    h[:, [16, 17]] = h[:, [17, 16]]


def _nothing(h: Complex) -> None:
    """No fault."""


@pytest.mark.parametrize(
    ("change", "channels"), [(_nothing, []), (_reverse, [(8,)]), (_exchange, [(16, 17)])]
)
def test_faults_of_channels_are_named(
    target: FrfTarget, rough: Array, change: Callable[[Complex], None], channels: list[tuple[int, ...]]
) -> None:
    faulty = measured(target, change)
    found = [fault.channels for fault in channel_faults(faulty, rough)]
    assert found == [tuple(target.data.outputs[n] for n in numbers) for numbers in channels]


def test_the_sentence_names_the_channel_and_every_set(target: FrfTarget, rough: Array) -> None:
    faulty = measured(target, _reverse)
    [note] = fault_notes([faulty, replace(faulty, name="posture2")], rough)
    assert note.startswith(f"posture1 and posture2: channel {target.data.outputs[8]} would agree")
    assert "sign reversed" in note
