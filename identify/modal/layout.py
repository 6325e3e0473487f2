"""Which side of an FRF matrix the references are, and the array the estimators work on, `[line, response,
reference]`.

The complex mode indicator function of that array: singular values of the FRF matrix at every line (Shih,
Tsuei, Allemang and Brown, MSSP 2 (1988)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet
from identify.modal.lines import is_even, spacing
from identify.modal.settings import ModalSettings

_UNEVEN = 0.05
"""Part by which steps between lines may differ."""
_AXIS = {"X": 1, "Y": 2, "Z": 3}


@dataclass(frozen=True)
class Layout:
    """FRFs ordered for estimation.

    frequency_hz (L,), evenly spaced on a linear or on a logarithmic axis; frf (L, responses, references), NaN
    where a pair was not measured; power of s of the measured quantity (receptance 0 .. accelerance 2); decay
    of the exponential window (1/s). transposed: the references are outputs of the measurement, as with a
    roving hammer and fixed accelerometers (reciprocity, UMONS Eq. 1).
    """

    frequency_hz: Array
    frf: Complex
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    power: int
    decay: float
    transposed: bool
    source: str = ""

    @property
    def s(self) -> Complex:
        """Where the FRFs sample the complex plane: sigma + j omega, (L,), rad/s."""
        return np.asarray(self.decay + 2j * np.pi * self.frequency_hz, dtype=np.complex128)

    def spacing_hz(self, at_hz: float) -> float:
        """Distance of the lines around a frequency, Hz."""
        return float(spacing(self.frequency_hz, np.array(at_hz)))

    @property
    def even(self) -> bool:
        """Whether lines are evenly spaced on a linear axis."""
        return is_even(self.frequency_hz, _UNEVEN)

    @cached_property
    def complete(self) -> NDArray[np.bool_]:
        """Responses measured against every reference, (responses,): the ones poles are estimated from."""
        return np.asarray(np.isfinite(self.frf).all(axis=(0, 2)))


def arrange(frf_set: FrfSet, settings: ModalSettings) -> Layout:
    """The lines of the band and the pairs to analyse, references last; InputError where nothing usable is
    left.
    """
    where, frf_set = frf_set.source or "FRF set", frf_set.joined
    transposed, picked = _references(frf_set, settings.references, where)
    frf = frf_set.frf.transpose(0, 2, 1) if transposed else frf_set.frf
    responses, references = (
        (frf_set.inputs, frf_set.outputs) if transposed else (frf_set.outputs, frf_set.inputs)
    )
    rows = _rows(responses, settings.direction, where)
    # Only what is left out is copied: large sets take most of their time here.
    frf = frf if rows == list(range(frf.shape[1])) else frf[:, rows]
    frf = frf if picked == list(range(frf.shape[2])) else frf[:, :, picked]
    finite = np.isfinite(frf)
    measured = np.asarray(finite.any(axis=0))
    if not measured.all():
        measured = measured | ~np.isnan(frf).all(axis=0)
    rows_measured = np.asarray(measured.any(axis=1))
    if not rows_measured.all():
        frf, finite, measured = frf[:, rows_measured], finite[:, rows_measured], measured[rows_measured]
    lines = _lines(frf_set.frequency_hz, settings.band_hz, where)
    lines = lines & (finite | ~measured).all(axis=(1, 2))
    layout = Layout(
        frequency_hz=frf_set.frequency_hz[lines],
        frf=frf if lines.all() else frf[lines],
        responses=tuple(responses[i] for i, kept in zip(rows, rows_measured, strict=True) if kept),
        references=tuple(references[i] for i in picked),
        power=POWER[frf_set.quantity],
        decay=frf_set.window_decay_per_s,
        transposed=transposed,
        source=frf_set.source,
    )
    _check(layout, settings, where)
    return layout


def _references(frf_set: FrfSet, names: tuple[str, ...] | None, where: str) -> tuple[bool, list[int]]:
    """Whether the references are the outputs, and their positions there."""
    if names is None:
        transposed = len(frf_set.outputs) < len(frf_set.inputs)
        return transposed, list(range(min(len(frf_set.outputs), len(frf_set.inputs))))
    wanted = [Channel.parse(name, "references") for name in names]
    for transposed, side in ((False, frf_set.inputs), (True, frf_set.outputs)):
        if all(channel in side for channel in wanted):
            return transposed, [side.index(channel) for channel in wanted]
    known = ", ".join(
        str(c) for c in (frf_set.inputs if len(frf_set.inputs) <= len(frf_set.outputs) else frf_set.outputs)
    )
    raise InputError(
        "references",
        f"{', '.join(names)} are neither all inputs nor all outputs of {where}",
        f"some of {known}",
    )


def _rows(responses: tuple[Channel, ...], direction: str | None, where: str) -> list[int]:
    if direction is None:
        return list(range(len(responses)))
    rows = [i for i, channel in enumerate(responses) if abs(channel.direction) == _AXIS[direction]]
    if not rows:
        raise InputError(
            "direction",
            f"no response channel of {where} is along {direction}",
            fix="choose another direction",
        )
    return rows


def _lines(frequency_hz: Array, band_hz: tuple[float, float] | None, where: str) -> NDArray[np.bool_]:
    low, high = (0.0, np.inf) if band_hz is None else band_hz
    lines = (frequency_hz >= low) & (frequency_hz <= high) & (frequency_hz > 0)
    if not lines.any():
        span = f"{frequency_hz[0]:g} to {frequency_hz[-1]:g} Hz" if len(frequency_hz) else "nothing"
        raise InputError(
            "band_hz", f"no line of {where} lies in {low:g} to {high:g} Hz", f"a band within {span}"
        )
    return np.asarray(lines)


def _check(layout: Layout, settings: ModalSettings, where: str) -> None:
    lines = len(layout.frequency_hz)
    if lines < 16:
        raise InputError(
            where,
            f"{lines} finite frequency lines in the band",
            "at least 16",
            "widen band_hz or fix the data",
        )
    if not is_even(np.log(layout.frequency_hz), _UNEVEN):
        _check_even(layout.frequency_hz, where)
    elif settings.estimator == "lsce" and not layout.even:
        found, fix = (
            "lines on a logarithmic axis",
            "take the default estimator, or export them on a linear axis",
        )
        raise InputError(where, found, "evenly spaced lines for LSCE", fix)
    if not layout.complete.any():
        raise InputError(
            where, "no response was measured against every reference", fix="name fewer references"
        )
    if not np.any(layout.frf[:, layout.complete]):
        raise InputError(where, "every FRF is zero")


def _check_even(frequency_hz: Array, where: str) -> None:
    """InputError for lines that are not evenly spaced."""
    lines, steps = len(frequency_hz), np.diff(frequency_hz)
    # Vendors print the step with few digits, so the lines may creep by a part of a step over the band.
    uneven = np.abs(steps / np.median(steps) - 1) > _UNEVEN
    if 2 * np.sum(uneven) > lines:
        raise InputError(
            where,
            f"lines that are not evenly spaced: {np.min(steps):.3g} to {np.max(steps):.3g} Hz apart",
            "a constant step, or a constant ratio of neighbours, which the search for modes needs",
            "export them on a linear or a logarithmic axis; a fit of a robot takes any lines",
        )
    if not is_even(frequency_hz, _UNEVEN):
        at = frequency_hz[np.argmax(np.abs(steps - np.mean(steps)))]
        raise InputError(
            where,
            f"the lines are not evenly spaced near {at:g} Hz",
            "a constant step",
            "choose band_hz beside the gap",
        )


def cmif(layout: Layout) -> np.ndarray:
    """(lines, references), largest first, of the responses measured against every reference; unit of the
    FRFs.

    A peak of the first is a mode; a peak of the second at the same line is another one that close.
    """
    return np.asarray(np.linalg.svd(layout.frf[:, layout.complete], compute_uv=False))
