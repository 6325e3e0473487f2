"""A spring and a viscous damper on each of a list of coordinates: the common part of joint and base
compliance; start values and bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from identify.core.arrays import Array, inverse_where_any
from identify.core.parameters import DampingValues, Parameter, Values, parameter, spread
from identify.model.effects.base import Effect, Term
from identify.model.effects.coupling import PAIRS, coupling_terms, diagonals, first_of, with_directions
from identify.model.effects.site import Site
from identify.robot.description import Robot

Axis = Literal["tx", "ty", "tz", "rx", "ry", "rz"]
Joints = Literal["all"] | list[int | str]
T = TypeVar("T", bound=str)


def unique(axes: list[T]) -> list[T]:
    """The axes, none of them twice; ValueError otherwise, for pydantic."""
    if len(set(axes)) < len(axes):
        raise ValueError("an axis is named twice")
    return axes


AxisList = Annotated[list[Axis], AfterValidator(unique)]
_SOFTEST, _SPAN, STIFF = 1e3, 1e2, 1e-2
"""How many times softer than its usual start a spring may be; either side of the start of a retardation
time; share of the usual start's compliance that one begins with.
"""
_RETARDATION_STD = float(np.log(1.6))
"""Of the logarithm of a retardation time about that of the usual damping."""
START_HZ = 20.0
"""Without a start value, each coordinate on its own resonates here: the middle of where robots do."""


ComplianceStd = Annotated[float | None, Field(gt=0)]


class Springs(Effect):
    """Spring and damper per free coordinate; a subclass says which coordinates."""

    axes: AxisList = Field(min_length=1, description="axes released")
    stiffness: Values = Field(Values(), description="N/m or N m/rad")
    damping: DampingValues = Field(DampingValues(), description="N s/m or N m s/rad")
    shrink: bool = Field(
        False,
        description=(
            "true: its parameters are compliances, zero unless the data ask for more, so that a rigid joint"
            " is inside the space; of `stiffness`, only `bounds` count"
        ),
    )
    compliance_std: ComplianceStd = Field(
        None,
        description=(
            "with `shrink`: standard deviation of each compliance about zero, m/N or rad/(N m); default:"
            " nothing is known of it"
        ),
    )
    coupled: bool = Field(
        False,
        description=(
            "rx and ry, and tx and ty, are coupled: the directions of most and least compliance lie"
            " anywhere in their plane, not along x and y; 2 more parameters per pair"
        ),
    )

    @model_validator(mode="after")
    def _couples_something(self) -> Self:
        check_shrinks(self.compliance_std, self.shrink)
        if self.coupled and self.shrink:
            raise ValueError("shrink: not of coupled springs; leave one of both out")
        if self.coupled and not self.pairs:
            raise ValueError("coupled: nothing to couple; name rx and ry, or tx and ty, among the axes")
        return self

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Axes across z, both of which are released."""
        return [pair for pair in PAIRS if set(pair) <= set(self.axes)]

    @property
    def axes_told(self) -> str:
        """For example: rx, ry, coupled."""
        return ", ".join([*self.axes, *(["coupled"] if self.coupled else [])])

    def variants(self) -> list[Self]:
        """Each of its axes alone, and pairs that are coupled or not, the other way round."""
        if len(self.axes) < 2:
            return []
        found = [self.model_copy(update={"axes": [axis], "coupled": False}) for axis in self.axes]
        return [*found, self.model_copy(update={"coupled": not self.coupled})] if self.pairs else found

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """A stiffness and a damping per coordinate, in that order; then those that couple two of them."""
        names = self.free_coordinates(robot)
        places = [(name, stiffness_unit(name), site.unit(name)) for name in names]
        if self.shrink and self.coupled:
            places += diagonals(site, places, self.pairs)
        inertia = np.array([site.carried(first_of(name)) for name, _, _ in places])
        keys = f"{where}.stiffness", f"{where}.damping"
        if self.shrink:
            return compliance_terms(places, inertia, self.stiffness, self.damping, keys, self.compliance_std)
        own = spring_terms(places, inertia, self.stiffness, self.damping, keys)
        return [*own, *coupling_terms(site, own, self.pairs, keys)] if self.coupled else own

    def initial_values(self, terms: Sequence[Term], band_hz: tuple[float, float]) -> Array:
        """Those of springs by themselves, and where they are coupled also pairs far more compliant in one
        direction than across it.
        """
        usual = super().initial_values(terms, band_hz)
        return with_directions(usual, [term.parameter for term in terms]) if self.coupled else usual


def check_shrinks(std: float | None, shrink: bool) -> None:
    """Raise a ValueError, for pydantic, where compliances are known that are no parameters."""
    if std and not shrink:
        raise ValueError("compliance_std: its parameters are stiffnesses; add `shrink: true`")


def stiffness_unit(coordinate: str) -> str:
    """N/m for a translation, N m/rad for a rotation, such as joint1.rz."""
    return "N/m" if coordinate.rsplit(".", maxsplit=1)[-1].startswith("t") else "N m/rad"


def spring_terms(
    places: Sequence[tuple[str, str, Array]],
    inertia: Array,
    stiffness: Values,
    damping: DampingValues,
    keys: tuple[str, str],
    start_hz: float = START_HZ,
) -> list[Term]:
    """A stiffness and a viscous damping for each place: its name, the unit of its stiffness, and the matrix
    (n, n) that one unit of either adds.

    Without a start value each resonates at `start_hz` with its inertia (places,); `keys` are those of
    stiffness and damping in the config.
    """
    k = spread(stiffness, inertia * (2 * np.pi * start_hz) ** 2, keys[0])
    c = spread(damping, 2 * damping.damping_ratio * np.sqrt(np.abs(k) * inertia), keys[1])
    terms = []
    for (name, unit, matrix), spring, damper in zip(places, k, c, strict=True):
        force, per, length = unit.partition("/")
        rate = f"{force} s{per}{length}"
        terms.append(Term(parameter(f"{name}.stiffness", unit, spring, stiffness, keys[0]), stiffness=matrix))
        terms.append(Term(parameter(f"{name}.damping", rate, damper, damping, keys[1]), damping=matrix))
    return terms


def compliance_terms(
    places: Sequence[tuple[str, str, Array]],
    inertia: Array,
    stiffness: Values,
    damping: DampingValues,
    keys: tuple[str, str],
    std: float | None = None,
) -> list[Term]:
    """The same springs by compliance and retardation time (damping over stiffness), rigid to begin with:
    a compliance from zero up to that of the least stiffness; std: its standard deviation, if that is known.
    """
    k = spread(stiffness, inertia * (2 * np.pi * START_HZ) ** 2, keys[0])
    terms = []
    for (name, unit, matrix), spring, moved in zip(places, k, inertia, strict=True):
        force, _, length = unit.partition("/")
        length = length or "1"
        per = f"{length}/{force}" if " " not in force else f"{length}/({force})"
        most = 1 / (stiffness.bounds[0] if stiffness.bounds else spring / _SOFTEST)
        compliance = Parameter(
            f"{name}.compliance",
            per,
            STIFF / spring,
            0.0,
            most,
            log=False,
            free=not stiffness.fixed,
            prior_std=std or 0.0,
        )
        tau = 2 * damping.damping_ratio * np.sqrt(moved / spring)
        retardation = Parameter(
            f"{name}.retardation_time",
            "s",
            tau,
            tau / _SPAN,
            tau * _SPAN,
            free=not damping.fixed,
            prior_std=_RETARDATION_STD,
        )
        terms.append(Term(compliance, compliance=inverse_where_any(matrix)))
        terms.append(Term(retardation))
    return terms


def joint_coordinates(robot: Robot, joints: Joints, axes: list[Axis], where: str) -> list[str]:
    """joint1.rz and so on, joint by joint; an unknown joint, or one twice, is an InputError."""
    numbers = range(1, len(robot.joints) + 1) if joints == "all" else robot.joint_numbers(joints, where)
    return [f"joint{number}.{axis}" for number in numbers for axis in axes]
