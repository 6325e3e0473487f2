"""`identify modes --output-only`: the modes of response records from the data to the result."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.errors import InputError
from identify.core.text import count, listed
from identify.core.threads import one_thread
from identify.core.thresholds import SIGMAS_95
from identify.core.yaml_input import YAML_SUFFIXES
from identify.fitting.resume import held
from identify.measured.frf_records import FrfFileOptions
from identify.measured.geometry import MeasuredGeometry, displacements
from identify.measured.loaders import FORMAT_OF_SUFFIX
from identify.measured.modal_tables import ModalTable
from identify.measured.response_files import load_responses
from identify.measured.several import files_of, name_of
from identify.modal.analysis import synthesis_error
from identify.modal.frf_errors import frf_errors
from identify.modal.operational.analysis import OperationalModes, analyse
from identify.modal.operational.settings import OperationalSettings
from identify.modal.settings import ModalSettings, chosen_settings
from identify.modes.evaluate import doubtful, drawn_diagram, mode_table, rejected_poles, turned_down
from identify.modes.export import write_tables
from identify.modes.output_setups import together
from identify.modes.said import asked, modal_settings, sources
from identify.modes.scaling import ScaledBy, Scaler, loaded, scaled_sentence, scaling_of
from identify.modes.sensors import drawn, geometry_of
from identify.modes.setups import setups_note
from identify.results import file as result_file
from identify.results.fit import HALF_SPECTRUM, FrfComparison
from identify.results.modes import (
    AnalysedMeasurement,
    ModesResult,
    OutputOnly,
    Reciprocity,
    ShapeScaling,
    Tones,
)
from identify.results.provenance import provenance, sha256

_UNSURE = 0.4
"""Half a 95 % interval of a damping ratio, relative, from which on a longer record is asked for."""


@dataclass(frozen=True)
class Asked:
    """What is said of the file, the analysis, what turns, where sensors are, and what scales the shapes."""

    file: FrfFileOptions = field(default_factory=FrfFileOptions)
    modal: dict[str, Any] = field(default_factory=dict)
    operational: OperationalSettings = field(default_factory=OperationalSettings)
    geometry: Path | None = None
    length_unit: str | None = None
    choices: Path | None = None
    scaled_by: ScaledBy = field(default_factory=ScaledBy)

    @property
    def beside(self) -> list[Path]:
        """Files that are read beside the records."""
        return [one for one in (self.geometry, self.choices, self.scaled_by.path) if one is not None]


def run_output_only(
    data: Path | Sequence[Path], out: Path | None, wanted: Asked
) -> tuple[ModesResult, list[Path]]:
    """Modes of the response records in a file, or in one for each setup of a test; returns the result and
    what was written, the HDF5 file first.

    InputError for anything that cannot be read, analysed or written.
    """
    begun = time.perf_counter()
    files = _files([data] if isinstance(data, Path) else data, wanted)
    modal = {**chosen_settings(wanted.choices), **wanted.modal}
    settings = modal_settings(ModalSettings(), modal)
    name = name_of(files)
    with one_thread():
        histories = [load_responses(path, wanted.file) for path in files]
        scaler = loaded(wanted.scaled_by, wanted.file, histories[0])
        sensors, notes = geometry_of(files[0], wanted.geometry, wanted.length_unit)
        path = out or Path("reports") / f"{name}_modes.h5"
        table = path.with_suffix(".yaml")
        read = [*files, *wanted.beside]
        result_file.check_new(path, "modes", read, [table, table.with_suffix(".uff")])
        with held(path):
            found = [analyse(history, wanted.operational, settings) for history in histories]
            if len(found) == 1:
                one, modes, more = _alone(files[0], found[0], sensors, scaler, wanted)
            else:
                kept = [_unscaled(file, each, wanted) for file, each in zip(files, found, strict=True)]
                one, modes = together(name, found, kept, sensors)
                more = (setups_note(name, one.setups),) if one.setups is not None else ()
            said = dict.fromkeys(note for each in found for note in each.notes)
            result = ModesResult(
                name=name,
                verdict=_verdict(one),
                notes=(*notes, *said, *more),
                seconds=time.perf_counter() - begun,
                measurements={one.name: one},
                provenance=provenance(
                    "",
                    asked(
                        wanted.file,
                        settings,
                        wanted.geometry,
                        wanted.length_unit,
                        wanted.operational,
                        wanted.scaled_by.said,
                    ),
                    [(str(one), sha256(one)) for one in read],
                    sources(wanted.file, settings, modal, wanted.operational, wanted.scaled_by.said),
                ),
            )
            result_file.write(result, path)
            return result, [path, *write_tables(modes, sensors, table)]


def _files(paths: Sequence[Path], wanted: Asked) -> list[Path]:
    """The files of all setups; InputError for what is not of responses, and masses for several setups."""
    for path in paths:
        _check(path, wanted.file)
    files = [one for path in paths for one in files_of(path, FORMAT_OF_SUFFIX)]
    if len(files) > 1 and wanted.scaled_by.path is not None:
        found, fix = f"given beside {len(files)} files of responses", "scale one of them, or leave it out"
        raise InputError("--scale-frf or --scale-record", found, "one file of responses", fix)
    return files


def _alone(
    file: Path, found: OperationalModes, sensors: MeasuredGeometry | None, scaler: Scaler, wanted: Asked
) -> tuple[AnalysedMeasurement, ModalTable, tuple[str, ...]]:
    """A measurement of one file, its modal table, and sentences on modal masses."""
    scaling, more = scaling_of(found, scaler, wanted.operational)
    modes = _table(found, scaling)
    extras = _extras(found, wanted.operational.teeth or 0, scaling)
    return _analysed(file, found, modes, sensors, extras), modes, more


def _unscaled(file: Path, found: OperationalModes, wanted: Asked) -> AnalysedMeasurement:
    """What a result keeps of one setup, but for pictures."""
    extras = _extras(found, wanted.operational.teeth or 0, None)
    return _analysed(file, found, found.table, None, extras)


def _check(data: Path, file: FrfFileOptions) -> None:
    if data.suffix.lower() in YAML_SUFFIXES:
        raise InputError(str(data), "a study beside --output-only", "a file of response records")
    for key in ("quantity", "averages", "window_decay_per_s", "inputs"):
        if getattr(file, key) is not None:
            name = f"--{key.removesuffix('_per_s').replace('_', '-')}"
            raise InputError(
                name, "said of FRFs, beside --output-only", "records of responses", "leave it out"
            )


def _table(found: OperationalModes, scaling: ShapeScaling | None) -> ModalTable:
    if scaling is None:
        return found.table
    return replace(
        found.table, modal_mass_kg=scaling.modal_mass_kg, modal_mass_std_kg=scaling.modal_mass_std_kg
    )


def _extras(found: OperationalModes, teeth: int, scaling: ShapeScaling | None) -> OutputOnly:
    return OutputOnly(
        seconds=found.records.seconds,
        blocks=len(found.correlations.blocks),
        shape_std=found.scatter.shapes,
        tones=_tones(found),
        teeth=teeth,
        scaling=scaling,
    )


def _analysed(
    data: Path,
    found: OperationalModes,
    table: ModalTable,
    sensors: MeasuredGeometry | None,
    extras: OutputOnly,
) -> AnalysedMeasurement:
    """What a result keeps of an analysis."""
    rejected = rejected_poles(found.rejected)
    lines, judged = found.layout.frequency_hz, (*found.verified.modes, *found.rejected)
    return AnalysedMeasurement(
        name=data.stem,
        file=str(data),
        sha256=found.records.sha256,
        posture_deg=np.zeros(0),
        estimator="SSI-cov",
        highest_order=found.diagram.orders[-1],
        total_error=synthesis_error(found.layout.frf, found.rebuilt)[1],
        modes=mode_table(found.table, found.layout.references, found.participation, found.settings),
        rejected=rejected,
        diagram=drawn_diagram(found.diagram, lines, found.mode_indicator, found.settings, judged),
        reciprocity=Reciprocity((), (), *np.zeros((3, 0))),
        frf=_spectra(found),
        geometry=None if sensors is None else drawn(sensors),
        shapes=None if sensors is None else displacements(sensors, table),
        output_only=extras,
    )


def _tones(found: OperationalModes) -> Tones:
    rows = [
        (t.frequency_hz, t.width_hz, t.kurtosis, t.share, t.multiple or 0, t.speed_hz) for t in found.tones
    ]
    frequency, width, kurtosis, share, multiple, speed = np.array(rows).reshape(-1, 6).T
    return Tones(frequency, width, kurtosis, share, multiple.astype(int), speed)


def _spectra(found: OperationalModes) -> FrfComparison:
    """Half spectra of the records beside those of the modes, in place of FRFs."""
    layout, units = found.layout, set(found.records.units)
    size = found.correlations.size if len(units) == 1 else np.ones(len(found.records.channels))
    scale = np.outer(size, size[found.correlations.references])
    rows, columns = (index.ravel() for index in np.indices(scale.shape))
    measured, rebuilt = ((values * scale)[:, rows, columns] for values in (layout.frf, found.rebuilt))
    return FrfComparison(
        quantity=HALF_SPECTRUM,
        unit=f"({units.pop()})^2/Hz" if len(units) == 1 else "1/Hz",
        window_decay_per_s=0.0,
        frequency_hz=layout.frequency_hz,
        output=tuple(str(layout.responses[i]) for i in rows),
        input=tuple(str(layout.references[j]) for j in columns),
        measured=measured,
        fitted=rebuilt,
        **frf_errors(measured, rebuilt),
    )


def _verdict(m: AnalysedMeasurement) -> tuple[str, ...]:
    said = (_found(m), _left_out(m), _harmonics(m), _longer(m), doubtful(m), turned_down(m))
    return (" ".join(filter(None, said)),)


def _found(m: AnalysedMeasurement) -> str:
    assert m.output_only is not None
    modes = {0: "No mode was", 1: "One mode was"}.get(len(m.modes.frequency_hz), "")
    modes = modes or f"{len(m.modes.frequency_hz)} modes were"
    lines, said = m.frf.frequency_hz, m.output_only
    rebuilt = f" They rebuild the half spectra to {100 * m.total_error:.3g} % (RMS over all)."
    return (
        f"{modes} found between {lines[0]:.4g} and {lines[-1]:.4g} Hz in {said.seconds:.4g} s of"
        f" {count(len(m.modes.channels), 'response')} alone ({m.estimator}, orders up to {m.highest_order};"
        f" intervals from {said.blocks} blocks).{rebuilt if len(m.modes.frequency_hz) else ''}"
    )


def _left_out(m: AnalysedMeasurement) -> str:
    assert m.output_only is not None
    if not len(m.modes.frequency_hz):
        return ""
    if m.output_only.scaling is not None:
        return scaled_sentence(m.output_only.scaling)
    return "Without a force there is no modal mass: shapes are unscaled, their largest component is 1."


def _harmonics(m: AnalysedMeasurement) -> str:
    """What turns, in a sentence."""
    assert m.output_only is not None
    tones = m.output_only.tones
    if not len(tones.frequency_hz):
        return "No harmonic of anything that turns stands out."
    parts = [
        f"{hz:.4g} Hz" + (f" ({_multiple(int(k), speed, m.output_only.teeth)})" if k else "")
        for hz, k, speed in zip(tones.frequency_hz, tones.multiple, tones.speed_hz, strict=True)
    ]
    shown = [*parts[:8], f"{len(parts) - 8} more"] if len(parts) > 8 else parts
    return (
        f"{count(len(parts), 'tone')} of steady amplitude or at a multiple of a stated speed"
        f" ({100 * np.sum(tones.share):.2g} % of all power): {listed(shown)}. They were reduced to the"
        " level beside them before the analysis, and no pole there as narrow as a tone counts as a mode."
    )


def _multiple(multiple: int, speed_hz: float, teeth: int) -> str:
    if teeth and multiple % teeth == 0:
        return f"{multiple // teeth} x the tooth passing at {teeth * speed_hz:.4g} Hz"
    return f"{multiple} x {speed_hz:.4g} Hz"


def _longer(m: AnalysedMeasurement) -> str:
    """Which damping ratios a longer record would tell better."""
    assert m.output_only is not None
    half = SIGMAS_95 * m.modes.damping_std / np.maximum(m.modes.damping_ratio, 1e-12)
    unsure = np.flatnonzero(half > _UNSURE)
    if not len(unsure):
        return ""
    worst = int(unsure[np.argmax(half[unsure])])
    seconds = m.output_only.seconds * (half[worst] / _UNSURE) ** 2
    return (
        f"The damping of {count(len(unsure), 'mode')} is known to no better than {_UNSURE:.0%}, worst at"
        f" {m.modes.frequency_hz[worst]:.4g} Hz ({half[worst]:.0%}): about {seconds:.2g} s of records would"
        " be needed for that."
    )
