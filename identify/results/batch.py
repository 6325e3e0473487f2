"""The result of `identify batch`: all fits of a batch side by side, as kept in its HDF5 file (layout and
writer: `identify.results.file`).

The fits themselves are in files of their own; n fits, p parameters, m modes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

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

    name: Annotated[Texts, "name"]
    state: Annotated[Texts, "name"]
    error: Annotated[Texts, "name"]
    file: Annotated[Texts, "name"]
    attempts: Annotated[NDArray[np.int_], "name"]
    seconds: Annotated[Array, "name"]
    converged: Annotated[NDArray[np.bool_], "name"]
    gap: Annotated[Array, "name"]
    cost: Annotated[Array, "name"]
    relative_error: Annotated[Array, "name"]
    posture_deg: Annotated[Array, "name joint"]
    tool_m: Annotated[Array, "name axis"]


@dataclass(frozen=True)
class ParametersByPosture:
    """Fitted values (n, p) with their intervals; std of ln value where log, else of the value; usable: free,
    determined enough and off its bounds.  joint_*: of all postures together (p,), None where that was not
    asked for.
    """

    name: Annotated[Texts, "name"]
    unit: Annotated[Texts, "name"]
    log: Annotated[NDArray[np.bool_], "name"]
    value: Annotated[Array, "fit name", "$unit"]
    std: Annotated[Array, "fit name", "see log"]
    low_95: Annotated[Array, "fit name", "$unit"]
    high_95: Annotated[Array, "fit name", "$unit"]
    usable: Annotated[NDArray[np.bool_], "fit name"]
    joint_value: Annotated[Array | None, "name", "$unit"]
    joint_low_95: Annotated[Array | None, "name", "$unit"]
    joint_high_95: Annotated[Array | None, "name", "$unit"]


@dataclass(frozen=True)
class ModesByPosture:
    """Modes of the fitted models (n, m) by frequency, and the measured ones paired with them, NaN where there
    is none.
    """

    frequency_hz: Annotated[Array, "fit mode"]
    damping_ratio: Annotated[Array, "fit mode"]
    measured_frequency_hz: Annotated[Array, "fit mode"]
    measured_damping_ratio: Annotated[Array, "fit mode"]


@dataclass(frozen=True)
class DependenceTable:
    """Whether each parameter is the same at all postures (`identify.batch.population`); a row per parameter,
    NaN where it cannot be determined.

    mean and its limits in the parameter's unit; scatter and slope per rad of ln value where log, else of the
    value; trend_joint from 1, 0: none; p_value of chi_square is adjusted for the number of parameters (Holm);
    depends: it is less than 1 %.
    """

    parameter: Annotated[Texts, "parameter"]
    count: Annotated[NDArray[np.int_], "parameter"]
    mean: Annotated[Array, "parameter", "see ../parameters/unit"]
    mean_low_95: Annotated[Array, "parameter", "see ../parameters/unit"]
    mean_high_95: Annotated[Array, "parameter", "see ../parameters/unit"]
    chi_square: Annotated[Array, "parameter"]
    freedom: Annotated[NDArray[np.int_], "parameter"]
    p_value: Annotated[Array, "parameter"]
    scatter: Annotated[Array, "parameter", "see ../parameters/log"]
    trend_joint: Annotated[NDArray[np.int_], "parameter"]
    slope_per_rad: Annotated[Array, "parameter"]
    slope_std: Annotated[Array, "parameter", "1/rad"]
    slope_p_value: Annotated[Array, "parameter"]
    depends: Annotated[NDArray[np.bool_], "parameter"]


@dataclass(frozen=True)
class PopulationTable:
    """All fits together (`identify.batch.population`); a row per parameter (p), NaN where it cannot be
    determined.

    mean and its limits in the parameter's unit; scatter between fits and its limits as the standard deviation
    of ln value where log, else of the value, NaN of those that are shared; p_value of no difference, adjusted
    for the number of parameters (Holm); differs: it is less than 1 %.  value, low_95, high_95 (n, p): of each
    fit with what all others say.  common: how many nuisance parameters all fits have in common.
    """

    parameter: Annotated[Texts, "parameter"]
    log: Annotated[NDArray[np.bool_], "parameter"]
    shared: Annotated[NDArray[np.bool_], "parameter"]
    count: Annotated[NDArray[np.int_], "parameter"]
    mean: Annotated[Array, "parameter", "see ../parameters/unit"]
    mean_low_95: Annotated[Array, "parameter", "see ../parameters/unit"]
    mean_high_95: Annotated[Array, "parameter", "see ../parameters/unit"]
    scatter: Annotated[Array, "parameter", "see log"]
    scatter_low_95: Annotated[Array, "parameter", "see log"]
    scatter_high_95: Annotated[Array, "parameter", "see log"]
    p_value: Annotated[Array, "parameter"]
    differs: Annotated[NDArray[np.bool_], "parameter"]
    value: Annotated[Array, "fit parameter", "see ../parameters/unit"]
    low_95: Annotated[Array, "fit parameter", "see ../parameters/unit"]
    high_95: Annotated[Array, "fit parameter", "see ../parameters/unit"]
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
