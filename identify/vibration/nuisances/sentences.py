"""Nuisance parameters, in words."""

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
    "form": "forms of bending links",
    "impulse": "strengths of impacts",
}


def kind_of(one: Nuisance) -> str:
    """What it is an error of, as a plural: what a measurement of its own would remove."""
    if one.group == "link":
        return {"mass": "masses", "centre": "centres of mass"}.get(one.change.split("_")[0], "inertias")
    if one.group == "point":
        return "directions of sensors" if one.change.startswith("r") else "places of points"
    return "durations of impacts" if one.change == "duration" else _KINDS[one.group]


def sentence(some: Sequence[Nuisance], shift: Array) -> str:
    """Errors of one kind at one place, in units of their standard deviations (n,), as part of a sentence."""
    first, amount = some[0], np.array([one.std for one in some]) * shift
    kind, place, beyond = kind_of(first), first.place, float(np.abs(shift).max())
    said = _single(kind, place, amount) if kind in _SINGLE else _several(kind, place, amount, some)
    return f"{said} ({beyond:.1f} times what was stated)"


_SINGLE = ("masses", "sensitivities", "delays", "strengths of impacts", "durations of impacts")


def _single(kind: str, place: str, amount: Array) -> str:
    """What one number says."""
    more = bool(amount[0] > 0)
    if kind == "masses":
        return f"{place} is {_percent(amount[0])} {'heavier' if more else 'lighter'}"
    if kind == "sensitivities":
        name = "the force transducer" if place == FORCE else f"channel {place}"
        return f"{name} reads {_percent(amount[0])} too {'much' if more else 'little'}"
    if kind == "strengths of impacts":
        return f"impacts {place} were {_percent(amount[0])} {'stronger' if more else 'weaker'} than stated"
    if kind == "durations of impacts":
        return f"impacts were {_percent(amount[0])} {'longer' if more else 'shorter'} than stated"
    return f"responses of {place} are {1e6 * abs(amount[0]):.0f} µs {'late' if more else 'early'}"


def _several(kind: str, place: str, amount: Array, some: Sequence[Nuisance]) -> str:
    """What numbers along several axes say."""
    size, most = float(np.linalg.norm(amount)), float(np.abs(amount).max())
    along = f"({_along(some, 1e3 * amount)} mm)"
    return {
        "centres of mass": f"the centre of mass of {place} is {1e3 * size:.1f} mm off {along}",
        "inertias": f"the inertia of {place} is up to {_percent(most)} off",
        "places of points": f"point {place} is {1e3 * size:.1f} mm beside its place {along}",
        "directions of sensors": f"sensor {place} is {np.degrees(size):.1f}° askew",
        "directions of impacts": f"the impact {place} was {np.degrees(size):.1f}° askew",
        "joint angles": f"the angles of {place} are up to {np.degrees(most):.2f}° off",
        "forms of bending links": f"{place} is off a beam by up to {100 * most:.0f} %",
        "places of joints": f"{place} sits {1e3 * size:.1f} mm beside its place",
    }[kind]


def _percent(logarithm: float) -> str:
    return f"{100 * abs(np.expm1(logarithm)):.1f} %"


def _along(some: Sequence[Nuisance], amount: Array) -> str:
    return ", ".join(
        f"{one.change.split('_')[-1]} {value:+.1f}" for one, value in zip(some, amount, strict=True)
    )
