"""What the form of an effect may be off by: a model of a part is never quite the part."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from identify.core.arrays import Array
from identify.model.effects.site import Site

What = Literal["shape", "mass"]


@dataclass(frozen=True)
class Form:
    """Errors of the form of the effect at a place, each by its name, and what it is an error of: the shape in
    which a part deforms, or where its mass is.

    changes: at a site, per unit of each error: M (k, n, n) and, by node, the motion of points (k, 6, n) in
    the axes of their link.
    """

    place: str
    errors: tuple[tuple[str, What], ...]
    changes: Callable[[Site], tuple[Array, Mapping[int, Array]]]
