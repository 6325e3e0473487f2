"""The benchmark of intervals under stated uncertainty: what differs from seed to seed, and how it counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.benchmarks.coverage_stated import Row, table, told
from tests.generator.dirt import CAREFUL, soil


def test_every_seed_soils_the_arm_that_is_told_anew() -> None:
    """But not its joints, of which the truth is."""
    spec = told(3)
    one, other = (soil(replace(spec, seed=seed), CAREFUL) for seed in (1, 2))
    assert one.told is spec.arm
    assert other.told is spec.arm
    assert np.array_equal(one.arm.stiffness, spec.arm.stiffness)
    masses = [[link.inertia.mass for link in arm.links] for arm in (spec.arm, one.arm, other.arm)]
    assert len({tuple(mass) for mass in masses}) == 3


@pytest.mark.parametrize("factor", [1, 2])
def test_a_table_says_what_was_held_and_how_wide_it_was_stated(factor: int) -> None:
    rng = np.random.default_rng(1)
    errors = 0.01 * rng.normal(size=(400, 2))
    rows: list[Row] = [
        {
            "names": ["joint1.rz.stiffness", "joint1.rz.damping"],
            "ratio": np.exp(error).tolist(),
            "std": [0.01 * factor] * 2,
            "held": (np.abs(error) < 1.96 * 0.01 * factor).tolist(),
            **{"gap": 1.0, "gap_validation": 1.1, "doubted": False, "seconds": 1.0, "seconds_simulated": 2.0},
        }
        for error in errors
    ]
    last = next(line for line in table(rows).splitlines() if "all parameters" in line).split()
    held, stated = float(last[2].rstrip("%")), float(last[-2])
    assert held == pytest.approx((95.0, 99.99)[factor - 1], abs=2.0)
    assert stated == pytest.approx(factor, rel=0.1)
