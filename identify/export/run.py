"""What `identify export` does, without the terminal: a fitted model, postures and a format in, files out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.core.arrays import Array
from identify.core.atomic import ELSEWHERE, check_writable
from identify.core.errors import InputError
from identify.core.threads import one_thread
from identify.export.base import FORMATS, Exported, Format, Job
from identify.export.linear import linear_model
from identify.export.reduced import reduced
from identify.model.modes import complex_modes
from identify.results.discovery import fit_of
from identify.results.fit import FitResult
from identify.vibration.fitted_model import FittedModel, check_band, fitted_model, posture_of

_ALL = "all"


@dataclass(frozen=True)
class Wanted:
    """What is asked for: the format; postures as angles, names of measurements, or `all` of these; modes or
    the error of a model with fewer states; and the band that it is for, by default that of the fit.
    """

    to: str
    postures: Sequence[str] = ()
    modes: int | None = None
    error: float | None = None
    band_hz: tuple[float, float] | None = None


def run_export(result: Path, wanted: Wanted, out: Path | None = None) -> Exported:
    """Write a fitted model at each posture; out: the file, where there is one posture, else what stands
    before the names of the postures; by default the result's name without suffix.

    InputError for a file that is no fit, an unknown format or posture, what a format cannot say, and a file
    that exists, which is kept.
    """
    form: Format = FORMATS.get(wanted.to, "--to")()
    if wanted.band_hz is not None:
        check_band(wanted.band_hz)
    asked = wanted.modes is not None or wanted.error is not None
    if asked and not form.reduces:
        able = [name for name, one in FORMATS.usable().items() if one.reduces]
        raise InputError("--modes or --error", f"with `--to {wanted.to}`", "one of " + ", ".join(able))
    fit = fit_of(result)
    model = fitted_model(fit, str(result))
    places = _places(wanted.postures, fit, model)
    paths = _paths(result, out, form, [name for name, _ in places])
    for path in (one for main in paths for one in form.paths(main)):
        if path.resolve() == result.resolve():
            raise InputError(str(path), "the result itself", "another file", ELSEWHERE)
        if path.exists():
            raise InputError(str(path), "the file exists", "a new file", f"{ELSEWHERE}, or remove it")
        check_writable(path)
    written: list[Path] = []
    notes: dict[str, None] = {}
    with one_thread():
        for (name, posture), path in zip(places, paths, strict=True):
            found = form.write(_job(name, fit, model, posture, path, wanted))
            written += found.written
            notes |= dict.fromkeys(note if len(places) == 1 else f"{name}: {note}" for note in found.notes)
    return Exported(written, tuple(notes))


def _job(name: str, fit: FitResult, model: FittedModel, posture: Array, path: Path, wanted: Wanted) -> Job:
    band_hz = wanted.band_hz or model.band_hz or _own_band(model, posture)
    linear = linear_model(f"{fit.name} {name}", fit, model, posture, band_hz)
    asked = wanted.modes is not None or wanted.error is not None
    fewer = reduced(linear, band_hz, wanted.modes, wanted.error or 0.0) if asked else None
    return Job(linear, path, band_hz, fewer)


def _own_band(model: FittedModel, posture: Array) -> tuple[float, float]:
    """Around the modes of a model that was fitted without a band."""
    frequency = complex_modes(*model.system(posture).matrices(model.values)).frequency_hz
    return (0.5 * float(frequency[0]), 1.2 * float(frequency[-1])) if len(frequency) else (1.0, 100.0)


def _places(asked: Sequence[str], fit: FitResult, model: FittedModel) -> list[tuple[str, Array]]:
    """Names and angles, rad, of the postures; by default the first measurement's."""
    names = list(fit.measurements)
    texts = [name for text in asked or names[:1] for name in (names if text == _ALL else [text])]
    found = [(text, posture_of(text, fit, model)) for text in dict.fromkeys(texts)]
    return [(name if name in names else _angles(posture), posture) for name, posture in found]


def _angles(posture: Array) -> str:
    """A posture as part of the name of a file."""
    return "_".join(f"{angle:g}" for angle in np.rad2deg(posture).round(6).tolist())


def _paths(result: Path, out: Path | None, form: Format, names: Sequence[str]) -> list[Path]:
    if out is not None and len(names) == 1:
        return [out]
    base = (out or result).with_suffix("")
    safe = [re.sub(r"[^\w.+-]", "_", name) for name in names]
    return [base.with_name(f"{base.name}_{name}{form.suffix}") for name in safe]
