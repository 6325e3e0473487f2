"""What a truth file tells, to the digits that every processor's rounding agrees on."""

from __future__ import annotations

import json
from typing import Any


def nine_digits(text: str) -> Any:
    """A JSON text with its numbers to nine digits."""
    return json.loads(text, parse_float=lambda digits: float(f"{float(digits):.9g}"))
