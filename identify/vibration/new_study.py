"""A new study out of an old one: its config as it was written, comments and all, for another folder and under
a name of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from identify.core.config_paths import relocate
from identify.core.yaml_input import renamed, round_trip
from identify.vibration.study import Study, StudyFile


def new_study(file: StudyFile, folder: Path, what: str, values: Mapping[str, float]) -> Any:
    """The data of a study that begins at these values, for a file in `folder`; what: what it is now, which
    its name says, so that its fit does not replace that of the study before.
    """
    data = round_trip().load(file.text)
    if file.path.parent.resolve() != folder.resolve():
        relocate(Study, data, file.path.parent, folder)
    renamed(data, file.study.name, what)
    data["initial"] = {name: float(f"{value:.6g}") for name, value in values.items()}
    return data
