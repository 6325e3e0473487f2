"""The study of a planned test, to be filled in."""

from __future__ import annotations

import io
from pathlib import Path

from ruamel.yaml.comments import CommentedMap

from identify.core.arrays import Array
from identify.core.config_paths import relocated
from identify.core.yaml_input import round_trip
from identify.planning.known import Known


def planned_name(number: int) -> str:
    """Of the measurement with a number, from 1."""
    return f"planned{number}"


def study_text(known: Known, posture_deg: Array, folder: Path) -> str:
    """The study with the measurements of the plan in place of its own, as the text of a file in a folder."""
    yaml = round_trip()
    yaml.width = 140
    data = yaml.load(known.config)
    data["name"] = f"{known.name}_plan"
    if known.config_folder is not None:
        own = [(data, "points"), (data, "modal_choices")]
        for owner, key in ((data["robot"], "urdf"), (data["robot"], "dh"), *own):
            if key in owner:
                owner[key] = relocated(owner[key], known.config_folder, folder)
    data["measurements"] = [_planned(number, posture) for number, posture in enumerate(posture_deg, 1)]
    text = io.StringIO()
    yaml.dump(data, text)
    return text.getvalue()


def _planned(number: int, posture_deg: Array) -> CommentedMap:
    """A measurement that is to be done, in one line."""
    entry = CommentedMap({"file": f"{planned_name(number)}.uff", "posture_deg": posture_deg.tolist()})
    entry.fa.set_flow_style()
    return entry
