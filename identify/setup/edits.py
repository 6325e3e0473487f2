"""Changes of a study: which key gets which value, and which points of the points file are on another link."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from identify.robot.points import Point

Key = tuple[str | int, ...]


@dataclass(frozen=True)
class Edit:
    """A key of the study and its new value; mappings on the way are made where they are missing."""

    key: Key
    value: Any

    def put(self, data: Any) -> None:
        """Change the data of a study in place."""
        *way, last = self.key
        for name in way:
            if isinstance(data, list):
                data = data[int(name)]
            else:
                if data.get(name) is None:
                    data[name] = {}
                data = data[name]
        data[last] = self.value


@dataclass(frozen=True)
class OnLink:
    """A point of the points file that is on another link: with the same coordinates there, or at the same
    place as `point` says.
    """

    node: int
    link: str
    point: Point | None = None


Change = Edit | OnLink


def edited(data: Any, edits: Sequence[Change]) -> Any:
    """The data of a study with some keys changed."""
    found = deepcopy(data)
    for edit in edits:
        if isinstance(edit, Edit):
            edit.put(found)
    return found


def in_words(edits: Sequence[Change]) -> str:
    """The lines of the study, or of the points file, that change, as they would be written."""
    links = {edit.node: edit.link for edit in edits if isinstance(edit, OnLink)}
    lines = list(dict.fromkeys(_line(edit) for edit in edits if isinstance(edit, Edit)))
    if links:
        some = [f"{node} on {link}" for node, link in list(links.items())[:3]]
        lines.append(f"points: {', '.join(some)}{', ...' if len(links) > 3 else ''}")
    most = 3
    more = f"; and {len(lines) - most} more" if len(lines) > most else ""
    return "; ".join(f"`{line}`" for line in lines[:most]) + more


def _line(edit: Edit) -> str:
    """A key with its value; the number of a measurement is said only where postures are told apart."""
    alike = edit.key[0] == "measurements" and edit.key[-1] not in ("posture_deg", "use")
    key = [str(part) for part in edit.key if not (alike and isinstance(part, int))]
    return f"{'.'.join(key)}: {_text(edit.value)}"


def _text(value: Any) -> str:
    if isinstance(value, Mapping):
        shown = [f"{_text(key)}: {_text(one)}" for key, one in list(value.items())[:4]]
        return "{" + ", ".join(shown) + (", ..." if len(value) > 4 else "") + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_text, value)) + "]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
