"""How an error names what a user can add or correct: a key of a config, or an option of a command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_OPTIONS = ContextVar("_OPTIONS", default=False)


def key(name: str, example: str = "") -> str:
    """`the key unit, such as unit: g`, or, where there is no config, ``--unit`, such as `--unit g``."""
    if not _OPTIONS.get():
        return f"the key {name}" + (f", such as {name}: {example}" if example else "")
    option = f"--{name.removesuffix('_per_s').replace('_', '-')}"
    return f"`{option}`" + (f", such as `{option} {example}`" if example else "")


@contextmanager
def as_options() -> Iterator[None]:
    """Within, all is given by options."""
    before = _OPTIONS.set(True)
    try:
        yield
    finally:
        _OPTIONS.reset(before)
