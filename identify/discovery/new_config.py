"""The study that a discovery ends with: the config as it was written, comments and all, with the new effects
and the values found.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from identify.core.config_paths import relocate_measurement, relocated
from identify.core.yaml_input import round_trip
from identify.model.effects.base import Effect
from identify.vibration.study import StudyFile

_PATHS = (("robot", "urdf"), ("robot", "dh"), ("points",), ("reference",), ("modal_choices",))


def config_text(
    file: StudyFile, new: Sequence[tuple[Effect, str]], values: Mapping[str, float], folder: Path
) -> str:
    """The study with effects added, each with a remark, and start values for all parameters, as the text of a
    file in `folder`.
    """
    yaml = round_trip()
    yaml.width = 140
    data = yaml.load(file.text)
    if file.path.parent.resolve() != folder.resolve():
        _move(data, file.path.parent, folder)
    _rename(data, file.study.name)
    if "effects" not in data:
        data["effects"] = CommentedSeq(_in_one_line(effect) for effect in file.study.effects)
    for effect, remark in new:
        data["effects"].append(_in_one_line(effect))
        data["effects"].yaml_set_comment_before_after_key(len(data["effects"]) - 1, before=remark)
    data["initial"] = {name: float(f"{value:.6g}") for name, value in values.items()}
    text = io.StringIO()
    yaml.dump(data, text)
    return text.getvalue()


def entry_of(effect: Effect) -> dict[str, Any]:
    """An effect as an entry of `effects`: what differs from the defaults."""
    entry: dict[str, Any] = effect.model_dump(mode="json", exclude_defaults=True)
    return {"kind": effect.kind, **entry}


def _in_one_line(effect: Effect) -> CommentedMap:
    entry = CommentedMap(entry_of(effect))
    entry.fa.set_flow_style()
    return entry


def _rename(data: Any, name: str) -> None:
    """A name of its own, so that its fit does not replace that of the study before."""
    again = re.fullmatch(r"(.*_discovered)(\d*)", name)
    new = f"{again[1]}{int(again[2] or 1) + 1}" if again else f"{name}_discovered"
    if "name" in data:
        data["name"] = new
    else:
        data.insert(1, "name", new)


def _move(data: Any, old: Path, new: Path) -> None:
    """Paths relative to one folder become relative to another."""
    for *outer, key in _PATHS:
        part = data
        for name in outer:
            part = part.get(name, {})
        if key in part:
            part[key] = relocated(part[key], old, new)
    for measurement in data["measurements"]:
        relocate_measurement(measurement, old, new)
