"""Universal files for Test.Lab, ME'scope and others: measured and fitted FRFs (58b), and the model's mode
shapes with modal A (55) on their geometry (2411, 2412, 2420).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import ClassVar, cast

import numpy as np

from identify.core import atomic
from identify.core.arrays import Array, Complex
from identify.export.base import Exported, Format, Job
from identify.export.linear import LinearModel, lines_of
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet, Quantity
from identify.measured.modal_tables import ModalTable
from identify.measured.uff.shapes import shapes_text
from identify.measured.uff.write import new_geometry_text, write_uff58
from identify.model.geometry import sensor_geometry
from identify.results.fit import FrfComparison, MeasurementResult


class UniversalFiles(Format):
    """The main file has geometry and shapes; beside it, `_fitted` has FRFs of the model and, at a posture
    that was measured, `_measured` those that it was fitted to.
    """

    suffix: ClassVar[str] = ".uff"

    def paths(self, path: Path) -> list[Path]:
        """Shapes, fitted and measured FRFs."""
        return [
            path,
            *(path.with_name(f"{path.stem}_{what}{path.suffix}") for what in ("fitted", "measured")),
        ]

    def write(self, job: Job) -> Exported:
        """Two or three files."""
        shapes, fitted, measured = self.paths(job.path)
        model = job.model
        geometry = sensor_geometry(model.system.site.engine, model.points)
        text = new_geometry_text(geometry) + shapes_text(mode_table(model), str(shapes))
        atomic.write_text(shapes, text)
        at = _measurement(model)
        if at is None or at.frf is None:
            line_hz = lines_of(job.band_hz)
            frfs = FrfSet(line_hz, model.receptance(line_hz), model.channels, model.channels, "receptance")
            _write(fitted, frfs)
            return Exported([shapes, fitted], (*model.notes, *_no_measurement(at)))
        kept = [pair for pair in range(len(at.frf.output)) if not _of_motor(at.frf, pair)]
        said = (*model.notes, *_window(at.frf), *_motors(len(at.frf.output) - len(kept)))
        if not kept:
            return Exported([shapes], said)
        _write(fitted, _frf_set(at.frf, at.frf.fitted, kept))
        _write(measured, _frf_set(at.frf, at.frf.measured, kept))
        return Exported([shapes, fitted, measured], said)


def mode_table(model: LinearModel) -> ModalTable:
    """The modes as a table, with modal masses of 1 kg: a residue is phi_i phi_j / (2 j omega_d)."""
    modes = model.modes
    scale = np.sqrt(2j * modes.eigenvalues.imag)
    return ModalTable(
        modes.frequency_hz,
        modes.damping_ratio,
        model.channels,
        np.asarray(scale[:, None] * (modes.shapes @ model.out.T)),
        modal_mass_kg=np.ones(len(modes.frequency_hz)),
    )


def _write(path: Path, frfs: FrfSet) -> None:
    atomic.write_atomically(path, partial(_binary, frfs))


def _binary(frfs: FrfSet, path: Path) -> None:
    write_uff58(path, frfs, binary=True)


def _measurement(model: LinearModel) -> MeasurementResult | None:
    """The measurement at the model's posture, where there is one."""
    at = [
        one
        for one in model.fit.measurements.values()
        if np.allclose(np.deg2rad(one.posture_deg), model.posture, rtol=0, atol=1e-9)
    ]
    named = [one for one in at if model.name.endswith(f" {one.name}")]
    return next(iter([*named, *at]), None)


def _of_motor(compared: FrfComparison, pair: int) -> bool:
    """Whether it has a motor at either end."""
    return any(Channel.parse(texts[pair]).motor for texts in (compared.output, compared.input))


def _motors(count: int) -> Iterable[str]:
    if count:
        yield f"FRFs of motors are left out ({count}): the format has points alone"


def _frf_set(compared: FrfComparison, values: Complex, kept: Sequence[int]) -> FrfSet:
    """Pairs as they were compared as a set, those that are kept; NaN where a pair was not measured."""
    outputs = _channels([compared.output[pair] for pair in kept])
    inputs = _channels([compared.input[pair] for pair in kept])
    frf = np.full((len(compared.frequency_hz), len(outputs), len(inputs)), np.nan, dtype=complex)
    coherence = None if compared.coherence is None else np.full(frf.shape, np.nan)
    for pair in kept:
        output, force = Channel.parse(compared.output[pair]), Channel.parse(compared.input[pair])
        at = outputs.index(output), inputs.index(force)
        frf[:, at[0], at[1]] = values[:, pair]
        if coherence is not None and values is compared.measured:
            coherence[:, at[0], at[1]] = cast(Array, compared.coherence)[:, pair]
    return FrfSet(
        compared.frequency_hz,
        frf,
        outputs,
        inputs,
        cast(Quantity, compared.quantity),
        coherence,
        window_decay_per_s=compared.window_decay_per_s,
    )


def _channels(texts: Sequence[str]) -> tuple[Channel, ...]:
    return tuple(dict.fromkeys(Channel.parse(text) for text in texts))


def _window(compared: FrfComparison) -> Iterable[str]:
    decay = compared.window_decay_per_s
    if decay:
        yield (
            f"FRFs are as they were measured, with an exponential window of {decay:g} 1/s, which the format"
            f" cannot state: `identify modes --window-decay {decay:g}`; shapes are without it"
        )


def _no_measurement(at: MeasurementResult | None) -> Iterable[str]:
    if at is None:
        yield "nothing was measured at this posture: the FRFs are receptances of the model between all points"
