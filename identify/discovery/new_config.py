"""The study that a discovery ends with: the config as it was written, comments and all, with the new effects
and the values found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml.comments import CommentedSeq

from identify.core.yaml_input import in_one_line, yaml_text
from identify.model.effects.base import Effect
from identify.vibration.costs.base import parse_cost
from identify.vibration.new_study import new_study
from identify.vibration.study import StudyFile

_TAKEN_UP = "added by identify discover, because records may begin before the impacts"
_FORM = "a real link is not exactly a beam: its form was fitted"


def config_text(
    file: StudyFile, new: Sequence[tuple[Effect, str]], values: Mapping[str, float], folder: Path
) -> str:
    """The study with effects added, each with a remark, and start values for all parameters, as the text of a
    file in `folder`; with what the search took up besides, too.
    """
    data = new_study(file, folder, "discovered", values)
    if "cost" in data and parse_cost(data["cost"]) != file.study.cost:
        data["cost"] = file.study.cost.kind
        for key in ("optimizer", "target_cost"):  # which were chosen for another cost
            data.pop(key, None)
    if "effects" not in data:
        effects = CommentedSeq(in_one_line(entry_of(effect)) for effect in file.study.effects)
        data.insert(list(data).index("initial"), "effects", effects)
    known = len(data["effects"])
    if "uncertainty" not in data and file.study.uncertainty is not None:
        data["uncertainty"] = file.study.uncertainty.model_dump(exclude_defaults=True)
        data.yaml_set_comment_before_after_key("uncertainty", before=_FORM)
    for effect, remark in [*((one, _TAKEN_UP) for one in file.study.effects[known:]), *new]:
        data["effects"].append(in_one_line(entry_of(effect)))
        data["effects"].yaml_set_comment_before_after_key(len(data["effects"]) - 1, before=remark)
    return yaml_text(data)


def entry_of(effect: Effect) -> dict[str, Any]:
    """An effect as an entry of `effects`: what differs from the defaults."""
    entry: dict[str, Any] = effect.model_dump(mode="json", exclude_defaults=True)
    return {"kind": effect.kind, **entry}
