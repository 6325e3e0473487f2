"""A damaged universal file gives the same numbers or an error that says where, never other numbers."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set
from identify.measured.uff.write import write_uff58
from tests.measured.frf_sets import by_pair, some_set
from tests.measured.uff_text import Dataset58, coherence, some_frf, text


def single_precision() -> bytes:
    """Two FRFs, one with coherence, as most programs write them."""
    gamma2 = coherence(np.array([0.9, 0.99, 1.0, 0.5, 0.999999]))
    return text([Dataset58(some_frf()), gamma2, Dataset58(some_frf(1), response=(103, -1))])


@cache
def written(binary: bool, even: bool, folder: Path) -> bytes:
    """The same from our own writer."""
    frequency = np.array([1.0, 2.0, 3.0, 4.0]) if even else np.array([1.0, 2.0, 3.5, 4.0])
    path = folder / "written.uff"
    write_uff58(path, some_set(lines=4, outputs=2, inputs=1, frequency_hz=frequency), binary=binary)
    return path.read_bytes()


@cache
def undamaged(kind: str, folder: Path) -> tuple[bytes, FrfSet]:
    """A file of a kind, and what it holds."""
    content = (
        single_precision() if kind == "single" else written("binary" in kind, "uneven" not in kind, folder)
    )
    return content, read(content, folder)


def read(content: bytes, folder: Path) -> FrfSet:
    path = folder / "damaged.uff"
    path.unlink(missing_ok=True)  # some disks wait when a file is cut to nothing and written again
    path.write_bytes(content)
    return load_frf_set(path)


def assert_nothing_else(content: bytes, whole: FrfSet, folder: Path) -> bool:
    """Same numbers for whatever is still there (True), or an error that names the file (False)."""
    try:
        damaged = read(content, folder)
    except InputError as error:
        assert "damaged.uff" in str(error)
        return False
    assert damaged.quantity == whole.quantity
    np.testing.assert_array_equal(damaged.frequency_hz, whole.frequency_hz)
    expected = by_pair(whole)
    for pair, (values, gamma2) in by_pair(damaged).items():
        np.testing.assert_array_equal(values, expected[pair][0])
        assert gamma2 is None or np.array_equal(gamma2, expected[pair][1])
    return True


def test_every_lost_byte_and_every_truncation(tmp_path: Path) -> None:
    content = single_precision()
    whole = read(content, tmp_path)
    survived = [
        assert_nothing_else(content[:at] + content[at + 1 :], whole, tmp_path) for at in range(len(content))
    ]
    survived += [assert_nothing_else(content[:at], whole, tmp_path) for at in range(len(content))]
    assert 0 < sum(survived) < len(survived) / 2


def test_every_lost_and_every_doubled_line(tmp_path: Path) -> None:
    content = single_precision()
    whole = read(content, tmp_path)
    lines = content.splitlines(keepends=True)
    for at in range(len(lines)):
        assert not assert_nothing_else(b"".join(lines[:at] + lines[at + 1 :]), whole, tmp_path)
        assert not assert_nothing_else(b"".join(lines[: at + 1] + lines[at:]), whole, tmp_path)


def damages(content: bytes) -> st.SearchStrategy[bytes]:
    """Up to three bytes lost, added or a piece cut out."""
    place = st.integers(0, len(content) - 1)
    return st.one_of(
        place.map(lambda at: content[:at] + content[at + 1 :]),
        st.tuples(place, st.binary(min_size=1, max_size=3)).map(
            lambda a: content[: a[0]] + a[1] + content[a[0] :]
        ),
        st.tuples(place, st.sampled_from([b"\n", b" ", b"7", b"-", b".", b"E", b"\r\n"])).map(
            lambda a: content[: a[0]] + a[1] + content[a[0] :]
        ),
        st.tuples(place, st.integers(1, 200)).map(lambda a: content[: a[0]] + content[a[0] + a[1] :]),
    )


@pytest.mark.parametrize("kind", ["single", "ascii", "ascii uneven", "binary", "binary uneven"])
@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_random_damage(kind: str, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = tmp_path_factory.getbasetemp()
    content, whole = undamaged(kind, folder)
    assert_nothing_else(data.draw(damages(content)), whole, folder)


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        (b"9.99999e-01", b"        NaN", "line 30: ' +NaN'"),
        (b" 9.00000e-01", b" 9.0000 e-01", r"line 30: .* in the columns of a number"),
        (b"  9.00000e-01", b" 9.00000e-01", r"line 30: values in \d+ columns"),
        (b"    -1\n    -1", b"    -1\nhello\n    -1", "'hello' between datasets"),
        (b"        12   3", b"       12    3", "record 6 .* not in its columns"),
    ],
)
def test_the_error_says_where_and_what(tmp_path: Path, old: bytes, new: bytes, found: str) -> None:
    content = single_precision()
    assert old in content
    with pytest.raises(InputError, match=found):
        read(content.replace(old, new, 1), tmp_path)


@pytest.mark.parametrize("content", [b"", b"\n", b"frequency_hz,output\n", b"\x89HDF\r\n\x1a\n"])
def test_what_is_no_universal_file_is_refused(tmp_path: Path, content: bytes) -> None:
    with pytest.raises(InputError):
        read(content, tmp_path)
