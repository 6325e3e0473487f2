"""What an explained motion says in sentences: what was found, what to be warned of, and what the records
cannot say.
"""

from __future__ import annotations

import numpy as np

from identify.explain.effects.base import MOTION_EFFECTS
from identify.results.explain import TargetResult

_OF = {
    "torque": "Motor torque",
    "deflection": "Motor-side minus link-side position",
    "tracking": "Tracking error (command minus motor position)",
}
_SCALE = {"N m": (1.0, "N m"), "rad": (1e3 * 180 / np.pi, "millidegrees")}
_SPRINGS = ("joint-compliance", "damped-compliance")
_FEW = 0.01
_CLOSE = 2.0


def verdict(found: TargetResult, judge: str) -> tuple[str, ...]:
    """Sentences on one target: how much is explained on the judging record and on those that nothing depended
    on, and by what, strongest evidence first.
    """
    scale, unit = _SCALE[found.unit]
    joints = ", ".join(f"{joint}" for joint in found.joints)
    before, after = (
        ", ".join(f"{scale * value:.3g}" for value in values)
        for values in (found.rms_judge_start, found.rms_judge)
    )
    taken = ", ".join(f"{100 * value:.3g}" for value in found.explained)
    if not found.effects.name:
        return (
            (
                f"{_OF[found.target]} of joints {joints}: nothing was found that explains more of record"
                f" {judge} (RMS {before} {unit})."
            ),
        )
    said = (
        f"{_OF[found.target]} of joints {joints}: RMS residual on record {judge} from {before} to {after}"
        f" {unit}, "
    )
    effects = "; ".join(found.effects.sentence)
    return (
        said + f"{taken} % of its squares explained.",
        *(_of_test(found, name) for name in found.tests),
        *_of_pairs(found),
        f"In order of evidence: {effects}.",
    )


def _of_test(found: TargetResult, name: str) -> str:
    scale, unit = _SCALE[found.unit]
    before, after, taken = (
        ", ".join(f"{factor * value:.3g}" for value in values)
        for factor, values in (
            (scale, found.tests[name].rms_start),
            (scale, found.tests[name].rms),
            (100.0, found.tests[name].explained),
        )
    )
    return f"On test record {name}: from {before} to {after} {unit}, {taken} %."


def _of_pairs(found: TargetResult) -> list[str]:
    """What the worst pair of records says."""
    if not len(found.pairs.fitted):
        return []
    least = ", ".join(f"{100 * value:.3g}" for value in found.pairs.explained.min(axis=0))
    return [f"Fitted to any one record and judged by any other, the same effects explain at least {least} %."]


def notes(found: TargetResult) -> list[str]:
    """Warnings: values at an end of their range, values that the two records disagree on, and a residual far
    above noise.
    """
    said = list(found.warnings)
    v = found.values
    for row in np.flatnonzero(v.at_edge):
        said.append(
            f"{found.words(v.effect[row])}: {v.name[row]} is at a limit of its search range, so the effect"
            " may stand for something else"
        )
    apart = np.flatnonzero((v.low_95 > v.other_high_95) | (v.high_95 < v.other_low_95))
    names = [
        f"{found.words(v.effect[row])} ({v.name[row]})" for row in apart if not _is_phase(found, int(row))
    ]
    if names:
        listed = "; ".join(names)
        said.append(
            f"{found.target}: the two records, fitted alone, disagree beyond their intervals on {listed};"
            " intervals are only as valid as the model"
        )
    said += _unconfirmed(found)
    moved = float(np.sqrt((found.body_errors**2).mean())) if len(found.body_errors) else 0.0
    if moved > _CLOSE:
        said.append(
            f"{found.target}: errors of rigid bodies are {moved:.2g} times as large as stated (RMS of"
            f" {len(found.body_errors)} combinations): state a larger `uncertainty`, or an effect is missing"
        )
    return said


def _unconfirmed(found: TargetResult) -> list[str]:
    """Effects that a pair of records does not confirm."""
    said = []
    for name, share in zip(found.pairs.effect, found.pairs.share.T, strict=True):
        pairs = [
            f"{found.pairs.judge[n]}, fitted to {found.pairs.fitted[n]}" for n in np.flatnonzero(share <= 0)
        ]
        if pairs:
            listed = "; ".join(pairs)
            said.append(f"{found.words(name)}: not confirmed by record {listed}")
    return said


def _behind_the_gear(found: TargetResult) -> list[str]:
    """Latencies beside springs, which friction behind the gear is like."""
    v = found.values
    at = {(name, what): value for name, what, value in zip(v.effect, v.name, v.value, strict=True)}
    said = []
    for joint in found.joints:
        latency = at.get((f"joint{joint}.sensor-latency", "latency"))
        soft = [at.get((f"joint{joint}.{kind}", "compliance")) for kind in _SPRINGS]
        if latency and (compliance := next(filter(None, soft), None)):
            said.append(
                f"whether the link-side sensor of joint {joint} is late, or viscous friction of"
                f" {latency / compliance:.3g} N m s/rad acts behind its gear: both look alike"
            )
    return said


def _is_phase(found: TargetResult, row: int) -> bool:
    """Whether a value is the cosine or sine of a harmonic, whose phase depends on where a record counts
    from.
    """
    number = found.effects.name.index(found.values.effect[row])
    kind = MOTION_EFFECTS.get(found.effects.kind[number])
    return kind.harmonic and found.values.name[row] in {c.name for c in kind.coefficients}


def unknown(found: TargetResult) -> list[str]:
    """What these records cannot say about one target."""
    said = []
    if found.target in ("torque", "deflection"):
        standing = [1 - curves.used.mean() for curves in found.curves.values()]
        said.append(
            f"the {found.target} at rest: {100 * np.mean(standing):.0f} % of the samples, where a joint"
            " stands, are left out, because friction of a joint at rest takes any value up to its breakaway"
            " torque"
        )
    for name, rivals in zip(found.effects.name, found.effects.rivals, strict=True):
        if rivals:
            others = " or ".join(found.words(rival) for rival in rivals.split(", "))
            said.append(
                f"whether it is {found.words(name)}, or {others}: these records do not tell them apart"
            )
    said += _behind_the_gear(found)
    unsure = [str(joint) for joint, noise in zip(found.joints, found.noise, strict=True) if np.isnan(noise)]
    if unsure:
        said.append(
            f"the noise of the {found.target} of joint {', '.join(unsure)}: it cannot be separated from a"
            " filtered or smooth signal, so there is no gap"
        )
    far = [
        f"joint {joint} ({gap:.2g})"
        for joint, gap in zip(found.joints, found.gap, strict=True)
        if gap > _CLOSE
    ]
    if far:
        said.append(
            f"what the rest of the {found.target} consists of: the residual exceeds the sample-to-sample"
            " noise (gap, 1 is noise) at " + ", ".join(far)
        )
    return said
