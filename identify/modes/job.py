"""What an analysis of modes is about: the FRFs of a file, or (`from_study`) those of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from identify.core.errors import InputError
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import frf_files
from identify.measured.several import name_of, sha256_of_all
from identify.measured.source import Estimation
from identify.modal.settings import ModalSettings
from identify.modal.setups.result import pooled
from identify.modes.evaluate import Measured
from identify.modes.said import asked, modal_settings, sources
from identify.modes.sensors import drawn, geometry_of
from identify.modes.setups import read_setups
from identify.results.provenance import provenance, sha256
from identify.results.tables import Provenance

NO_WINDOW = (
    "no exponential window was stated: if force and response were multiplied by one, all damping is too large"
    " by it; say its decay, `--window-decay`, or 0 where there was none"
)


@dataclass(frozen=True)
class Place:
    """Where the sensors of a data file are: universal file, by default the data file itself, and its length
    unit where it says none.
    """

    geometry: Path | None = None
    length_unit: str | None = None


@dataclass(frozen=True)
class Job:
    """The measurements and the settings of an analysis; beside: files that were read with them."""

    name: str
    measured: list[Measured]
    settings: ModalSettings
    provenance: Provenance
    notes: Sequence[str] = ()
    beside: Sequence[Path] = ()


@dataclass(frozen=True)
class Source:
    """Files, folders or patterns of files; file: what is said of them; estimation: of FRFs from time records,
    None: they have FRFs; roved: see `setups.read_setups`.
    """

    paths: Sequence[Path]
    file: FrfFileOptions = field(default_factory=FrfFileOptions)
    estimation: Estimation | None = None
    roved: bool = False

    @property
    def files(self) -> list[Path]:
        """Every file."""
        return frf_files(self.paths)


def job_of_files(source: Source, modal: dict[str, Any], place: Place, choices: Path | None) -> Job:
    """The FRFs of files with their geometry; InputError for anything that cannot be read."""
    one, notes = _measured(source, place)
    file = source.file
    settings = modal_settings(ModalSettings(), modal)
    beside = [path for path in (place.geometry, choices) if path is not None]
    came_from = provenance(
        "",
        asked(file, settings, place.geometry, place.length_unit, beside=_said(source)),
        [(str(path), sha256(path)) for path in (*source.files, *beside)],
        sources(file, settings, modal, beside=_said(source)),
    )
    return Job(one.name, [one], settings, came_from, notes, [*source.files, *beside])


def _said(source: Source) -> dict[str, Any]:
    """What is said beside the options of a file."""
    said: dict[str, Any] = {"roved": True} if source.roved else {}
    if source.estimation is not None:
        said["estimate"] = source.estimation.model_dump(mode="json", exclude_unset=True)
    return said


def window_untold(options: FrfFileOptions, data: FrfSet) -> bool:
    """Whether neither the options nor the file say that there was an exponential window, or none."""
    return options.window_decay_per_s is None and not data.window_decay_per_s


def _measured(source: Source, place: Place) -> tuple[Measured, list[str]]:
    """The FRFs of files with their geometry, and what is to be said about it."""
    name, where = name_of(source.paths), str(source.paths[0])
    setups = read_setups(source.files, source.file, source.estimation, source.roved)
    frf_set = setups[0][1] if len(setups) == 1 else pooled([one for _, one in setups], where)
    sensors, notes = geometry_of(source.files[0], place.geometry, place.length_unit, source.file.format)
    if sensors is not None and not {c.node for c in (*frf_set.outputs, *frf_set.inputs)} & set(sensors.nodes):
        raise InputError(
            str(place.geometry or where),
            "a geometry without any measured point",
            "the nodes of the FRFs",
            "check its node numbers",
        )
    untold = window_untold(source.file, frf_set) and not _is_random(source)
    said = dict.fromkeys(f"{one.source}: {note}" for _, one in setups for note in one.notes)
    measured = Measured(name, where, frf_set, (), sensors, None if sensors is None else drawn(sensors))
    if len(setups) > 1:
        digest = sha256_of_all([one.sha256 for _, one in setups])
        measured = replace(measured, data=replace(frf_set, sha256=digest), setups=setups)
    return measured, [*notes, *([NO_WINDOW] if untold else ()), *said]


def _is_random(source: Source) -> bool:
    return source.estimation is not None and source.estimation.excitation == "random"
