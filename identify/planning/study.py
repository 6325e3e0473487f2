"""The study of a planned test, to be filled in."""

from __future__ import annotations

from pathlib import Path

from ruamel.yaml.comments import CommentedMap

from identify.core.arrays import Array
from identify.core.config_paths import relocated
from identify.core.yaml_input import in_one_line, round_trip, yaml_text
from identify.planning.known import Known


def planned_name(number: int) -> str:
    """Of the measurement with a number, from 1."""
    return f"planned{number}"


def study_text(known: Known, posture_deg: Array, folder: Path) -> str:
    """The study with the measurements of the plan in place of its own, as the text of a file in a folder."""
    data = round_trip().load(known.config)
    data["name"] = f"{known.name}_plan"
    if known.config_folder is not None:
        laid = data.get("registration", {})
        own = [(data, "points"), (data, "modal_choices"), (data.get("like", {}), "result")]
        own += [(laid, "geometry"), (laid, "pairs")]
        for owner, key in ((data["robot"], "urdf"), (data["robot"], "dh"), *own):
            if key in owner:
                owner[key] = relocated(owner[key], known.config_folder, folder)
    data["measurements"] = [_planned(number, posture) for number, posture in enumerate(posture_deg, 1)]
    return yaml_text(data)


def _planned(number: int, posture_deg: Array) -> CommentedMap:
    """A measurement that is to be done, in one line."""
    return in_one_line({"file": f"{planned_name(number)}.uff", "posture_deg": posture_deg.tolist()})
