"""A MuJoCo model (MJCF) as a URDF: bodies, joints, inertias and meshes; no actuators, tendons or contacts.

MuJoCo compiles the model, inertias of bodies without any from their geoms as it does, so this runs in the
child process of `identify.core.binary_input`.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import mujoco
import numpy as np

from identify.core.arrays import Array
from identify.core.hdf5_tree import Refused
from identify.core.tree import Group
from identify.robot.pose import inverse, roll_pitch_yaw
from identify.robot.urdf_elements import MOMENTS

_KINDS = {
    int(mujoco.mjtJoint.mjJNT_HINGE): "revolute",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "prismatic",
    int(mujoco.mjtJoint.mjJNT_BALL): "floating",
    int(mujoco.mjtJoint.mjJNT_FREE): "floating",
}
_PLAIN = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
}


def converted(path: Path, arguments: dict[str, str]) -> Group:
    """The members `urdf`, its text, and `notes`; Refused, with the words of MuJoCo."""
    del arguments
    notes: list[str] = []
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, mujoco.FatalError) as error:
        raise Refused("", f"MuJoCo says: {_words(error)}") from error
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        model = _without_meshes(spec)
        if model is None:
            raise Refused("", f"MuJoCo says: {_words(error)}") from error
        notes.append(f"read without its meshes ({_words(error)})")
    root = _Writer(path, spec, model).robot()
    return Group({"urdf": ET.tostring(root, encoding="unicode"), "notes": (*notes, *_closed(model))})


def _words(error: Exception) -> str:
    return " ".join(str(error).split())[:300]


def _without_meshes(spec: Any) -> Any | None:
    """The model with the bodies that are written in numbers only, where that is enough."""
    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            spec.delete(geom)
    for kind in (spec.meshes, spec.skins, spec.materials, spec.textures):
        for one in list(kind):
            spec.delete(one)
    for geom in spec.geoms:
        geom.material = ""
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError):
        return None


def _closed(model: Any) -> tuple[str, ...]:
    """Loops that constraints close, which a tree of joints cannot say."""
    loops = (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD))
    names = [
        model.equality(i).name or f"number {i + 1}" for i in range(model.neq) if model.eq_type[i] in loops
    ]
    if not names:
        return ()
    return (f"constraints that close loops were cut ({', '.join(names)})",)


class _Writer:
    """Elements of a URDF for a compiled model and its specification."""

    def __init__(self, path: Path, spec: Any, model: Any) -> None:
        self.folder, self.spec, self.model = path.parent, spec, model
        self.shift = {0: np.zeros(3)}
        self.masters = dict(self._mimics())

    def robot(self) -> ET.Element:
        root = ET.Element("robot", name=self.spec.modelname or "robot")
        for body in range(self.model.nbody):
            first, count = int(self.model.body_jntadr[body]), int(self.model.body_jntnum[body])
            joints = list(range(first, first + count))
            self.shift[body] = self.model.jnt_pos[joints[-1]] if joints else np.zeros(3)
            if body:
                self._joints(root, body, joints)
            self._link(root, body)
        return root

    def _name(self, body: int) -> str:
        return self.model.body(body).name or f"body{body}"

    def _joints(self, root: ET.Element, body: int, joints: list[int]) -> None:
        """From the parent to a body, with links without mass between several joints of one body."""
        model = self.model
        parent = int(model.body_parentid[body])
        link, at = self._name(parent), -self.shift[parent]
        pose = _pose(model.body_pos[body] + at, model.body_quat[body])
        if not joints:
            _joint(root, f"{self._name(body)}_fixed", "fixed", link, self._name(body), pose)
        before = np.zeros(3)
        for joint in joints:
            last = joint == joints[-1]
            child = self._name(body) if last else f"{self._name(body)}_{joint - joints[0] + 1}"
            if not last:
                ET.SubElement(root, "link", name=child)
            pose = pose @ _pose(model.jnt_pos[joint] - before)
            kind = _KINDS[int(model.jnt_type[joint])]
            if kind == "revolute" and not model.jnt_limited[joint]:
                kind = "continuous"
            name = model.joint(joint).name or f"joint{joint + 1}"
            element = _joint(root, name, kind, link, child, pose)
            ET.SubElement(element, "axis", xyz=_text(model.jnt_axis[joint]))
            if model.jnt_limited[joint]:
                lower, upper = model.jnt_range[joint]
                limits = {"lower": repr(float(lower)), "upper": repr(float(upper))}
                ET.SubElement(element, "limit", limits, effort="0", velocity="0")
            if joint in self.masters:
                ET.SubElement(element, "mimic", self.masters[joint])
            link, pose, before = child, np.eye(4), model.jnt_pos[joint]

    def _mimics(self) -> Iterator[tuple[int, dict[str, str]]]:
        model = self.model
        for i in range(model.neq):
            if model.eq_type[i] == int(mujoco.mjtEq.mjEQ_JOINT) and model.eq_obj2id[i] >= 0:
                offset, times = model.eq_data[i, :2]
                master = model.joint(int(model.eq_obj2id[i])).name or f"joint{model.eq_obj2id[i] + 1}"
                said = {"joint": master, "multiplier": repr(float(times)), "offset": repr(float(offset))}
                yield int(model.eq_obj1id[i]), said

    def _link(self, root: ET.Element, body: int) -> None:
        model, link = self.model, ET.SubElement(root, "link", name=self._name(body))
        if model.body_mass[body] > 0:
            inertial = ET.SubElement(link, "inertial")
            pose = _pose(model.body_ipos[body] - self.shift[body])
            _origin(inertial, pose)
            turn = _pose(np.zeros(3), model.body_iquat[body])[:3, :3]
            tensor = turn @ np.diag(model.body_inertia[body]) @ turn.T
            ET.SubElement(inertial, "mass", value=repr(float(model.body_mass[body])))
            ET.SubElement(inertial, "inertia", {k: repr(float(tensor[at])) for k, at in MOMENTS.items()})
        for geom in range(int(model.body_geomadr[body]), self._last(body)):
            self._geom(link, body, geom)

    def _last(self, body: int) -> int:
        return int(self.model.body_geomadr[body] + self.model.body_geomnum[body])

    def _geom(self, link: ET.Element, body: int, geom: int) -> None:
        """What a geom looks like; one that collides only is taken for the shape of a link without others."""
        model, kind = self.model, int(self.model.geom_type[geom])
        mesh = kind == int(mujoco.mjtGeom.mjGEOM_MESH)
        if not (mesh or kind in _PLAIN) or (mesh and not self._file(geom)):
            return
        seen = not (model.geom_contype[geom] or model.geom_conaffinity[geom])
        element = ET.SubElement(link, "visual" if seen else "collision")
        pose = _pose(model.geom_pos[geom] - self.shift[body], model.geom_quat[geom])
        if mesh:  # MuJoCo has moved the mesh into its own centre and axes
            number = int(model.geom_dataid[geom])
            pose = pose @ inverse(_pose(model.mesh_pos[number], model.mesh_quat[number]))
        _origin(element, pose)
        ET.SubElement(ET.SubElement(element, "geometry"), *self._shape(geom))

    def _shape(self, geom: int) -> tuple[str, dict[str, str]]:
        kind, size = int(self.model.geom_type[geom]), self.model.geom_size[geom]
        if kind not in _PLAIN:
            number = int(self.model.geom_dataid[geom])
            return "mesh", {"filename": self._file(geom), "scale": _text(self.model.mesh_scale[number])}
        if _PLAIN[kind] == "box":
            return "box", {"size": _text(2 * size)}
        said = {"radius": repr(float(size[0]))}
        return _PLAIN[kind], said if _PLAIN[kind] == "sphere" else said | {"length": repr(2 * float(size[1]))}

    def _file(self, geom: int) -> str:
        """The mesh file, as seen from the model's folder; empty for a mesh that is written in the model."""
        name = self.model.mesh(int(self.model.geom_dataid[geom])).name
        mesh = next((one for one in self.spec.meshes if (one.name or Path(one.file).stem) == name), None)
        if mesh is None or not mesh.file:
            return ""
        return Path(os.path.relpath(self.folder / self.spec.meshdir / mesh.file, self.folder)).as_posix()


def _pose(shift: Array, quaternion: Array | None = None) -> Array:
    found = np.eye(4)
    if quaternion is not None:
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, np.asarray(quaternion, dtype=float))
        found[:3, :3] = turn.reshape(3, 3)
    found[:3, 3] = shift
    return found


def _joint(root: ET.Element, name: str, kind: str, parent: str, child: str, pose: Array) -> ET.Element:
    element = ET.SubElement(root, "joint", name=name, type=kind)
    ET.SubElement(element, "parent", link=parent)
    ET.SubElement(element, "child", link=child)
    _origin(element, pose)
    return element


def _origin(element: ET.Element, pose: Array) -> None:
    ET.SubElement(element, "origin", xyz=_text(pose[:3, 3]), rpy=_text(roll_pitch_yaw(pose)))


def _text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
