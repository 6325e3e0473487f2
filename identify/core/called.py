"""Packages that can be called: `identify.modes("frfs.uff")` beside `identify.modes.run`.

A command and the package of its machinery have the same name, and whichever is imported last would hide the
other; so the package is both.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from identify.core.registry import load


class _Called(ModuleType):
    """A package that does what the function of its name in `identify.api.commands` does."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return load(f"identify.api.commands:{self.__name__.rpartition('.')[2]}")(*args, **options)


def called(package: str) -> None:
    """Let a package be called."""
    sys.modules[package].__class__ = _Called
