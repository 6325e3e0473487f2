"""A robot's description with other bodies, in the format it came in: everything else as it was.

What fixed joints hold to a link of a URDF is part of its body when it is read (`identify.robot.urdf`), so
that the body goes to that link as a whole, and the inertias of what is held to it go.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

from identify.core.text_input import read_text
from identify.core.yaml_input import round_trip
from identify.robot.description import Link, Robot
from identify.robot.pseudo_inertia import tidied
from identify.robot.settings import RobotSettings
from identify.robot.urdf_elements import parse

_MOMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def with_bodies(settings: RobotSettings, folder: Path, robot: Robot, bodies: Sequence[Link]) -> str:
    """The text of a robot's file, in a folder, with these bodies in place of its links of the same names."""
    named = {body.name: tidied(body) for body in bodies}
    if settings.urdf is not None:
        return _urdf(folder / settings.urdf, robot, named)
    return _dh(folder / (settings.dh or Path()), named)


def _urdf(path: Path, robot: Robot, bodies: Mapping[str, Link]) -> str:
    root = parse(path).root
    held = {name for name, (carrier, _) in robot.frames.items() if carrier in bodies}
    for element in root.findall("link"):
        name = element.get("name", "").strip()
        old = element.find("inertial")
        if name not in bodies and name not in held:
            continue
        if old is not None:
            element.remove(old)
        if name in bodies:
            element.insert(0, _inertial(bodies[name]))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _inertial(body: Link) -> ElementTree.Element:
    element = ElementTree.Element("inertial")
    centre = " ".join(f"{value:.9g}" for value in body.centre)
    ElementTree.SubElement(element, "origin", xyz=centre, rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=f"{body.mass:.9g}")
    moments = {name: f"{body.inertia[place]:.9g}" for name, place in _MOMENTS.items()}
    ElementTree.SubElement(element, "inertia", moments)
    return element


def _dh(path: Path, bodies: Mapping[str, Link]) -> str:
    yaml, text = round_trip(), io.StringIO()
    yaml.width = 140
    data = yaml.load(read_text(path, "a Denavit-Hartenberg table in YAML"))
    for link in data["links"]:
        body = bodies.get(link["name"])
        if body is not None:
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia.tolist()
            link["mass_kg"], link["centre_m"] = _short(body.mass), list(map(_short, body.centre))
            link["inertia_kg_m2"] = list(map(_short, (xx, yy, zz, xy, xz, yz)))
    yaml.dump(data, text)
    return text.getvalue()


def _short(value: float) -> float:
    return float(f"{value:.9g}")
