"""The corrected study, written beside the one that it corrects (`identify check --apply`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from identify.core.atomic import write_text
from identify.core.errors import InputError
from identify.core.yaml_input import flat, in_one_line, round_trip, yaml_text
from identify.robot.points import new_points_text, points_text, read_points
from identify.robot.read import read_robot
from identify.setup.edits import Change, Edit, OnLink
from identify.vibration.study import StudyFile
from identify.vibration.study_points import points_of

_WHAT = "corrected"


def write_corrected(file: StudyFile, edits: Sequence[Change], notes: Sequence[str]) -> list[Path]:
    """The new study, NAME_corrected.yaml, and the points file where points are on other links; notes: what a
    remark at its beginning says.  InputError for a file that exists, which is kept.
    """
    study = _beside(file.path)
    data = round_trip().load(file.text)
    for edit in edits:
        if isinstance(edit, Edit):
            replace(edit, value=_one_line(edit.value)).put(data)
    data["name"] = f"{file.study.name}_{_WHAT}"
    texts = {study: ""}
    links = {edit.node: edit for edit in edits if isinstance(edit, OnLink)}
    if links:
        named = file.study.points or Path("points.csv")  # those of a geometry get a file
        points = _beside(file.resolve(named))
        texts[points] = _points(file, links)
        data["points"] = (named.parent / points.name).as_posix()
        data.pop("registration", None)
    data.yaml_set_start_comment("\n".join(("Corrected by `identify check --apply`:", *notes)))
    texts[study] = yaml_text(data)
    for path in texts:
        if path.exists():
            raise InputError(str(path), "the file exists", "a new file", "move or remove it")
    for path, text in texts.items():
        write_text(path, text)
    return list(texts)


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.stem}_{_WHAT}{path.suffix}")


def _one_line(value: Any) -> Any:
    """A value as it stands in one line of a study."""
    if isinstance(value, dict):
        return in_one_line(value)
    return flat(value) if isinstance(value, list) and not isinstance(value[0], dict) else value


def _points(file: StudyFile, edits: Mapping[int, OnLink]) -> str:
    """The text of a points file with some points on other links, in whichever frame it has them."""
    path = file.study.points
    if path is None:
        told = points_of(file, read_robot(file.study.robot, file.path.parent))
    else:
        told = read_points(file.resolve(path))
    found = {node: replace(told[node], link=edit.link) for node, edit in edits.items()}
    if file.study.points_frame == "link":
        found |= {node: edit.point for node, edit in edits.items() if edit.point is not None}
    return new_points_text({**told, **found}) if path is None else points_text(file.resolve(path), found)
