"""The one guard around what packages of third parties do at a plug point (`identify.core.registry`).

Whatever such a package raises is an InputError that names it, and what it prints goes to standard error, so
that the output of a command stays its own.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import sys
import warnings
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint
from typing import Any

from identify.core.errors import InputError

_FIX = "repair it with its authors, or uninstall it"
_guarded_classes: dict[type, str] = {}
"""Classes of packages whose methods have the guard, and the plug-in that each is named by."""


class BrokenPlugin(UserWarning):
    """A package that is installed and cannot be used: it is left out."""


class PluginError(InputError):
    """A package of a third party did what it may not do; `where` names it."""


def named(point: EntryPoint) -> str:
    """A plug-in and the package that brings it."""
    dist = point.dist
    return f"plug-in {point.name!r} of the package {f'{dist.name} {dist.version}' if dist else point.module}"


def package_of(thing: type) -> str:
    """The top-level package that a class is from."""
    return thing.__module__.partition(".")[0]


def name_of(thing: object) -> str:
    """The plug-in that an object is of; in a process that has only unpickled it, its package alone."""
    kind = type(thing)
    return _guarded_classes.get(kind) or f"plug-in {kind.__name__!r} of the package {package_of(kind)}"


def load_guarded(point: EntryPoint, what: str, is_one: Callable[[Any], bool]) -> Any:
    """What an entry point names, guarded; PluginError where it cannot be imported or is not what it should
    be.
    """
    with guard(named(point)):
        thing = point.load()
    if not is_one(thing):
        raise PluginError(named(point), f"{point.value} is no {what}", "what CONTRIBUTING.md describes", _FIX)
    if not isinstance(thing, type):
        return _guarded(thing, named(point))
    _guard_class(thing, package_of(thing), named(point))
    return thing


@contextlib.contextmanager
def blamed(function: Callable[..., Any]) -> Iterator[None]:
    """What is wrong with what a function gave is reported with its package, where it is one of a third
    party.
    """
    name = getattr(function, "plugin", "")
    if not name:
        yield
        return
    try:
        with guard(name):
            yield
    except PluginError:
        raise
    except InputError as error:
        raise InputError(f"{error.where}, read by {name}", error.found, error.expected, error.fix) from error


def note_broken(error: PluginError) -> None:
    """Say once that a package is left out."""
    warnings.warn(f"left out: {error}", BrokenPlugin, stacklevel=2)


@contextlib.contextmanager
def left_out_where_broken() -> Iterator[None]:
    """What a package cannot do inside is left out, and said."""
    try:
        yield
    except PluginError as error:
        note_broken(error)


@contextlib.contextmanager
def guard(name: str) -> Iterator[None]:
    """What happens inside is a package's: its errors name it, and it prints to standard error.

    Errors of identify's own kinds pass, which a package may raise to speak to the user.
    """
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    except (Exception, SystemExit) as error:
        if package_of(type(error)) == "identify":
            raise
        raise PluginError(name, f"{type(error).__name__}: {error}", fix=_FIX) from error


def _guard_class(thing: type, package: str, name: str) -> None:
    """Put the guard around the methods that a package wrote; in place, so that the class is still found where
    it is pickled.
    """
    for owner in thing.__mro__:
        if package_of(owner) != package or owner in _guarded_classes:
            continue
        _guarded_classes[owner] = name
        for key, value in list(vars(owner).items()):
            if key.startswith("_"):
                continue
            if inspect.isfunction(value):
                setattr(owner, key, _guarded(value, name))
            elif isinstance(value, classmethod | staticmethod):
                setattr(owner, key, type(value)(_guarded(value.__func__, name)))


def _guarded(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    package = function.__module__.partition(".")[0]

    @functools.wraps(function)
    def call(*words: Any, **options: Any) -> Any:
        with guard(name):
            made = function(*words, **options)
            if inspect.isgenerator(made):
                made = iter(list(made))  # what it does on the way is guarded, too
        if package_of(type(made)) == package:
            _guard_class(type(made), package, name)
        return made

    call.__dict__["plugin"] = name
    return call
