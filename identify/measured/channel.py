"""A channel: a measurement point and a signed direction, written `12:+Z` and coded as in universal files
(58).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from identify.core.errors import InputError

_NAMES = {0: "S", 1: "X", 2: "Y", 3: "Z", 4: "RX", 5: "RY", 6: "RZ"}
_CODES = {name: code for code, name in _NAMES.items()}
_PATTERN = re.compile(r"^\s*(\d+)\s*:\s*([+-]?)\s*(S|R?[XYZ])\s*$", re.IGNORECASE)


@dataclass(frozen=True, order=True)
class Channel:
    """Point number `node` and `direction`: +-1..3 translation, +-4..6 rotation, 0 scalar."""

    node: int
    direction: int

    def __post_init__(self) -> None:
        if abs(self.direction) not in _NAMES:
            raise ValueError(f"direction {self.direction} is not one of 0, +-1 .. +-6")

    @classmethod
    def parse(cls, text: str, where: str = "channel") -> Channel:
        """Read `12:+Z`, `12:-RX` or `12:S`; anything else is an InputError."""
        match = _PATTERN.match(text)
        if match is None:
            raise InputError(where, f"channel {text!r}", "point:direction such as 12:+Z, 3:-X or 7:+RY")
        code = _CODES[match[3].upper()]
        return cls(int(match[1]), -code if match[2] == "-" else code)

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
        sign = "" if self.direction == 0 else "-" if self.direction < 0 else "+"
        return f"{self.node}:{sign}{_NAMES[abs(self.direction)]}"
