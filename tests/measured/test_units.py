"""Units against factors worked out by hand, and everything that must be refused."""

from __future__ import annotations

from contextlib import suppress
from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.core.errors import InputError
from identify.measured.units import FrfUnit, parse_frf_unit, parse_signal_unit, ratio

G, LBF = 9.80665, 4.4482216152605


@pytest.mark.parametrize(
    ("text", "quantity", "factor"),
    [
        ("g/N", "accelerance", G),
        ("m/s^2/N", "accelerance", 1),
        ("m/s2/N", "accelerance", 1),
        ("m/s**2/N", "accelerance", 1),
        ("m/s²/N", "accelerance", 1),
        ("m s^-2 N^-1", "accelerance", 1),
        ("m/s/s/N", "accelerance", 1),
        ("(m/s^2)/(N)", "accelerance", 1),
        ("m/(s^2 N)", "accelerance", 1),
        ("1/kg", "accelerance", 1),
        ("mm/s2/N", "accelerance", 1e-3),
        ("in/s2/lbf", "accelerance", 0.0254 / LBF),
        ("g/lbf", "accelerance", G / LBF),
        ("g/kN", "accelerance", G / 1000),
        ("(m/s)/N", "mobility", 1),
        ("mm/s/N", "mobility", 1e-3),
        ("m/N", "receptance", 1),
        ("mm/N", "receptance", 1e-3),
        ("um/N", "receptance", 1e-6),
        ("µm/N", "receptance", 1e-6),
        ("μm/daN", "receptance", 1e-7),
        ("mil/lbf", "receptance", 2.54e-5 / LBF),
    ],
)
def test_frf_units_of_translations(text: str, quantity: str, factor: float) -> None:
    unit = parse_frf_unit(text, "here")
    assert (unit.quantity, unit.rotation, unit.moment) == (quantity, False, False)
    assert unit.factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("rad/s^2/N", FrfUnit("accelerance", 1, True, False)),
        ("rad/s2/(N m)", FrfUnit("accelerance", 1, True, True)),
        ("rad/s2/Nm", FrfUnit("accelerance", 1, True, True)),
        ("m/s/(N*m)", FrfUnit("mobility", 1, False, True)),
        ("deg/N", FrfUnit("receptance", pi / 180, True, False)),
    ],
)
def test_frf_units_of_rotations(text: str, expected: FrfUnit) -> None:
    assert parse_frf_unit(text, "here") == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        "g",
        "m/s^2",
        "m/s^2 N",
        "(m/s²)(N)",
        "V/N",
        "dB",
        "N/m",
        "m//N",
        "m/N)",
        "(m/N",
        "m^/N",
        "m^9/N",
        "m22/N",
        "/N",
        "m/",
        "ms^-2/N",
        "m/s^3/N",
        "M/N",
    ],
)
def test_what_is_no_frf_unit_is_refused_with_place_and_text(text: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_frf_unit(text, "file.csv, unit")
    assert "file.csv, unit" in str(caught.value) and repr(text) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "kind", "rotation", "factor", "si"),
    [
        ("g", "acceleration", False, G, "m/s^2"),
        ("m/s2", "acceleration", False, 1, "m/s^2"),
        ("mm/s", "velocity", False, 1e-3, "m/s"),
        ("um", "displacement", False, 1e-6, "m"),
        ("deg/s", "velocity", True, pi / 180, "rad/s"),
        ("N", "force", False, 1, "N"),
        ("lbf", "force", False, LBF, "N"),
        ("N-m", "force", True, 1, "N m"),
    ],
)
def test_signal_units(text: str, kind: str, rotation: bool, factor: float, si: str) -> None:
    unit = parse_signal_unit(text, "here")
    assert (unit.kind, unit.rotation, unit.si) == (kind, rotation, si)
    assert unit.factor == pytest.approx(factor, rel=1e-12)
    assert parse_signal_unit(unit.si, "here").factor == 1


@pytest.mark.parametrize("text", ["Pa", "m/N", "s", "", "m s"])
def test_what_is_neither_motion_nor_force_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        parse_signal_unit(text, "here")


@given(
    st.sampled_from(["m", "mm", "um", "in", "g", "mm/s", "m/s2", "deg/s2"]),
    st.sampled_from(["N", "kN", "lbf", "N m"]),
)
def test_a_ratio_of_signal_units_is_the_unit_of_the_ratio(response: str, force: str) -> None:
    by_parts = ratio(parse_signal_unit(response, ""), parse_signal_unit(force, ""), "")
    whole = parse_frf_unit(f"({response})/({force})", "")
    assert by_parts.factor == pytest.approx(whole.factor, rel=1e-12)
    assert (by_parts.quantity, by_parts.rotation, by_parts.moment) == (
        whole.quantity,
        whole.rotation,
        whole.moment,
    )


def test_a_ratio_of_two_forces_is_refused() -> None:
    with pytest.raises(InputError):
        ratio(parse_signal_unit("N", ""), parse_signal_unit("N", ""), "")


@given(st.text(alphabet="mNsgkrad/^()*-. 0123456789", max_size=12))
def test_any_text_is_a_unit_or_an_input_error(text: str) -> None:
    with suppress(InputError):
        assert parse_frf_unit(text, "").factor > 0
