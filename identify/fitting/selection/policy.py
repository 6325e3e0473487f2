"""What an analysis asks of its effects: the thresholds of the loop, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass

from identify.fitting.selection.gain import Rule

ANY = Rule()
"""Anything that data which were not fitted confirm."""


@dataclass(frozen=True)
class Policy:
    """How an analysis selects.

    admit: what a candidate must gain to be chosen at all; retain: an effect stays where leaving it out loses
    enough for one of these rules.
    settle: what an addition must gain over the last model that was settled on
    to be settled on by itself; settle_several: the same for several additions that do not gain enough one by
    one (None: whatever is admitted).  rival, rival_log_odds, rival_part: see `rivals`.
    parsimony: options that explain at least this part of what the best one explains are alike, and the
    smallest of them is taken; None: the likeliest.  parsimony_below: only where the best one explains less
    than this, so that many parameters of one effect do not stand for others that are missing too.
    pair_below: pairs are tried where the best one explains less than this.
    most: additions at most; patience: how many unsettled additions are followed, because two effects of equal
    size hide each other, and beyond that where one together with another explains what settle_several asks;
    tentative: one that explains less, also together with another, is not even followed;
    nearly: once this much is explained, only what settles by itself is added, and other variants of what was
    added are tried.
    many: an effect with this many parameters can stand for many things, and is looked for anew at the end.
    prune_each, rivals_each: whether effects are pruned, and rivals looked for, at every addition or in the
    end.
    """

    admit: Rule
    retain: tuple[Rule, ...]
    settle: Rule | None = None
    settle_several: Rule | None = None
    rival: Rule = ANY
    rival_log_odds: float = 5.0
    rival_part: float = -math.inf
    parsimony: float | None = None
    parsimony_below: float = math.inf
    pair_below: float = -math.inf
    most: float = math.inf
    patience: int = 0
    tentative: float = 0.0
    nearly: float = math.inf
    many: int = 8
    prune_each: bool = False
    rivals_each: bool = True
