"""Rigid-body base parameters by least squares: torque of recorded motion against the columns of
`identify.joints.base_set`.

Joints are weighted by what is left of each (Gautier 1997) in a second pass; speed and acceleration come from
behind the low-pass of the study, torques are as recorded.  Where a rotor's inertia cannot be told from a
link's, it goes to the link's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from identify.core.arrays import Array, Mask
from identify.core.errors import InputError
from identify.core.separable import eliminate
from identify.joints.base import Curve
from identify.joints.base_set import UNITS, BaseSet, all_columns, of_robot, standard_names, standard_values
from identify.joints.coupling import coupling_asked, moving
from identify.joints.data import JointTestData
from identify.joints.intervals import in_time, symmetric, table
from identify.measured.conditioning import ConditionedMotion
from identify.results.joints import CurveResult, Panel, Series
from identify.robot.description import Robot

_WORSE = 1.5
"""RMS of what is left of a run that was not fitted, over that of the fitted ones, from which a reader is
warned.
"""


@dataclass(frozen=True)
class _Run:
    """columns (samples, rows, base parameters); torque less that of known rotors, and samples that count,
    (samples, rows).
    """

    motion: ConditionedMotion
    columns: Array
    torque: Array
    used: Mask


class BaseParameters(Curve):
    """Motion of the whole arm."""

    kind: Literal["base-parameters"]
    joints: list[int] | None = Field(None, description="the joints whose torques are used; default: all")
    judge: list[Path] = Field([], description="runs that are not fitted, to judge by")
    rotor_inertia_kg_m2: list[float] | None = Field(
        None, description="at the motor, where it is known; default: identified"
    )

    def identify(self, bench: JointTestData) -> CurveResult:
        """Base parameters, friction and offsets."""
        robot = bench.rigid(self.label)
        rows = [bench.checked(joint, self.label) for joint in self.joints or range(1, bench.joints + 1)]
        chosen = of_robot(robot, rows, self.rotor_inertia_kg_m2 is None, bench.coupling)
        runs, judges = (
            [self._run(bench, robot, rows, chosen, path) for path in paths]
            for paths in (self.files, self.judge)
        )
        columns, torque, used = (
            np.concatenate([getattr(run, what) for run in runs]) for what in ("columns", "torque", "used")
        )
        if not used.any(axis=0).all():
            raise InputError(
                self.label, "a joint that stands all the time", "motion of every joint in use", "see `joints`"
            )
        values, weights = _weighted(columns, torque, used)
        left = np.where(used, torque - columns @ values, 0.0)
        rows_used = (columns * weights[:, None])[used]
        _, half = in_time(columns * weights[None, :, None], left * weights, used)
        found = [
            symmetric(
                chosen.names[n],
                UNITS[chosen.names[n].rsplit(".", 1)[1]],
                value,
                reach,
                expected=expected,
                meaning=meaning,
            )
            for n, value, reach, expected, meaning in zip(
                chosen.kept, values, half, _expected(robot, chosen), chosen.meanings, strict=True
            )
        ]
        said = (
            f"{len(values)} base parameters, {used.sum()} torques; condition of the columns"
            f" {_condition(rows_used):.3g}"
        )
        judged = [(run, "") for run in runs] + [(run, ", not fitted") for run in judges]
        panels = {
            f"{run.motion.name}, joint {row + 1}{how}": _panel(run, values, n)
            for run, how in judged
            for n, row in enumerate(rows)
        }
        texts = (said, *(_rest(run, values, rows, how) for run, how in judged), *runs[0].motion.said)
        rms = float(np.sqrt((left[used] ** 2).mean()))
        notes = _warned(judges, values, rms)
        if bench.coupling is None:
            motions = [run.motion for run in runs]
            notes += coupling_asked(motions, rows, columns, torque, used, weights)
        return CurveResult(
            "Rigid-body base parameters",
            self.kind,
            "N m",
            rms,
            int(used.sum()),
            table(found),
            panels,
            texts,
            notes,
        )

    def _run(
        self, bench: JointTestData, robot: Robot, rows: Sequence[int], chosen: BaseSet, path: Path
    ) -> _Run:
        motion = bench.motion(
            path, ("motor_position", bench.torque_quantity()), range(bench.joints), self.label
        )
        history = motion.position, motion.velocity, motion.acceleration
        columns = all_columns(robot, rows, *history, bench.coupling)[:, :, list(chosen.kept)]
        torque = motion.torque[:, rows].copy()
        if self.rotor_inertia_kg_m2 is not None:
            if len(self.rotor_inertia_kg_m2) != bench.joints:
                found = f"{len(self.rotor_inertia_kg_m2)} numbers"
                raise InputError(
                    f"{self.label}, key rotor_inertia_kg_m2", found, f"{bench.joints}, one per joint"
                )
            turns = np.eye(bench.joints) if bench.coupling is None else bench.coupling
            drives = (
                bench.gear_ratio**2 * np.array(self.rotor_inertia_kg_m2) * (motion.acceleration @ turns.T)
            )
            torque -= (drives @ turns)[:, rows]
        return _Run(motion, columns, torque, moving(motion, rows, bench))


def _weighted(columns: Array, torque: Array, used: Mask) -> tuple[Array, Array]:
    """Values (b,), joints weighted by one over what the first pass leaves of each, and the weights
    (rows,).
    """
    weights = np.ones(torque.shape[1])
    for _ in range(2):
        values = eliminate((columns * weights[:, None])[used], (torque * weights)[used]).coefficients
        left = np.where(used, torque - columns @ values, 0.0)
        final, weights = weights, 1 / np.maximum(np.sqrt((left**2).sum(axis=0) / used.sum(axis=0)), 1e-12)
    return values, final


def _expected(robot: Robot, chosen: BaseSet) -> Array:
    """What the robot's description says of the base parameters; NaN where friction, a rotor or a body that is
    not known is in them.
    """
    unknown = {link.name for link in robot.links if not (link.mass and np.any(link.inertia))}
    names = standard_names(robot)
    stated = np.where([name.rsplit(".", 1)[0] in unknown for name in names], np.nan, standard_values(robot))
    known = np.concatenate([stated, np.full(len(chosen.names), np.nan)])[: len(chosen.names)]
    return np.array([np.sum(row[row != 0] * known[row != 0]) for row in chosen.regrouping])


def _condition(rows: Array) -> float:
    """Largest over smallest singular value of columns of one length."""
    sizes = np.linalg.svd(rows / np.sqrt((rows**2).sum(axis=0)), compute_uv=False)
    return float(sizes[0] / sizes[-1])


def _rest(run: _Run, values: Array, rows: Sequence[int], judged: str) -> str:
    """What is left of each joint's torque."""
    left = run.torque - run.columns @ values
    parts = []
    for place, row in enumerate(rows):
        used = run.used[:, place]
        rms, whole = float(np.sqrt((left[used, place] ** 2).mean())), float(run.torque[used, place].std())
        parts.append(f"joint {row + 1} {rms:.3g} N m ({100 * rms / whole:.2g} % of its standard deviation)")
    return f"{run.motion.name}{judged}, RMS left: {', '.join(parts)}"


def _warned(judges: Sequence[_Run], values: Array, rms: float) -> tuple[str, ...]:
    """A note for each run that is not foretold about as well as those that were fitted."""
    left = {run.motion.name: (run.torque - run.columns @ values)[run.used] for run in judges}
    worse = {name: float(np.sqrt((one**2).mean())) / rms for name, one in left.items()}
    fix = (
        "the fitted motion excites too little, and what looks like values there fits what is not in the model"
    )
    return tuple(
        f"{name}, not fitted, is foretold {ratio:.2g} times worse; {fix}"
        for name, ratio in worse.items()
        if ratio > _WORSE
    )


def _panel(run: _Run, values: Array, place: int) -> Panel:
    used, time_s = run.used[:, place], run.motion.time_s
    measured, model = (
        np.where(used, torque, np.nan) for torque in (run.torque[:, place], (run.columns @ values)[:, place])
    )
    return Panel(
        "Time",
        "s",
        "Torque",
        "N m",
        {"measured": Series("noisy", time_s, measured), "identified": Series("line", time_s, model)},
    )
