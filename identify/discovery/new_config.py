"""The study that a discovery ends with: the config as it was written, comments and all, with the new effects and the values found."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from identify.effects.base import Effect
from identify.study import StudyFile
from identify.whole import write_whole

_PATHS = (("robot", "urdf"), ("robot", "dh"), ("points",), ("reference",))
_MEASURED = ("file", "modes", "shapes")


def write_config(file: StudyFile, new: Sequence[tuple[Effect, str]], values: Mapping[str, float], path: Path) -> None:
    """Write the study with effects added, each with a remark, and start values for all parameters; paths go on meaning the same files."""
    write_whole(
        path, partial(Path.write_text, data=config_text(file, new, values, path.parent), encoding="utf-8"), "choose another with `--out`"
    )


def config_text(file: StudyFile, new: Sequence[tuple[Effect, str]], values: Mapping[str, float], folder: Path) -> str:
    """The text of that config, for a file in `folder`."""
    yaml = YAML(typ="rt")
    yaml.width = 140
    data = yaml.load(file.text)
    if file.path.parent.resolve() != folder.resolve():
        _move(data, file.path.parent, folder)
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


def _move(data: Any, old: Path, new: Path) -> None:
    """Paths relative to one folder become relative to another."""
    for keys in _PATHS:
        _moved(data, keys, old, new)
    for measurement in data["measurements"]:
        for key in _MEASURED:
            _moved(measurement, (key,), old, new)
        if "repeats" in measurement:
            measurement["repeats"] = [_relative(one, old, new) for one in measurement["repeats"]]


def _moved(data: Any, keys: Sequence[str], old: Path, new: Path) -> None:
    for key in keys[:-1]:
        data = data.get(key, {})
    if keys[-1] in data:
        data[keys[-1]] = _relative(data[keys[-1]], old, new)


def _relative(path: str, old: Path, new: Path) -> str:
    return path if Path(path).is_absolute() else Path(os.path.relpath(old / path, new)).as_posix()
