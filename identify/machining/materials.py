"""Cutting coefficients of workpiece materials, as published.

They depend on tool, edge, chip thickness and speed: two sources of the same alloy differ by a factor of two.
For a decision that matters, measure them with the tool at hand and give them as `coefficients` of the tool.
"""

from __future__ import annotations

from dataclasses import dataclass

from identify.core.errors import InputError


@dataclass(frozen=True)
class Coefficients:
    """Cutting coefficients, N/m^2: tangential, radial and axial force per width and thickness of the chip.

    tangential_edge, radial_edge, N/m: forces per width of the chip that do not depend on its thickness;
    source: where they come from.
    """

    tangential: float
    radial: float
    axial: float = 0.0
    tangential_edge: float = 0.0
    radial_edge: float = 0.0
    source: str = ""


_REVIEW = "Table 5 of Chin. J. Mech. Eng. 34 (2021), doi:10.1186/s10033-021-00536-9"
MATERIALS = {
    "aluminium-6061-t6": Coefficients(
        243.77e6, 113.5e6, 0.0, 7.53e3, 7.83e3, f"carbide, dry; {_REVIEW}, its reference 160"
    ),
    "aluminium-6082-t6": Coefficients(
        631e6, 99e6, 273e6, 13e3, 10e3, f"carbide, dry; {_REVIEW}, its reference 189"
    ),
    "aluminium-7075-t6": Coefficients(
        767.01e6, 168.8e6, 222e6, 27.7e3, 26.6e3, f"carbide, dry; {_REVIEW}, its reference 190"
    ),
    "aluminium-7075-t6-low": Coefficients(
        600.46e6, 180.96e6, 0.0, 17.9e3, 20.42e3, f"carbide, dry; {_REVIEW}, its reference 160"
    ),
    "aluminium-7075-t6-high": Coefficients(
        1319.41e6, 788.83e6, 48.75e6, 19.65e3, 26.77e3, f"carbide, dry; {_REVIEW}, its reference 47"
    ),
    "aluminium-7075-hss": Coefficients(
        951.365e6, 262.597e6, 323.33e6, 11.115e3, 11.314e3, f"high-speed steel, dry; {_REVIEW}, reference 156"
    ),
    "aluminium-insperger": Coefficients(
        600e6, 200e6, source="the milling charts of Insperger and Stepan, Int. J. Numer. Meth. Eng. 61 (2004)"
    ),
}
"""Materials by the name that a tool's file uses."""


def material(name: str, where: str) -> Coefficients:
    """The coefficients of a material; InputError with the known ones for another name."""
    if name not in MATERIALS:
        raise InputError(
            where,
            f"unknown material {name!r}",
            "one of " + ", ".join(MATERIALS),
            "give `coefficients` measured with your tool",
        )
    return MATERIALS[name]
