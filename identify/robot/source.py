"""The URDF that a description is or stands for: URDF as it is, xacro expanded, MJCF converted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from identify.core.binary_input import made
from identify.core.errors import InputError
from identify.core.xml_input import Markup, parse_markup, parse_xml, read_xml_bytes
from identify.robot.urdf_elements import UrdfDocument

_CLONE = "clone it beside the package of this file, or name the folder above it in ROS_PACKAGE_PATH"
EXPECTED = "a URDF, xacro or MJCF file"
NO_ARGUMENTS: Mapping[str, str] = {}
_XACRO = ("identify.robot.expand_xacro:expanded", "expanded")
_MJCF = ("identify.robot.convert_mjcf:converted", "as URDF")


@dataclass(frozen=True)
class Source:
    """A description: the file, its URDF, and, where that was made of it, how and what it could not say."""

    path: Path
    content: bytes
    made: str = ""
    notes: tuple[str, ...] = ()

    def document(self) -> UrdfDocument:
        """Its elements with their lines."""
        root, lines = parse_xml(self.path, self.content, EXPECTED)
        document = UrdfDocument(self.path, root, lines, self.made, self.notes)
        if root.tag != "robot":
            raise InputError(document.where(root), f"the root element is <{root.tag}>", "<robot>")
        return document

    def markup(self) -> Markup:
        """Its text, to be changed."""
        return parse_markup(self.path, self.content, EXPECTED)

    def text(self) -> str:
        """The text of the URDF, which a file in UTF-8 would have."""
        return self.markup().changed()


def read_source(path: Path, arguments: Mapping[str, str] = NO_ARGUMENTS) -> Source:
    """The URDF of a file; arguments: of a xacro.

    InputError, in the words of what expands or converts it, for what cannot be.
    """
    content = read_xml_bytes(path, EXPECTED)
    root, _ = parse_xml(path, content, EXPECTED)
    if root.tag == "sdf":
        fix = "convert it to URDF, or take the xacro that it was made of"
        raise InputError(path.name, "this is an SDF file", EXPECTED, fix)
    if root.tag == "mujoco" and not arguments:
        return _made(path, _MJCF, {})
    values, calls = _macros(root)
    if root.tag == "robot" and (values or calls):
        try:
            return _made(path, _XACRO, arguments, _asked(root))
        except InputError:
            if values or arguments:
                raise
            note = f"macros that are not defined in it were left out ({', '.join(calls)})"
            return Source(path, content, notes=(note,))
    if arguments:
        found = f"arguments ({', '.join(arguments)}) of a file without macros"
        raise InputError(path.name, found, "arguments of a xacro file")
    return Source(path, content)


def _made(path: Path, how: tuple[str, str], arguments: Mapping[str, str], fix: str = "") -> Source:
    maker, word = how
    try:
        tree = made(path, maker, arguments, EXPECTED, fix)
    except InputError as error:
        package = "needs the package" in error.found
        raise InputError(path.name, error.found, EXPECTED, _CLONE if package else fix) from error
    text, notes = tree.members["urdf"], tree.members.get("notes", ())
    assert isinstance(text, str) and isinstance(notes, tuple)
    return Source(path, text.encode(), f" ({word})", notes)


def _asked(root: ElementTree.Element) -> str:
    """Which arguments a xacro takes."""
    names = [element.get("name", "") for element in root.iter("xacro:arg")]
    return f"give it arguments: it takes {', '.join(dict.fromkeys(names))}" if names else ""


def _macros(root: ElementTree.Element) -> tuple[bool, list[str]]:
    """Whether values are still to be evaluated, and which elements are macros."""
    values = any("${" in value or "$(" in value for one in root.iter() for value in one.attrib.values())
    return values, list(dict.fromkeys(one.tag for one in root.iter() if one.tag.startswith("xacro:")))
