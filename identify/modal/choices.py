"""A file of choices of a modal analysis: keys of `ModalSettings` apart from a study or a command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from identify.core.config import read_yaml, validated
from identify.modal.settings import ModalSettings


def chosen_settings(path: Path | None) -> dict[str, Any]:
    """The settings of the analysis that a YAML file gives; InputErrors for what is none, with its line."""
    if path is None:
        return {}
    data, _ = read_yaml(path)
    return validated(path, data, ModalSettings).model_dump(exclude_unset=True)


def with_choices(given: ModalSettings, path: Path) -> ModalSettings:
    """Settings over those of a file of choices; InputErrors where the two do not go together."""
    both = {**chosen_settings(path), **given.model_dump(exclude_unset=True)}
    return validated(path, both, ModalSettings)
