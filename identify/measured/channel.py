"""A channel: a measurement point and a signed direction, written `12:+Z` and coded as in universal files
(58); or the motor of a joint, `joint2:motor`: its torque as an input, its turn as an output, and
`joint2:reference`, what excited its controller.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from identify.core.errors import InputError

_NAMES = {0: "S", 1: "X", 2: "Y", 3: "Z", 4: "RX", 5: "RY", 6: "RZ"}
_CODES = {name: code for code, name in _NAMES.items()}
_PATTERN = re.compile(r"^\s*(\d{1,10})\s*:\s*([+-]?)\s*(S|R?[XYZ])\s*$", re.IGNORECASE)
"""Node and direction; a universal file has room for ten digits of a node."""
_OF_JOINT = re.compile(r"^\s*joint([1-9]\d*)\s*:\s*([+-]?)\s*(motor|reference)\s*$", re.IGNORECASE)
_TURNING, _SCALAR = 6, 0


@dataclass(frozen=True, order=True)
class Channel:
    """Point number `node` and `direction`: +-1..3 translation, +-4..6 rotation, 0 scalar; the motor of joint
    j has the node -j and the direction +-6, its reference -j and 0.
    """

    node: int
    direction: int

    def __post_init__(self) -> None:
        if abs(self.direction) not in _NAMES:
            raise ValueError(f"direction {self.direction} is not one of 0, +-1 .. +-6")

    @classmethod
    def parse(cls, text: str, where: str = "channel") -> Channel:
        """Read `12:+Z`, `12:-RX`, `12:S`, `joint2:motor` or `joint2:reference`; anything else is an
        InputError.
        """
        if of_joint := _OF_JOINT.match(text):
            turning = _TURNING if of_joint[3].lower() == "motor" else _SCALAR
            return cls(-int(of_joint[1]), -turning if of_joint[2] == "-" else turning)
        match = _PATTERN.match(text)
        if match is None:
            raise InputError(
                where, f"channel {text!r}", "point:direction such as 12:+Z, 3:-X, 7:+RY or joint2:motor"
            )
        code = _CODES[match[3].upper()]
        return cls(int(match[1]), -code if match[2] == "-" else code)

    @property
    def motor(self) -> int | None:
        """Number of the joint whose motor it is, from 1; None of a point."""
        return -self.node if self.node < 0 and abs(self.direction) == _TURNING else None

    @property
    def is_reference(self) -> bool:
        """Whether it is what excited the controller of a motor."""
        return self.node < 0 and self.direction == _SCALAR

    @property
    def sign(self) -> int:
        """+1 or -1."""
        return -1 if self.direction < 0 else 1

    @property
    def axis(self) -> int:
        """0, 1, 2 for x, y, z and 3, 4, 5 for rotation about them; a scalar channel has none."""
        if self.direction == 0:
            raise ValueError(f"{self} has no axis")
        return abs(self.direction) - 1

    @property
    def place(self) -> tuple[int, int]:
        """Node and axis, whatever the sign."""
        return self.node, abs(self.direction)

    def __str__(self) -> str:
        if self.is_reference:
            return f"joint{-self.node}:reference"
        if self.motor is not None:
            return f"joint{self.motor}:{'-' if self.direction < 0 else ''}motor"
        sign = "" if self.direction == 0 else "-" if self.direction < 0 else "+"
        return f"{self.node}:{sign}{_NAMES[abs(self.direction)]}"


def motors_of(channels: Iterable[Channel]) -> frozenset[int]:
    """Joints whose motors are among channels."""
    return frozenset(one.motor for one in channels if one.motor is not None)
