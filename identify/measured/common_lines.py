"""The abscissa that the records of a file share: the same for all, or the stretch that all have."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import count

_SAME = 1e-4
"""Difference of two axes, in spacings, that printing with few digits makes."""


def common_axis(axes: Iterable[tuple[str, Array]], what: str, fix: str) -> Array:
    """The axis that all (where, axis) share to a ten-thousandth of their spacing; InputError naming the first
    that differs.
    """
    first_where, first = "", np.empty(0)
    for where, axis in axes:
        if not first_where:
            first_where, first = where, axis
        elif len(axis) != len(first):
            found = f"{len(axis)} {what} values, {len(first)} in {first_where}"
            raise InputError(where, found, "one axis for all", fix)
        elif not _same(first, axis, first):
            found = f"a {what} axis that differs from that of {first_where}"
            raise InputError(where, found, "one axis for all", fix)
    return first


def common_lines(axes: Sequence[tuple[str, Array]]) -> tuple[Array, list[slice], tuple[str, ...]]:
    """The frequency lines that all (where, axis) have, where they stand in each, and a sentence on those that
    not all have.

    The lines of a record may begin later or end earlier than those of the longest, of which all together
    keep more than half; InputError naming the first record that is anything else.
    """
    longest_where, longest = max(axes, key=lambda one: len(one[1]))
    starts, first, last = [], 0, len(longest)
    for where, axis in axes:
        if np.any(np.diff(axis) <= 0):
            raise InputError(where, "frequencies that do not rise", "rising frequencies in Hz")
        start = int(np.argmin(np.abs(longest - axis[0]))) if len(axis) else 0
        end = start + len(axis)
        if not _same(longest[start:end], axis, longest) or 2 * (min(end, last) - max(start, first)) <= len(
            longest
        ):
            found = f"{_span(axis)}, beside {_span(longest)} in {longest_where}"
            fix = "export this record with the lines of the others, or without it"
            raise InputError(where, found, "the same lines for all FRFs, or most of them", fix)
        starts.append(start)
        first, last = max(first, start), min(last, end)
    slices = [slice(first - start, last - start) for start in starts]
    if last - first == len(longest):
        return longest, slices, ()
    shorter = [where for where, axis in axes if len(axis) < len(longest)]
    said = (
        f"of {len(longest)} lines the {last - first} were taken that all FRFs have, for"
        f" {len(shorter)} of {len(axes)} records {'has' if len(shorter) == 1 else 'have'} fewer, such as"
        f" {shorter[0].split(', ', 1)[-1]}"
    )
    return longest[first:last], slices, (said,)


def _span(axis: Array) -> str:
    return count(len(axis), "line") + (f" from {axis[0]:g} to {axis[-1]:g} Hz" if len(axis) else "")


def _same(a: Array, b: Array, spaced: Array) -> bool:
    """Whether two axes are the same but for printing; spaced: that whose smallest step is the measure."""
    return len(a) == len(b) and bool(np.max(np.abs(a - b), initial=0.0) <= _SAME * _spacing(spaced))


def _spacing(axis: Array) -> float:
    """The smallest step of an axis; of one with a single value, that value."""
    return float(np.diff(axis).min()) if len(axis) > 1 else float(np.abs(axis).max(initial=0.0))
