"""What bounds a test by itself, without a fit: FRFs that are no complex numbers, bodies that nobody measured,
drives that no arm has, and how heavy and long the arm is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from identify.core.text import listed
from identify.measured.finding import Finding
from identify.measured.frf_set import FrfSet
from identify.model.modes import complex_modes
from identify.robot.description import Robot
from identify.setup.score import Score

_FLAT = 1e-4
"""Share of its magnitude that an imaginary part has which is none."""
_ALIKE = 1e-6
_SAG = 1e-4
"""rad: how far drives of arms give way at least under the arm's own weight, g / (reach omega_1^2); rad/s
taken for Hz make less than a minute of arc of what is usual."""
_PLACEHOLDERS = 2


def size(robot: Robot) -> Finding:
    """What the arm weighs and how far it reaches, to be compared with its data sheet."""
    moving, whole = (sum(one.mass for one in links) for links in (robot.links[1:], robot.links))
    sentence = (
        f"The robot file has {whole:.4g} kg, of which {moving:.4g} kg move, and reaches {reach(robot):.3g} m"
        " from its second joint: does that agree with its data sheet?"
    )
    return Finding("info", "robot-total", (), sentence, whole)


def reach(robot: Robot) -> float:
    """From the second joint to the last link, stretched out, m."""
    return robot.stretched(2)


def placeholders(robot: Robot) -> Iterator[Finding]:
    """Links of different places with one and the same inertia or mass."""
    moving = [link for link in robot.links[1:] if link.mass > 0]
    alike = [
        link.name
        for link in moving
        if sum(np.allclose(link.inertia, other.inertia, rtol=_ALIKE, atol=0) for other in moving)
        > _PLACEHOLDERS
    ]
    if alike:
        sentence = (
            f"{listed(alike)} have the same inertia: placeholders?  Take them from CAD, or state in"
            " `uncertainty:` how far off they may be."
        )
        yield Finding("fail", "placeholder", (), sentence, len(alike))


def no_phases(data: FrfSet) -> Iterator[Finding]:
    """Magnitudes, decibels or real parts where complex numbers should be."""
    values = data.frf[np.isfinite(data.frf)]
    if not values.size or np.abs(values.imag).max() > _FLAT * np.abs(values).max():
        return
    real, check = values.real, "magnitude"
    if (real < 0).mean() > 0.9 or (np.abs(real) > 1).all():
        check, what = "decibels", "decibels (dB)"
    elif (real < 0).any():
        check, what = "real-part", "real parts alone"
    else:
        what = "magnitudes alone"
    sentence = (
        f"The FRFs have no phases: they are {what}, stored as complex numbers: export real and imaginary"
        " parts, or magnitudes and phases."
    )
    yield Finding("fail", check, (), sentence)


def sag(score: Score) -> float | None:
    """g over reach and the square of the first resonance of a fitted model, rad: how far the drives would
    give way under the arm's own weight; None where it has no resonance up to the highest line of the data,
    which then say how soft drives are at least, but not how stiff at most.
    """
    first = score.problem.measurements[0]
    modes = complex_modes(*first.system.matrices(score.values))
    highest = max(float(target.data.frequency_hz.max()) for target in score.problem.targets().frf)
    if not len(modes.frequency_hz) or modes.frequency_hz[0] > highest:
        return None
    length = max(reach(score.problem.robot), 1e-3)
    pull = float(np.linalg.norm(score.problem.robot.gravity)) or 9.81
    return pull / (length * (2 * np.pi * float(modes.frequency_hz[0])) ** 2)


def too_stiff(score: Score) -> bool:
    """Whether no drive is as stiff as the first resonance says, where the data have one."""
    found = sag(score)
    return found is not None and found < _SAG


def findings(robot: Robot, sets: Mapping[str, FrfSet]) -> list[tuple[str, Finding]]:
    """All of these, by name of measurement or empty for the study, but those of a fitted model."""
    found = [("", size(robot)), *(("", one) for one in placeholders(robot))]
    return [*found, *((name, one) for name, data in sets.items() for one in no_phases(data))]
