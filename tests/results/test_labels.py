"""Result files describe themselves: every dataset has its unit, stands over named dimensions, and opens as a
labelled array elsewhere; files of the old layout are read.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import re
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import h5py
import numpy as np
import pytest
import xarray

import identify
from identify.core.analyses import OF_KIND
from identify.core.errors import InputError
from identify.core.registry import load
from identify.reports.kinds import read_any
from identify.reports.outcome import Result
from identify.results import file as result_file
from identify.results.labels import FIXED, Level, declared, level
from tests.reports.discovery_sample import discovery_result
from tests.reports.kinds import CASES, Case
from tests.reports.modes_sample import modes_result
from tests.reports.sample import frf_result

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: case.name)
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Path]:
    """A result of each kind, and its file."""
    case: Case = request.param
    result, path = case.make()[0], tmp_path_factory.mktemp(case.name) / "x.h5"
    result_file.write(result, path)
    return result, path


@pytest.fixture(scope="module")
def pages() -> ModuleType:
    """What writes the reference of the documentation."""
    spec = importlib.util.spec_from_file_location("reference_pages", ROOT / "docs" / "reference_pages.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _datasets(path: Path) -> Iterator[tuple[str, str, tuple[str, ...], bool]]:
    """Path, unit, names of the scales, and whether it is a mere scale, of all datasets of a file."""
    with h5py.File(path) as file:
        names: list[str] = []
        file.visit(names.append)
        for name in names:
            one = file[name]
            assert " " not in name
            if isinstance(one, h5py.Dataset):
                own = name.rpartition("/")[2]
                dims = tuple(own if one.is_scale else dim[0].name.rpartition("/")[2] for dim in one.dims)
                bare = one.is_scale and (own in FIXED or b"netCDF" in one.attrs["NAME"])
                yield f"/{name}", one.attrs["units"], dims, bare
            elif name:
                assert set(one.attrs) <= {"name_encoded"}, "attributes describe"


def test_every_dataset_has_its_unit_and_its_dimensions_as_the_documentation_says(
    made: tuple[Any, Path], pages: ModuleType
) -> None:
    result, path = made
    rows = {row[0]: row[1:] for row in pages.datasets(type(result))}
    elsewhere = tuple(name.removesuffix("...") for name in rows if name.endswith("..."))
    seen = 0
    for name, unit, dims, bare in _datasets(path):
        if bare or name.startswith(elsewhere):
            continue
        (row,) = [row for row in rows if re.fullmatch(re.escape(row).replace(r"\*", "[^/]+"), name)]
        assert len(dims) == len(rows[row][0])
        with h5py.File(path) as file:
            if file[name].size:
                assert dims == rows[row][0], name
        assert unit == rows[row][1] or rows[row][1].startswith("see "), name
        seen += 1
    assert seen > 20


def test_a_file_and_the_result_are_the_same_tree(made: tuple[Any, Path]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with xarray.open_datatree(made[1], engine="h5netcdf") as tree:
            tree.load()
    of_result = identify.read_result(made[1]).to_xarray()
    xarray.testing.assert_equal(tree, of_result)
    for node in tree.subtree:
        assert not [dim for dim in node.dims if str(dim).startswith("phony")]
        for name, variable in node.variables.items():
            assert variable.attrs["units"] == of_result[node.path][name].attrs["units"]


def test_values_are_found_by_their_labels() -> None:
    result = frf_result(60, 4)
    tree = Result(result, (Path("x.h5"),)).to_xarray()
    name = result.parameters.name[1]
    value = tree["parameters/value"].sel(name=name)
    assert float(value) == result.parameters.value[1]
    assert str(tree["parameters/unit"].sel(name=name).values) == result.parameters.unit[1]
    frf = next(iter(result.measurements.values())).frf
    assert frf is not None
    measured = tree["measurements/posture1/frf/measured"]
    assert measured.attrs["units"] == frf.unit
    nearest = measured.sel(frequency_hz=frf.frequency_hz[7] + 1e-6, method="nearest")
    assert np.array_equal(nearest.values, frf.measured[7])


def test_every_array_of_every_class_says_its_dimensions() -> None:
    def told(kind: type) -> None:
        for field in dataclasses.fields(kind):
            text = str(field.type)
            if re.search(r"\b(Array|Complex|Texts|NDArray)", text):
                assert declared(kind).get(field.name, ((),))[0], f"{kind.__name__}.{field.name}"
            for inner in re.findall(r"\b[A-Z]\w+", text):
                found = getattr(sys.modules[kind.__module__], inner, None)
                if dataclasses.is_dataclass(found) and found not in seen:
                    seen.add(found)
                    told(found)  # type: ignore[arg-type]

    seen: set[Any] = set()
    for analysis in OF_KIND.values():
        told(load(analysis.result))
    assert len(seen) > 40


def test_arrays_that_are_not_as_declared_stand_over_dimensions_of_their_own(tmp_path: Path) -> None:
    result = frf_result(60, 4)
    odd = dataclasses.replace(result, correlation=np.zeros((2, 3, 4)), history=np.zeros(3))
    fields = {one.name: one.dims for one in level(odd).fields}
    assert fields["correlation"] == ("correlation_0", "correlation_1", "correlation_2")
    assert fields["history"] == ("history_0",)
    result_file.write(odd, tmp_path / "x.h5")
    assert read_any(tmp_path / "x.h5").correlation.shape == (2, 3, 4)


def test_without_xarray_one_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(InputError, match=r"no xarray in this Python; expected xarray; install the extra"):
        Result(frf_result(60, 4), (Path("x.h5"),)).to_xarray()


def test_a_result_without_parameters_says_so() -> None:
    with pytest.raises(InputError, match=r"m\.h5: a modal analysis has no table of parameters.*`tables`"):
        _ = Result(modes_result(), (Path("m.h5"),)).parameters


def _write_layout_1(group: h5py.Group, own: Level) -> None:
    """As identify wrote before its files had labels: numbers as attributes, no units, no scales."""
    for name, value, *_ in own.fields:
        if dataclasses.is_dataclass(value) or isinstance(value, dict):
            _write_layout_1(group.create_group(name, track_order=True), level(value, own))
        elif isinstance(value, tuple):
            texts = np.array(value, dtype=object)
            group.create_dataset(name, data=texts, dtype=h5py.string_dtype(), shape=(len(value),))
        elif isinstance(value, (np.ndarray, str)):
            group.create_dataset(name, data=value)
        else:
            group.attrs[name] = value


@pytest.mark.parametrize("result", [frf_result(60, 4), discovery_result(), modes_result()])
def test_files_of_layout_1_are_read(result: Any, tmp_path: Path) -> None:
    result_file.write(result, tmp_path / "new.h5")
    with h5py.File(tmp_path / "old.h5", "w") as file:
        _write_layout_1(file, level(dataclasses.replace(result, layout=1)))
        assert file.attrs["layout"] == 1
        assert "units" not in file["verdict"].attrs
    old, new = (read_any(tmp_path / name) for name in ("old.h5", "new.h5"))
    assert (old.layout, new.layout) == (1, result_file.LAYOUT)
    result_file.write(old, tmp_path / "again.h5")
    again = read_any(tmp_path / "again.h5")
    assert again.layout == result_file.LAYOUT
    xarray.testing.assert_identical(
        Result(new, (Path("x.h5"),)).to_xarray(), Result(again, (Path("x.h5"),)).to_xarray()
    )
