"""Hammer tests on arms that nobody tuned, simulated in the time domain with an effect hidden or not: test
data without inverse crime.

Nothing here imports `identify`.  `arm` and `makes` say what the robot is, `tree` puts it at a posture,
`structure`, `nonlinear` and `faults` hide something, `plant` and `hammer` simulate, `chain` and `estimate`
measure, `universal` and `generate` write the files.
"""

from tests.generator.generate import generate
from tests.generator.spec import TestSpec

__all__ = ["TestSpec", "generate"]
