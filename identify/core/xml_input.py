"""The border for XML: elements with their lines, in any encoding the file declares, of limited size and
depth, without entities of its own.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from identify.core.errors import InputError
from identify.core.files import MEBIBYTE, read_bytes
from identify.core.text_input import has_control

_LARGEST, _DEPTH = 32 * MEBIBYTE, 60
Lines = dict[ElementTree.Element, int]


class _Refused(Exception):
    """Something that is XML, but not for a robot."""


def read_xml(path: Path, expected: str) -> tuple[ElementTree.Element, Lines]:
    """The root element of an XML file, and the line of each element; InputError, with the line, for what is
    no XML, declares entities or nests deeper than any robot.
    """
    content = read_bytes(path, expected, _LARGEST)
    builder, parser, lines = ElementTree.TreeBuilder(), expat.ParserCreate(), Lines()
    open_elements: list[str] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        open_elements.append(tag)
        if len(open_elements) > _DEPTH:
            raise _Refused(f"elements nested deeper than {_DEPTH} levels")
        fault = has_control("".join((tag, *attributes, *attributes.values())))
        if fault:
            raise _Refused(fault)
        lines[builder.start(tag, attributes)] = parser.CurrentLineNumber

    def end(tag: str) -> None:
        open_elements.pop()
        builder.end(tag)

    def entity(*_: object) -> None:
        raise _Refused("an entity declaration")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.EntityDeclHandler = entity
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
    return builder.close(), lines
