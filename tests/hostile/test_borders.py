"""Whatever is put in place of a file, every loader says in one sentence that it is none."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest

from identify.core import binary_input
from identify.core.config import family_of
from identify.core.errors import InputError, InputErrors
from identify.core.text_input import read_csv, read_text
from identify.core.tree import Group
from identify.core.xml_input import read_xml
from identify.core.yaml_input import parse_yaml, plain
from identify.measured.loaders import FORMAT_OF_SUFFIX, LOADERS, TIME_LOADERS, load_frf_set, load_time_history
from identify.measured.modal_tables import read_modal_table
from identify.measured.record_files import RecordFile
from identify.measured.uff.geometry import read_geometry
from identify.measured.uff.shapes import read_shapes
from identify.measured.uff.write import write_uff58
from identify.reports.kinds import read_any
from identify.robot.dh import read_dh
from identify.robot.points import read_points
from identify.robot.urdf import read_urdf
from identify.robot.visual import read_mesh
from identify.vibration.reference import read_reference
from identify.vibration.study import read_study
from tests.benchmarks.hostile import examine, table
from tests.measured.frf_sets import some_set

SUFFIX_OF = {form: suffix for suffix, form in FORMAT_OF_SUFFIX.items()}
READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    **{f"frf {name}": (SUFFIX_OF[name], load_frf_set) for name in LOADERS.builtin},
    **{f"time {name}": (SUFFIX_OF[name], load_time_history) for name in TIME_LOADERS.builtin},
    **{f"record {name}": (suffix, RecordFile) for name, suffix in SUFFIX_OF.items()},
    "modes yaml": (".yaml", read_modal_table),
    "modes csv": (".csv", read_modal_table),
    "geometry": (".uff", read_geometry),
    "shapes": (".uff", read_shapes),
    "urdf": (".urdf", read_urdf),
    "xacro": (".xacro", read_urdf),
    "mjcf": (".xml", read_urdf),
    "mesh dae": (".dae", read_mesh),
    "mesh stl": (".stl", read_mesh),
    "mesh obj": (".obj", read_mesh),
    "dh": (".yaml", read_dh),
    "points": (".csv", read_points),
    "reference": (".yaml", partial(read_reference, known=["a"])),
    "study": (".yaml", read_study),
    "family": (".yaml", family_of),
    "result": (".h5", read_any),
}
CONTENT = {
    "garbage": bytes(np.random.default_rng(0).integers(0, 256, 5000, dtype=np.uint8)),
    "NUL": b"\x00" * 100_000,
    "Latin-1": "name: Gelenk f\xfcr Pr\xfcfung\n".encode("latin-1"),
    "HDF5 cut": b"\x89HDF\r\n\x1a\n" + b"\x00" * 40,
    "deep": b"a: " + b"[" * 200_000,
    "deep XML": b"<a>" * 200_000,
}


def _refused(read: Callable[[Path], object], path: Path) -> None:
    with pytest.raises((InputError, InputErrors)) as caught:
        read(path)
    assert path.stem in str(caught.value) and str(caught.value).isprintable()


@pytest.mark.parametrize("name", READERS)
def test_what_is_no_file_is_refused(name: str, tmp_path: Path) -> None:
    suffix, read = READERS[name]
    _refused(read, tmp_path / f"missing{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    _refused(read, tmp_path / f"folder{suffix}")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / f"pipe{suffix}")
        _refused(read, tmp_path / f"pipe{suffix}")
        (tmp_path / f"zero{suffix}").symlink_to("/dev/zero")
        _refused(read, tmp_path / f"zero{suffix}")
    with (tmp_path / f"huge{suffix}").open("wb") as file:
        file.truncate(2**40)
    _refused(read, tmp_path / f"huge{suffix}")


@pytest.mark.parametrize("name", [name for name in READERS if name != "family"])
@pytest.mark.parametrize("content", CONTENT)
def test_what_is_none_of_the_kind_is_refused(name: str, content: str, tmp_path: Path) -> None:
    suffix, read = READERS[name]
    (tmp_path / f"broken{suffix}").write_bytes(CONTENT[content])
    _refused(read, tmp_path / f"broken{suffix}")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a: 1\nb: !!float x", "line 2: the tag"),
        ("a: &x {<<: *x}", "line 1: the anchor 'x' contains itself"),
        ("a: &x 1\nb: &x 2", "line 2: the anchor 'x' a second time"),
        ("a: " + "1" * 400, "line 1: a number of 400 digits"),
        ('a: "x\\0y"', r"line 1: the control character U\+0000"),
        ("? [a, b]\n: c", "line 1: a key that is a list"),
        ("%YAML 1.1\n---\na: 1", "line 1: a directive"),
        ("a: " + "[" * 30 + "]" * 30, "nested deeper than 20"),
        (
            "a: &a [1,1,1,1,1,1,1,1,1,1]\n"
            + "\n".join(f"{y}: &{y} [{','.join(['*' + x] * 10)}]" for x, y in ["ab", "bc", "cd", "de", "ef"]),
            "more than 250000 values",
        ),
    ],
)
def test_what_a_config_does_not_need_is_refused(text: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        parse_yaml(text, "f.yaml")


def test_plain_yaml_is_read_and_a_date_is_text() -> None:
    text = "a: &x [1, 2.5]\nb: *x\nc: 2026-13-45\nd: {<<: {e: true}}\n"
    found = plain(parse_yaml(text, "f.yaml"))
    assert found == {"a": [1, 2.5], "b": [1, 2.5], "c": "2026-13-45", "d": {"e": True}}


def test_text_is_utf8_with_or_without_a_mark_and_ends_its_lines_as_it_likes(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_bytes("\ufeffa,ü\r\n1,2\r\n".encode())
    assert read_text(tmp_path / "x.csv", "text") == "a,ü\n1,2\n"
    (tmp_path / "x.csv").write_bytes(b"a,b\n" + b"x" * 140_000 + b",1\n")
    with pytest.raises(InputError, match="line 2: cells that cannot be read"):
        read_csv(tmp_path / "x.csv", "CSV")


@pytest.mark.parametrize("encoding", ["utf-16", "iso-8859-1", "windows-1252"])
def test_xml_declares_its_encoding(encoding: str, tmp_path: Path) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?>\n<robot name="Prüfstand"/>'
    (tmp_path / "x.urdf").write_bytes(text.encode(encoding))
    assert read_xml(tmp_path / "x.urdf", "a URDF file")[0].get("name") == "Prüfstand"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('<!DOCTYPE r [<!ENTITY a "x">]>\n<robot name="&a;"/>', "line 1: XML that is not read .an entity"),
        ('<?xml version="1.0" encoding="none"?><robot/>', "unknown encoding"),
        ('<robot name="a&#10;b"/>', "the control character"),
    ],
)
def test_xml_of_other_kinds_is_refused(text: str, found: str, tmp_path: Path) -> None:
    (tmp_path / "x.urdf").write_text(text)
    with pytest.raises(InputError, match=found):
        read_xml(tmp_path / "x.urdf", "a URDF file")


def _external_link(file: h5py.File) -> None:
    file["frf"] = h5py.ExternalLink("other.h5", "/x")


def _loop(file: h5py.File) -> None:
    file["frf"], file["other"] = h5py.SoftLink("/other"), h5py.SoftLink("/frf")


def _raw(file: h5py.File) -> None:
    file.create_dataset("frf", (4,), "f8", external=[("raw.bin", 0, 32)])


def _virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((4,), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", (4,))
    file.create_virtual_dataset("frf", layout)


def _unwritten(file: h5py.File) -> None:
    file.create_dataset("frf", (2**40,), "f8", chunks=(2**20,), compression="gzip")


def _compound(file: h5py.File) -> None:
    file["frf"] = np.zeros(3, [("a", "f8"), ("b", "f8"), ("c", "S3")])


def _reference(file: h5py.File) -> None:
    file.create_dataset("frf", (1,), h5py.ref_dtype)


def _within_itself(file: h5py.File) -> None:
    group = file.create_group("frf")
    group["again"] = group


@pytest.mark.parametrize(
    ("make", "found"),
    [
        (_external_link, "frf: a link into another file"),
        (_loop, "links that lead to each other"),
        (_raw, "frf: data in another file"),
        (_virtual, "frf: a virtual dataset"),
        (_unwritten, "frf: shape .* where the file holds 0"),
        (_compound, "frf: values of type"),
        (_reference, "frf: values of references"),
        (_within_itself, "groups nested deeper than"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_what_leads_out_of_an_hdf5_file_is_refused_by_name(
    make: Callable[[h5py.File], None], found: str, tmp_path: Path
) -> None:
    with h5py.File(tmp_path / "x.h5", "w") as file:
        make(file)
    with pytest.raises(InputError, match=found):
        binary_input.read_hdf5(tmp_path / "x.h5")


def test_links_within_a_file_and_every_kind_of_value_are_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["a/b"], file["link"] = np.arange(3.0), h5py.SoftLink("/a/b")
        file["z"], file["text"], file["texts"] = 1 + 2j, "ü", ["x", "yz"]
        file.attrs["n"] = 3
    names = ["link", "z", "text", "texts", "n", "gone"]
    here = binary_input.read_hdf5(tmp_path / "x.h5", names).members
    assert here["link"].tolist() == [0, 1, 2] and here["z"] == 1 + 2j and here["n"] == 3
    assert (here["text"], here["texts"]) == ("ü", ("x", "yz")) and "gone" not in here
    whole = binary_input.read_hdf5(tmp_path / "x.h5")
    assert isinstance(whole.members["a"], Group) and whole.attributes["n"] == 3


def test_a_child_that_dies_is_a_sentence_and_the_next_file_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["a"] = 1.0
    assert binary_input.read_hdf5(tmp_path / "x.h5").members["a"] == 1
    reader = binary_input._reader(os.getpid())
    ask = reader._ask

    def killed(request: dict[str, object], seconds: float) -> object:
        assert reader._process is not None
        os.kill(reader._process.pid, signal.SIGKILL)
        reader._process.wait()
        return ask(request, seconds)

    with monkeypatch.context() as patched:
        patched.setattr(reader, "_ask", killed)
        with pytest.raises(InputError, match=r"x\.h5: it breaks the library that reads it"):
            binary_input.read_hdf5(tmp_path / "x.h5")
    assert binary_input.read_hdf5(tmp_path / "x.h5").members["a"] == 1


@pytest.mark.parametrize("which", [0, 1, -1])
def test_a_lost_byte_of_binary_data_is_refused(which: int, tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    write_uff58(path, some_set(), binary=True)
    content = path.read_bytes()
    starts = [at for at in range(len(content)) if content.startswith(b"\n    -1\n", at)]
    at = starts[::2][which] - 9
    assert load_frf_set(path).frf.size
    path.write_bytes(content[:at] + content[at + 1 :])
    with pytest.raises(InputError):
        load_frf_set(path)


def test_a_byte_count_that_differs_from_the_record_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.uff"
    write_uff58(path, some_set(), binary=True)
    content = path.read_bytes()
    count = content.split(b"\n", 2)[1].split()[4]
    path.write_bytes(content.replace(count.rjust(12), str(int(count) - 8).encode().rjust(12), 1))
    with pytest.raises(InputError, match="bytes announced"):
        load_frf_set(path)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="mutants are read in forked processes")
def test_mutants_of_all_inputs_are_accepted_or_refused() -> None:
    counts, failures = examine(100, 20261122, "", None)
    assert not failures, "\n".join(failures)
    assert all(count["accepted"] + count["refused"] for count in counts.values()), table(counts)
    assert sum(count["accepted"] for count in counts.values()) > 10
