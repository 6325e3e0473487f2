"""Universal files written here by hand, column by column, as other programs write them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Dataset58:
    """A dataset 58 in single precision: values (n,), complex for FRFs."""

    values: np.ndarray
    function: int = 4
    response: tuple[int, int] = (12, 3)
    reference: tuple[int, int] = (14, 1)
    start: float = 2.5
    step: float = 0.625
    abscissa: tuple[int, str] = (18, "Hz")
    ordinate: tuple[int, str] = (12, "m/s2")
    denominator: tuple[int, str] = (13, "N")
    names: tuple[str, str] = ("link5", "link6_2")

    def lines(self) -> list[str]:
        """The dataset with its opening and closing -1."""
        kind = 5 if np.iscomplexobj(self.values) else 2
        numbers = np.stack([self.values.real, self.values.imag], 1).ravel() if kind == 5 else self.values
        dofs = "".join(
            f" {name:>10s}{node:10d}{direction:4d}"
            for name, (node, direction) in zip(self.names, (self.response, self.reference), strict=True)
        )
        return [
            "    -1",
            "    58",
            "H1",
            "NONE",
            "NONE",
            "NONE",
            "NONE",
            f"{self.function:5d}{0:10d}{0:5d}{0:10d}{dofs}",
            f"{kind:10d}{len(self.values):10d}{1:10d}{self.start:13.5e}{self.step:13.5e}{0:13.5e}",
            *(
                f"{code:10d}    0    0    0 {'NONE':20s} {unit:20s}"
                for code, unit in (self.abscissa, self.ordinate, self.denominator, (0, "NONE"))
            ),
            *("".join(f"{number:13.5e}" for number in numbers[i : i + 6]) for i in range(0, len(numbers), 6)),
            "    -1",
        ]


def coherence(values: np.ndarray, **changes: object) -> Dataset58:
    """A coherence record."""
    return Dataset58(values, function=6, ordinate=(0, "NONE"), denominator=(0, "NONE"), **changes)  # type: ignore[arg-type]


def text(datasets: Sequence[Dataset58], end: str = "\n") -> bytes:
    """A file of some datasets."""
    return (end.join(line for dataset in datasets for line in dataset.lines()) + end).encode()


def units164(length: float, force: float) -> str:
    """A dataset 164: units by which to divide."""
    numbers = f"{length:25.17E}{force:25.17E}{1:25.17E}\n{273.15:25.17E}".replace("E", "D")
    return f"    -1\n   164\n         9USER_DEFINED                 2\n{numbers}\n    -1\n"


def some_frf(seed: int = 0, lines: int = 5) -> np.ndarray:
    """Complex numbers that six digits hold exactly."""
    random = np.random.default_rng(seed)
    values = random.normal(size=lines) + 1j * random.normal(size=lines)
    return np.array([complex(float(f"{v.real:.5e}"), float(f"{v.imag:.5e}")) for v in values])
