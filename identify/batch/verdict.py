"""What a batch has found, in sentences."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Texts
from identify.results.batch import DependenceTable, JobTable, ParametersByPosture
from identify.results.fit import FitResult

MEANING = (
    "A stiffness or damping of a joint does not know the posture: that it seems to is a sign of an effect"
    " that the model lacks or places elsewhere (bending of a link, compliance of the base or of the other"
    " axes, a balancer, a hose, friction), which the fit of each posture loads onto it"
)
_LEAST_FREEDOM = 5
_RISE = 1.1


def verdict(jobs: JobTable, dependence: DependenceTable, kept: int, seconds: float, workers: str) -> Texts:
    """What was done, how good the fits are, and whether a parameter depends on posture; kept: fits that were
    there from before.
    """
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
    return first, _quality(jobs), _dependence(dependence)


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


def _dependence(d: DependenceTable) -> str:
    tested = np.isfinite(d.p_value)
    if not tested.any():
        return "Whether a parameter depends on posture cannot be told: none is determined at two postures."
    found = _by_scatter(d)
    if not found:
        return (
            f"No parameter depends on posture, as far as the intervals of {tested.sum()} parameters can tell."
        )
    named = ", ".join(_told(d, row) for row in found[:3]) + (
        f" and {len(found) - 3} more" if len(found) > 3 else ""
    )
    depend = "depends" if len(found) == 1 else "depend"
    return (
        f"{len(found)} of {tested.sum()} parameters {depend} on posture more than the intervals allow:"
        f" {named}."
    )


def _told(d: DependenceTable, row: int) -> str:
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


def notes(jobs: JobTable, p: ParametersByPosture, d: DependenceTable, together: FitResult | None) -> Texts:
    """What a reader must be warned of."""
    said = []
    stiff = [row for row in _by_scatter(d) if p.log[row]]
    if stiff:
        said.append(MEANING)
    trends = [row for row in stiff if d.slope_p_value[row] < 0.01]
    if trends:
        row = trends[0]
        change = 100 * (np.exp(d.slope_per_rad[row] * np.deg2rad(10)) - 1)
        said.append(
            f"the clearest trend: {d.parameter[row]} changes by {change:+.2g} % for every 10° of joint"
            f" {d.trend_joint[row]}"
        )
    own = jobs.gap[np.isfinite(jobs.gap)]
    if together is not None and len(own) and np.isfinite(together.gap):
        rms = float(np.sqrt(np.mean(own**2)))
        worse = (
            "so one set of parameters does not do for all postures"
            if together.gap > _RISE * rms
            else "so one set does for all postures"
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
