"""What `identify modes` does, without the terminal: FRFs in, modes with their quality out, as HDF5, YAML and
universal files.
"""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from identify.core.interruption import check
from identify.core.threads import one_thread
from identify.core.yaml_input import YAML_SUFFIXES
from identify.fitting.resume import held
from identify.measured.frf_records import FrfFileOptions
from identify.modal.alone import disagreement
from identify.modal.analysis import ModalAnalysis
from identify.modal.settings import ModalSettings, chosen_settings
from identify.modes.doubt import disagreement_note
from identify.modes.evaluate import Measured, analysed, verdict
from identify.modes.export import frf_paths, write_frfs, write_tables
from identify.modes.job import Job, Place, Source, job_of_files
from identify.modes.setups import setups_note
from identify.results import file as result_file
from identify.results.modes import AnalysedMeasurement, ModesResult


def run_modes(
    data: Path | Source,
    out: Path | None = None,
    file: FrfFileOptions | None = None,
    modal: dict[str, Any] | None = None,
    geometry: Path | None = None,
    length_unit: str | None = None,
    frfs: bool = False,
    choices: Path | None = None,
) -> tuple[ModesResult, list[Path]]:
    """Modes of the FRFs in a file, in several of one test, or of every FRF measurement of a study; returns
    the result and what was written, the HDF5 file first.

    data: a file, or files with all that is said of them; file: what the user says about a file alone; modal:
    keys of `ModalSettings` that replace those of the study or the defaults; geometry: universal file with the
    measurement points, by default the data file itself, its lengths in length_unit where it says none;
    frfs: whether analysed and rebuilt FRFs are written too;
    choices: YAML file of keys like modal, which overrides it.  A study has all but `modal` itself.
    InputError for anything that cannot be read, analysed or written.
    """
    begun = time.perf_counter()
    modal = {**chosen_settings(choices), **(modal or {})}
    with one_thread():
        source = Source([data], file or FrfFileOptions()) if isinstance(data, Path) else data
        job = _job(source, modal, Place(geometry, length_unit), choices)
        path = out or Path("reports") / f"{job.name}_modes.h5"
        tables = [path.with_name(f"{path.stem}{_suffix(m, job.measured)}.yaml") for m in job.measured]
        beside = [path for table in tables for path in (table, table.with_suffix(".uff"), *frf_paths(table))]
        read = [
            *source.paths,
            *filter(None, [geometry, choices]),
            *job.beside,
            *(Path(one.data.source) for one in job.measured),
        ]
        result_file.check_new(path, "modes", read, beside)
        with held(path):
            pairs = _analysed(job.measured, job.settings)
            kept = [one for _, one in pairs]
            result = ModesResult(
                name=job.name,
                verdict=verdict(kept),
                notes=(*job.notes, *_differences(pairs)),
                seconds=time.perf_counter() - begun,
                measurements={one.name: one for one in kept},
                provenance=job.provenance,
            )
            result_file.write(result, path)
            written = [path]
            for (found, _), one, table in zip(pairs, job.measured, tables, strict=True):
                written += write_tables(found.table, one.sensors, table)
                written += write_frfs(found, table) if frfs else []
    return result, written


def _job(source: Source, modal: dict[str, Any], place: Place, choices: Path | None) -> Job:
    first = source.paths[0]
    if first.suffix.lower() not in YAML_SUFFIXES:
        return job_of_files(source, modal, place, choices)
    # A study brings the robot and its engine, which take seconds to import.
    from identify.modes.from_study import job_of_study  # noqa: PLC0415

    said_too_much = source != Source([first]) or place != Place()
    return job_of_study(first, modal, refused=said_too_much)


def _analysed(
    measured: Sequence[Measured], settings: ModalSettings
) -> list[tuple[ModalAnalysis, AnalysedMeasurement]]:
    """Each measurement's modes, and what the result keeps of them."""
    found = []
    for one in measured:
        check()
        found.append(analysed(one, settings))
    return found


def _differences(pairs: Sequence[tuple[ModalAnalysis, AnalysedMeasurement]]) -> list[str]:
    """A sentence on each measurement in several setups, and on each whose FRFs do not share their poles."""
    said = [setups_note(kept.name, kept.setups) for _, kept in pairs if kept.setups is not None]
    alone = [(kept.name, found) for found, kept in pairs if kept.setups is None or kept.setups.together]
    found = [(name, disagreement(analysis), len(analysis.table)) for name, analysis in alone]
    return said + [disagreement_note(name, one, modes) for name, one, modes in found if one is not None]


def _suffix(one: Measured, all_of_them: Sequence[Measured]) -> str:
    return "" if len(all_of_them) == 1 else "_" + re.sub(r"[^\w.+-]", "_", one.name)
