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
    enough for one of these rules.  rival, rival_log_odds, rival_part: see `rivals`.
    parsimony: options that explain at least this part of what the best one explains are alike, and the
    smallest of them is taken; None: the likeliest.
    many: an effect with this many parameters can stand for many things, and is looked for anew at the end.
    persistent: whether, where nothing of what was refitted is admitted, what promises less is refitted too.
    prune_each, rivals_each: whether effects are pruned, and rivals looked for, at every addition or in the
    end.
    """

    admit: Rule
    retain: tuple[Rule, ...]
    rival: Rule = ANY
    rival_log_odds: float = 5.0
    rival_part: float = -math.inf
    parsimony: float | None = None
    many: int = 8
    persistent: bool = False
    prune_each: bool = False
    rivals_each: bool = True
