"""Several results as one comparison: what differs is said, what cannot be compared is refused."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError
from identify.reports.compare.pick import matched, shape_mac, shared
from identify.results import file as result_file
from identify.results.comparison import apart_in_std, compared, differing, unique_labels
from tests.reports.modes_sample import modes_result
from tests.reports.sample import frf_result, modal_result


def _written(folder: Path, **runs: object) -> list[Path]:
    files = [folder / f"{name}.h5" for name in runs]
    for file, run in zip(files, runs.values(), strict=True):
        result_file.write(run, file)
    return files


def test_the_better_run_is_named(tmp_path: Path) -> None:
    found = compared(_written(tmp_path, good=frf_result(20, 3, gap=1.01), bad=frf_result(20, 3, gap=3.2)))
    assert "1.01 (good), 3.20 (bad); good is lowest" in found.verdict[0]
    assert len(found.verdict) == 3


def test_a_run_beside_itself_differs_in_nothing(tmp_path: Path) -> None:
    found = compared(_written(tmp_path, a=frf_result(20, 3), b=frf_result(20, 3)))
    assert "there is little between them" in found.verdict[0]
    assert found.verdict[2].startswith("0 of 4 common parameters of b differ")
    (one,) = [s for s in shared(found) if s.name == "posture1"]
    assert len(one.frfs) == 2
    a, b = one.runs.values()
    assert {mode: other for mode, (other, _) in matched(a, b).items()} == {0: 0, 1: 1, 2: 2, 3: 3}
    mac = shape_mac(one)
    assert mac is not None and np.diag(mac.values) == pytest.approx(1.0)


def test_a_parameter_outside_its_uncertainty_differs() -> None:
    a = frf_result(20, 3)
    value = a.parameters.value.copy()
    value[0] *= np.exp(1.9 * np.hypot(0.011, 0.011))
    within = dataclasses.replace(a, parameters=dataclasses.replace(a.parameters, value=value))
    assert apart_in_std(a, within)["joint1.rz.stiffness"] == pytest.approx(1.9)
    assert differing(a, within) == []
    value = value.copy()
    value[0] *= 1.01
    beyond = dataclasses.replace(a, parameters=dataclasses.replace(a.parameters, value=value))
    assert differing(a, beyond) == ["joint1.rz.stiffness"]


def test_only_common_lines_and_pairs_are_laid_over_each_other(tmp_path: Path) -> None:
    one, other = frf_result(40, 3), frf_result(40, 3)
    m = other.measurements["posture1"]
    assert m.frf is not None
    cut = dataclasses.replace(
        m.frf,
        **{
            name: getattr(m.frf, name)[5:, 2:]
            for name in ("measured", "initial", "fitted", "band_95", "noise", "coherence")
        },
        **{
            name: getattr(m.frf, name)[2:]
            for name in ("output", "input", "gap", "relative_error", "frac", "area_error")
        },
        frequency_hz=m.frf.frequency_hz[5:],
    )
    other = dataclasses.replace(other, measurements={"posture1": dataclasses.replace(m, frf=cut)})
    found = shared(compared(_written(tmp_path, one=one, other=other)))
    assert [s.name for s in found] == ["posture1"]
    a, b = found[0].frfs.values()
    assert a.output == b.output == m.frf.output[2:]
    assert np.array_equal(a.measured, m.frf.measured[5:, 2:]) and np.array_equal(a.fitted, b.fitted)


def test_what_makes_a_comparison_doubtful_is_noted(tmp_path: Path) -> None:
    one = frf_result(20, 3)
    m = dataclasses.replace(one.measurements["posture1"], sha256="ef" * 32)
    other = dataclasses.replace(one, cost_kind="frf-area", converged=False, measurements={"posture1": m})
    notes = " ".join(compared(_written(tmp_path, one=one, other=other)).notes)
    for said in ("other did not converge", "different kinds of cost", "different data: posture1"):
        assert said in notes


def test_labels_tell_files_of_the_same_name_apart() -> None:
    assert unique_labels([Path("old/arm.h5"), Path("new/arm.h5")]) == ["old/arm", "new/arm"]
    assert unique_labels([Path("old/a.h5"), Path("new/b.h5")]) == ["a", "b"]


def test_what_cannot_be_compared_is_refused(tmp_path: Path) -> None:
    fit, modes = _written(tmp_path, fit=modal_result(), modes=modes_result())
    with pytest.raises(InputError, match="holds a modal analysis"):
        compared([fit, modes])
    with pytest.raises(InputError, match="named twice"):
        compared([fit, fit])


def test_report_and_compare_write_the_same_comparison(tmp_path: Path) -> None:
    files = [str(file) for file in _written(tmp_path, a=modal_result(), b=modal_result(seed=9))]
    said = CliRunner().invoke(app, ["compare", *files, "--report"])
    assert said.exit_code == 0, said.output
    page = tmp_path / "a_b_compare.html"
    before = page.read_bytes()
    page.unlink()
    assert CliRunner().invoke(app, ["report", *files]).exit_code == 0
    assert page.read_bytes() == before
    assert (tmp_path / "a_b_compare.pdf").read_bytes().startswith(b"%PDF")
