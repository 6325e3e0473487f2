"""FRF sets for round trips, and how to compare them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet


def some_set(seed: int = 0, lines: int = 7, outputs: int = 3, inputs: int = 2, **changes: Any) -> FrfSet:
    """Random values with coherence, averages and window decay."""
    random = np.random.default_rng(seed)
    shape = (lines, outputs, inputs)
    frf = (random.normal(size=shape) + 1j * random.normal(size=shape)) * 10.0 ** random.integers(-9, 3, shape)
    whole = FrfSet(
        frequency_hz=2.5 + 0.625 * np.arange(lines),
        frf=frf,
        outputs=tuple(Channel(3 + i, (1, -2, 3)[i % 3]) for i in range(outputs)),
        inputs=tuple(Channel(3 + j, (1, 2, 3)[j % 3]) for j in range(inputs)),
        quantity="accelerance",
        coherence=random.uniform(0, 1, shape),
        averages=4,
        window_decay_per_s=0.69,
    )
    return replace(whole, **changes)


@st.composite
def sets(draw: st.DrawFn) -> FrfSet:
    """Sets of any small size and quantity, even or uneven, with rotations, with pairs and coherences that
    lack.
    """
    lines, outputs, inputs = draw(st.integers(1, 6)), draw(st.integers(1, 3)), draw(st.integers(1, 2))
    whole = some_set(
        draw(st.integers(0, 1000)),
        lines,
        outputs,
        inputs,
        quantity=draw(st.sampled_from(["receptance", "mobility", "accelerance"])),
    )
    direction = st.integers(-6, 6)
    whole = replace(whole, outputs=tuple(Channel(10**i, draw(direction)) for i in range(outputs)))
    if draw(st.booleans()):
        steps = draw(st.lists(st.floats(1e-3, 1e3), min_size=lines, max_size=lines))
        whole = replace(whole, frequency_hz=np.cumsum(steps))
    if draw(st.booleans()):
        whole = replace(whole, coherence=None)
    if outputs > 1 and draw(st.booleans()):
        frf = whole.frf.copy()
        frf[:, 0, 0] = np.nan
        coherence = None if whole.coherence is None else np.where(np.isnan(frf), np.nan, whole.coherence)
        whole = replace(whole, frf=frf, coherence=coherence)
    return whole


def by_pair(frf_set: FrfSet) -> dict[tuple[Channel, Channel], tuple[np.ndarray, np.ndarray | None]]:
    """Values and coherence of the measured pairs, whatever their order in the set."""
    pairs = {}
    for i, output in enumerate(frf_set.outputs):
        for j, input_ in enumerate(frf_set.inputs):
            if frf_set.measured[i, j]:
                coherence = (
                    None
                    if frf_set.coherence is None or np.isnan(frf_set.coherence[:, i, j]).all()
                    else frf_set.coherence[:, i, j]
                )
                pairs[output, input_] = (frf_set.frf[:, i, j], coherence)
    return pairs


def assert_same(read: FrfSet, written: FrfSet, rtol: float = 0.0) -> None:
    """The same measured pairs with the same values, to a relative difference."""
    assert read.quantity == written.quantity
    np.testing.assert_allclose(read.frequency_hz, written.frequency_hz, rtol=max(rtol, 1e-8) if rtol else 0)
    a, b = by_pair(read), by_pair(written)
    assert set(a) == set(b)
    for pair, (values, coherence) in b.items():
        np.testing.assert_allclose(a[pair][0].real, values.real, rtol=rtol)
        np.testing.assert_allclose(a[pair][0].imag, values.imag, rtol=rtol)
        if coherence is None:
            assert a[pair][1] is None
        else:
            np.testing.assert_allclose(a[pair][1], coherence, rtol=rtol)
