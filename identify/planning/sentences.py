"""What is said of a plan."""

from __future__ import annotations

import numpy as np
import scipy.special

from identify.core.thresholds import SIGMAS_95
from identify.planning.known import Known
from identify.results.plan import PromisedTable
from identify.vibration.notes import of_gap


def verdict(
    promised: PromisedTable, ratio: float, what: str, sizes: tuple[int, ...], first: bool
) -> tuple[str, ...]:
    """What is determined, and how well; first: whether nothing was measured before."""
    said = [
        f"{sizes[0]} postures, {sizes[1]} impacts and {sizes[2]} sensors determine {what}: at the median,"
        f" their intervals are {ratio:.3g} times narrower than those of tests of the same size at random."
    ]
    worst = int(np.argmax(promised.promised))
    said.append(
        f"The 95 % intervals that it promises are ± {100 * promised.promised.min():.2g} to"
        f" {100 * promised.promised[worst]:.2g} %, the widest that of {promised.name[worst]}."
    )
    if not first:
        gain = promised.now / promised.promised
        best = int(np.argmax(gain))
        said.append(
            f"Together with the data of the fit, this narrows the intervals by a factor of"
            f" {np.median(gain):.3g} at the median, most that of {promised.name[best]}: {gain[best]:.3g}."
        )
    return tuple(said)


def verdict_apart(
    promised: PromisedTable, ratio: float, rival: str, sizes: tuple[int, ...]
) -> tuple[str, ...]:
    """How well the test tells the model from a rival; the difference is the last row of the table."""
    apart, random = (SIGMAS_95 / half[-1] for half in (promised.promised, promised.random))
    chance = 100 * scipy.special.ndtr(apart / 2)
    enough = "enough to decide" if apart > 2 * SIGMAS_95 else "too little to decide"
    return (
        f"{sizes[0]} postures, {sizes[1]} impacts and {sizes[2]} sensors tell the model from {rival}:"
        f" with all parameters of both fitted anew, they differ by {apart:.3g} standard deviations, {enough};"
        f" tests of the same size at random differ by {random:.3g} (the median), {ratio:.3g} times less.",
        f"Whichever is right, the expected log odds for it are {apart**2 / 2:.3g}, and the test prefers it in"
        f" {_percent(chance)} % of all cases.",
    )


def _percent(chance: float) -> str:
    return "more than 99.9" if chance > 99.9 else f"{chance:.3g}"


def next_best(impact: str, angles_deg: str, gain: float | None) -> str:
    """The one impact that says most."""
    where = f"an impact at {impact} with joint angles ({angles_deg})°"
    if gain is None:
        return f"If it is to be one impact alone: {where}, with these sensors."
    return (
        f"If it is to be one impact alone: {where}, with these sensors, narrows the intervals by a factor of"
        f" {gain:.3g} at the median."
    )


def notes(known: Known) -> tuple[str, ...]:
    """What a reader must be warned of."""
    noise, (low, high, _) = known.noise, known.band
    grown = noise.larger(np.array([low, high]))
    more = f", at {high:.3g} Hz {grown[1] / grown[0]:.2g} times that at {low:.3g} Hz" if noise.growth else ""
    said = [
        f"the promise holds for a noise of {noise.floor:.3g} m/s²/N in the real and in the imaginary part of"
        f" each accelerance and of {100 * noise.relative:.2g} % in the force{more}, and for parameters near"
        " those given"
    ]
    if known.settings is not None:
        said.append(
            "promised intervals include the stated uncertainty; postures, impacts and sensors were chosen"
            " without it"
        )
    if known.config_folder is None:
        said.append(
            "the paths in the study of the test are those of the fit's study: put it into the same folder"
        )
    return *said, *of_gap(known.gap, "for which this test is not planned")
