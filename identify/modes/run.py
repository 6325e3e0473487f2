"""What `identify modes` does, without the terminal: FRFs in, modes with their quality out, as HDF5, YAML and
universal files.
"""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from identify.core.errors import InputError
from identify.core.interruption import check
from identify.core.threads import one_thread
from identify.fitting.resume import held
from identify.measured.frf_records import FrfFileOptions
from identify.measured.loaders import load_frf_set
from identify.modal.analysis import ModalAnalysis
from identify.modal.settings import ModalSettings
from identify.modes.evaluate import Measured, analysed, verdict
from identify.modes.export import frf_paths, write_frfs, write_tables
from identify.modes.said import asked, chosen_settings, modal_settings, sources
from identify.modes.sensors import drawn, geometry_of
from identify.results import file as result_file
from identify.results.modes import AnalysedMeasurement, ModesResult
from identify.results.provenance import provenance, sha256

_STUDIES = (".yaml", ".yml")


def run_modes(
    data: Path,
    out: Path | None = None,
    file: FrfFileOptions | None = None,
    modal: dict[str, Any] | None = None,
    geometry: Path | None = None,
    length_unit: str | None = None,
    frfs: bool = False,
    choices: Path | None = None,
) -> tuple[ModesResult, list[Path]]:
    """Modes of the FRFs in a file, or of every FRF measurement of a study; returns the result and what was
    written, the HDF5 file first.

    file: what the user says about a data file; modal: keys of `ModalSettings` that replace those of the study
    or the defaults; geometry: universal file with the measurement points, by default the data file itself,
    its lengths in length_unit where it says none; frfs: whether analysed and rebuilt FRFs are written
    too; choices: YAML file of keys like modal, which overrides it.  A study has all but `modal` itself.
    InputError for anything that cannot be read, analysed or written.
    """
    begun = time.perf_counter()
    notes: list[str] = []
    modal = {**chosen_settings(choices), **(modal or {})}
    with one_thread():
        if data.suffix.lower() in _STUDIES:
            # A study brings the robot and its engine, which take seconds to import.
            from identify.modes.from_study import modal_study  # noqa: PLC0415

            said_too_much = (file is not None and file != FrfFileOptions()) or geometry or length_unit
            study = modal_study(data, modal, refused=bool(said_too_much))
            measured, settings = study.measured, modal_settings(study.settings, modal)
            name, came_from = study.name, study.provenance
        else:
            file = file or FrfFileOptions()
            one, notes = _of_file(data, file, geometry, length_unit)
            measured, settings, name = [one], modal_settings(ModalSettings(), modal), data.stem
            inputs = [(str(path), sha256(path)) for path in (data, geometry, choices) if path is not None]
            came_from = provenance(
                "", asked(file, settings, geometry, length_unit), inputs, sources(file, settings, modal)
            )
        path = out or Path("reports") / f"{name}_modes.h5"
        tables = [path.with_name(f"{path.stem}{_suffix(m, measured)}.yaml") for m in measured]
        beside = [path for table in tables for path in (table, table.with_suffix(".uff"), *frf_paths(table))]
        read = [data, *filter(None, [geometry, choices]), *(Path(m.data.source) for m in measured)]
        result_file.check_new(path, "modes", read, beside)
        with held(path):
            pairs = _analysed(measured, settings)
            kept = [one for _, one in pairs]
            result = ModesResult(
                name=name,
                verdict=verdict(kept),
                notes=tuple(notes),
                seconds=time.perf_counter() - begun,
                measurements={one.name: one for one in kept},
                provenance=came_from,
            )
            result_file.write(result, path)
            written = [path]
            for (found, _), one, table in zip(pairs, measured, tables, strict=True):
                written += write_tables(found.table, one.sensors, table)
                written += write_frfs(found, table) if frfs else []
    return result, written


def _analysed(
    measured: Sequence[Measured], settings: ModalSettings
) -> list[tuple[ModalAnalysis, AnalysedMeasurement]]:
    """Each measurement's modes, and what the result keeps of them."""
    found = []
    for one in measured:
        check()
        found.append(analysed(one, settings))
    return found


def _of_file(
    data: Path, file: FrfFileOptions, geometry: Path | None, length_unit: str | None
) -> tuple[Measured, list[str]]:
    """The FRFs of a file with their geometry, and what is to be said about it."""
    frf_set = load_frf_set(data, file)
    sensors, notes = geometry_of(data, geometry, length_unit)
    if sensors is not None and not {c.node for c in (*frf_set.outputs, *frf_set.inputs)} & set(sensors.nodes):
        raise InputError(
            str(geometry or data),
            "a geometry without any measured point",
            "the nodes of the FRFs",
            "check its node numbers",
        )
    return (
        Measured(data.stem, str(data), frf_set, (), sensors, None if sensors is None else drawn(sensors)),
        [*notes, *(f"{data}: {note}" for note in frf_set.notes)],
    )


def _suffix(one: Measured, all_of_them: Sequence[Measured]) -> str:
    return "" if len(all_of_them) == 1 else "_" + re.sub(r"[^\w.+-]", "_", one.name)
