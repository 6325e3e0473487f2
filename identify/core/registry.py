"""Plug points: effects, costs, optimizers and loaders are found by name, built-in and third-party through the
same door.

A third party adds `[project.entry-points."identify.effects"]  my-kind = "my_package.module:MyEffect"` to its
own pyproject.toml.  Modules are imported when their name is first asked for, so that the command line starts
fast.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from inspect import isabstract
from typing import Any

from identify.core.errors import InputError
from identify.core.plugin import PluginError, load_guarded, note_broken

_GROUPS = "identify."
"""What the names of all plug points begin with."""


@cache
def installed(group: str) -> tuple[EntryPoint, ...]:
    """The entry points of third parties, looked up once: it takes a look into every installed package."""
    return tuple(entry_points(group=group))


def plug_ins() -> tuple[str, ...]:
    """The packages of third parties that are plugged in anywhere, each with its version, sorted."""
    groups = (group for group in entry_points().groups if group.startswith(_GROUPS))
    owners = (point.dist for group in groups for point in installed(group))
    return tuple(sorted({f"{one.name} {one.version}" for one in owners if one is not None}))


@dataclass
class Registry:
    """Names and where to import them from (`module:attribute`), with `group` the entry-point group of third
    parties, and `base`, as `module:attribute`, the class that theirs must be of; empty: they are functions.
    formerly: old names, each with the one that does its work now.
    """

    what: str
    group: str
    builtin: dict[str, str]
    base: str = ""
    formerly: dict[str, str] = field(default_factory=dict)
    added: dict[str, Any] = field(default_factory=dict)

    def names(self) -> list[str]:
        """Every known name, sorted."""
        return sorted({*self.builtin, *self.added, *(point.name for point in installed(self.group))})

    def add(self, name: str, thing: Any) -> None:
        """Register `thing` for this process; an existing name is refused."""
        if name in self.names():
            raise ValueError(f"{self.what} {name!r} is registered already")
        self.added[name] = thing

    def get(self, name: str, where: str = "config") -> Any:
        """The registered object; an unknown name is an InputError that lists the known ones."""
        if name in self.added:
            return self.added[name]
        if name in self.builtin:
            return load(self.builtin[name])
        for point in installed(self.group):
            if point.name == name:
                return load_guarded(point, self.what, self._is_one)
        raise InputError(
            where, f"unknown {self.what} {name!r}", "one of " + ", ".join(self.names()), self.near(name)
        )

    def usable(self) -> dict[str, Any]:
        """All registered objects by name; what is broken of third parties is left out with a warning."""
        found = {}
        for name in self.names():
            try:
                found[name] = self.get(name)
            except PluginError as error:
                note_broken(error)
        return found

    def _is_one(self, thing: Any) -> bool:
        if not self.base:
            return callable(thing)
        return isinstance(thing, type) and issubclass(thing, load(self.base)) and not isabstract(thing)

    def near(self, name: str) -> str:
        """What an old name is called now, or a question after the known name that is most like an unknown
        one; empty where none is.
        """
        if name in self.formerly:
            return f"it is `{self.formerly[name]}` now"
        found = difflib.get_close_matches(name, self.names(), n=1)
        return f"did you mean `{found[0]}`?" if found else ""


def load(place: str) -> Any:
    """What `module:attribute` names."""
    module, attribute = place.split(":")
    return getattr(import_module(module), attribute)


def parse_kind(registry: Registry, data: Any) -> Any:
    """The registered settings model of `data['kind']`, validated, or data themselves where they were; raises
    ValueError for pydantic to report with its key.
    """
    if isinstance(data, load(registry.base)):
        return data
    known = ", ".join(registry.names())
    if not isinstance(data, dict) or not isinstance(data.get("kind"), str):
        raise ValueError(f"expected a mapping with `kind`: one of {known}")
    if data["kind"] not in registry.names():
        near = registry.near(data["kind"])
        raise ValueError(
            f"unknown {registry.what} {data['kind']!r}; expected one of {known}{'; ' * bool(near)}{near}"
        )
    try:
        kind = registry.get(data["kind"])
    except PluginError as error:
        raise ValueError(str(error)) from error
    return kind.model_validate(data)
