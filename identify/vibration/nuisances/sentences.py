"""Errors of what was told, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.vibration.nuisances.nuisance import FORCE, Nuisance

_KINDS = {
    "channel": "sensitivities",
    "impact": "directions of impacts",
    "joint": "joint angles",
    "kinematics": "places of joints",
    "set": "delays",
}


def kind_of(one: Nuisance) -> str:
    """What it is an error of, as a plural: what a measurement of its own would remove."""
    if one.group == "link":
        return {"mass": "masses", "centre": "centres of mass"}.get(one.change.split("_")[0], "inertias")
    if one.group == "point":
        return "directions of sensors" if one.change.startswith("r") else "places of points"
    return _KINDS[one.group]


def sentence(some: Sequence[Nuisance], shift: Array) -> str:
    """Errors of one kind at one place, in units of their standard deviations (n,), as part of a sentence."""
    first, amount = some[0], np.array([one.std for one in some]) * shift
    kind, place = kind_of(first), first.place
    size, beyond = float(np.linalg.norm(amount)), float(np.abs(shift).max())
    if kind == "masses":
        said = f"{place} is {_percent(amount[0])} {'heavier' if amount[0] > 0 else 'lighter'}"
    elif kind == "centres of mass":
        said = f"the centre of mass of {place} is {1e3 * size:.1f} mm off ({_along(some, 1e3 * amount)} mm)"
    elif kind == "inertias":
        said = f"the inertia of {place} is up to {_percent(np.abs(amount).max())} off"
    elif kind == "places of points":
        said = f"point {place} is {1e3 * size:.1f} mm beside its place ({_along(some, 1e3 * amount)} mm)"
    elif kind == "directions of sensors":
        said = f"sensor {place} is {np.degrees(size):.1f}° askew"
    elif kind == "directions of impacts":
        said = f"the impact {place} was {np.degrees(size):.1f}° askew"
    elif kind == "sensitivities":
        name = "the force transducer" if place == FORCE else f"channel {place}"
        said = f"{name} reads {_percent(amount[0])} too {'much' if amount[0] > 0 else 'little'}"
    elif kind == "joint angles":
        said = f"the angles of {place} are up to {np.degrees(np.abs(amount).max()):.2f}° off"
    elif kind == "places of joints":
        said = f"{place} sits {1e3 * size:.1f} mm beside its place"
    else:
        said = (
            f"responses of {place} are {1e6 * abs(amount[0]):.0f} µs {'late' if amount[0] > 0 else 'early'}"
        )
    return f"{said} ({beyond:.1f} times what was stated)"


def _percent(logarithm: float) -> str:
    return f"{100 * abs(np.expm1(logarithm)):.1f} %"


def _along(some: Sequence[Nuisance], amount: Array) -> str:
    return ", ".join(
        f"{one.change.split('_')[-1]} {value:+.1f}" for one, value in zip(some, amount, strict=True)
    )
