"""MuJoCo's MJCF: the robot standing at a posture, each free coordinate a joint with its spring and damper.

Bodies are those of the model at the posture, in their joint frames; joint angles are elastic displacements,
zero at the posture.  What the effects add to the bodies' mass, gravity stiffness and springs is put on single
coordinates where it is diagonal (armature, stiffness, damping of a joint), and else on fixed tendons, one for
each eigenvector of the rest: a tendon of length a'q with armature, stiffness or damping v adds v a a' to the
matrix.  Springs are preloaded (`springref`) so that gravity is balanced at the posture.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation

from identify.core import atomic
from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import listed
from identify.export.base import Exported, Format, Job
from identify.export.linear import LinearModel
from identify.export.springs import NOTHING, added_matrices, beside, joint_springs, moved_body
from identify.robot.posture import AXES, Body

_ROLES = ("armature", "stiffness", "damping")
_WEIGHTLESS = 1e-9
"""Mass, kg, and inertia of what has none but moves: the compiler asks for some."""
_USE = "use `--to mat` or `--to statespace`"


class Mjcf(Format):
    """One XML file."""

    suffix: ClassVar[str] = ".xml"

    def write(self, job: Job) -> Exported:
        """InputError for effects whose coordinates or matrices MuJoCo cannot have."""
        text = mjcf_text(job.model)
        atomic.write_text(job.path, text)
        said = "joint angles of the file are elastic displacements, 0 at the posture"
        return Exported([job.path], (*job.model.notes, said))


def mjcf_text(model: LinearModel) -> str:
    """The model as MJCF."""
    site = model.system.site
    mechanism = site.engine.mechanism
    root = ET.Element("mujoco", model=model.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    option = ET.SubElement(root, "option", gravity=_numbers(mechanism.gravity), timestep="0.0001")
    ET.SubElement(option, "flag", contact="disable")
    bodies = [ET.SubElement(root, "worldbody")]
    own = _owners(model)
    for number, body in enumerate(mechanism.bodies):
        bodies.append(_body(bodies[body.parent + 1], body))
        _joints(bodies[-1], [name for name, (at, _) in own.items() if at == number], own)
    for name, (at, _) in own.items():
        if at is None:
            _massless(bodies[_carrier(model, name) + 1], name)
    _sites(model, bodies)
    _springs(root, model)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _springs(root: ET.Element, model: LinearModel) -> None:
    """Springs, dampers and armatures of the joints, and tendons for what couples them."""
    rest = added_matrices(model)
    sag = _sag(model, rest["stiffness"])
    springs = joint_springs(model)
    none = np.zeros(len(sag))
    own_of = {"armature": none, "stiffness": springs.stiffness, "damping": springs.damping}
    joints = {one.get("name"): one for one in root.iter("joint")}
    tendons: list[tuple[str, float, Array]] = []
    for role in _ROLES:
        _check_positive(model, rest[role], role)
        single, coupled = beside(rest[role], own_of[role])
        for name, value in zip(model.coordinates, single, strict=True):
            if value > 0:
                joints[name].set(role, repr(float(value)))
        tendons += [(role, value, vector) for value, vector in coupled]
    for name, value in zip(model.coordinates, sag, strict=True):
        joints[name].set("springref", repr(float(value)))
    if tendons:
        _tendons(ET.SubElement(root, "tendon"), tendons, model.coordinates)


def _owners(model: LinearModel) -> dict[str, tuple[int | None, str]]:
    """Of each free coordinate the body that it moves and along which axis, or None where it is one of an
    effect that moves no body; InputError for one that MuJoCo cannot have.
    """
    found = {name: moved_body(model, name) for name in model.coordinates}
    for name, there in found.items():
        if there is None:
            said = f"{name}, which bends a link or moves several coordinates at once"
            raise InputError("--to", said, "coordinates that are joints of single bodies in mjcf", _USE)
    return {name: there for name, there in found.items() if there is not None}


def _body(parent: ET.Element, body: Body) -> ET.Element:
    node = ET.SubElement(
        parent, "body", name=body.name, pos=_numbers(body.pose[:3, 3]), quat=_quaternion(body.pose[:3, :3])
    )
    moments, turned = np.linalg.eigh(body.inertia)
    turned = turned * np.sign(np.linalg.det(turned))
    moments = np.maximum(moments, _WEIGHTLESS)
    moments[2] = min(moments[2], moments[0] + moments[1])  # rounding may take a plate past the inequality
    ET.SubElement(
        node,
        "inertial",
        pos=_numbers(body.centre),
        quat=_quaternion(turned),
        mass=repr(max(float(body.mass), _WEIGHTLESS)),
        diaginertia=_numbers(moments),
    )
    return node


def _joints(node: ET.Element, names: list[str], own: dict[str, tuple[int | None, str]]) -> None:
    """The joints of a body, translations first, in the order of the model; of two about one axis first that
    of an effect.
    """
    for name in sorted(names, key=lambda one: (AXES.index(own[one][1]), one == f"{node.get('name')}.rz")):
        axis = AXES.index(own[name][1])
        kind = "slide" if axis < 3 else "hinge"
        ET.SubElement(node, "joint", name=name, type=kind, axis=_numbers(np.eye(3)[axis % 3]))


def _carrier(model: LinearModel, name: str) -> int:
    """The body of the link that a coordinate without motion belongs to."""
    mechanism = model.system.site.engine.mechanism
    link = name.rpartition(".")[0]
    if link in mechanism.frames:
        return mechanism.frames[link][0]
    names = [body.name for body in mechanism.bodies]
    return names.index(link) if link in names else -1


def _massless(parent: ET.Element, name: str) -> None:
    """A coordinate of an effect as a joint of a body that weighs nothing: tendons give it its inertia."""
    node = ET.SubElement(parent, "body", name=f"{name}.body")
    ET.SubElement(node, "joint", name=name, type="slide", axis="0 0 1")
    small = _WEIGHTLESS * 1e-3
    ET.SubElement(node, "inertial", pos="0 0 0", mass=repr(small), diaginertia=_numbers(np.full(3, small)))


def _sites(model: LinearModel, bodies: list[ET.Element]) -> None:
    """The points, whose axes are those of their sensors."""
    for point in model.points:
        number, pose = model.system.site.engine.mechanism.frames[point.link]
        at, turn = pose[:3, :3] @ point.position + pose[:3, 3], pose[:3, :3] @ point.axes.T
        ET.SubElement(
            bodies[number + 1], "site", name=f"point{point.node}", pos=_numbers(at), quat=_quaternion(turn)
        )


def _sag(model: LinearModel, stiffness: Array) -> Array:
    """(n,): where the springs would be without weight."""
    site = model.system.site
    weight = site.shapes[:, model.system.free].T @ site.engine.gravity_forces()
    return np.asarray(np.linalg.lstsq(stiffness, weight, rcond=NOTHING * 1e-3)[0])


def _check_positive(model: LinearModel, matrix: Array, role: str) -> None:
    """InputError where a matrix has what no spring, damper or body has: a servo's inertia, for one."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    if values[0] < -NOTHING * max(float(np.abs(values).max()), 1e-300) or not np.allclose(matrix, matrix.T):
        most = np.argsort(-np.abs(vectors[:, 0]))[:2]
        where = listed([model.coordinates[i] for i in most if abs(vectors[i, 0]) > 0.1])
        kinds = sorted({effect.kind for effect in model.model.effects} & {"servo"})
        why = f" ({listed(kinds)})" if kinds else ""
        found = f"a negative {role} at {where}{why}, which MuJoCo does not have"
        raise InputError("--to", found, "effects of springs, dampers and masses in mjcf", _USE)


def _tendons(parent: ET.Element, tendons: list[tuple[str, float, Array]], names: Iterable[str]) -> None:
    """A fixed tendon for each; the length at rest of its spring follows from the joints' `springref`."""
    for number, (role, value, vector) in enumerate(tendons, start=1):
        node = ET.SubElement(parent, "fixed", {"name": f"{role}{number}", role: repr(value)})
        for name, coefficient in zip(names, vector, strict=True):
            if coefficient:
                ET.SubElement(node, "joint", joint=name, coef=repr(float(coefficient)))


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)


def _quaternion(rotation: Array) -> str:
    return _numbers(Rotation.from_matrix(rotation).as_quat(scalar_first=True))
