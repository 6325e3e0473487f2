"""Limits of published stability charts, recomputed two ways: python -m tests.benchmarks.charts [--speeds 4].

The parameters are those under which the charts are usually quoted, not checked against the papers; the charts
themselves are not read off.  Printed is how far the exact limits of `identify` are from those of a simulation
in time (`tests.generator.milling`, which shares no code with it), whose step is taken to its end.

- One and two degrees of freedom of Insperger and Stepan (2004, Int. J. Numer. Meth. Eng. 61): 0.03993 kg, 922
  Hz, 1.1 %, alike in both directions; two teeth, 600 and 200 N/mm^2, down-milling with 5, 10, 50 and 100 % of
  the diameter, 5,000 to 25,000 rpm.
- The end mill of Altintas and Budak (1995, Ann. CIRP 44): 603 and 666 Hz, 3.9 and 3.5 %, 5.59 and 5.715 N/um;
  three teeth, 600 N/mm^2, Kr 0.07, half immersion up-milling and a slot, 4,000 to 15,000 rpm.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from identify.machining.engagement import Engagement
from identify.machining.exact_limit import exact_limit
from identify.machining.lobes import inverse_eigenvalues, zeroth_order
from identify.machining.materials import Coefficients
from identify.machining.semi_discretization import TimeDomain
from identify.machining.structure import Structure
from tests.generator import milling

_DEEPEST = 0.02
"""Depths, m, beyond which a chart is not looked at."""
_STEPS = (240, 480)
Modes = list[tuple[float, float, float]]


@dataclass(frozen=True)
class Chart:
    """modes: stiffness, N/m, Hz and damping ratio along feed, and normal where there are two."""

    name: str
    modes: Modes
    teeth: int
    cutting: Coefficients
    swept: tuple[float, float]
    rpm: tuple[float, float]

    @property
    def structure(self) -> Structure:
        """The modes as uncoupled oscillators."""
        stiffness, hz, ratio = np.array(self.modes).T
        omega = 2 * np.pi * hz
        mass, damping = stiffness / omega**2, 2 * ratio * stiffness / omega
        return Structure(np.diag(mass), np.diag(damping), np.diag(stiffness), np.eye(3, len(self.modes)))


def charts() -> list[Chart]:
    """Those of the two papers."""
    one = (0.03993 * (2 * np.pi * 922.0) ** 2, 922.0, 0.011)
    aluminium = Coefficients(600e6, 200e6)
    found = []
    for count, part in ((count, part) for count in (1, 2) for part in (0.05, 0.1, 0.5, 1.0)):
        name = f"Insperger and Stepan, {count} DOF, {part:.0%}"
        entry = float(np.arccos(2 * part - 1))
        found.append(Chart(name, [one] * count, 2, aluminium, (entry, np.pi), (5e3, 25e3)))
    mill = [(5.59e6, 603.0, 0.039), (5.715e6, 666.0, 0.035)]
    for name, leave in (("half immersion", np.pi / 2), ("slot", np.pi)):
        cutting = Coefficients(600e6, 0.07 * 600e6)
        found.append(Chart(f"Altintas and Budak, {name}", mill, 3, cutting, (0.0, leave), (4e3, 15e3)))
    return found


def compared(chart: Chart, rpm: float) -> float:
    """Exact limit over the simulated one, less one; NaN where one of them finds none within the depths."""
    structure, cut = chart.structure, Engagement(chart.teeth, *chart.swept, np.pi / 2, chart.cutting)
    lines = structure.lines_hz(800)
    inverse = inverse_eigenvalues(cut.mean, structure.receptance(lines))
    near = float(zeroth_order(inverse, lines, cut.teeth, np.array([rpm])).depth[0])
    domain = TimeDomain(structure, cut, 1.1 * max(hz for _, hz, _ in chart.modes))
    found = domain.limit(rpm, min(near, _DEEPEST), _DEEPEST)
    if not np.isfinite(found):
        return np.nan
    tip = partial(_tip, structure)
    exact = exact_limit(cut, tip, domain.highest_hz, rpm, (found, domain.chatter_hz(rpm, found)))
    depth = found if exact is None else exact.depth
    sketch = milling.Cut(chart.teeth, *chart.swept, chart.cutting.tangential, chart.cutting.radial, 0.0)
    arm = milling.Arm(structure.mass, structure.damping, structure.stiffness, structure.out)
    return depth / milling.exact_limit(arm, sketch, rpm, depth, _STEPS)[0] - 1


def _tip(structure: Structure, lines: np.ndarray) -> np.ndarray:
    at = structure.receptance(np.abs(lines))
    return np.where(lines[:, None, None] < 0, np.conj(at), at)


def main() -> None:
    """Print how far the two ways are apart on every chart."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.charts", description=__doc__)
    parser.add_argument("--speeds", type=int, default=4)
    given = parser.parse_args()
    with threadpool_limits(1):
        for chart in charts():
            apart = 100 * np.array([compared(chart, rpm) for rpm in np.geomspace(*chart.rpm, given.speeds)])
            known = np.abs(apart[np.isfinite(apart)])
            print(
                f"{chart.name}: {len(known)} of {len(apart)} limits within {1e3 * _DEEPEST:.0f} mm, apart by"
                f" {np.median(known):.3f} % (median), {known.max():.3f} % at most",
                flush=True,
            )


if __name__ == "__main__":
    main()
