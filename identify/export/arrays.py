"""Matrices by name: `.npz` for NumPy, `.mat` (v5) for MATLAB, Octave and SciPy, and the state space alone as
JSON, which any language reads.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, ClassVar

import numpy as np
from scipy.io import savemat

from identify.core import atomic
from identify.core.version import VERSION
from identify.export.base import Exported, Format, Job


def contents(job: Job) -> dict[str, Any]:
    """Everything by name: arrays, texts and lists of texts."""
    model = job.model
    a, b, c, d = model.state_space
    channels = [str(channel) for channel in model.channels]
    found: dict[str, Any] = {
        "mass": model.mass,
        "damping": model.damping,
        "stiffness": model.stiffness,
        "output_map": model.out,
        "input_map": model.out.T,
        "A": a,
        "B": b,
        "C": c,
        "D": d,
        "coordinates": list(model.coordinates),
        "coordinate_units": list(model.units),
        "outputs": channels,
        "inputs": channels,
        "output_unit": "m",
        "input_unit": "N",
        "joints": [joint.name for joint in model.model.robot.joints],
        "posture_deg": np.rad2deg(model.posture),
        "mode_hz": model.modes.frequency_hz,
        "mode_damping_ratio": model.modes.damping_ratio,
        "band_hz": np.array(job.band_hz),
        "name": model.name,
        "notes": list(notes(job)),
        "identify": VERSION,
    }
    if job.reduced is not None:
        r = job.reduced
        found |= {"A_reduced": r.a, "B_reduced": r.b, "C_reduced": r.c, "D_reduced": r.d}
        found |= {"reduced_modes": float(r.modes), "reduced_error": r.error}
    return found


def notes(job: Job) -> tuple[str, ...]:
    """What the file says in sentences."""
    return (*job.model.notes, *(() if job.reduced is None else (job.reduced.sentence,)))


def _binary(job: Job, save: Callable[[BinaryIO], None]) -> Exported:
    """The one file of a job, saved as a whole."""
    stream = io.BytesIO()
    save(stream)
    atomic.write_atomically(job.path, partial(Path.write_bytes, data=stream.getvalue()))
    return Exported([job.path], notes(job))


class Npz(Format):
    """NumPy's archive of arrays, texts among them; nothing pickled."""

    suffix: ClassVar[str] = ".npz"
    reduces: ClassVar[bool] = True

    def write(self, job: Job) -> Exported:
        """One file."""
        arrays = {name: np.asarray(value) for name, value in contents(job).items()}
        return _binary(job, lambda stream: np.savez_compressed(stream, **arrays))  # type: ignore[arg-type]


class Mat(Format):
    """A MATLAB file; lists of texts are cell arrays."""

    suffix: ClassVar[str] = ".mat"
    reduces: ClassVar[bool] = True

    def write(self, job: Job) -> Exported:
        """One file."""
        values = {
            name: np.array(value, dtype=object) if isinstance(value, list) else value
            for name, value in contents(job).items()
        }
        return _binary(job, lambda stream: savemat(stream, values, oned_as="column"))


class StateSpace(Format):
    """A, B, C, D with their names and units, as JSON; of the reduced model where one is asked for."""

    suffix: ClassVar[str] = ".json"
    reduces: ClassVar[bool] = True

    def write(self, job: Job) -> Exported:
        """One file."""
        kept = ("outputs", "inputs", "output_unit", "input_unit", "joints", "posture_deg", "band_hz", "name")
        whole = contents(job)
        end = "_reduced" if job.reduced is not None else ""
        said = {name: whole[f"{name}{end}"] for name in "ABCD"} | {name: whole[name] for name in kept}
        said |= {"notes": whole["notes"], "identify": VERSION}
        text = json.dumps(said, default=lambda array: np.asarray(array).tolist())
        atomic.write_text(job.path, text + "\n")
        return Exported([job.path], notes(job))
