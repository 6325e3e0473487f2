"""batch.yaml: a base study and the postures or data sets to fit it to, or whole studies; read into the
studies to fit, one by one.
"""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from identify.batch.posture_table import ANGLE, posture_of, read_table
from identify.core.config import Settings, read_settings, read_yaml
from identify.core.config_paths import relocate
from identify.core.errors import InputError
from identify.measured.several import name_of
from identify.vibration.study import MeasurementSettings

SCHEMA = "identify-batch/1"
Data = dict[str, Any]


class JointSettings(Settings):
    """What all fits have in common."""

    shared: list[str] = Field(
        [],
        description=(
            "names of parameters that are the same in all fits, `*` for any part of a name, such as"
            " *.damping; all others are each fit's own, with mean and scatter"
        ),
    )


class BatchSettings(Settings):
    """What one batch.yaml describes."""

    schema_: Literal["identify-batch/1"] = Field(alias="schema", description="version of this format")
    name: str = Field(
        "batch",
        min_length=1,
        pattern=r"^[^/\\]+$",
        description="names the folder of the results and their summary",
    )
    study: Path | None = Field(
        None,
        description="the base study; its measurements are those of the batch unless the batch has its own",
    )
    measurements: list[Data] = Field(
        [],
        description=(
            "measurements as in a study, each fitted on its own; `file` may be a pattern such as day1/*.uff"
        ),
    )
    table: Path | None = Field(
        None,
        description=(
            "CSV of further measurements: columns are keys of a measurement, and joint1_deg, joint2_deg, ..."
        ),
    )
    each: Data = Field(
        {}, description="keys that every measurement of the list and the table has unless it says otherwise"
    )
    studies: list[str] = Field(
        [], description="whole studies, or patterns such as cell*/config.yaml, each fitted as it is"
    )
    joint: bool | JointSettings = Field(
        False,
        description=(
            "take all fits together: mean and scatter of every parameter, and of a base study also one fit of"
            " all measurements with one set of parameters"
        ),
    )
    time_limit_s: float = Field(
        3600.0, gt=0, description="a fit that takes longer is ended and counted as failed"
    )

    @model_validator(mode="after")
    def _something(self) -> BatchSettings:
        if self.study is None and not self.studies:
            raise ValueError("give a base `study`, or `studies`")
        if self.study is None and (self.measurements or self.table or self.each):
            raise ValueError(
                "`measurements`, `table` and `each` need the base `study` that is fitted to them"
            )
        if self.each and not (self.measurements or self.table):
            raise ValueError("`each` is of `measurements` and `table`, which the batch does not have")
        return self

    @property
    def shared(self) -> list[str] | None:
        """Patterns of parameters that all fits share; None where fits are not taken together."""
        if isinstance(self.joint, JointSettings):
            return self.joint.shared
        return [] if self.joint else None


@dataclass(frozen=True)
class Item:
    """One fit: its name, a study, and the measurements that stand in place of the study's own, or None; paths
    relative to its folder.
    """

    name: str
    study: Path
    measurements: tuple[Data, ...] | None = None


@dataclass(frozen=True)
class Batch:
    """A batch that was read: its file and text, what it says, the fits by posture, and the joint one, if
    asked for.
    """

    path: Path
    text: str
    settings: BatchSettings
    items: tuple[Item, ...]
    joint: Item | None


def read_batch(path: Path) -> Batch:
    """The batch in a YAML file.

    What is wrong with the batch itself raises InputError or InputErrors; what is wrong with one measurement
    shows when it is fitted.
    """
    settings, text = read_settings(path, BatchSettings, SCHEMA)
    items: list[Item] = []
    joint = None
    if settings.study is not None:
        study = path.parent / settings.study
        own = [*_listed(path, settings, study), *_tabled(path, settings, study)]
        measured = [{**settings.each, **one} for one in own] if own else _of_study(study)
        for one in measured:
            items.append(Item(str(one.get("name") or _stem(one)), study, ({**one, "use": "fit"},)))
        joint = Item("joint", study, tuple(measured)) if settings.joint else None
    for found in _studies(path, settings):
        items.append(Item(Path(found).stem, path.parent / found))
    return Batch(path, text, settings, tuple(_distinct(items)), joint)


def _studies(path: Path, settings: BatchSettings) -> list[str]:
    """Whole studies; InputError for one that stands twice, which would count twice."""
    found = [one for pattern in settings.studies for one in _found(path.parent, pattern)]
    places = [os.path.abspath(path.parent / one) for one in found]
    for number, one in enumerate(found):
        if places[number] in places[:number]:
            raise InputError(f"{path}, key studies", f"{one} twice", "each study once", "take one out")
    return found


def _of_study(study: Path) -> list[Data]:
    data, _ = read_yaml(study)
    measured = data.get("measurements") if isinstance(data, dict) else None
    if not isinstance(measured, list) or not measured:
        raise InputError(
            str(study),
            "no measurements, and the batch has none",
            "`measurements` or `table` in the batch, or in the study",
        )
    return [
        dict(one) if isinstance(one, dict) else {"name": f"measurement {number}"}
        for number, one in enumerate(measured, 1)
    ]


def _listed(path: Path, settings: BatchSettings, study: Path) -> Iterator[Data]:
    for one in settings.measurements:
        file = one.get("file", "")
        if isinstance(file, str) and glob.has_magic(file):
            many = {key: value for key, value in one.items() if key != "name"}
            for found in _found(path.parent, file):
                yield _moved({**many, "file": found}, path.parent, study)
        else:
            yield _moved(one, path.parent, study)


def _tabled(path: Path, settings: BatchSettings, study: Path) -> Iterator[Data]:
    if settings.table is None:
        return
    table = path.parent / settings.table
    for _, row in read_table(table):
        data = {key: value for key, value in row.items() if not ANGLE.fullmatch(key)}
        angles = posture_of(row)
        yield _moved({**data, **({"posture_deg": angles} if angles else {})}, table.parent, study)


def _moved(one: Data, folder: Path, study: Path) -> Data:
    """The measurement with its paths relative to the folder of the study."""
    moved = deepcopy(one)
    relocate(MeasurementSettings, moved, folder, study.parent)
    return moved


def _found(folder: Path, pattern: str) -> list[str]:
    """The files of a pattern in order; the pattern itself where there is none, so that its fit says that
    there is no such file.
    """
    return sorted(glob.glob(pattern, root_dir=folder, recursive=True)) or [pattern]


def _stem(one: Data) -> str:
    file = one.get("file") or one.get("modes") or "measurement"
    return name_of([Path(str(path)) for path in (file if isinstance(file, list) else [file])])


def _distinct(items: list[Item]) -> Iterator[Item]:
    """The items with names that can be file names, each once."""
    taken = {"joint"}
    for item in items:
        name = plain = re.sub(r"[^\w.+-]", "_", item.name)
        number = 1
        while name.lower() in taken:
            number += 1
            name = f"{plain}_{number}"
        taken.add(name.lower())
        yield Item(name, item.study, item.measurements)
