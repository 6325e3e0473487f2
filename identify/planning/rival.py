"""Another model of the same robot and data, from which a test is to tell the fitted one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.planning.information import FreeModel
from identify.planning.known import Known, known_of

_NOTHING = 1e-9
"""Of the information on the difference, what is known of it beforehand: nearly nothing."""


@dataclass(frozen=True)
class Rival:
    """name: what it has and the fitted model has not, in words; known: the same as of the fit."""

    name: str
    known: Known

    @property
    def model(self) -> FreeModel:
        """The model with its free parameters."""
        return self.known.free_model

    def before(self, known: Known, anew: bool, difference: Array) -> Array:
        """(u, u): what is known of the parameters of both before the test; difference (): the information on
        the difference in the candidates, of which next to nothing is known.
        """
        last = np.atleast_2d(_NOTHING * difference)
        return np.asarray(scipy.linalg.block_diag(known.before(anew), self.known.before(anew), last))


def rival_of(known: Known, path: Path) -> Rival:
    """The rival of a fit; InputError for a file that is neither fit nor discovery, another robot, and the
    same effects.
    """
    other = known_of(path, known.noise.floor, float(known.band[2]), known.noise.relative)
    points, own = other.model.points, known.model.points
    same = points.keys() == own.keys() and all(points[node].link == own[node].link for node in own)
    if not same or len(other.model.robot.joints) != len(known.model.robot.joints):
        raise InputError(f"--rival {path}", "another robot, or other points", "a fit of the same ones")
    mine, its = ([effect.sentence() for effect in one.model.effects] for one in (known, other))
    if mine == its:
        raise InputError(f"--rival {path}", "the same effects", "a fit with another effect")
    more, less = ([one for one in some if one not in rest] for some, rest in ((its, mine), (mine, its)))
    said = f"the model with {', '.join(more)}" if more else f"the model without {', '.join(less)}"
    return Rival(said, other)
