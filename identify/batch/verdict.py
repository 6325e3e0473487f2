"""What a batch has found, in sentences."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Texts
from identify.results.batch import DependenceTable, JobTable, ParametersByPosture, PopulationTable
from identify.results.fit import FitResult

MEANING = (
    "Stiffness and damping of a joint do not depend on posture. If they seem to, an effect is missing from"
    " the model or acts elsewhere (bending of a link, compliance of the base or of the other axes, a"
    " balancer, a hose, friction), and the fit of each posture attributes it to the joint"
)
_LEAST_FREEDOM = 5
_RISE = 1.1


def population_verdict(p: PopulationTable | None) -> Texts:
    """Which parameters differ between fits, where all were taken together."""
    if p is None:
        return ()
    tested, size = np.isfinite(p.p_value) & ~p.shared, np.nan_to_num(p.relative_scatter, nan=-1.0)
    found = [int(k) for k in np.argsort(-size, kind="stable") if p.differs[k] and tested[k]]
    fits, count = int(p.count.max(initial=0)), int(tested.sum())
    if not found:
        return (
            f"Together, the {fits} fits differ in no parameter, as far as the intervals of {count} parameters"
            " can tell.",
        )
    named = [f"{p.parameter[k]} by {100 * size[k]:.2g} %" for k in found[:3]]
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    return (
        f"Together, the {fits} fits differ in {len(found)} of {count} parameters more than their intervals"
        f" allow (one standard deviation): {', '.join(named)}{more}.",
    )


def population_notes(p: PopulationTable | None) -> Texts:
    """What a reader of all fits together must know."""
    if p is None:
        return ()
    said = [
        f"{name} is stated to be the same in all fits, but they differ in it more than their intervals allow"
        for name, shared, differs in zip(p.parameter, p.shared, p.differs, strict=True)
        if shared and differs
    ]
    if p.common:
        said.append(
            f"{p.common} nuisance parameters of the robot are the same in all fits, which use one"
            " description: they do not average out, and the intervals of means count them once"
        )
    return tuple(said)


def verdict(jobs: JobTable, kept: int, seconds: float, workers: str) -> Texts:
    """What was done, and how good the fits are; kept: fits that were there from before."""
    done = sum(state == "done" for state in jobs.state)
    rest = [
        f"{jobs.state.count(state)} {word}"
        for state, word in (("failed", "failed"), ("waiting", "not begun"))
        if state in jobs.state
    ]
    rest += [f"{kept} {'was' if kept == 1 else 'were'} kept from before"] if kept else []
    first = (
        f"{done} of {len(jobs.state)} fits completed in {seconds:.0f} s on"
        f" {workers}{'; ' + ', '.join(rest) if rest else ''}."
    )
    return first, _quality(jobs)


def _quality(jobs: JobTable) -> str:
    known = np.isfinite(jobs.gap)
    if not known.any():
        return (
            "The noise of the data is not known, so how good the fits are can only be judged by their errors."
        )
    worst = int(np.nanargmax(jobs.gap))
    median, most = np.median(jobs.gap[known]), jobs.gap[worst]
    return (
        f"The residuals are {median:.2f} times the noise in the median and {most:.2f} times at worst"
        f" ({jobs.name[worst]})."
    )


def dependence_verdict(d: DependenceTable) -> str:
    """Whether a parameter depends on posture."""
    tested = np.isfinite(d.p_value)
    if not tested.any():
        return (
            "Whether a parameter depends on posture cannot be determined: none is determined at two postures."
        )
    found = _by_scatter(d)
    if not found:
        return (
            f"No parameter depends on posture, as far as the intervals of {tested.sum()} parameters can tell."
        )
    named = ", ".join(_dependence(d, row) for row in found[:3]) + (
        f" and {len(found) - 3} more" if len(found) > 3 else ""
    )
    depend = "depends" if len(found) == 1 else "depend"
    return (
        f"{len(found)} of {tested.sum()} parameters {depend} on posture more than the intervals allow:"
        f" {named}."
    )


def _dependence(d: DependenceTable, row: int) -> str:
    return (
        f"{d.parameter[row]} (scatter {100 * d.scatter[row]:.2g} %)"
        if d.scatter[row] > 0
        else d.parameter[row]
    )


def _by_scatter(d: DependenceTable) -> list[int]:
    """Parameters that depend on posture, the one that scatters most first."""
    return [
        int(row) for row in np.argsort(-np.nan_to_num(d.scatter, nan=-1.0), kind="stable") if d.depends[row]
    ]


def dependence_notes(p: ParametersByPosture, d: DependenceTable) -> Texts:
    """What a dependence on posture means."""
    stiff = [row for row in _by_scatter(d) if p.log[row]]
    if not stiff:
        return ()
    trends = [row for row in stiff if d.slope_p_value[row] < 0.01]
    if not trends:
        return (MEANING,)
    row = trends[0]
    change = 100 * (np.exp(d.slope_per_rad[row] * np.deg2rad(10)) - 1)
    return (
        MEANING,
        f"the clearest trend: {d.parameter[row]} changes by {change:+.2g} % for every 10° of joint"
        f" {d.trend_joint[row]}",
    )


def notes(jobs: JobTable, d: DependenceTable, together: FitResult | None) -> Texts:
    """What a reader must be warned of."""
    said = []
    own = jobs.gap[np.isfinite(jobs.gap)]
    if together is not None and len(own) and np.isfinite(together.gap):
        rms = float(np.sqrt(np.mean(own**2)))
        worse = (
            "so one set of parameters does not describe all postures"
            if together.gap > _RISE * rms
            else "so one set describes all postures"
        )
        said.append(
            f"fitted together the residual is {together.gap:.2f} times the noise, each on its own {rms:.2f}"
            f" times, {worse}"
        )
    if 0 < int(d.freedom.max(initial=0)) < _LEAST_FREEDOM:
        said.append(f"with {int(d.freedom.max()) + 1} postures the test finds only large differences")
    slow = sum(s == "done" and not c for s, c in zip(jobs.state, jobs.converged, strict=True))
    if slow:
        said.append(f"{slow} fits did not converge: see the table")
    return tuple(said)
