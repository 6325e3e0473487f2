"""Units of responses, forces and FRFs as instruments write them (`g/N`, `m/s^2/N`, `(m/s)/N`, `in/s2/lbf`),
turned into SI.

An expression is read as it stands, left to right: products (space, `*`, `.`, `-`), quotients (`/`), powers
(`s^2`, `s2`, `s**-1`) and brackets.  `g` is standard gravity, `lb` a pound-force: masses do not occur as
response or force.  Nothing is guessed.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import Literal

from identify.core.errors import InputError
from identify.measured.frf_set import Quantity

Kind = Literal["displacement", "velocity", "acceleration", "force"]

GRAVITY = 9.80665
"""Standard gravity (m/s^2), CGPM 1901."""

POUND_FORCE = 4.4482216152605
"""lbf in N: 0.45359237 kg times standard gravity."""

_Dims = tuple[tuple[str, int], ...]
_LENGTH: _Dims = (("m", 1),)
_ANGLE: _Dims = (("rad", 1),)
_FORCE: _Dims = (("N", 1),)
_ACCELERATION: _Dims = (("m", 1), ("s", -2))
_MASS: _Dims = (("N", 1), ("m", -1), ("s", 2))
_PRESSURE: _Dims = (("N", 1), ("m", -2))
_MOMENT: _Dims = (("N", 1), ("m", 1))

_ATOMS: dict[str, tuple[float, _Dims]] = {
    **{
        name: (factor, _LENGTH)
        for name, factor in {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}.items()
    },
    **{
        name: (factor, _LENGTH)
        for name, factor in {"in": 0.0254, "inch": 0.0254, "ft": 0.3048, "mil": 2.54e-5}.items()
    },
    **{name: (factor, (("s", 1),)) for name, factor in {"s": 1.0, "sec": 1.0}.items()},
    **{
        name: (factor, _ANGLE)
        for name, factor in {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": pi / 180}.items()
    },
    **{name: (factor, _FORCE) for name, factor in {"N": 1.0, "kN": 1e3, "mN": 1e-3, "daN": 10.0}.items()},
    **{name: (POUND_FORCE, _FORCE) for name in ("lbf", "lb", "lbs")},
    **{name: (GRAVITY, _FORCE) for name in ("kgf", "kp")},
    **{name: (GRAVITY, _ACCELERATION) for name in ("g", "G", "gn")},
    "Nm": (1.0, _MOMENT),
    "kg": (1.0, _MASS),
    "1": (1.0, ()),
    # What stands beside FRFs in files of a test, and is none: pressure, voltage, current, strain.
    **{name: (factor, _PRESSURE) for name, factor in {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6}.items()},
    **{name: (factor, (("V", 1),)) for name, factor in {"V": 1.0, "mV": 1e-3}.items()},
    **{name: (factor, (("A", 1),)) for name, factor in {"A": 1.0, "mA": 1e-3}.items()},
    **{
        name: (factor, ())
        for name, factor in {"strain": 1.0, "ustrain": 1e-6, "ue": 1e-6, "uE": 1e-6}.items()
    },
}
_TOKEN = re.compile(
    r"\s*(?:(?P<name>1(?!\d)|[A-Za-z_]+)(?:(?:\^|\*\*)?(?P<power>[+-]?[1-3]))?(?!\d)|(?P<mark>[()/*]))"
)
_SIMILAR = str.maketrans({"²": "^2", "µ": "u", "μ": "u", "·": "*", ".": "*"})
_HYPHEN = re.compile(r"(?<=[A-Za-z])-(?=[A-Za-z])")
_KINDS: dict[int, Kind] = {0: "displacement", -1: "velocity", -2: "acceleration"}
_QUANTITIES: dict[int, Quantity] = {0: "receptance", -1: "mobility", -2: "accelerance"}
QUANTITY_OF_KIND: dict[Kind, Quantity] = {
    "displacement": "receptance",
    "velocity": "mobility",
    "acceleration": "accelerance",
}
"""What a motion over a force is called."""
_FRF_RESTS: dict[tuple[bool, bool], dict[str, int]] = {
    (False, False): {"m": 1},
    (True, False): {"rad": 1},
    (False, True): {},
    (True, True): {"rad": 1, "m": -1},
}
"""(rotation, moment) and what is left of the unit without s and N."""
_EXAMPLES = "a unit such as m/s^2/N, g/N, (m/s)/N, um/N or in/s2/lbf"


class Foreign(InputError):
    """What is read and is no motion over a force of a structure, as of a microphone; a file may have it
    beside what is.
    """


@dataclass(frozen=True)
class SignalUnit:
    """Unit of one signal: SI value = factor x value; rotation: rad instead of m, N m instead of N."""

    kind: Kind
    rotation: bool
    factor: float

    @property
    def si(self) -> str:
        """The SI unit of the kind: m, m/s, m/s^2, N, rad, rad/s, rad/s^2 or N m."""
        if self.kind == "force":
            return "N m" if self.rotation else "N"
        power = {"displacement": "", "velocity": "/s", "acceleration": "/s^2"}[self.kind]
        return ("rad" if self.rotation else "m") + power


@dataclass(frozen=True)
class FrfUnit:
    """Unit of an FRF: SI value = factor x value; the response may be a rotation, the excitation a moment."""

    quantity: Quantity
    factor: float
    rotation: bool = False
    moment: bool = False


def parse_frf_unit(text: str, where: str) -> FrfUnit:
    """Quantity and factor to SI of a response per force; InputError where the text is no
    such unit, Foreign where it is one of something else."""
    factor, dims = _evaluate(text, where)
    time = dims.pop("s", 0)
    if dims.pop("N", 0) == -1 and time in _QUANTITIES:
        for (rotation, moment), rest in _FRF_RESTS.items():
            if dims == rest:
                return FrfUnit(_QUANTITIES[time], factor, rotation, moment)
    raise Foreign(
        where, f"unit {text!r} is not a displacement, velocity or acceleration per force", _EXAMPLES
    )


def parse_signal_unit(text: str, where: str) -> SignalUnit:
    """Kind and factor to SI of a displacement, velocity, acceleration, force or their rotational kin;
    InputError otherwise.
    """
    factor, dims = _evaluate(text, where)
    if dims in ({"N": 1}, {"N": 1, "m": 1}):
        return SignalUnit("force", "m" in dims, factor)
    time = dims.pop("s", 0)
    if dims in ({"m": 1}, {"rad": 1}) and time in _KINDS:
        return SignalUnit(_KINDS[time], "rad" in dims, factor)
    raise Foreign(
        where,
        f"unit {text!r} is neither a motion nor a force",
        "a unit such as m/s^2, g, mm/s, um, rad/s, N or lbf",
    )


def ratio(response: SignalUnit, force: SignalUnit, where: str) -> FrfUnit:
    """Unit of response over force; InputError where the first is no motion or the second no force."""
    if response.kind == "force" or force.kind != "force":
        raise Foreign(where, f"an FRF of {response.kind} over {force.kind}", "a motion over a force")
    return FrfUnit(
        QUANTITY_OF_KIND[response.kind], response.factor / force.factor, response.rotation, force.rotation
    )


def _evaluate(text: str, where: str) -> tuple[float, dict[str, int]]:
    """Factor and non-zero exponents of m, s, N and rad; InputError where the text is no product of known
    units.
    """
    rest = _HYPHEN.sub("*", text.translate(_SIMILAR)).strip()
    product, outer = _Product(), []
    while rest:
        match = _TOKEN.match(rest)
        if match is None:
            raise InputError(where, f"unit {text!r} cannot be read from {rest!r} on", _EXAMPLES)
        rest = rest[match.end() :]
        try:
            if match["mark"] == "(":
                outer.append(product)
                product = _Product()
            elif match["mark"] == ")":
                product = outer.pop().times(*product.whole())
            elif match["mark"]:
                product.operator(match["mark"])
            else:
                factor, dims = _ATOMS[match["name"]]
                power = int(match["power"] or 1)
                product.times(factor**power, {name: power * exponent for name, exponent in dims})
        except (KeyError, IndexError, ValueError) as error:
            raise InputError(
                where, f"unit {text!r} has {match[0].strip()!r} where it means nothing", _EXAMPLES
            ) from error
    if outer or product.pending:
        raise InputError(where, f"unit {text!r} is incomplete", _EXAMPLES)
    return product.factor, {name: power for name, power in product.dims.items() if power}


class _Product:
    """A chain of units, read left to right; `pending` is the operator that still waits for its right side."""

    def __init__(self) -> None:
        self.factor, self.dims, self.pending = 1.0, Counter[str](), "start"

    def operator(self, mark: str) -> None:
        """Take `/` or `*`; ValueError where one is waiting already."""
        if self.pending:
            raise ValueError(mark)
        self.pending = mark

    def times(self, factor: float, dims: Mapping[str, int]) -> _Product:
        """Multiply by, or after a `/` divide by, a unit."""
        sign = -1 if self.pending == "/" else 1
        self.factor *= factor**sign
        for name, power in dims.items():
            self.dims[name] += sign * power
        self.pending = ""
        return self

    def whole(self) -> tuple[float, Counter[str]]:
        """Factor and exponents; ValueError where an operator is still waiting."""
        if self.pending:
            raise ValueError(self.pending)
        return self.factor, self.dims
