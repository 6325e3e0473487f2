"""The result of a simulated or fitted motion as it is kept in its HDF5 file (layout and writer:
`identify.results.file`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np

from identify.core.arrays import Array, Complex, Index, Texts
from identify.results.circular import CircularTest
from identify.results.header import KeyedHeader
from identify.results.tables import ParameterTable, StartTable


@dataclass(frozen=True)
class Trace:
    """A signal of all joints over the times of its record: values (samples, joints) in `unit`."""

    unit: str
    values: Annotated[Array, "tick column", "$unit"]


@dataclass(frozen=True)
class TrajectoryComparison:
    """A recorded signal (samples, joints; NaN where none) beside the simulated one and that of the start
    model (None: the same).

    rms (1 + phases, joints) over the whole record and each phase; noise: its standard deviation, NaN where
    the study says none.
    """

    unit: str
    time_s: Annotated[Array, "time_s"]
    measured: Annotated[Array, "time_s joints", "$unit"]
    initial: Annotated[Array | None, "time_s joints", "$unit"]
    simulated: Annotated[Array, "time_s joints", "$unit"]
    noise: Annotated[float, "", "$unit"]
    rms: Annotated[Array, "phases joints", "$unit"]
    rms_initial: Annotated[Array | None, "phases joints", "$unit"]


@dataclass(frozen=True)
class Glitches:
    """What the friction of single joints adds to the radial error of a circle behind each of their reversals
    (g,): number of the joint, from 1; angle about the centre, rad, at which it turns round; of the feedback
    and of the end the largest difference, m, that its friction makes there, outwards positive.
    """

    joint: Annotated[Index, "glitch"]
    angle: Annotated[Array, "glitch", "rad"]
    feedback: Annotated[Array, "glitch", "m"]
    end: Annotated[Array, "glitch", "m"]


@dataclass(frozen=True)
class ClosedLoopFrfs:
    """FRFs of joints in their closed loop in a posture, per torque of a motor at the gear output: velocity of
    motors, rad/s/(N m), and acceleration of links, rad/s^2/(N m), (lines, output, input), simulated and
    measured; joint: numbers of outputs and inputs, from 1.
    """

    start_deg: Annotated[Array, "joints"]
    joint: Annotated[Index, "excited"]
    frequency_hz: Annotated[Array, "frequency_hz"]
    velocity: Annotated[Complex, "frequency_hz output input", "rad/s/(N m)"]
    acceleration: Annotated[Complex | None, "frequency_hz output input", "rad/s^2/(N m)"]
    velocity_measured: Annotated[Complex | None, "frequency_hz output input", "rad/s/(N m)"]
    acceleration_measured: Annotated[Complex | None, "frequency_hz output input", "rad/s^2/(N m)"]


@dataclass(frozen=True)
class RecordResult:
    """One motion: signals by quantity at the controller's ticks, and what was recorded beside them; gap: RMS
    over noise, NaN without.

    phases: names, the first of them the whole record; phase_s (phases, 2). paths: of a tool that is led, its
    places (samples, 3) at the ticks by what they are (command, feedback, end); circles: the circular test of
    each. fed: torques and currents that the recorded motion takes by inverse dynamics, beside those recorded.
    """

    name: str
    use: str
    file: str
    sha256: str
    start_deg: Annotated[Array, "joints"]
    time_s: Annotated[Array, "tick"]
    signals: dict[str, Trace]
    comparisons: dict[str, TrajectoryComparison]
    phases: Annotated[Texts, "phases"]
    phase_s: Annotated[Array, "phases end"]
    gap: float
    paths: dict[str, Trace] | None = None
    circles: dict[str, CircularTest] | None = None
    glitches: Glitches | None = None
    fed: dict[str, TrajectoryComparison] | None = None


@dataclass(frozen=True)
class TrialTable:
    """Effects that were tried, in their order (t): name, round, gap on fitted and on judging records,
    whether it stayed (1), and the odds for it (natural logarithm; NaN in files of old).
    """

    name: Annotated[Texts, "name"]
    round: Annotated[Array, "name"]
    gap: Annotated[Array, "name"]
    gap_validation: Annotated[Array, "name"]
    kept: Annotated[Array, "name"]
    log_odds: Annotated[Array, "name"] = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, kw_only=True)
class MotionResult(KeyedHeader):
    """A whole run. effects: sentences on what the model has; parameters, starts, trials: None where nothing
    was fitted.

    realtime_factor: seconds of motion per second of computing, all records side by side; free: how many
    numbers a fit of the study finds; study: the text of the better study that a search for missing effects
    ends with, empty where there is none; searched: whether this is such a search; frfs: of excited records,
    by the names of those that they come from.
    """

    KIND: ClassVar[str] = "motion"
    seed: int
    effects: Annotated[Texts, "effect"]
    joints: Annotated[Texts, "joints"]
    step_s: float
    period_s: float
    realtime_factor: float
    gap: float
    gap_validation: float
    converged: bool
    parameters: ParameterTable | None
    correlation: Annotated[Array | None, "free_number free_again"]
    starts: StartTable | None
    history: Annotated[Array | None, "progress progress_column", "see documentation"]
    trials: TrialTable | None
    records: dict[str, RecordResult]
    free: int = 0
    study: str = ""
    searched: bool = False
    frfs: dict[str, ClosedLoopFrfs] = field(default_factory=dict)
