"""The result of `identify batch`: all fits of a batch side by side, as kept in its HDF5 file (layout and
writer: `identify.results.file`).

The fits themselves are in files of their own; n fits, p parameters, m modes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, Texts
from identify.results.header import Header


@dataclass(frozen=True)
class JobTable:
    """One row per fit, in the order of the batch; numbers are NaN where it failed.

    posture_deg (n, joints) and tool_m (n, 3), the last measurement point in the base's axes; relative_error:
    |difference| over |measured| of all FRFs.
    """

    name: Texts
    state: Texts
    error: Texts
    file: Texts
    attempts: NDArray[np.int_]
    seconds: Array
    converged: NDArray[np.bool_]
    gap: Array
    cost: Array
    relative_error: Array
    posture_deg: Array
    tool_m: Array


@dataclass(frozen=True)
class ParametersByPosture:
    """Fitted values (n, p) with their intervals; std of ln value where log, else of the value; usable: free,
    determined enough and off its bounds.  joint_*: of all postures together (p,), None where that was not
    asked for.
    """

    name: Texts
    unit: Texts
    log: NDArray[np.bool_]
    value: Array
    std: Array
    low_95: Array
    high_95: Array
    usable: NDArray[np.bool_]
    joint_value: Array | None
    joint_low_95: Array | None
    joint_high_95: Array | None


@dataclass(frozen=True)
class ModesByPosture:
    """Modes of the fitted models (n, m) by frequency, and the measured ones paired with them, NaN where there
    is none.
    """

    frequency_hz: Array
    damping_ratio: Array
    measured_frequency_hz: Array
    measured_damping_ratio: Array


@dataclass(frozen=True)
class DependenceTable:
    """Whether each parameter is the same at all postures (`identify.batch.homogeneity`); a row per parameter,
    NaN where it cannot be determined.

    mean and its limits in the parameter's unit; scatter and slope per rad of ln value where log, else of the
    value; trend_joint from 1, 0: none; p_value of chi_square is adjusted for the number of parameters (Holm);
    depends: it is less than 1 %.
    """

    parameter: Texts
    count: NDArray[np.int_]
    mean: Array
    mean_low_95: Array
    mean_high_95: Array
    chi_square: Array
    freedom: NDArray[np.int_]
    p_value: Array
    scatter: Array
    trend_joint: NDArray[np.int_]
    slope_per_rad: Array
    slope_std: Array
    slope_p_value: Array
    depends: NDArray[np.bool_]


@dataclass(frozen=True)
class PopulationTable:
    """All fits together (`identify.batch.population`); a row per parameter (p), NaN where it cannot be
    determined.

    mean and its limits in the parameter's unit; scatter between fits and its limits as the standard deviation
    of ln value where log, else of the value, NaN of those that are shared; p_value of no difference, adjusted
    for the number of parameters (Holm); differs: it is less than 1 %.  value, low_95, high_95 (n, p): of each
    fit with what all others say.  common: how many nuisance parameters all fits have in common.
    """

    parameter: Texts
    log: NDArray[np.bool_]
    shared: NDArray[np.bool_]
    count: NDArray[np.int_]
    mean: Array
    mean_low_95: Array
    mean_high_95: Array
    scatter: Array
    scatter_low_95: Array
    scatter_high_95: Array
    p_value: Array
    differs: NDArray[np.bool_]
    value: Array
    low_95: Array
    high_95: Array
    common: int

    @property
    def relative_scatter(self) -> Array:
        """(p,): over the mean."""
        return np.asarray(np.where(self.log, 1.0, 1 / np.abs(self.mean)) * self.scatter)


@dataclass(frozen=True, kw_only=True)
class BatchResult(Header):
    """A whole batch; verdict and notes are sentences; workers says who did it; joint_file: the result of the
    joint fit, empty without; population: None where fits were not asked to be taken together.
    """

    KIND: ClassVar[str] = "batch"
    workers: str
    joint_file: str
    joint_gap: float
    jobs: JobTable
    parameters: ParametersByPosture
    modes: ModesByPosture
    dependence: DependenceTable
    population: PopulationTable | None = None

    @property
    def failed(self) -> int:
        """How many fits failed."""
        return sum(state == "failed" for state in self.jobs.state)

    @property
    def complete(self) -> bool:
        """Whether every fit completed."""
        return not self.failed
