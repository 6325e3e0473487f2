"""Command line: python -m tests.generator OUT --case tilt_j2 --seed 3."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec


def main() -> None:
    """Write one test folder."""
    parser = argparse.ArgumentParser(prog="python -m tests.generator", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write")
    parser.add_argument("--case", default="none", help="what to hide, such as tilt_j2 or base_rocking+delay")
    parser.add_argument("--arm", choices=MAKES, default="random")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--strength", type=float, default=1.0, help="size of what is hidden")
    parser.add_argument(
        "--noise", type=float, default=TestSpec.noise_response, help="of each response sample, m/s^2"
    )
    parser.add_argument(
        "--noise-force", type=float, default=TestSpec.noise_force, help="of each force sample, N"
    )
    parser.add_argument(
        "--force", type=float, help="mean peak at level 1, N; default: by the arm's mass, 180 N at most"
    )
    parser.add_argument(
        "--levels", type=float, nargs="+", help="force levels; default: 1, or 0.3 1 3 where it matters"
    )
    parser.add_argument("--decay", type=float, help="window decay, 1/s; default: as the slowest mode needs")
    parser.add_argument("--nodes", type=int, nargs="+", help="keep only these points; the last is struck")
    parser.add_argument("--direction-error", type=float, default=0.0, help="of the hammer, degrees")
    parser.add_argument("--weighed", action="store_true", help="accelerometers feel gravity")
    parser.add_argument("--binary", action="store_true", help="write UFF 58b")
    parser.add_argument("--truth", type=Path, help="default: OUT.truth.json")
    given = parser.parse_args()
    arm = MAKES[given.arm](given.seed)
    spec = TestSpec(
        arm=arm.at_points(given.nodes) if given.nodes else arm,
        seed=given.seed,
        force_n=given.force,
        noise_response=given.noise,
        noise_force=given.noise_force,
        window_decay_per_s=given.decay,
        direction_error_deg=given.direction_error,
        weighed=given.weighed,
        binary=given.binary,
    )
    spec = hide(spec, given.case, given.strength)
    generate(replace(spec, levels=tuple(given.levels)) if given.levels else spec, given.out, given.truth)


if __name__ == "__main__":
    main()
