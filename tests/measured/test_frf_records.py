"""What all formats share: units asked for, disagreements refused, channels renamed, doubled and broken values
found.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions, FrfRecord, FrfRecords, to_frf_set
from identify.measured.frf_set import FrfSet
from identify.measured.units import parse_frf_unit

VALUES = np.array([1 + 2j, 3 - 1j, 0.5j])


def record(**changes: object) -> FrfRecord:
    whole = FrfRecord(Channel(12, 3), Channel(1, 1), VALUES, "x.csv, line 7")
    return replace(whole, **changes)  # type: ignore[arg-type]


def build(*records: FrfRecord, file: dict[str, object] | None = None, **options: object) -> FrfSet:
    whole = FrfRecords(np.array([1.0, 2.0, 3.0]), list(records))
    return to_frf_set(replace(whole, **(file or {})), FrfFileOptions.model_validate(options), "x.csv", "abc")  # type: ignore[arg-type]


def test_options_refuse_what_they_do_not_know() -> None:
    for bad in ({"units": "g/N"}, {"averages": 0}, {"window_decay_per_s": -1}, {"quantity": "impedance"}):
        with pytest.raises(ValidationError):
            FrfFileOptions.model_validate(bad)


def test_a_silent_file_needs_the_unit_and_a_speaking_one_must_agree() -> None:
    with pytest.raises(InputError, match=r"x\.csv, line 7: the file gives no unit .* add the key unit"):
        build(record())
    np.testing.assert_allclose(build(record(), unit="g/N").frf[:, 0, 0], 9.80665 * VALUES)
    stated = record(unit=parse_frf_unit("g/N", ""))
    np.testing.assert_allclose(build(stated).frf, build(stated, unit="g/N").frf)
    for file, one in (({}, stated), ({"unit": parse_frf_unit("g/N", "")}, record())):
        for other in ("m/s^2/N", "m/N"):
            with pytest.raises(InputError, match="the key unit says"):
                build(one, file=file, unit=other)


def test_the_quantity_must_agree_with_the_unit() -> None:
    assert build(record(), unit="m/N", quantity="receptance").quantity == "receptance"
    with pytest.raises(InputError, match="the key quantity says mobility, the unit says receptance"):
        build(record(), unit="m/N", quantity="mobility")
    with pytest.raises(InputError, match="gives no unit"):
        build(record(), quantity="mobility")


def test_one_set_has_one_quantity() -> None:
    with pytest.raises(InputError, match=r"different quantities: accelerance .* receptance"):
        build(
            record(unit=parse_frf_unit("g/N", "")),
            record(output=Channel(3, 1), unit=parse_frf_unit("m/N", "")),
        )


def test_rotations_need_si_where_one_unit_is_said_for_all() -> None:
    turning = record(output=Channel(12, 5))
    assert build(turning, unit="m/s^2/N").frf[0, 0, 0] == VALUES[0]
    with pytest.raises(InputError, match="is rotational"):
        build(turning, unit="g/N")
    with pytest.raises(InputError, match="translation over force at"):
        build(replace(turning, unit=parse_frf_unit("g/N", "")))


@pytest.mark.parametrize("key", ["averages", "window_decay_per_s"])
def test_file_and_option_must_agree_on_averages_and_window(key: str) -> None:
    assert getattr(build(record(), unit="m/N", file={key: 4}), key) == 4
    assert getattr(build(record(), unit="m/N", **{key: 4}), key) == 4
    assert getattr(build(record(), unit="m/N", file={key: 4}, **{key: 4}), key) == 4
    with pytest.raises(InputError, match=f"the file says {key} = 4, the key {key} says 5"):
        build(record(), unit="m/N", file={key: 4}, **{key: 5})


def test_channels_are_renamed_with_their_sign() -> None:
    read = build(record(), unit="m/N", channels={"12:+Z": "5:-X", "1:+X": "14:+Y"})
    assert (str(read.outputs[0]), str(read.inputs[0])) == ("5:-X", "14:+Y")
    np.testing.assert_array_equal(read.frf[:, 0, 0], VALUES)
    with pytest.raises(InputError, match=r"channel 13:\+Z is not in the file; expected one of 1:\+X, 12:\+Z"):
        build(record(), unit="m/N", channels={"13:+Z": "5:-X"})
    with pytest.raises(InputError, match="key channels"):
        build(record(), unit="m/N", channels={"12:+Z": "five"})


def test_renaming_onto_another_channel_makes_a_doubled_pair() -> None:
    other = record(output=Channel(13, 3), values=2 * VALUES)
    with pytest.raises(InputError, match="stands there again with other values"):
        build(record(), other, unit="m/N", channels={"13:+Z": "12:+Z"})


def test_values_that_are_not_finite_and_coherences_outside_0_to_1_are_refused() -> None:
    with pytest.raises(InputError, match=r"x\.csv, line 7: FRF 12:\+Z/1:\+X is not finite in line 2"):
        build(record(values=np.array([1, np.nan, 2])), unit="m/N")
    for bad in (1.01, -0.1, np.nan):
        with pytest.raises(InputError, match=r"coherence .* at line 3"):
            build(record(coherence=np.array([0.5, 1.0, bad])), unit="m/N")


@pytest.mark.parametrize("frequency", [[1.0, 3.0, 2.0], [-1.0, 0.0, 1.0], [1.0, np.nan, 2.0], []])
def test_frequencies_must_rise(frequency: list[float]) -> None:
    with pytest.raises(InputError, match="frequenc"):
        build(record(), unit="m/N", file={"frequency_hz": np.array(frequency)})


def test_pairs_that_lack_are_nan_and_coherence_may_lack_for_some() -> None:
    one = record(coherence=np.array([0.1, 0.2, 0.3]))
    other = record(output=Channel(3, 1), input=Channel(4, 1))
    read = build(one, other, unit="m/N")
    assert read.measured.tolist() == [[True, False], [False, True]]
    assert read.coherence is not None and np.isnan(read.coherence[:, 1, 1]).all()
    assert build(other, unit="m/N").coherence is None
    with pytest.raises(InputError, match="no FRF"):
        build(unit="m/N")
