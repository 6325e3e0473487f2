"""Files that do not agree on one drive, as with a brake on in one of them: each file is explained by the same
arm, but for the stiffness and damping of a single joint.

No key of a study says so, because what a brake holds is not the drive that the others have: the file is kept
apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.thresholds import MISSING
from identify.setup.decide import LEFT
from identify.setup.edits import Edit
from identify.setup.score import SLIGHT, Score, scored
from identify.setup.soft import softened
from identify.setup.stated import Stated
from identify.setup.within import within
from identify.vibration.log_shape import frf_targets

_LEAST = float(np.log(1.5))
"""Logarithm of a ratio of stiffnesses: drives differ less from posture to posture."""


@dataclass(frozen=True)
class Brake:
    """number: of the measurement; joint: from 1; ratio: how many times as stiff its drive is there as in the
    others; share: of the squares of that file that are left; count: of its FRFs; others: the fit of them;
    alone, both: the fit of the file with that drive, and with another file without.
    """

    number: int
    joint: int
    ratio: float
    share: float
    count: int
    others: Score
    alone: Score
    both: Score

    def likely(self, stated: Stated) -> Brake:
        """The same with the share that is left where nuisance parameters are fitted along."""
        if any(within(one, stated.uncertainty, MISSING).worst > MISSING for one in (self.others, self.alone)):
            return self
        alone, both = (within(one, stated.uncertainty).worst for one in (self.alone, self.both))
        return replace(self, share=(alone / both) ** 2)

    def sentence(self, stated: Stated) -> str:
        """What was found."""
        file = stated.study.measurements[self.number].source.name
        return (
            f"the drive of joint {self.joint} is {self.ratio:.2g} times as stiff in {file} as in the other"
            " files, and nothing else differs: was its brake on there, or off only there?"
        )

    @property
    def edit(self) -> Edit:
        """What keeps the file out of the fit."""
        return Edit(("measurements", self.number, "use"), "validate")


def brake(stated: Stated, first: Score) -> Brake | None:
    """The drive that leaves least in a file where it alone is another; None where the study has one file, or
    no drive leaves little.  Of two files it is the one where the drive is stiffer.
    """
    every = [one for number in stated.sets for one in _in(stated, first, number)]
    every = [one for one in every if abs(np.log(one.ratio)) > _LEAST]
    if every and stated.uncertainty is not None:
        joint = min(every, key=lambda one: one.share).joint
        every = [one.likely(stated) if one.joint == joint else one for one in every]
    found = [one for one in every if one.share <= LEFT]
    if not found:
        return None
    joint = min(found, key=lambda one: one.share).joint
    return max((one for one in found if one.joint == joint), key=lambda one: one.ratio)


def _in(stated: Stated, first: Score, number: int) -> Iterator[Brake]:
    """Every drive, in one file."""
    rest = stated.without(number)
    if not any(one.use == "fit" for one in rest.measured):
        return
    others = scored(rest.problem(), first.values)
    alone = replace(stated, sets={number: stated.sets[number]}).problem()
    two = replace(stated, sets=dict(list({number: stated.sets[number], **rest.sets}.items())[:2]))
    both = scored(two.problem(), first.values)
    before = _squares(both, 0)
    told = list(zip(alone.parameters, others.values, strict=True))
    for place in drives([p.name for p, _ in told]):
        name = told[place][0].name.removesuffix(".stiffness")
        parameters = tuple(p.at(float(value), free=p.name.startswith(f"{name}.")) for p, value in told)
        score = scored(replace(alone, parameters=parameters))
        if abs(score.level - others.level) < SLIGHT:
            ratio = float(score.values[place] / others.values[place])
            joint = int(name.partition(".")[0].removeprefix("joint"))
            share = _squares(score, 0) / before
            if share <= LEFT:  # else it does not matter what every spring explains
                share *= max(before / _squares(softened(both), 0), 1.0)
            count = len(score.squares(levelled=True)[0])
            yield Brake(number, joint, ratio, share, count, others, score, both)


def drives(names: Sequence[str]) -> list[int]:
    """Which of some parameters are stiffnesses of joints about their own axes: a base that turns about an
    axis of the same name has no brake.
    """
    return [n for n, name in enumerate(names) if name.startswith("joint") and name.endswith(".rz.stiffness")]


def _squares(score: Score, place: int) -> float:
    """What is left of a set, at the number of lines that it has, up to the common factor."""
    lines = len(frf_targets(score.problem)[place].data.frequency_hz)
    return float(score.squares(levelled=True)[place].sum()) / lines
