"""The result of an explained motion as it is kept in its HDF5 file (layout and writer:
`identify.results.file`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

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

    name: Annotated[Texts, "name"]
    kind: Annotated[Texts, "name"]
    sentence: Annotated[Texts, "name"]
    evidence: Annotated[Array, "name"]
    chance: Annotated[Array, "name"]
    share: Annotated[Array, "name joints"]
    rivals: Annotated[Texts, "name"]
    reading: Annotated[Texts, "name"]


@dataclass(frozen=True)
class StepTable:
    """How they were found (s): share (s, joints) of what was still left on the judging record, evidence then,
    RMS left (s, joints).
    """

    name: Annotated[Texts, "name"]
    evidence: Annotated[Array, "name"]
    share: Annotated[Array, "name joints"]
    rms_fit: Annotated[Array, "name joints", "$unit"]
    rms_judge: Annotated[Array, "name joints", "$unit"]


@dataclass(frozen=True)
class ValueTable:
    """Values (v) with their 95 % intervals, and the same fitted to the judging record alone; at_edge: at an
    end of the range searched.
    """

    effect: Annotated[Texts, "value_row"]
    name: Annotated[Texts, "value_row"]
    unit: Annotated[Texts, "value_row"]
    value: Annotated[Array, "value_row", "$unit"]
    low_95: Annotated[Array, "value_row", "$unit"]
    high_95: Annotated[Array, "value_row", "$unit"]
    other: Annotated[Array, "value_row", "$unit"]
    other_low_95: Annotated[Array, "value_row", "$unit"]
    other_high_95: Annotated[Array, "value_row", "$unit"]
    at_edge: Annotated[NDArray[np.bool_], "value_row"]


@dataclass(frozen=True)
class BoundTable:
    """Effects that were tried and not found (b): the value each would have, and its 95 % interval."""

    effect: Annotated[Texts, "effect"]
    unit: Annotated[Texts, "effect"]
    value: Annotated[Array, "effect", "$unit"]
    low_95: Annotated[Array, "effect", "$unit"]
    high_95: Annotated[Array, "effect", "$unit"]


@dataclass(frozen=True)
class Curves:
    """One record: (samples, joints) measured, from what is known alone, and with all effects; used: samples
    that count.
    """

    name: str
    use: str
    time_s: Annotated[Array, "time_s"]
    measured: Annotated[Array, "time_s joints", "$unit"]
    known: Annotated[Array, "time_s joints", "$unit"]
    explained: Annotated[Array, "time_s joints", "$unit"]
    used: Annotated[NDArray[np.bool_], "time_s joints"]


@dataclass(frozen=True)
class Unseen:
    """A record that was neither fitted nor judged by: RMS residual (joints,) before and with the effects."""

    rms_start: Annotated[Array, "joints", "$unit"]
    rms: Annotated[Array, "joints", "$unit"]

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

    fitted: Annotated[Texts, "pair"] = ()
    judge: Annotated[Texts, "pair"] = ()
    effect: Annotated[Texts, "effect"] = ()
    rms_start: Annotated[Array, "pair joints", "$unit"] = field(default_factory=lambda: np.zeros((0, 0)))
    rms: Annotated[Array, "pair joints", "$unit"] = field(default_factory=lambda: np.zeros((0, 0)))
    share: Annotated[Array, "pair effect"] = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def explained(self) -> Array:
        """Part of the judge's sum of squares that the effects take away, (p, joints)."""
        return 1 - (self.rms / self.rms_start) ** 2


@dataclass(frozen=True)
class Glossary:
    """What the names of all effects that were tried mean, in words (n)."""

    name: Annotated[Texts, "name"] = ()
    sentence: Annotated[Texts, "name"] = ()


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
    joints: Annotated[NDArray[np.int_], "joints"]
    rms_fit_start: Annotated[Array, "joints", "$unit"]
    rms_fit: Annotated[Array, "joints", "$unit"]
    rms_judge_start: Annotated[Array, "joints", "$unit"]
    rms_judge: Annotated[Array, "joints", "$unit"]
    noise: Annotated[Array, "joints", "$unit"]
    tried: int
    effects: EffectTable
    steps: StepTable
    values: ValueTable
    bounds: BoundTable
    curves: dict[str, Curves]
    tests: dict[str, Unseen] = field(default_factory=dict)
    glossary: Glossary = field(default_factory=Glossary)
    body_errors: Annotated[Array, "combination"] = field(default_factory=lambda: np.zeros(0))
    pairs: PairTable = field(default_factory=PairTable)
    warnings: Annotated[Texts, "warning"] = ()

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
    unknown: Annotated[Texts, "unknown"]
    conditioning: Annotated[Texts, "conditioning"]
    targets: dict[str, TargetResult]
