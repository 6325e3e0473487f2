"""Draw new cases for `tests.benchmarks.discovery` at random: python -m tests.benchmarks.discovery_draw OUT
--seed N [--count 60] [--dirt careful|typical] [--three] [--outside] [--unequal].

Every sixth case has nothing hidden in it, every sixth two effects, the others one, each kind of the catalogue
about as often; makes of arm, places and sizes by the seed.  The records begin up to 20 ms before the impacts,
and half of them are windowed so lightly that slow modes ring on beyond their end.  With dirt, everything told
is a little wrong (`tests.generator.dirt`), and what several force levels show is left out.  Three: each case
has three effects.  Unequal: each posture has a noise of its own, from half to six times the usual one.
Outside the catalogue are joints whose law no effect has, and nothing else: right is then a law measured at
that joint or, where springs on sliders hold it, dry friction of that joint.  Draw after the work is done, and
score once.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.generator.cases import CASES, hide
from tests.generator.dirt import CAREFUL, ORDINARY, soil
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec

_BESIDES = ("pad", "fractional", "friction_springs")
"""Laws that no effect of the catalogue has."""
_JOINTS = (
    "tilt",
    "radial",
    "axial",
    "turned_tilt",
    "turned_radial",
    "rotor",
    "friction",
    "hardening",
    *_BESIDES,
)
_LINKS = ("absorber",)
_OF_LEVELS = ("friction", "hardening", "friction_springs")
DIRT = {"careful": CAREFUL, "typical": ORDINARY}
_EARLIEST_S, _LIGHT_PER_S = 0.02, 0.693
_QUIETEST, _NOISIEST = 0.5, 6.0
_STRUCTURE = ("base_rocking", "tilt", "radial", "axial", "absorber", "payload", "delay", "polarity", "gain")
"""What two or three effects at once are drawn from."""


def named(kind: str, rng: np.random.Generator) -> str:
    """A case of a kind, at a place where it is seen."""
    if kind == "flex":
        return f"link{rng.integers(2, 4)}_flex"
    if kind in _JOINTS:
        return f"{kind}_j{rng.integers(2, 4)}"
    return f"{kind}_l{rng.integers(2, 5)}" if kind in _LINKS else kind


def drawn(count: int, seed: int, without: tuple[str, ...] = _BESIDES) -> list[str]:
    """So many cases, by name."""
    rng = np.random.default_rng(seed)
    kinds = [kind for kind in CASES if kind not in without]
    order = [kind for _ in range(-(-count // len(kinds))) for kind in rng.permutation(kinds)]
    found = []
    for number in range(count):
        if number % 6 == 5:
            found.append("none")
        elif number % 6 == 2:
            pair = rng.choice(_STRUCTURE, 2, replace=False)
            found.append("+".join(named(str(kind), rng) for kind in pair))
        else:
            found.append(named(str(order.pop()), rng))
    return found


def drawn_three(count: int, seed: int) -> list[str]:
    """So many cases of three effects at once, by name."""
    rng = np.random.default_rng(seed)
    threes = [rng.choice(_STRUCTURE, 3, replace=False) for _ in range(count)]
    return ["+".join(named(str(kind), rng) for kind in three) for three in threes]


def drawn_outside(count: int, seed: int) -> list[str]:
    """So many cases of laws that no effect has, by name."""
    rng = np.random.default_rng(seed)
    return [named(_BESIDES[number % len(_BESIDES)], rng) for number in range(count)]


def noisier(postures: int, rng: np.random.Generator) -> tuple[float, ...]:
    """How many times the usual noise each posture has."""
    ends = np.log([_QUIETEST, _NOISIEST])
    return tuple(np.exp(rng.uniform(*ends, postures)).tolist())


def of_draws(name: str, description: str | None, count: int) -> argparse.ArgumentParser:
    """What every draw is asked: where it goes, its seed, how many tests, and how far off they are stated."""
    parser = argparse.ArgumentParser(prog=f"python -m tests.benchmarks.{name}", description=description)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--dirt", choices=sorted(DIRT))
    return parser


def main() -> None:
    """Write the folders of a draw with their truths."""
    parser = of_draws("discovery_draw", __doc__, 60)
    parser.add_argument("--three", action="store_true", help="three effects at once in every case")
    parser.add_argument("--outside", action="store_true", help="laws that the catalogue does not have")
    parser.add_argument("--unequal", action="store_true", help="each posture with a noise of its own")
    given = parser.parse_args()
    rng, of_records, of_noise = (np.random.default_rng([given.seed, stream]) for stream in (1, 2, 3))
    if given.three:
        cases = drawn_three(given.count, given.seed)
    elif given.outside:
        cases = drawn_outside(given.count, given.seed)
    else:
        cases = drawn(given.count, given.seed, (*_BESIDES, *_OF_LEVELS) if given.dirt else _BESIDES)
    for number, case in enumerate(cases):
        seed = int(rng.integers(1, 10**6))
        spec = TestSpec(
            MAKES[str(rng.choice(list(MAKES)))](seed),
            seed=seed,
            binary=True,
            pre_trigger_s=float(of_records.uniform(0.0, _EARLIEST_S)),
            window_decay_per_s=_LIGHT_PER_S if of_records.random() < 0.5 else None,
        )
        if given.unequal:
            spec = replace(spec, noisier=noisier(spec.postures, of_noise))
        folder = given.out / f"{number:02d}_{case.replace('+', '_and_')}"
        test = hide(spec, case)
        if given.dirt:
            test = soil(test, DIRT[given.dirt])
        generate(test, folder, given.out / f"{folder.name}.truth.json")
        print(folder.name, flush=True)


if __name__ == "__main__":
    main()
