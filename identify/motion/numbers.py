"""Numbers of a motion study that belong to joints: given, or to be identified; and their arrays over a
population of candidates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, Field, model_validator
from pydantic.fields import FieldInfo

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.core.parameters import Parameter


class JointNumber(Settings):
    """One number per joint, or one for all; searched within `bounds`, or within so much of it, unless
    `fixed`.
    """

    initial: float | list[float] = Field(
        description="value, or where the search starts; one for all joints, or one per joint"
    )
    bounds: tuple[float, float] | None = Field(
        None, description="smallest and largest value; both above zero: searched on a log scale"
    )
    within: float | None = Field(
        None, gt=0, lt=1, description="in place of `bounds`: share of each value within which it is known"
    )
    fixed: bool = Field(False, description="true: kept at `initial`")
    joints: list[int] | None = Field(
        None, description="numbers (from 1) of the joints of which it is searched; default: all"
    )

    @model_validator(mode="after")
    def _one_range(self) -> Self:
        if self.within is not None and self.bounds is not None:
            raise ValueError("within: in place of `bounds`; give one of them")
        return self


def _from_number(data: Any) -> Any:
    return (
        {"initial": data, "fixed": True}
        if isinstance(data, (int, float, list, tuple)) and not isinstance(data, bool)
        else data
    )


Number = Annotated[JointNumber, BeforeValidator(_from_number)]
"""In a config: 0.97, [0.97, 0.5, 0.5], or {initial: 0.97, bounds: [0.1, 2]}, which is to be identified."""


def quantity(unit: str, about: str, default: float | None = None, least: float = 0.0) -> Any:
    """A field of a section: its unit, what it is, its value where it is left out (None: it must be given),
    and the least it can be.
    """
    extra: dict[str, Any] = {"unit": unit, "least": least}
    text = f"{about} ({unit})" if unit else about
    if default is None:
        return Field(description=text, json_schema_extra=extra)
    return Field(JointNumber(initial=default, fixed=True), description=text, json_schema_extra=extra)


@dataclass(frozen=True)
class NumberTable:
    """All numbers of some sections: free ones as parameters, and the value of every one for every joint.

    given: (joints,) by `section.key`; columns: of those that are to be identified the joints (from 0) and
    their parameters' numbers, (2, n).
    """

    parameters: tuple[Parameter, ...]
    given: Mapping[str, Array]
    columns: Mapping[str, NDArray[np.intp]]

    def arrays(self, values: Array) -> dict[str, Array]:
        """(m, joints) by `section.key` at parameter values (m, parameters)."""
        arrays = {
            key: np.broadcast_to(given, (len(values), given.size)).copy() for key, given in self.given.items()
        }
        for key, (joints, columns) in self.columns.items():
            arrays[key][:, joints] = values[:, columns]
        return arrays


def number_table(sections: Mapping[str, BaseModel], joints: int, first: int = 0) -> NumberTable:
    """The numbers of sections by name; `first` is the number of the first parameter.

    Raises InputError where a list has another length than the robot has joints, or bounds and start disagree.
    """
    parameters: list[Parameter] = []
    given, columns = {}, {}
    for section, settings in sections.items():
        for key, field in type(settings).model_fields.items():
            number = getattr(settings, key)
            if not isinstance(number, JointNumber):
                continue
            where = f"{section}.{key}"
            given[where] = _values(number, field, joints, where)
            if not number.fixed:
                free = _joints(number, joints, where)
                columns[where] = np.array([free, first + len(parameters) + np.arange(len(free))])
                parameters += [
                    _parameter(f"joint{n + 1}.{where}", given[where][n], number, field, where) for n in free
                ]
    return NumberTable(tuple(parameters), given, columns)


def _joints(number: JointNumber, joints: int, where: str) -> list[int]:
    """The joints, from 0, of which a number is searched."""
    told = range(1, joints + 1) if number.joints is None else number.joints
    if not set(told) <= set(range(1, joints + 1)) or len(set(told)) < len(told) or not told:
        raise InputError(f"{where}.joints", f"{list(told)}", f"numbers from 1 to {joints}, each once")
    return [joint - 1 for joint in sorted(told)]


def _values(number: JointNumber, field: FieldInfo, joints: int, where: str) -> Array:
    values = np.atleast_1d(np.asarray(number.initial, dtype=float))
    if values.size not in (1, joints):
        raise InputError(where, f"{values.size} values", f"one, or {joints}: one per joint")
    if np.isnan(values).any() or (values < _extra(field)["least"]).any():
        raise InputError(where, f"value {values.min():g}", f"at least {_extra(field)['least']:g}")
    return np.asarray(np.broadcast_to(values, joints)).copy()


def _parameter(name: str, value: float, number: JointNumber, field: FieldInfo, where: str) -> Parameter:
    if number.within is not None:
        lower, upper = sorted((value * (1 - number.within), value * (1 + number.within)))
    elif number.bounds is not None:
        lower, upper = number.bounds
    else:
        raise InputError(
            f"{where}.bounds",
            "missing",
            "the smallest and largest value",
            "add `bounds`, or give the plain number to keep it",
        )
    if not _extra(field)["least"] <= lower < upper:
        raise InputError(
            f"{where}.bounds",
            f"[{lower:g}, {upper:g}]",
            f"the smaller bound first, at least {_extra(field)['least']:g}",
        )
    if not lower <= value <= upper:
        raise InputError(
            f"{where}.initial", f"{value:g}", f"a value within its bounds [{lower:g}, {upper:g}]"
        )
    return Parameter(name, str(_extra(field)["unit"]), float(value), lower, upper, log=lower > 0)


def _extra(field: FieldInfo) -> dict[str, Any]:
    return (
        dict(field.json_schema_extra)
        if isinstance(field.json_schema_extra, dict)
        else {"unit": "", "least": -np.inf}
    )
