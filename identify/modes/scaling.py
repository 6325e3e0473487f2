"""Modal masses of modes from responses alone: what the user gave to scale them by, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from identify.core.errors import InputError
from identify.core.text import count, listed
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set
from identify.measured.response_files import load_responses
from identify.measured.time_history import TimeHistory
from identify.modal.analysis import analyse as analyse_frfs
from identify.modal.operational.analysis import OperationalModes, analyse
from identify.modal.operational.by_added_mass import by_added_mass
from identify.modal.operational.by_frfs import by_frfs
from identify.modal.operational.settings import OperationalSettings
from identify.modal.settings import ModalSettings
from identify.results.modes import ShapeScaling

_BY_HAND = ("modes_hz", "keep_hz", "drop_hz")
"""Settings that name modes of one record alone."""


@dataclass(frozen=True)
class ScaledBy:
    """FRFs of the same structure, or a second record with masses, kg, added at points (by node)."""

    frf: Path | None = None
    record: Path | None = None
    added_kg: Mapping[int, float] = field(default_factory=dict)

    @property
    def path(self) -> Path | None:
        """The file."""
        return self.frf or self.record

    @property
    def said(self) -> dict[str, Any]:
        """As it stands in the record of what was asked."""
        if self.path is None:
            return {}
        key, mass = (
            ("scale_frf", {}) if self.frf else ("scale_record", {"added_mass_kg": dict(self.added_kg)})
        )
        return {key: str(self.path), **mass}


@dataclass(frozen=True)
class Scaler:
    """What scales, loaded; None: nothing does."""

    by: ScaledBy
    data: FrfSet | TimeHistory | None


def loaded(by: ScaledBy, file: FrfFileOptions, history: TimeHistory) -> Scaler:
    """What scales modes of these records; InputError for what cannot do so, before the work.

    file: what is said of both records; a file of FRFs says everything itself.
    """
    if by.path is None:
        return Scaler(by, None)
    if by.frf is not None:
        frfs = load_frf_set(by.frf, FrfFileOptions())
        _check_ends(frfs, history)
        return Scaler(by, frfs)
    heavier = load_responses(by.path, file)
    nodes = _nodes(history) & _nodes(heavier)
    for node in by.added_kg:
        if node not in nodes:
            found, known = f"point {node}, which is not in both records", ", ".join(map(str, sorted(nodes)))
            raise InputError(
                "--added-mass", found, f"one of {known}" if known else "records of the same points"
            )
    return Scaler(by, heavier)


def _check_ends(frfs: FrfSet, history: TimeHistory) -> None:
    """InputError where no FRF has its force and its response at channels of the records."""
    known = {history.channels[i].place for i in history.responses}
    rows, columns = (
        [n for n, c in enumerate(side) if c.place in known] for side in (frfs.outputs, frfs.inputs)
    )
    if not np.isfinite(frfs.frf[:, rows][:, :, columns]).any():
        names = [str(history.channels[i]) for i in history.responses]
        raise InputError(
            frfs.source,
            "no FRF whose force and response are both at channels of the records",
            "one or more, such as that at a sensor which was hit",
            f"the records have {', '.join(names[:6])}{', ...' * (len(names) > 6)}",
        )


def _nodes(history: TimeHistory) -> set[int]:
    return {history.channels[i].node for i in history.responses}


def scaling_of(
    found: OperationalModes, scaler: Scaler, operational: OperationalSettings
) -> tuple[ShapeScaling | None, tuple[str, ...]]:
    """Modal masses of modes, and what is to be said about them."""
    notes: tuple[str, ...] = ()
    if isinstance(scaler.data, FrfSet):
        forced = analyse_frfs(scaler.data, ModalSettings(band_hz=found.settings.band_hz))
        masses, how = by_frfs(found, forced), "FRFs"
    elif isinstance(scaler.data, TimeHistory):
        alike = found.settings.model_copy(update={key: ModalSettings().model_dump()[key] for key in _BY_HAND})
        heavier = analyse(scaler.data, operational, alike)
        masses, how = by_added_mass(found, heavier, scaler.by.added_kg), "added mass"
        notes = (*heavier.notes, *_still(found, scaler.by.added_kg))
    else:
        return None, ()
    said = ShapeScaling(
        method=how,
        source=str(scaler.by.path),
        modal_mass_kg=masses.kg,
        modal_mass_std_kg=masses.std_kg,
        partner_hz=masses.partner_hz,
        reason=masses.reason,
        added_node=np.array(list(scaler.by.added_kg), dtype=int),
        added_kg=np.array(list(scaler.by.added_kg.values()), dtype=float),
    )
    return said, notes


def _still(found: OperationalModes, nodes: Mapping[int, float]) -> tuple[str, ...]:
    """Axes along which an added mass is taken as still, for nothing was recorded there."""
    notes = []
    for node in nodes:
        seen = {abs(c.direction) for c in found.records.channels if c.node == node}
        missing = [axis for code, axis in ((1, "X"), (2, "Y"), (3, "Z")) if code not in seen]
        if missing:
            axes = listed(missing)
            notes.append(
                f"point {node} was not recorded along {axes}: the added mass is taken as still along it, so"
                " modal masses of modes that do move along it come out too small"
            )
    return tuple(notes)


def scaled_sentence(scaling: ShapeScaling) -> str:
    """How many modal masses are known, from what, and why others are not."""
    has_mass = np.isfinite(scaling.modal_mass_kg)
    where = Path(scaling.source).name
    if scaling.method == "FRFs":
        by = f"the FRFs of {where}"
    else:
        masses = [
            f"{kg:.4g} kg at point {node}"
            for node, kg in zip(scaling.added_node, scaling.added_kg, strict=True)
        ]
        by = f"{where}, recorded with {listed(masses)}"
    said = f"Modal masses of {int(has_mass.sum())} of {count(len(has_mass), 'mode')} come from {by}"
    return f"{said}; they belong to shapes whose largest component is 1."
