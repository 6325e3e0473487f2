"""Universal files: what they say, in vendors' habits, and read by a second reader (pyuff)."""

from __future__ import annotations

import gc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyuff
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import FrfFileOptions, load_frf_set, load_time_history
from identify.measured.uff.records import read_records
from identify.measured.uff.write import write_uff58
from tests.measured.frf_sets import assert_same, sets, some_set
from tests.measured.uff_text import Dataset58, coherence, some_frf, text, units164
from tests.shared import shared

G = 9.80665
PAIR = (Channel(12, 3), Channel(14, 1))


def load(tmp_path: Path, content: bytes | str, **options: object) -> FrfSet:
    path = tmp_path / "test.uff"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_frf_set(path, FrfFileOptions.model_validate(options))


def test_an_frf_with_its_coherence_is_read_as_it_stands(tmp_path: Path) -> None:
    frf, gamma2 = some_frf(), np.array([0.9, 0.99, 1.0, 0.5, 0.999999])
    read = load(tmp_path, text([Dataset58(frf), coherence(gamma2)]), averages=4, window_decay_per_s=0.69)
    assert (read.outputs, read.inputs, read.quantity) == ((PAIR[0],), (PAIR[1],), "accelerance")
    assert (read.averages, read.window_decay_per_s) == (4, 0.69)
    np.testing.assert_array_equal(read.frf[:, 0, 0], frf)
    assert read.coherence is not None
    np.testing.assert_array_equal(read.coherence[:, 0, 0], gamma2)
    np.testing.assert_array_equal(read.frequency_hz, 2.5 + 0.625 * np.arange(5))
    assert read.source.endswith("test.uff") and len(read.sha256) == 64


def test_rounded_frequencies_stay_as_the_file_says(tmp_path: Path) -> None:
    read = load(tmp_path, text([Dataset58(some_frf(), start=2.50061, step=0.625153)]))
    np.testing.assert_array_equal(read.frequency_hz, 2.50061 + 0.625153 * np.arange(5))


@pytest.mark.parametrize(
    ("ordinate", "denominator", "quantity", "factor"),
    [
        ((12, "g"), (13, "N"), "accelerance", G),
        ((12, "mm/s^2"), (13, "kN"), "accelerance", 1e-6),
        ((11, "m/s"), (13, "N"), "mobility", 1),
        ((8, "um"), (13, "N"), "receptance", 1e-6),
        ((0, "g"), (13, "N"), "accelerance", G),
        ((0, "m/s"), (0, "lbf"), "mobility", 1 / 4.4482216152605),
        ((12, "g/N"), (13, "N"), "accelerance", G),
        ((12, "(m/s2)/N"), (0, "NONE"), "accelerance", 1),
    ],
    ids=str,
)
def test_labels_win_over_type_codes(
    tmp_path: Path, ordinate: tuple[int, str], denominator: tuple[int, str], quantity: str, factor: float
) -> None:
    read = load(tmp_path, text([Dataset58(some_frf(), ordinate=ordinate, denominator=denominator)]))
    assert read.quantity == quantity
    np.testing.assert_allclose(read.frf[:, 0, 0], factor * some_frf(), rtol=1e-12)


@pytest.mark.parametrize(
    ("ordinate", "denominator", "found"),
    [
        ((8, "m/s^2"), (13, "N"), r"type code 8 \(receptance\) with the unit 'm/s\^2' \(accelerance\)"),
        ((12, "um/N"), (0, "NONE"), r"type code 12 \(accelerance\) with the unit 'um/N' \(receptance\)"),
        ((12, "m/s^2/kN"), (13, "N"), "unit 'm/s\\^2/kN' with the denominator 'N'"),
    ],
    ids=str,
)
def test_an_axis_that_contradicts_itself_is_refused(
    tmp_path: Path, ordinate: tuple[int, str], denominator: tuple[int, str], found: str
) -> None:
    with pytest.raises(InputError, match=found):
        load(tmp_path, text([Dataset58(some_frf(), ordinate=ordinate, denominator=denominator)]))


@pytest.mark.parametrize(
    ("code", "quantity", "factor"),
    [(8, "receptance", 1e-6), (11, "mobility", 1e-6), (12, "accelerance", 1e-6)],
)
def test_without_labels_dataset_164_says_the_units(
    tmp_path: Path, code: int, quantity: str, factor: float
) -> None:
    bare = text([Dataset58(some_frf(), ordinate=(code, "NONE"), denominator=(13, "NONE"))]).decode()
    read = load(tmp_path, units164(1000, 1e-3) + bare)  # mm and kN
    assert read.quantity == quantity
    np.testing.assert_allclose(read.frf[:, 0, 0], factor * some_frf(), rtol=1e-12)


def test_without_labels_and_dataset_164_the_user_is_asked_and_the_type_code_must_agree(
    tmp_path: Path,
) -> None:
    bare = text([Dataset58(some_frf(), ordinate=(12, "NONE"), denominator=(13, "NONE"))])
    with pytest.raises(InputError, match=r"gives no unit for its accelerance; .* add the key unit"):
        load(tmp_path, bare)
    assert load(tmp_path, bare, unit="g/N").frf[0, 0, 0] == pytest.approx(G * some_frf()[0], rel=1e-12)
    with pytest.raises(InputError, match="type codes say accelerance, the unit says receptance"):
        load(tmp_path, bare, unit="m/N")


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"ordinate": (12, "V")}, "'V'"),
        ({"ordinate": (12, "g/N"), "denominator": (13, "lbf")}, "with the denominator 'lbf'"),
        ({"ordinate": (13, "N")}, "force over force"),
        ({"response": (12, 4)}, "translation over force at 12:.RX/14:.X"),
        ({"response": (12, 7)}, "direction 7"),
        ({"abscissa": (17, "s")}, "type code 17"),
        ({"abscissa": (0, "NONE")}, "type code 0"),
        ({"values": np.array([1.0, 2.0])}, "is real"),
        ({"function": 2}, "no FRF among the function types .2."),
    ],
)
def test_what_is_no_frf_is_refused(tmp_path: Path, changes: dict[str, object], found: str) -> None:
    with pytest.raises(InputError, match=found):
        load(tmp_path, text([replace(Dataset58(some_frf()), **changes)]))  # type: ignore[arg-type]


def test_rotations_carry_rotational_units(tmp_path: Path) -> None:
    data = Dataset58(
        some_frf(), response=(12, 4), reference=(14, -5), ordinate=(12, "deg/s2"), denominator=(13, "Nm")
    )
    read = load(tmp_path, text([data]))
    assert (str(read.outputs[0]), str(read.inputs[0])) == ("12:+RX", "14:-RY")
    np.testing.assert_allclose(read.frf[:, 0, 0], np.pi / 180 * some_frf(), rtol=1e-12)


def test_a_pair_that_comes_twice_must_be_the_same_twice(tmp_path: Path) -> None:
    once, other = Dataset58(some_frf(0)), Dataset58(some_frf(1))
    assert load(tmp_path, text([once, once])).frf.shape == (5, 1, 1)
    with pytest.raises(InputError, match=r"dataset 2, line 18: FRF 12:\+Z/14:\+X stands there again"):
        load(tmp_path, text([once, other]))
    with pytest.raises(InputError, match=r"coherence .* again with other values"):
        load(tmp_path, text([once, coherence(np.full(5, 0.5)), coherence(np.full(5, 0.6))]))


def test_records_on_different_frequencies_are_refused(tmp_path: Path) -> None:
    for other in (
        Dataset58(some_frf(), response=(11, 1), step=0.626),
        Dataset58(some_frf(lines=2), response=(11, 1)),
    ):
        with pytest.raises(InputError, match=r"dataset 2, line 18: .* the same lines for all FRFs, or most"):
            load(tmp_path, text([Dataset58(some_frf()), other]))


def test_a_record_that_ends_earlier_leaves_the_lines_that_all_have(tmp_path: Path) -> None:
    values = some_frf()
    records = [
        Dataset58(values),
        Dataset58(values[1:4], response=(11, 1), start=2.5 + 0.625),
        Dataset58(values[:4], response=(13, 1)),
        coherence(np.linspace(0.5, 0.9, 5)),
    ]
    read = load(tmp_path, text(records))
    np.testing.assert_allclose(read.frequency_hz, 2.5 + 0.625 * np.arange(1, 4))
    np.testing.assert_array_equal(read.frf[:, 0, 0], read.frf[:, 1, 0])
    np.testing.assert_array_equal(read.frf[:, 0, 0], read.frf[:, 2, 0])
    assert read.coherence is not None
    np.testing.assert_allclose(read.coherence[:, 0, 0], [0.6, 0.7, 0.8])
    assert "of 5 lines the 3 were taken that all FRFs have, for 2 of 4 records have fewer" in read.notes[0]
    assert "dataset 2" in read.notes[0]


@pytest.mark.parametrize(
    ("odd", "said"),
    [
        ({"response": (99, 0), "ordinate": (15, "Pa")}, "unit 'Pa' is neither a motion nor a force"),
        ({"ordinate": (15, "NONE")}, "type code 15 (pressure), which is neither"),
        ({"denominator": (0, "V")}, "unit 'V' is neither a motion nor a force"),
        ({"ordinate": (12, "Pa/N"), "denominator": (0, "NONE")}, "'Pa/N' is"),
        ({"denominator": (12, "m/s2")}, "an FRF of acceleration over acceleration"),
        ({"response": (-1, 3)}, "node -1 with direction 3"),
    ],
)
def test_what_is_no_frf_of_the_structure_is_left_out_beside_those_that_are(
    tmp_path: Path, odd: dict[str, object], said: str
) -> None:
    other = replace(Dataset58(some_frf(), response=(11, 1)), **odd)  # type: ignore[arg-type]
    read = load(tmp_path, text([Dataset58(some_frf()), other]))
    assert list(map(str, read.outputs)) == ["12:+Z"]
    assert said in read.notes[0] and "dataset 2" in read.notes[0]
    with pytest.raises(InputError):
        load(tmp_path, text([other]))


def test_a_time_record_at_no_node_is_passed_over(tmp_path: Path) -> None:
    sound = Dataset58(np.arange(12.0), function=1, response=(-1, 0), reference=(-1, 0), abscissa=(17, "s"))
    read = load(tmp_path, text([Dataset58(some_frf()), sound]))
    assert read.frf.shape == (5, 1, 1)
    assert read.notes == (
        "1 function of type 1 (time response) was not read: neither an FRF (4) nor a coherence (6)",
    )


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("even", [False, True])
def test_an_frf_that_is_no_number_at_0_hz_loses_that_line(tmp_path: Path, binary: bool, even: bool) -> None:
    frequency = np.linspace(0, 12, 7) if even else np.array([0, 1, 2, 4, 7, 11, 16.0])
    data = FrfSet(
        frequency, np.exp(1j * frequency)[:, None, None], (Channel(1, 3),), (Channel(1, 3),), "receptance"
    )
    write_uff58(tmp_path / "a.uff", data, binary)
    whole = (tmp_path / "a.uff").read_bytes()
    if binary:
        one = np.array([1.0, 0.0]).tobytes()
        assert whole.count(one) == 1
        holed = whole.replace(one, np.array([np.nan, np.inf]).tobytes())
    else:
        one = f"{1:20.12E}{0:20.12E}".encode()
        assert whole.count(one) == 1
        holed = whole.replace(one, f"{np.nan:20.12E}{np.inf:20.12E}".encode())
    (tmp_path / "a.uff").write_bytes(holed)
    read = load_frf_set(tmp_path / "a.uff")
    np.testing.assert_allclose(read.frequency_hz, frequency[1:], atol=1e-9)
    np.testing.assert_allclose(read.frf[:, 0, 0], data.frf[1:, 0, 0], atol=1e-9)
    assert read.notes == ("the line at 0 Hz was left out: not all FRFs are numbers there",)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # it leaves its file open
@pytest.mark.parametrize("kind", [4, 6])
def test_uneven_binary_data_are_read_as_pyuff_writes_them(tmp_path: Path, kind: int) -> None:
    """It announces the bytes of one number for every point."""
    x = np.geomspace(5, 55, 40)
    values = np.exp(1j * x) if kind == 6 else np.sin(x)
    head = {"type": 58, "binary": 1, "func_type": 4 if kind == 6 else 6, "abscissa_spacing": 0}
    ends = {"rsp_node": 2, "rsp_dir": 3, "ref_node": 1, "ref_dir": 3}
    codes = {"abscissa_spec_data_type": 18, "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13}
    values_58 = {"ord_data_type": kind, "x": x, "data": values}
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets({**head, **ends, **codes, **values_58}, "add")
    gc.collect()
    found = read_records(tmp_path / "a.uff").records[0]
    np.testing.assert_array_equal(found.x, x)
    np.testing.assert_array_equal(found.values, values)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_line_end_is_read(tmp_path: Path, end: str) -> None:
    np.testing.assert_array_equal(load(tmp_path, text([Dataset58(some_frf())], end)).frf[:, 0, 0], some_frf())


@given(st.lists(st.sampled_from(["\n", "\r\n"]), min_size=40, max_size=40))
@settings(max_examples=30, deadline=None)
def test_mixed_line_ends_are_read(tmp_path_factory: pytest.TempPathFactory, ends: list[str]) -> None:
    lines = [*Dataset58(some_frf()).lines(), *coherence(np.full(5, 0.5)).lines()]
    content = "".join(line + end for line, end in zip(lines, ends, strict=False))
    np.testing.assert_array_equal(load(tmp_path_factory.mktemp("ends"), content).frf[:, 0, 0], some_frf())


def test_many_lines_are_read_at_once_and_a_bad_one_is_named(tmp_path: Path) -> None:
    """Lines that are alike are read together; one that ends or begins otherwise is still what it is."""
    values = np.arange(60.0) * (1 + 2j)
    lines = Dataset58(values).lines()
    odd = "".join(line + ("\r\n" if n == 30 else "\n") for n, line in enumerate(lines))
    for content in (odd, odd.replace("\r\n", "\n"), odd.replace("\r\n", "\n").replace("\n", "\r")):
        np.testing.assert_array_equal(load(tmp_path, content).frf[:, 0, 0], values)
    for wrong in (lines[30][:-1], lines[30][:-1] + " ", lines[30][:-1] + "x"):
        broken = [*lines[:30], wrong, *lines[31:]]
        with pytest.raises(InputError, match="line 31: "):
            load(tmp_path, "".join(line + "\n" for line in broken))


def test_vendors_habits_are_read(tmp_path: Path) -> None:
    plain = text([Dataset58(some_frf())]).decode()
    habits = {
        "trailing blanks everywhere": "\n".join(line.ljust(80) for line in plain.splitlines()),
        "no line end at the end": plain.rstrip("\n"),
        "end-of-file mark of DOS": plain + "\x1a",
        "byte order mark": "\ufeff" + plain,
        "blank lines between datasets": "\n\n" + plain + "\n\n",
        "exponents with D": plain.replace("e-0", "D-0").replace("e+0", "D+0"),
        "names longer than ten letters": text(
            [Dataset58(some_frf(), names=("a_point_name", "another_long_name"))]
        ).decode(),
        "other datasets": "    -1\n    15\n" + f"{1:10d}" * 4 + "\n    -1\n" + plain,
        "other functions": text([Dataset58(some_frf(1), function=3)]).decode() + plain,
    }
    for name, content in habits.items():
        np.testing.assert_array_equal(load(tmp_path, content).frf[:, 0, 0], some_frf(), err_msg=name)


def test_double_uneven_data_are_read_in_the_standard_and_in_the_twenty_column_layout(tmp_path: Path) -> None:
    uneven = some_set(lines=3, outputs=1, inputs=1, frequency_hz=np.array([1.0, 2.0, 4.5]), coherence=None)
    path = tmp_path / "x.uff"
    write_uff58(path, uneven)
    standard = path.read_text()
    body = standard.splitlines()[13:-1]
    assert [len(line) for line in body] == [53] * 3
    wide = standard.replace("\n".join(body), "\n".join(line[:13].rjust(20) + line[13:] for line in body))
    for content in (standard, wide):
        assert_same(load(tmp_path, content), uneven, rtol=1e-12)


@pytest.mark.parametrize("binary", [False, True])
@settings(max_examples=60, deadline=None)
@given(frf_set=sets())
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory, binary: bool, frf_set: FrfSet
) -> None:
    path = tmp_path_factory.mktemp("round") / "x.uff"
    write_uff58(path, frf_set, binary=binary)
    read = load_frf_set(path)
    assert_same(read, frf_set, rtol=0 if binary else 1e-12)
    # pyuff fails or goes wrong at single points; everything else it must see as we do.
    if len(frf_set.frequency_hz) > 1:
        other = pyuff.UFF(str(path)).read_sets()
        other = [other] if isinstance(other, dict) else other
        for mine, theirs in zip(read_records(path).records, other, strict=True):
            np.testing.assert_array_equal(mine.values, theirs["data"])
            np.testing.assert_allclose(mine.x, theirs["x"], rtol=1e-14)
            assert (mine.response.node, mine.reference.direction) == (theirs["rsp_node"], theirs["ref_dir"])


@pytest.mark.parametrize("order", [">", "<"])
@pytest.mark.parametrize("precision", ["f4", "f8"])
@pytest.mark.parametrize("habit", ["as the standard", "line end behind the data", "half the number of bytes"])
def test_binary_data_of_either_byte_order_and_in_vendors_habits(
    tmp_path: Path, order: str, precision: str, habit: str
) -> None:
    frf = some_frf()
    numbers = np.stack([frf.real, frf.imag], 1).astype(order + precision)
    announced = numbers.nbytes // 2 if habit.startswith("half") else numbers.nbytes
    head = Dataset58(frf).lines()[:13]
    head[1] = f"    58b{1 if order == '<' else 2:6d}{2:6d}{11:12d}{announced:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    head[8] = f"{5 if precision == 'f4' else 6:10d}" + head[8][10:]
    content = (
        "\n".join(head).encode()
        + b"\n"
        + numbers.tobytes()
        + (b"\r\n" if habit.startswith("line") else b"")
        + b"    -1\n"
    )
    expected = numbers.astype(float) @ [1, 1j]
    np.testing.assert_array_equal(load(tmp_path, content).frf[:, 0, 0], expected)
    if not habit.startswith("line"):  # a lost byte and an added line end make the right length again
        with pytest.raises(InputError, match="not followed by -1"):
            load(tmp_path, content.replace(numbers.tobytes(), numbers.tobytes()[:-1]))


def test_binary_data_that_look_like_the_end_of_a_dataset_are_read(tmp_path: Path) -> None:
    trap = np.frombuffer(b"\n    -1\n" + b"    -1\n\n", "<f8")
    frf_set = some_set(
        lines=2,
        outputs=1,
        inputs=1,
        coherence=None,
        frf=np.array([trap[0] + 1j, trap[1] + 2j])[:, None, None],
    )
    path = tmp_path / "x.uff"
    write_uff58(path, frf_set, binary=True)
    assert_same(load_frf_set(path), frf_set)


def test_binary_not_a_number_and_foreign_formats_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    write_uff58(path, some_set(outputs=1, inputs=1, coherence=None), binary=True)
    content = path.read_bytes()
    at = content.rindex(b"    -1") - 16
    with pytest.raises(InputError, match="value 7 is not finite"):
        load(tmp_path, content[:at] + np.array([np.nan]).tobytes() + content[at + 8 :])
    with pytest.raises(InputError, match="export the file as ASCII"):
        load(tmp_path, content.replace(b"58b     1     2", b"58b     1     3"))


def test_a_signalling_not_a_number_is_refused_like_any_other(tmp_path: Path) -> None:
    """Turning it into double precision warns, and a warning is no sentence."""
    frf = some_frf()
    numbers = np.stack([frf.real, frf.imag], 1).astype("<f4")
    numbers.view("<u4")[3, 0] = 0x7F800001
    head = Dataset58(frf).lines()[:13]
    head[1] = f"    58b{1:6d}{2:6d}{11:12d}{numbers.nbytes:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    with pytest.raises(InputError, match="value 4 is not finite"):
        load(tmp_path, "\n".join(head).encode() + b"\n" + numbers.tobytes() + b"    -1\n")


def test_time_histories_with_blocks_and_units(tmp_path: Path) -> None:
    def signal(seed: int, **changes: object) -> Dataset58:
        values = some_frf(seed).real
        return Dataset58(
            values, function=1, start=0, step=1 / 512, abscissa=(17, "s"), denominator=(0, "NONE"), **changes
        )  # type: ignore[arg-type]

    hits = [
        signal(2 * hit + kind, **named)
        for hit in range(3)
        for kind, named in enumerate(({"ordinate": (12, "g")}, {"ordinate": (13, "N")}))
    ]
    path = tmp_path / "x.unv"
    path.write_bytes(text(hits))
    read = load_time_history(path)
    assert read.data.shape == (3, 5, 2) and read.units == ("m/s^2", "N")
    assert read.sample_rate_hz == pytest.approx(512, rel=1e-5)
    np.testing.assert_allclose(read.data[2, :, 0], G * some_frf(4).real, rtol=1e-12)
    np.testing.assert_array_equal(read.data[1, :, 1], some_frf(3).real)
    path.write_bytes(text(hits[:-1]))
    with pytest.raises(InputError, match="different numbers of blocks"):
        load_time_history(path)
    path.write_bytes(text([signal(0, ordinate=(12, "NONE"))]))
    with pytest.raises(InputError, match="gives no unit for acceleration"):
        load_time_history(path)
    assert load_time_history(path, {"acceleration": "g"}).data[0, 0, 0] == pytest.approx(
        G * some_frf(0)[0].real, rel=1e-12
    )


def test_measured_files_are_read_as_pyuff_reads_them() -> None:
    folder = shared("data", "pyuff_measured_uff")
    for path in [*sorted(folder.glob("*.uff")), shared("data", "uliege_aircraft", "aircraft_converted.uff")]:
        theirs = pyuff.UFF(str(path)).read_sets()
        theirs = [one for one in ([theirs] if isinstance(theirs, dict) else theirs) if one["type"] == 58]
        records = read_records(path).records
        assert len(records) == len(theirs)
        for mine, other in zip(records, theirs, strict=True):
            np.testing.assert_array_equal(mine.values, other["data"])
            np.testing.assert_allclose(mine.x, other["x"], rtol=1e-12)
            assert (mine.function, mine.response.node, mine.ordinate.code) == (
                other["func_type"],
                other["rsp_node"],
                other["ordinate_spec_data_type"],
            )


def test_the_converted_aircraft_asks_for_its_unit_and_equals_its_source() -> None:
    path = shared("data", "uliege_aircraft", "aircraft_converted.uff")
    with pytest.raises(InputError, match="dataset 2, line 82: the file gives no unit"):
        load_frf_set(path)
    read = load_frf_set(path, FrfFileOptions(unit="m/s^2/N"))
    source = np.load(shared("data", "uliege_aircraft", "frf_g_per_N.npz"))["H"]
    assert read.frf.shape == (1601, 3, 74)
    scale = np.abs(source).max() * G
    np.testing.assert_allclose(read.frf, G * source.astype(complex).transpose(2, 1, 0), atol=1e-6 * scale)


def test_a_hammer_test_of_252_records_loads_whole() -> None:
    path = shared("hidden", "none_101", "posture1.uff")
    read = load_frf_set(path, FrfFileOptions(averages=4, window_decay_per_s=0.69))
    assert read.frf.shape == (124, 42, 3) and read.measured.all() and read.coherence is not None
    assert read.frf[0, 0, 0] == -8.98560e-06 - 1.02688e-05j
    assert read.frequency_hz[1] == 2.50061e00 + 6.25153e-01
