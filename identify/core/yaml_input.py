"""The border for YAML: plain mappings, lists, texts and numbers, of limited size and depth.

What a study does not need is refused with its line: tags (`!!float`), directives, anchors that contain
themselves or are given twice, aliases that unfold to more than the file could hold, numbers of more digits
than any has, keys that are lists.  What looks like a date is text.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent, ScalarEvent
from ruamel.yaml.resolver import VersionedResolver
from ruamel.yaml.tag import Tag

from identify.core.errors import InputError
from identify.core.files import MEBIBYTE
from identify.core.text_input import LARGEST, has_control, read_text

YAML_SUFFIXES = (".yaml", ".yml")
"""How names of YAML files end."""
_DEPTH, _NODES, _DIGITS, _WIDTH = 20, 250_000, 60, 140
_TEXT, _DATE, _FLOAT = (f"tag:yaml.org,2002:{name}" for name in ("str", "timestamp", "float"))
_NUMBER = re.compile(r"[-+]?(0[xX][\da-fA-F_]+|0[oObB][\d_]+|[\d_.]+([eE][-+]?\d+)?)")
L = TypeVar("L")
_DAMAGED = (ValueError, LookupError, TypeError, AttributeError, AssertionError, RecursionError)
"""What the YAML reader raises on broken YAML beside its own errors."""


def read_yaml_file(path: Path, expected: str, largest: int = MEBIBYTE, fix: str = "check the path") -> Any:
    """What a YAML file holds, as `parse_yaml` gives it; InputError for what is no such file."""
    return parse_yaml(read_text(path, expected, largest, fix), str(path), expected)


def parse_yaml(text: str, where: str, expected: str = "a YAML file") -> Any:
    """The data of a YAML text, mappings and lists knowing their lines (`line_of`); InputError with the line
    where it is broken or holds what a config does not need.
    """
    directive = re.search(r"^%", text, re.MULTILINE)
    if directive is not None:
        line = text.count("\n", 0, directive.start()) + 1
        raise InputError(f"{where} line {line}", "a directive", expected, "remove it")
    try:
        return round_trip().load(text)
    except MarkedYAMLError as error:
        at = f"{where} line {error.problem_mark.line + 1}" if error.problem_mark else where
        if isinstance(error, _Refused):
            raise InputError(at, str(error.problem), expected, "remove it") from error
        _check_spaces(text, where, expected)
        found = f"broken YAML ({error.problem or error.context})"
        raise InputError(at, found, expected, "check indents and quotes") from error
    except (YAMLError, *_DAMAGED) as error:
        raise InputError(
            where, f"broken YAML ({_first_line(error)})", expected, "check indents and quotes"
        ) from error


def _check_spaces(text: str, where: str, expected: str) -> None:
    """Raise an InputError where a line of a broken text begins with what looks like a space and is none."""
    strange = re.search(r"^ *([^\S \n])", text, re.MULTILINE)
    if strange is not None:
        line, name = (
            text.count("\n", 0, strange.start(1)) + 1,
            f"no-break or other space U+{ord(strange[1]):04X}",
        )
        found = f"broken YAML (a {'tab' if strange[1] == chr(9) else name} in the indent)"
        raise InputError(f"{where} line {line}", found, expected, "write plain spaces")


def round_trip() -> YAML:
    """A reader and writer that keeps comments, with the limits of this border."""
    yaml = YAML(typ="rt")
    yaml.Composer, yaml.Resolver = _Composer, _Resolver
    return yaml


def yaml_text(data: Any) -> str:
    """The text of data that were read so, comments and all."""
    yaml, text = round_trip(), io.StringIO()
    yaml.width = _WIDTH
    yaml.dump(data, text)
    return text.getvalue()


def renamed(data: Any, name: str, what: str) -> None:
    """Give the data of a study called `name` the name of what it is now: arm_fitted, then arm_fitted2."""
    again = re.fullmatch(rf"(.*_{what})(\d*)", name)
    new = f"{again[1]}{int(again[2] or 1) + 1}" if again else f"{name}_{what}"
    if "name" in data:
        data["name"] = new
    else:
        data.insert(1, "name", new)


def in_one_line(data: Mapping[str, Any]) -> CommentedMap:
    """A mapping that is written in one line: {a: 1, b: 2}."""
    entry = CommentedMap(data)
    entry.fa.set_flow_style()
    return entry


def flat(data: Sequence[Any]) -> CommentedSeq:
    """A list that is written in one line: [1, 2]."""
    entry = CommentedSeq(data)
    entry.fa.set_flow_style()
    return entry


def plain(data: Any) -> Any:
    """The same data as dictionaries, lists and numbers of Python, which know no lines."""
    if isinstance(data, dict):
        return {plain(key): plain(value) for key, value in data.items()}
    if isinstance(data, list):
        return [plain(value) for value in data]
    for kind in (bool, int, float, str):
        if isinstance(data, kind):
            return kind(data)
    return data


def line_of(data: Any, keys: list[Any]) -> str:
    """` line N` of a key in the YAML, or of the nearest parent that has one."""
    line = ""
    for key in keys:
        try:
            marks = data.lc.data[key]
            line, data = f" line {marks[0] + 1}", data[key]
        except (AttributeError, KeyError, IndexError, TypeError):
            break
    return line


def leaves(data: Any, kind: type[L], above: tuple[Any, ...] = ()) -> Iterator[tuple[list[Any], L]]:
    """Every value of a kind, such as `str`, in a YAML file with the keys that lead to it."""
    if isinstance(data, kind):
        yield list(above), data
    inside = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in inside:
        yield from leaves(value, kind, (*above, key))


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


class _Refused(MarkedYAMLError):
    """Something that is YAML, but not for a config."""


class _Composer(Composer):
    """Composes nodes within the limits; sizes: how many nodes each anchor stands for."""

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader)
        self.sizes: dict[str, int] = {}
        self.opened: set[str] = set()
        self.nodes = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """The next node; MarkedYAMLError where it goes beyond a limit."""
        event = self.parser.peek_event()
        is_alias = isinstance(event, AliasEvent)
        fault = self._alias(event.anchor) if is_alias else self._fault(event)
        if (
            not fault
            and index is None
            and parent is not None
            and not isinstance(event, (ScalarEvent, AliasEvent))
        ):
            fault = "a key that is a list or a mapping"
        self.nodes += 1
        if self.nodes > _NODES:
            fault = f"more than {_NODES} values"
        if fault:
            raise _Refused(None, None, fault, event.start_mark)
        before = self.nodes
        if event.anchor and not is_alias:
            self.opened.add(event.anchor)
        node = super().compose_node(parent, index)
        if event.anchor and not is_alias:
            self.sizes[event.anchor] = self.nodes - before
        return node

    def _alias(self, name: str) -> str:
        """Count what an alias stands for; what is wrong with it."""
        if name in self.opened and name not in self.sizes:
            return f"the anchor {name!r} contains itself"
        self.nodes += self.sizes.get(name, 0)
        return ""

    def _fault(self, event: Any) -> str:
        """What is wrong with a scalar or with the beginning of a list or mapping."""
        if event.ctag is not None:
            return f"the tag `{event.tag}`, where only plain values are read"
        if event.anchor in self.opened:
            return f"the anchor {event.anchor!r} a second time"
        if self.depth >= _DEPTH:
            return f"nested deeper than {_DEPTH} levels"
        if not isinstance(event, ScalarEvent):
            return ""
        return (_number_fault(event.value) if event.implicit[0] else "") or has_control(
            event.value.replace("\n", " ")
        )


def _number_fault(text: str) -> str:
    """Why a plain value is a number that cannot be computed with, or nothing."""
    if len(text) > _DIGITS and _NUMBER.fullmatch(text):
        return f"a number of {len(text)} digits, where {_DIGITS} are read at most"
    try:
        beyond = abs(float(text)) > LARGEST
    except ValueError:
        return ""
    return f"the number {text}, beyond all that can be computed with" if beyond else ""


class _Resolver(VersionedResolver):
    """Takes what looks like a date for text, as no key of a config is a date, and so a point alone."""

    def resolve(self, kind: Any, value: Any, implicit: Any) -> Any:
        """The tag of a node that has none."""
        tag = super().resolve(kind, value, implicit)
        no_number = str(tag) == _FLOAT and not re.search(r"\d|inf|nan", value, re.IGNORECASE)
        return Tag(suffix=_TEXT) if no_number or str(tag) == _DATE else tag
