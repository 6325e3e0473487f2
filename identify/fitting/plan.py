"""The plan of a fit: its stages, each with what it minimises and which parameters it moves, and its starts.

A study writes a stage as one mapping, the keys of the optimizer beside those of the stage (`StageSettings`).
An analysis makes the `FitPlan` from its own data and models and hands it to `identify.fitting.fit`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Annotated, Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from identify.core.arrays import Array
from identify.core.config import FlatSettings
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Optimizer, parse_optimizer


class StageSettings(FlatSettings):
    """One stage as written in the config: an optimizer, what it moves and what it compares."""

    INNER: ClassVar[str] = "optimizer"
    optimizer: Annotated[Optimizer, BeforeValidator(parse_optimizer)]
    parameters: list[str] | None = Field(
        None,
        min_length=1,
        description=(
            "parameters that this stage fits, `*` for any part of a name, as in joint1.*; default: all free"
        ),
    )
    measurements: list[str] | None = Field(
        None,
        min_length=1,
        description="names of the measurements that this stage compares; default: all that are fitted",
    )


def as_list(data: Any) -> Any:
    """One stage, or a list of them, as a list."""
    return data if isinstance(data, (list, tuple)) else [data]


@dataclass(frozen=True)
class Stage:
    """One stage: what searches, what it minimises, and which parameters (parameters,) it moves."""

    optimizer: Optimizer
    objective: Objective
    moves: NDArray[np.bool_]


@dataclass(frozen=True)
class FitPlan:
    """Everything a fit needs.

    stages: what each start goes through; last_resort: those of one more start from the best point, where the
    starts did not agree.  starts: at most this many; start_factor: how far from the initial values they are
    drawn.  target_cost ends the fit; believed_cost: a minimum above it is not believed early, however many
    starts agree on it.  alike: a Gauss-Newton stage that would begin no farther than this, on the search
    scale, from where it began in an earlier start is not run again, but leads where that led.  far: cost of
    the result above which Gauss-Newton ends coarsely.
    """

    parameters: tuple[Parameter, ...]
    objective: Objective
    stages: tuple[Stage, ...]
    last_resort: tuple[Stage, ...] = ()
    starts: int = 1
    start_factor: float = 3.0
    target_cost: float = 0.0
    believed_cost: float = np.inf
    seed: int = 1
    alike: float = 0.0
    far: float = np.inf

    @property
    def initial(self) -> Array:
        """Where the search starts, (parameters,)."""
        return np.array([parameter.initial for parameter in self.parameters])


S = TypeVar("S", bound=StageSettings)


def make_stages(
    settings: Sequence[S], parameters: Sequence[Parameter], objective: Callable[[S], Objective]
) -> tuple[Stage, ...]:
    """The stages for these parameters; objective: what a stage minimises.

    Raises InputError for a stage that names no free parameter.
    """
    return tuple(
        Stage(one.optimizer, objective(one), _moves(one.parameters, parameters, f"optimizer.{number}"))
        for number, one in enumerate(settings)
    )


def _moves(patterns: Sequence[str] | None, parameters: Sequence[Parameter], where: str) -> NDArray[np.bool_]:
    """Which parameters have a name that fits; all without patterns."""
    names = [parameter.name for parameter in parameters]
    if not patterns:
        return np.ones(len(names), dtype=bool)
    moves = np.array([any(fnmatchcase(name, pattern) for pattern in patterns) for name in names])
    if not any(p.free and moved for p, moved in zip(parameters, moves, strict=True)):
        raise InputError(
            f"{where}.parameters",
            f"no free parameter is called {' or '.join(patterns)}",
            "names such as " + ", ".join(names[:3]),
            "`*` stands for any part",
        )
    return moves
