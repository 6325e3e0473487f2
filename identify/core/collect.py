"""Do several things and report everything that was wrong with them at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from identify.core.errors import InputError, InputErrors
from identify.core.interruption import check

T = TypeVar("T")


def collect(makers: Sequence[Callable[[], T]]) -> list[T]:
    """The results of all makers, or all of their errors at once; what several say is said once."""
    results, errors = [], []
    for make in makers:
        check()
        try:
            results.append(make())
        except InputError as error:
            errors.append(error)
        except InputErrors as several:
            errors += several.errors
    if errors:
        raise InputErrors(list({str(error): error for error in errors}.values()))
    return results
