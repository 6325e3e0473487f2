"""The border for XML: elements with their lines, in any encoding the file declares, of limited size and
depth, without entities of its own.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from identify.core.errors import InputError
from identify.core.files import MEBIBYTE, read_bytes
from identify.core.text_input import has_control

_LARGEST, _DEPTH = 32 * MEBIBYTE, 60
_TAG = re.compile(r"<(?:[^>\"']|\"[^\"]*\"|'[^']*')*>")
_ENCODING = re.compile(r"^(<\?xml\b[^>]*?\bencoding\s*=\s*)(\"[^\"]*\"|'[^']*')")
Lines = dict[ElementTree.Element, int]


class _Refused(Exception):
    """Something that is XML, but not for a robot."""


@dataclass(frozen=True)
class _Parsed:
    """What a parser has met: of each element its line, and its first byte with that of its last tag."""

    root: ElementTree.Element
    lines: Lines
    ends: dict[ElementTree.Element, tuple[int, int]]
    encoding: str


@dataclass
class Markup:
    """An XML file whose text is changed at a few places only: its root element, and the changes so far, each
    from one place of the text to another.
    """

    root: ElementTree.Element
    _content: bytes
    _parsed: _Parsed
    _changes: list[tuple[int, int, str]] = field(default_factory=list)

    def replace(self, element: ElementTree.Element, new: str) -> None:
        """Put a text in place of an element."""
        self._changes.append((*self._span(element), new))

    def insert(self, element: ElementTree.Element, new: str) -> None:
        """Put a text at the beginning of what an element holds."""
        first, last = self._span(element)
        tag = self._tag(first)
        if tag.endswith("/>"):
            self._changes.append((first, last, f"{tag[:-2]}>{new}</{element.tag}>"))
        else:
            self._changes.append((first + len(tag), first + len(tag), new))

    def indentation(self, element: ElementTree.Element) -> str:
        """The blanks before the line that an element begins on."""
        line = self._text[: self._span(element)[0]].rpartition("\n")[2]
        return line[: len(line) - len(line.lstrip())]

    def changed(self) -> str:
        """The text with all changes, for a file in UTF-8."""
        text = self._text
        for first, last, new in sorted(self._changes, reverse=True):
            text = text[:first] + new + text[last:]
        return _ENCODING.sub(r'\1"UTF-8"', text.removeprefix("\ufeff")).replace("\r\n", "\n")

    @cached_property
    def _text(self) -> str:
        return self._content.decode(self._parsed.encoding)

    def _span(self, element: ElementTree.Element) -> tuple[int, int]:
        """From the first character of an element to that behind its last tag."""
        first, last = (
            len(self._content[:end].decode(self._parsed.encoding)) for end in self._parsed.ends[element]
        )
        tag = self._tag(first)
        return first, first + len(tag) if tag.endswith("/>") else last + len(self._tag(last))

    def _tag(self, first: int) -> str:
        found = _TAG.match(self._text, first)
        assert found is not None
        return found[0]


def read_xml(path: Path, expected: str, *, words: bool = False) -> tuple[ElementTree.Element, Lines]:
    """The root element of an XML file, and the line of each element; InputError, with the line, for what is
    no XML, declares entities or nests deeper than any robot; words: with the text between tags.
    """
    parsed = _parsed(path, read_xml_bytes(path, expected), expected, words)
    return parsed.root, parsed.lines


def read_xml_bytes(path: Path, expected: str) -> bytes:
    """The content of a file that should be XML, of limited size."""
    return read_bytes(path, expected, _LARGEST)


def parse_xml(path: Path, content: bytes, expected: str) -> tuple[ElementTree.Element, Lines]:
    """The same of what a file holds, or what was made of it."""
    parsed = _parsed(path, content, expected)
    return parsed.root, parsed.lines


def parse_markup(path: Path, content: bytes, expected: str) -> Markup:
    """XML whose text is to be changed; InputError as `read_xml`."""
    parsed = _parsed(path, content, expected)
    return Markup(parsed.root, content, parsed)


def _parsed(path: Path, content: bytes, expected: str, words: bool = False) -> _Parsed:
    builder, parser, lines = ElementTree.TreeBuilder(), expat.ParserCreate(), Lines()
    open_elements: list[tuple[ElementTree.Element, int]] = []
    ends: dict[ElementTree.Element, tuple[int, int]] = {}
    encoding = ["utf-16" if content[:2] in (BOM_UTF16_LE, BOM_UTF16_BE) else "utf-8"]

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) >= _DEPTH:
            raise _Refused(f"elements nested deeper than {_DEPTH} levels")
        fault = has_control("".join((tag, *attributes, *attributes.values())))
        if fault:
            raise _Refused(fault)
        element = builder.start(tag, attributes)
        open_elements.append((element, parser.CurrentByteIndex))
        lines[element] = parser.CurrentLineNumber

    def end(tag: str) -> None:
        element, first = open_elements.pop()
        ends[element] = first, parser.CurrentByteIndex
        builder.end(tag)

    def entity(*_: object) -> None:
        raise _Refused("an entity declaration")

    def declared(version: str, name: str | None, standalone: int) -> None:
        encoding[0] = name or encoding[0]

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.EntityDeclHandler, parser.XmlDeclHandler = entity, declared
    if words:
        parser.buffer_text, parser.CharacterDataHandler = True, builder.data
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        found = f"broken XML ({expat.errors.messages[error.code]})"
        raise InputError(f"{path.name} line {error.lineno}", found, expected) from error
    except (
        _Refused,
        ValueError,
        LookupError,
    ) as error:  # of the last two, encodings that Python does not know
        where = f"{path.name} line {parser.CurrentLineNumber}"
        raise InputError(where, f"XML that is not read ({error})", expected, "remove it") from error
    return _Parsed(builder.close(), lines, ends, encoding[0])
