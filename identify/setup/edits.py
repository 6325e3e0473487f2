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
        _at(data, way)[last] = self.value


@dataclass(frozen=True)
class Entries(Edit):
    """Entries of a mapping of the study, beside those that are there; a factor of what has one is that much
    more.
    """

    def put(self, data: Any) -> None:
        """Change the data of a study in place."""
        *way, last = self.key
        parent = _at(data, way)
        there = parent.get(last)
        if not there:
            parent[last] = deepcopy(self.value)
            return
        known = {str(name): name for name in there}
        for name, value in self.value.items():
            own = known.get(str(name), name)
            before = there.get(own, 1.0)
            both = isinstance(value, float) and not isinstance(before, str)
            there[own] = before * value if both else value


def _at(data: Any, way: Sequence[str | int]) -> Any:
    """What stands there, made where it is missing."""
    for name in way:
        if isinstance(data, list):
            data = data[int(name)]
        else:
            if data.get(name) is None:
                data[name] = {}
            data = data[name]
    return data


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
    lines = list(dict.fromkeys(map(_line, _by_key(edits))))
    if links:
        some = [f"{node} on {link}" for node, link in list(links.items())[:3]]
        lines.append(f"points: {', '.join(some)}{', ...' if len(links) > 3 else ''}")
    most = 3
    more = f"; and {len(lines) - most} more" if len(lines) > most else ""
    return "; ".join(f"`{line}`" for line in lines[:most]) + more


def _by_key(edits: Sequence[Change]) -> list[Edit]:
    """Edits of keys, each key once: entries of one mapping together."""
    found: dict[Key, Edit] = {}
    for edit in edits:
        if isinstance(edit, Entries) and edit.key in found:
            found[edit.key] = Entries(edit.key, {**found[edit.key].value, **edit.value})
        elif isinstance(edit, Edit):
            found[edit.key] = edit
    return list(found.values())


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
