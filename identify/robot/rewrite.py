"""A robot's description with other bodies, in the format it came in: everything else as it was.

What fixed joints hold to a link of a URDF is part of its body when it is read (`identify.robot.urdf`), so
that the body goes to that link as a whole, and the inertias of what is held to it go.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from identify.core.arrays import Array
from identify.core.config_paths import relocated
from identify.core.text_input import read_text
from identify.core.xml_input import Markup
from identify.core.yaml_input import round_trip, yaml_text
from identify.robot.description import Link, Robot
from identify.robot.pseudo_inertia import tidied
from identify.robot.settings import RobotSettings
from identify.robot.source import read_source
from identify.robot.urdf_elements import MOMENTS
from identify.robot.visual import mesh_place

_NOWHERE: Mapping[str, Array] = {}


def with_bodies(
    settings: RobotSettings,
    folder: Path,
    robot: Robot,
    bodies: Sequence[Link],
    shifts: Mapping[str, Array] = _NOWHERE,
    to: Path | None = None,
) -> str:
    """The text of a robot's file, in a folder, with these bodies in place of its links of the same names.

    Of a URDF, shifts: by how much joints sit elsewhere (3,), m, in the axes of the link that carries them, by
    name; to: the folder that the text is for, from which meshes must be found; default: the same.
    """
    named = {body.name: tidied(body) for body in bodies}
    if settings.urdf is None:
        return _dh(folder / (settings.dh or Path()), named)
    path = folder / settings.urdf
    markup = read_source(path, settings.arguments).markup()
    _put_bodies(markup, robot, named)
    _shift_joints(markup, robot, shifts)
    if to is not None and to.resolve() != path.parent.resolve():
        _relocate_meshes(markup, path.parent, to)
    return markup.changed()


def _put_bodies(markup: Markup, robot: Robot, bodies: Mapping[str, Link]) -> None:
    held = {name for name, (carrier, _) in robot.frames.items() if carrier in bodies}
    for element in markup.root.findall("link"):
        name, old = element.get("name", "").strip(), element.find("inertial")
        if name in bodies and old is not None:
            markup.replace(old, _inertial(bodies[name], markup.indentation(old)))
        elif name in bodies:
            above = markup.indentation(element)
            markup.insert(element, f"\n{above}  {_inertial(bodies[name], above + '  ')}\n{above}")
        elif name in held and old is not None:
            markup.replace(old, "")


def _inertial(body: Link, indentation: str) -> str:
    element = ElementTree.Element("inertial")
    ElementTree.SubElement(element, "origin", xyz=_words(body.centre), rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=f"{body.mass:.9g}")
    moments = {name: f"{body.inertia[place]:.9g}" for name, place in MOMENTS.items()}
    ElementTree.SubElement(element, "inertia", moments)
    ElementTree.indent(element)
    return ElementTree.tostring(element, encoding="unicode").replace("\n", f"\n{indentation}")


def _shift_joints(markup: Markup, robot: Robot, shifts: Mapping[str, Array]) -> None:
    for element in markup.root.findall("joint"):
        shift, parent = shifts.get(element.get("name", "").strip()), element.find("parent")
        if shift is None or parent is None:
            continue
        frame = robot.frames.get(parent.get("link", "").strip())
        own = shift if frame is None else frame[1][:3, :3].T @ shift
        origin = element.find("origin")
        if origin is None:
            markup.insert(element, f'<origin xyz="{_words(own)}"/>')
        else:
            before = np.array(origin.get("xyz", "0 0 0").split(), dtype=float)
            _put_attribute(markup, origin, "xyz", _words(before + own))


def _relocate_meshes(markup: Markup, old: Path, new: Path) -> None:
    """Let meshes that are found from one folder be found from another; those of a package that is not found
    stay.
    """
    for mesh in markup.root.iter("mesh"):
        name = mesh.get("filename", "")
        found = mesh_place(old, name)
        if name and (found.is_file() or not ("://" in name or Path(name).is_absolute())):
            _put_attribute(markup, mesh, "filename", relocated(_beside(found, old), old, new))


def _beside(path: Path, folder: Path) -> Path:
    """A path relative to a folder; on another drive as it is."""
    try:
        return Path(os.path.relpath(path, folder.resolve()))
    except ValueError:
        return path


def _put_attribute(markup: Markup, element: ElementTree.Element, name: str, value: str) -> None:
    new = ElementTree.Element(element.tag, {**element.attrib, name: value})
    new.extend(element)
    markup.replace(element, ElementTree.tostring(new, encoding="unicode"))


def _words(values: Array) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _dh(path: Path, bodies: Mapping[str, Link]) -> str:
    data = round_trip().load(read_text(path, "a Denavit-Hartenberg table in YAML"))
    for link in data["links"]:
        body = bodies.get(link["name"])
        if body is not None:
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia.tolist()
            link["mass_kg"], link["centre_m"] = _short(body.mass), list(map(_short, body.centre))
            link["inertia_kg_m2"] = list(map(_short, (xx, yy, zz, xy, xz, yz)))
    return yaml_text(data)


def _short(value: float) -> float:
    return float(f"{value:.9g}")
