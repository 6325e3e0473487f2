"""A xacro file as the URDF that it stands for.

Its expressions are evaluated, so this runs in the child process of `identify.core.binary_input`.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import xacro
from xacro import substitution_args

from identify.core.hdf5_tree import Refused
from identify.core.tree import Group
from identify.robot.package import package_folder


def expanded(path: Path, arguments: dict[str, str]) -> Group:
    """The member `urdf`: its text; Refused, with the words of xacro, for what cannot be expanded."""

    def find(package: str) -> str:
        found = package_folder(package, path.parent)
        if found is None:
            raise Refused(
                "", f"it needs the package {package!r}, which is neither beside it nor in a folder above"
            )
        return str(found)

    substitution_args._eval_find = find  # that of xacro needs an installed ROS
    os.chdir(path.parent)
    used = _Asked(arguments)
    try:
        document = xacro.process_file(str(path), mappings=used)
    except Refused:
        raise
    except Exception as error:  # whatever the expressions and includes of a stranger's file raise
        raise Refused("", _said(error)) from error
    if lost := arguments.keys() - used.asked:
        raise Refused("", f"it does not take the argument {min(lost)!r}")
    return Group({"urdf": document.documentElement.toprettyxml(indent="  ")})


class _Asked(dict[str, str]):
    """Arguments, and which of them a xacro asks for, in whichever of its files."""

    def __init__(self, arguments: dict[str, str]) -> None:
        super().__init__(arguments)
        self.asked = set[object]()

    def __contains__(self, name: object) -> bool:
        self.asked.add(name)
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        self.asked.add(name)
        return super().__getitem__(name)


def _said(error: Exception) -> str:
    chain: list[BaseException] = [error]
    while isinstance(deeper := getattr(chain[-1], "exc", None), BaseException):
        chain.append(deeper)
    for cause in chain:
        asked = re.search(r"Undefined substitution argument (\w+)", str(cause))
        if asked:
            return f"it needs the argument {asked[1]!r}"
        if isinstance(cause, Refused):
            return cause.found
        if isinstance(cause, OSError):
            there = os.path.relpath(cause.filename or "?")  # from the folder of the xacro
            return f"it includes {there}, which cannot be read: is an argument missing?"
    return "xacro says: " + " ".join(str(error).split())[:300]
