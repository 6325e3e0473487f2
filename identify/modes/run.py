"""What `identify modes` does, without the terminal: FRFs in, modes with their quality out, as HDF5, YAML and
universal files.
"""

from __future__ import annotations

import io
import re
import time
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError
from ruamel.yaml import YAML

from identify.core.atomic import write_atomically
from identify.core.config import read_yaml, validated
from identify.core.errors import InputError
from identify.core.interruption import check
from identify.core.threads import one_thread
from identify.fitting.resume import held
from identify.measured.frf_records import FrfFileOptions
from identify.measured.geometry import MeasuredGeometry
from identify.measured.loaders import FORMAT_OF_SUFFIX, load_frf_set
from identify.measured.modal_table import ModalTable
from identify.measured.modal_tables import write_modal_table
from identify.measured.uff.blocks import blocks
from identify.measured.uff.geometry import read_geometry
from identify.measured.uff.shapes import write_shapes
from identify.modal.analysis import ModalAnalysis
from identify.modal.settings import ModalSettings
from identify.modes.evaluate import Measured, analysed, verdict
from identify.modes.export import frf_paths, write_frfs
from identify.results import file as result_file
from identify.results import tables
from identify.results.modes import AnalysedMeasurement, ModesResult
from identify.results.provenance import provenance, sha256
from identify.results.setting_table import option_settings

T = TypeVar("T", bound=BaseModel)
_STUDIES = (".yaml", ".yml")
_NODES = (15, 2411)


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
    modal = {**_chosen(choices), **(modal or {})}
    with one_thread():
        if data.suffix.lower() in _STUDIES:
            # A study brings the robot and its engine, which take seconds to import.
            from identify.modes.from_study import modal_study  # noqa: PLC0415

            said_too_much = (file is not None and file != FrfFileOptions()) or geometry or length_unit
            study = modal_study(data, modal, refused=bool(said_too_much))
            measured, settings = study.measured, _settings(study.settings, modal)
            name, came_from = study.name, study.provenance
        else:
            file = file or FrfFileOptions()
            one, notes = _of_file(data, file, geometry, length_unit)
            measured, settings, name = [one], _settings(ModalSettings(), modal), data.stem
            inputs = [(str(path), sha256(path)) for path in (data, geometry, choices) if path is not None]
            came_from = provenance(
                "", _asked(file, settings, geometry, length_unit), inputs, _sources(file, settings, modal)
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
                written += _write_tables(found.table, one.sensors, table)
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


def _chosen(path: Path | None) -> dict[str, Any]:
    """The settings of the analysis that a YAML file gives; InputError for what is none, with its line."""
    if path is None:
        return {}
    data, _ = read_yaml(path)
    settings = validated(path, data, ModalSettings)
    return settings.model_dump(exclude_unset=True)


def file_options(**given: Any) -> FrfFileOptions:
    """Options of a data file from values that may be None; InputError for one that is not possible."""
    return _validated(FrfFileOptions, given)


def _settings(base: ModalSettings, given: dict[str, Any] | None) -> ModalSettings:
    """Settings with the given keys replaced; InputError for a value that is not possible."""
    return _validated(ModalSettings, {**base.model_dump(), **(given or {})})


def _validated(model: type[T], values: dict[str, Any]) -> T:
    try:
        return model.model_validate(values)
    except ValidationError as error:
        fault = error.errors()[0]
        where = str(fault["loc"][0]) if fault["loc"] else "options"
        found = f"found {fault['input']!r}" if fault["loc"] else "they do not fit together"
        raise InputError(where, found, fault["msg"][:1].lower() + fault["msg"][1:]) from error


def _sources(
    file: FrfFileOptions, settings: ModalSettings, modal: dict[str, Any] | None
) -> tables.SettingTable:
    """The settings of an analysis of a file, each with its source."""
    given = {
        **file.model_dump(exclude_defaults=True),
        **{f"modal.{key}": value for key, value in (modal or {}).items()},
    }
    return option_settings({"": file, "modal": settings}, given)


def _of_file(
    data: Path, file: FrfFileOptions, geometry: Path | None, length_unit: str | None
) -> tuple[Measured, list[str]]:
    """The FRFs of a file with their geometry, and what is to be said about it."""
    frf_set = load_frf_set(data, file)
    sensors, notes = _geometry(data, geometry, length_unit)
    if sensors is not None and not {c.node for c in (*frf_set.outputs, *frf_set.inputs)} & set(sensors.nodes):
        raise InputError(
            str(geometry or data),
            "a geometry without any measured point",
            "the nodes of the FRFs",
            "check its node numbers",
        )
    return (
        Measured(data.stem, str(data), frf_set, (), sensors, None if sensors is None else _drawn(sensors)),
        [*notes, *(f"{data}: {note}" for note in frf_set.notes)],
    )


def _geometry(
    data: Path, geometry: Path | None, length_unit: str | None
) -> tuple[MeasuredGeometry | None, list[str]]:
    if geometry is not None:
        return read_geometry(geometry, length_unit), []
    is_universal = FORMAT_OF_SUFFIX.get(data.suffix.lower()) == "uff"
    if is_universal and any(block.number in _NODES for block in blocks(data)):
        try:
            return read_geometry(data, length_unit), []
        except InputError as error:
            if length_unit is not None:
                raise
            return None, [
                "the geometry in the data file was left out, so shapes are not drawn (`--length-unit` would"
                f" say it): {error}"
            ]
    if length_unit is not None:
        raise InputError(
            "length_unit", f"{length_unit!r} without a geometry", fix="name one with `--geometry`"
        )
    return None, [
        "no geometry was given, so shapes are not drawn: `--geometry` takes a universal file with datasets 15"
        " or 2411"
    ]


def _drawn(sensors: MeasuredGeometry) -> tables.Geometry:
    row = {node: n for n, node in enumerate(sensors.nodes)}
    segments = [(row[a], row[b]) for line in sensors.lines for a, b in pairwise(line)]
    return tables.Geometry(
        nodes=np.array(sensors.nodes, dtype=int),
        point_names=("",) * len(row),
        point_links=("",) * len(row),
        points=sensors.position_m,
        skeleton=np.zeros((0, 3)),
        segments=np.array(segments, dtype=int).reshape(-1, 2),
        axes=sensors.axes,
    )


def _asked(
    file: FrfFileOptions, settings: ModalSettings, geometry: Path | None, length_unit: str | None
) -> str:
    """What was asked of a data file as YAML, with every setting of the analysis."""
    said: dict[str, Any] = dict(file.model_dump(exclude_defaults=True))
    said |= {
        key: value
        for key, value in (("geometry", geometry and str(geometry)), ("length_unit", length_unit))
        if value is not None
    }
    stream = io.StringIO()
    YAML().dump({**said, "modal": settings.model_dump(mode="json")}, stream)
    return stream.getvalue()


def _suffix(one: Measured, all_of_them: Sequence[Measured]) -> str:
    return "" if len(all_of_them) == 1 else "_" + re.sub(r"[^\w.+-]", "_", one.name)


def _write_tables(table: ModalTable, sensors: MeasuredGeometry | None, path: Path) -> list[Path]:
    """The modal table as YAML, and shapes with their geometry as a universal file; nothing where no mode was
    found.
    """
    if not len(table):
        return []
    shapes = path.with_suffix(".uff")
    write_atomically(path, partial(write_modal_table, table=table))
    write_atomically(shapes, partial(write_shapes, table=table, geometry=sensors))
    return [path, shapes]
