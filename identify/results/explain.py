"""The result of an explained motion as it is kept in its HDF5 file (layout and writer:
`identify.results.file`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Texts
from identify.results.header import KeyedHeader


@dataclass(frozen=True)
class EffectTable:
    """The effects found (e), by evidence: what each is worth on the judging record when all others stay.

    share (e, joints): part of the sum of squares that would remain without it, NaN where it does not act;
    chance: of no mean gain; rivals: other effects that would do about as well in its place, as a list in
    words; reading: its values in the field's own terms.
    """

    name: Texts
    kind: Texts
    sentence: Texts
    evidence: Array
    chance: Array
    share: Array
    rivals: Texts
    reading: Texts


@dataclass(frozen=True)
class StepTable:
    """How they were found (s): share (s, joints) of what was still left on the judging record, evidence then,
    RMS left (s, joints).
    """

    name: Texts
    evidence: Array
    share: Array
    rms_fit: Array
    rms_judge: Array


@dataclass(frozen=True)
class ValueTable:
    """Values (v) with their 95 % intervals, and the same fitted to the judging record alone; at_edge: at an
    end of the range searched.
    """

    effect: Texts
    name: Texts
    unit: Texts
    value: Array
    low_95: Array
    high_95: Array
    other: Array
    other_low_95: Array
    other_high_95: Array
    at_edge: NDArray[np.bool_]


@dataclass(frozen=True)
class BoundTable:
    """Effects that were tried and not found (b): the value each would have, and its 95 % interval."""

    effect: Texts
    unit: Texts
    value: Array
    low_95: Array
    high_95: Array


@dataclass(frozen=True)
class Curves:
    """One record: (samples, joints) measured, from what is known alone, and with all effects; used: samples
    that count.
    """

    name: str
    use: str
    time_s: Array
    measured: Array
    known: Array
    explained: Array
    used: NDArray[np.bool_]


@dataclass(frozen=True)
class Unseen:
    """A record that was neither fitted nor judged by: RMS residual (joints,) before and with the effects."""

    rms_start: Array
    rms: Array

    @property
    def explained(self) -> Array:
        """Part of its sum of squares that the effects take away, (joints,)."""
        return 1 - (self.rms / self.rms_start) ** 2


@dataclass(frozen=True)
class PairTable:
    """The effects found (e), fitted to one record and judged by another, for every pair of records (p).

    fitted, judge: names of the records; effect: names; rms_start, rms (p, joints): on the judge, before and
    with them; share (p, e): part of the judge's squares, over all joints that it touches, that each takes
    away as it was fitted, all else the same.
    """

    fitted: Texts = ()
    judge: Texts = ()
    effect: Texts = ()
    rms_start: Array = field(default_factory=lambda: np.zeros((0, 0)))
    rms: Array = field(default_factory=lambda: np.zeros((0, 0)))
    share: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def explained(self) -> Array:
        """Part of the judge's sum of squares that the effects take away, (p, joints)."""
        return 1 - (self.rms / self.rms_start) ** 2


@dataclass(frozen=True)
class Glossary:
    """What the names of all effects that were tried mean, in words (n)."""

    name: Texts = ()
    sentence: Texts = ()


@dataclass(frozen=True)
class TargetResult:
    """One kind of history explained.  RMS and noise are in `unit`, (joints,), *_start: before any effect;
    tried: number of candidates; tests: by name, the records that nothing depended on;
    warnings: what a reader must know before he believes any of it;
    body_errors (k,): combinations of errors of stated bodies, in stated standard deviations; pairs: every
    record judged by every other one.
    """

    target: str
    unit: str
    joints: NDArray[np.int_]
    rms_fit_start: Array
    rms_fit: Array
    rms_judge_start: Array
    rms_judge: Array
    noise: Array
    tried: int
    effects: EffectTable
    steps: StepTable
    values: ValueTable
    bounds: BoundTable
    curves: dict[str, Curves]
    tests: dict[str, Unseen] = field(default_factory=dict)
    glossary: Glossary = field(default_factory=Glossary)
    body_errors: Array = field(default_factory=lambda: np.zeros(0))
    pairs: PairTable = field(default_factory=PairTable)
    warnings: Texts = ()

    def words(self, names: str) -> str:
        """One name, or a list of them, in a few words; as they are where an older file does not say."""
        known = dict(zip(self.glossary.name, self.glossary.sentence, strict=True))
        said = (known.get(name, name) for name in names.split(", "))
        return "; ".join(sentence.split(" (")[0].split(": ")[0] for sentence in said)

    @property
    def gap_start(self) -> Array:
        """RMS residual over noise on the judging record before any effect, (joints,)."""
        return self.rms_judge_start / self.noise

    @property
    def gap(self) -> Array:
        """RMS residual over noise on the judging record, (joints,)."""
        return self.rms_judge / self.noise

    @property
    def explained(self) -> Array:
        """Part of the sum of squares on the judging record that the effects take away, (joints,)."""
        return 1 - (self.rms_judge / self.rms_judge_start) ** 2


@dataclass(frozen=True, kw_only=True)
class ExplainResult(KeyedHeader):
    """A whole run; verdict, notes, unknown (what these data cannot say) and conditioning (what was done to
    the records) are sentences.
    """

    KIND: ClassVar[str] = "explained"
    key: str = ""
    unknown: Texts
    conditioning: Texts
    targets: dict[str, TargetResult]
