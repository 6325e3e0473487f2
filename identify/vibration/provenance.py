"""Where the result of a study of vibration comes from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from identify.core.files import read_bytes
from identify.measured.loaders import frf_files
from identify.measured.several import is_pattern
from identify.results import fit as results
from identify.results import tables
from identify.results.provenance import provenance, sha256
from identify.results.setting_table import config_settings, given_of
from identify.results.tables import SettingTable
from identify.robot.points import Point, new_points_text
from identify.robot.source import read_source
from identify.vibration.study import StudyFile


def provenance_of(file: StudyFile) -> tables.Provenance:
    """Provenance of a run of a study.  Raises OSError where one of its files cannot be read."""
    return provenance(file.path.name, file.text, study_inputs(file), study_settings(file))


def study_inputs(file: StudyFile) -> list[tuple[str, str]]:
    """Every file that a study names, each with its sha256: what it is computed from, and compared with."""
    study = file.study
    paths = [study.robot.urdf or study.robot.dh or Path(), study.points, study.reference, study.modal_choices]
    paths.append(None if study.like is None else study.like.result)
    if study.registration is not None:
        paths += [study.registration.geometry, study.registration.pairs]
    for m in study.measurements:
        for path in (*m.sources, *m.repeats):
            there = file.resolve(path)
            folder = path if there.is_dir() else path.parent
            several = there.is_dir() or is_pattern(path)
            paths += [folder / one.name for one in frf_files(there)] if several else [path]
        paths.append(m.shapes)
    return [(str(path), sha256(file.resolve(path))) for path in paths if path is not None]


def description_of(file: StudyFile, points: Mapping[int, Point]) -> results.Description:
    """The texts of the robot's, as URDF where it was made of another, and the points' files; points: those of
    a study that has no file of them.
    """
    settings, path = file.study.robot, file.study.points
    text = "" if path is None else _text(file.resolve(path))
    if path is None and points:
        text = new_points_text(points)
    if settings.urdf is None:
        path = settings.dh or Path()
        return results.Description(path.name, _text(file.resolve(path)), text)
    source = read_source(file.resolve(settings.urdf), settings.arguments)
    return results.Description(settings.urdf.name, source.text(), text)


def _text(path: Path) -> str:
    return read_bytes(path, "an input file").decode(
        "utf-8-sig", errors="replace"
    )  # a name in another encoding must not cost a finished fit


def study_settings(file: StudyFile) -> SettingTable:
    """Every setting of a study; where it names no optimizer, the stages that run instead."""
    if "optimizer" in file.study.model_fields_set:
        return config_settings(file)
    stages = [{"kind": stage.optimizer.kind, **given_of(stage)} for stage in file.study.stages]
    return config_settings(file, {"optimizer": stages})
