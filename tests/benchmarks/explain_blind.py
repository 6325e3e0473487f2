"""`identify explain` on dirty simulated motion: python -m tests.benchmarks.explain_blind --seed N.

Bodies are 5 % off what is stated, torques have noise that keeps up to 0.95 of its last value and come late
through a filter, encoders count.  Six pairs of records have nothing hidden; the others have one effect each,
drawn with its size by the seed.  Corrections of bodies, which are wrong, are no false names.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.benchmarks.explain import cases, deflections, errors, explained, torques
from tests.motion.hidden_drive import Array, Hidden, Motion

NULLS = 6
OF_BODIES = ("first-moment", "inertia", "payload-mass")
"""Ends of names of corrections of bodies; `rotor-inertia` is none."""
_LARGE = {"link2.first-moment": 6.0, "link3.inertia": 1.5, "payload-mass": 4.0, "joint2.torque-constant": 2.0}
"""How much larger than in the clean benchmark, so that errors of 5 % of the bodies cannot be it."""


def main() -> None:
    """Print a row per case and the score."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.explain_blind", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--cases", type=int, default=20, help="of which six have nothing hidden")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    kinds = sorted(set(cases()) - {name for name in cases() if " + " in name})
    drawn = [""] * NULLS + list(
        rng.choice(kinds, given.cases - NULLS, replace=given.cases - NULLS > len(kinds))
    )
    named, false, false_in_nulls = 0, 0, 0
    for number, name in enumerate(drawn):
        hit, wrong = scored(str(name), dirty(str(name), rng, 10 * given.seed + number))
        named, false = named + (hit and bool(name)), false + len(wrong)
        false_in_nulls += bool(wrong) and not name
    count = given.cases - NULLS
    print(f"named {named} of {count}; false names {false} in all, in {false_in_nulls} of {NULLS} nulls")


def dirty(name: str, rng: np.random.Generator, seed: int) -> Hidden:
    """A hidden effect of a size of its own, or none, with dirt."""
    factor = float(rng.uniform(0.8, 2.0)) * _LARGE.get(name, 1.0)
    found = _scaled(name, factor) if name else Hidden()
    return replace(
        found,
        seeds=(2 * seed, 2 * seed + 1),
        bodies_off=0.05,
        counts=4096,
        memory=float(rng.choice([0.5, 0.8, 0.95])),
        torque_lag_s=float(rng.uniform(0.0, 0.003)),
    )


def _scaled(name: str, factor: float) -> Hidden:
    plain = cases()[name]

    def times(of: Callable[[Motion], Array]) -> Callable[[Motion], Array]:
        return lambda m: factor * of(m)

    if name in torques():
        return replace(plain, motor=tuple(times(one) for one in plain.motor))
    if name in deflections() and plain.deflection is not None and "hardening" not in name:
        return replace(plain, deflection=times(plain.deflection))
    if name in errors() and plain.error is not None:
        return replace(plain, error=times(plain.error))
    return replace(
        plain, payload_kg=factor * plain.payload_kg, latency_s=tuple(factor * t for t in plain.latency_s)
    )


def scored(name: str, hidden: Hidden) -> tuple[bool, list[str]]:
    """Whether the hidden effect is named, or among the rivals of what is; names that are false."""
    wrist = "coupling" in name
    result, seconds = explained(5 if wrist else 3, hidden, **({"joints": [4, 5]} if wrist else {}))
    tables = [found.effects for found in result.targets.values()]
    names = [one for table in tables for one in table.name]
    rivals = {rival for table in tables for row in table.rivals for rival in row.split(", ") if row}
    wrong = [one for one in names if one != name and not _of_body(one)]
    stood_for = name in rivals and name not in names
    if stood_for and wrong:
        wrong = wrong[1:]
    hit = name in names or stood_for
    print(f"{name or 'nothing':36s} {'named' if hit else '-':6s} {', '.join(names) or 'nothing'}", end="")
    print(f"{' (or ' + name + ')' if stood_for else ''}  ({seconds:.1f} s)", flush=True)
    return hit, wrong


def _of_body(name: str) -> bool:
    return name == "payload-mass" or (name.startswith("link") and name.endswith(OF_BODIES))


if __name__ == "__main__":
    main()
