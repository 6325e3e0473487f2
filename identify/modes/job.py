"""What an analysis of modes is about: the FRFs of a file, or (`from_study`) those of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identify.core.errors import InputError
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import frf_files, load_frf_set
from identify.modal.settings import ModalSettings
from identify.modes.evaluate import Measured
from identify.modes.said import asked, modal_settings, sources
from identify.modes.sensors import drawn, geometry_of
from identify.results.provenance import provenance, sha256
from identify.results.tables import Provenance

NO_WINDOW = (
    "no exponential window was told: if force and response were multiplied by one, all damping is too large"
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


def job_of_file(
    data: Path, file: FrfFileOptions, modal: dict[str, Any], place: Place, choices: Path | None
) -> Job:
    """The FRFs of a file with their geometry; InputError for anything that cannot be read."""
    one, notes = _measured(data, file, place)
    settings = modal_settings(ModalSettings(), modal)
    beside = [path for path in (place.geometry, choices) if path is not None]
    came_from = provenance(
        "",
        asked(file, settings, place.geometry, place.length_unit),
        [(str(path), sha256(path)) for path in (*frf_files(data), *beside)],
        sources(file, settings, modal),
    )
    return Job(data.stem, [one], settings, came_from, notes, beside)


def window_untold(options: FrfFileOptions, data: FrfSet) -> bool:
    """Whether neither the options nor the file say that there was an exponential window, or none."""
    return options.window_decay_per_s is None and not data.window_decay_per_s


def _measured(data: Path, file: FrfFileOptions, place: Place) -> tuple[Measured, list[str]]:
    """The FRFs of a file with their geometry, and what is to be said about it."""
    frf_set = load_frf_set(data, file).chosen(file.outputs, file.inputs, str(data))
    sensors, notes = geometry_of(frf_files(data)[0], place.geometry, place.length_unit, file.format)
    if sensors is not None and not {c.node for c in (*frf_set.outputs, *frf_set.inputs)} & set(sensors.nodes):
        raise InputError(
            str(place.geometry or data),
            "a geometry without any measured point",
            "the nodes of the FRFs",
            "check its node numbers",
        )
    untold = window_untold(file, frf_set)
    return (
        Measured(data.stem, str(data), frf_set, (), sensors, None if sensors is None else drawn(sensors)),
        [*notes, *([NO_WINDOW] if untold else ()), *(f"{data}: {note}" for note in frf_set.notes)],
    )
