"""Maps of a fitted model against closed forms written in the tests, and its intervals against draws from the
covariance.
"""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path

import numpy as np
import pytest

from identify.batch import executor
from identify.batch.executor import open_executor
from identify.core.errors import InputError
from identify.map.asked import MapOptions, parse_grid
from identify.map.posture_map import map_postures
from identify.map.run import PART, map_part, run_map
from identify.model.modes import complex_modes
from identify.results import file as result_file
from identify.results import fit as results
from identify.results.fit import FitResult
from identify.results.map import MapPart, MapResult
from identify.vibration.fitted_model import fitted_model, tool_point
from identify.vibration.run import run_fit
from tests.batch import planar
from tests.batch.conftest import always, in_this_process


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The planar arm fitted at two postures; its files are gone afterwards, so the result must do."""
    folder = tmp_path_factory.mktemp("map")
    study = planar.write_study(folder / "study", planar.postures(2))
    angles = np.rad2deg(planar.postures(2))
    rows = [
        f"  - {{file: p{n}.csv, posture_deg: {q.tolist()}, noise: {{relative: {planar.NOISE}}}}}"
        for n, q in enumerate(angles, 1)
    ]
    study.write_text(study.read_text() + "\n".join(["band_hz: [4, 64]", "measurements:", *rows]) + "\n")
    run_fit(study, folder / "fit.h5", {})
    for path in (folder / "study").iterdir():
        path.unlink()
    return folder / "fit.h5"


GRID = MapOptions(grid=((1, -60.0, 60.0, 3), (3, -50.0, 50.0, 41)), lines=40, modes=3)


@pytest.fixture(scope="module")
def mapped(model: Path) -> MapResult:
    """A map over a grid of two joints."""
    with in_this_process():
        result, written = run_map(model, GRID)
    assert [path.name for path in written] == ["fit_map.h5", "fit_map.csv"]
    assert sorted(path.name for path in model.parent.iterdir()) == [
        "fit.h5",
        "fit_map.csv",
        "fit_map.h5",
        "study",
    ]
    return result


def _fitted(model: Path) -> tuple[np.ndarray, np.ndarray]:
    """Fitted stiffness and damping, (3,) each."""
    p = result_file.read(model, FitResult).parameters
    found = dict(zip(p.name, p.value, strict=True))
    stiffness, damping = (
        [found[f"joint{n}.rz.{what}"] for n in (1, 2, 3)] for what in ("stiffness", "damping")
    )
    return np.array(stiffness), np.array(damping)


def test_receptance_compliance_and_modes_are_those_of_the_closed_form(model: Path, mapped: MapResult) -> None:
    k, c = _fitted(model)
    rows = mapped.rows
    s = 2j * np.pi * mapped.line_hz[:, None, None]
    assert len(rows.name) == 123 > PART, "more than one part"
    for row in (0, 60, 122):
        q = np.deg2rad(rows.posture_deg[row])
        jacobian, mass = planar._jacobian(q, 3, 0.3), planar.mass_matrix(q)
        z = np.diag(k) + s * np.diag(c) + s**2 * mass
        h = jacobian @ np.linalg.solve(z, np.broadcast_to(jacobian.T, (len(s), 3, 2)))
        assert rows.receptance_m_per_n[row][:, :2, :2] == pytest.approx(h, rel=1e-5, abs=1e-12)
        assert np.abs(rows.receptance_m_per_n[row][:, 2]).max() == 0, "a planar arm does not move along z"
        assert rows.compliance_m_per_n[row, :2, :2] == pytest.approx(
            jacobian @ np.diag(1 / k) @ jacobian.T, rel=1e-6
        )
        assert rows.peak_m_per_n[row, 0] == pytest.approx(np.abs(h[:, 0, 0]).max(), rel=1e-5)
        state = np.block(
            [
                [np.zeros((3, 3)), np.eye(3)],
                [-np.linalg.solve(mass, np.diag(k)), -np.linalg.solve(mass, np.diag(c))],
            ]
        )
        poles = sorted((v for v in np.linalg.eigvals(state) if v.imag > 0), key=abs)
        assert rows.frequency_hz[row] == pytest.approx(np.abs(poles) / 2 / np.pi, rel=1e-6)
        assert rows.damping_ratio[row] == pytest.approx(-np.real(poles) / np.abs(poles), rel=1e-5)
        angles = np.cumsum(q)
        assert rows.tool_m[row, :2] == pytest.approx(
            [planar.LENGTH @ np.cos(angles), planar.LENGTH @ np.sin(angles)], abs=1e-9
        )


def test_intervals_are_those_of_draws_from_the_covariance(model: Path, mapped: MapResult) -> None:
    result: results.FitResult = result_file.read(model, FitResult)
    fitted = fitted_model(result, "fit.h5")
    system, rng = fitted.system(np.deg2rad(mapped.rows.posture_deg[7])), np.random.default_rng(1)
    drawn = fitted.values + rng.normal(size=(800, fitted.spread.shape[1])) @ fitted.spread.T
    assert np.std(np.log(drawn), axis=0) == pytest.approx(result.parameters.std, rel=0.15)
    modes = [complex_modes(*system.matrices(values)) for values in drawn]
    for key, low, high in (
        ("frequency_hz", "frequency_low_95", "frequency_high_95"),
        ("damping_ratio", "damping_low_95", "damping_high_95"),
    ):
        std = np.std([getattr(one, key) for one in modes], axis=0)
        half = (getattr(mapped.rows, high)[7] - getattr(mapped.rows, low)[7]) / 2
        assert half == pytest.approx(1.96 * std, rel=0.15), key


def test_the_csv_has_the_numbers_of_the_file(mapped: MapResult, model: Path) -> None:
    kept = result_file.read(model.with_name("fit_map.h5"), MapResult)
    with model.with_name("fit_map.csv").open() as stream:
        table = list(csv.DictReader(stream))
    assert [row["name"] for row in table] == list(kept.rows.name)
    assert [float(row["mode2_hz"]) for row in table] == pytest.approx(kept.rows.frequency_hz[:, 1])
    assert [float(row["mode1_damping_high"]) for row in table] == pytest.approx(
        kept.rows.damping_high_95[:, 0]
    )
    assert [float(row["peak_y_m_per_n"]) for row in table] == pytest.approx(kept.rows.peak_m_per_n[:, 1])
    assert [float(row["joint3_deg"]) for row in table[:3]] == pytest.approx([-50.0, -47.5, -45.0])


def test_a_cluster_gives_the_same_map(cluster: str, model: Path, mapped: MapResult, tmp_path: Path) -> None:
    with open_executor(cluster=cluster) as executor, always(executor):
        again, _ = run_map(model, GRID, tmp_path / "again.h5")
    for field in dataclasses.fields(mapped.rows):
        one, other = getattr(mapped.rows, field.name), getattr(again.rows, field.name)
        assert one == other if isinstance(one, tuple) else np.array_equal(one, other)


def test_a_table_of_postures(at_once: None, model: Path, mapped: MapResult, tmp_path: Path) -> None:
    table = tmp_path / "postures.csv"
    table.write_text("name,joint1_deg,joint2_deg,joint3_deg\nhome,0,60,30\nout,10,40,-20\n")
    result, _ = run_map(model, MapOptions(postures=table, lines=5, modes=9, tool=1), tmp_path / "t.h5")
    assert result.rows.name == ("home", "out")
    assert result.rows.frequency_hz.shape == (2, 9)
    assert np.isnan(result.rows.frequency_hz[:, 3:]).all(), "three joints, three modes"
    assert result.tool == "p1 on link2"
    for text, match in (
        ("name,joint1_deg\na,1\n", "columns joint1_deg to joint3_deg"),
        ("joint1_deg,joint2_deg,joint3_deg\n1,x,3\n", "line 2"),
    ):
        table.write_text(text)
        with pytest.raises(InputError, match=match):
            run_map(model, MapOptions(postures=table), tmp_path / "t.h5")
    with pytest.raises(InputError, match=r"postures\.csv: not a file for a map: an input"):
        run_map(model, MapOptions(postures=table), table.with_suffix(".h5"))
    assert table.read_text() == text, "the table stays"


def test_a_part_that_is_there_is_kept(model: Path, tmp_path: Path) -> None:
    place = {"link": "link3", "position": [0.3, 0.0, 0.0]}
    nothing = {"limit": None, "like": None, "node": None}
    arguments = {
        "asked": {"model": str(model), "point": place, "lines": [5.0, 6.0], "modes": 2, **nothing},
        "names": ["a"],
        "postures": [[0.0, 1.0, 0.3]],
        "out": str(tmp_path / "p.h5"),
    }
    assert map_part(**arguments, key="one", attempt=1) == {"kept": False}
    assert map_part(**arguments, key="one", attempt=1) == {"kept": True}
    assert map_part(**arguments, key="other", attempt=1) == {"kept": False}, "of another map"
    assert result_file.read(tmp_path / "p.h5", MapPart).rows.name == ("a",)


def test_the_fitted_posture_gives_the_modes_of_the_fit(model: Path) -> None:
    result: results.FitResult = result_file.read(model, FitResult)
    fitted = fitted_model(result, "fit.h5")
    rows = map_postures(
        fitted, tool_point(fitted, None), ["first"], fitted.posture[None], np.array([5.0, 9.0]), 3
    )
    assert rows.frequency_hz[0] == pytest.approx(result.measurements["p1"].modes.frequency_hz)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        (MapOptions(), "none or several"),
        (MapOptions(grid=((9, 0.0, 1.0, 2),)), "a joint from 1 to 3"),
        (MapOptions(grid=((1, 0.0, 1.0, 2),), tool=77), "no point 77; expected one of 1, 2"),
        (MapOptions(grid=((1, 0.0, 1.0, 2),), band_hz=(9.0, 2.0)), "two frequencies, the lower first"),
    ],
)
def test_what_cannot_be_mapped(
    at_once: None, model: Path, tmp_path: Path, options: MapOptions, match: str
) -> None:
    with pytest.raises(InputError, match=match):
        run_map(model, options, tmp_path / "x.h5")


def test_results_that_cannot_be_mapped(at_once: None, model: Path, tmp_path: Path) -> None:
    result: results.FitResult = result_file.read(model, FitResult)
    old = dataclasses.replace(result, description=None)
    with pytest.raises(InputError, match=r"old\.h5: without the robot's description"):
        fitted_model(old, "old.h5")
    names = ("other.stiffness", *result.parameters.name[1:])
    other = dataclasses.replace(result, parameters=dataclasses.replace(result.parameters, name=names))
    with pytest.raises(InputError, match="other parameters than its config names"):
        fitted_model(other, "other.h5")
    with pytest.raises(InputError, match="JOINT:FIRST:LAST:COUNT"):
        parse_grid("2:-60:60")
    with pytest.raises(InputError, match="not a file for a map"):
        run_map(model, GRID, model)


def test_a_short_map_starts_no_other_process(model: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def started(*_: object) -> None:
        raise AssertionError("a worker was started")

    options = MapOptions(grid=((1, -60.0, 60.0, 2),), lines=8, modes=2)
    with monkeypatch.context() as patched:
        patched.setattr(executor, "perform", started)
        alone, _ = run_map(model, options, model.with_name("alone.h5"))
    assert alone.workers == "this process"
    asked, _ = run_map(model, options, model.with_name("asked.h5"), workers=1)
    assert asked.workers == "1 local worker"
    assert np.array_equal(asked.rows.receptance_m_per_n, alone.rows.receptance_m_per_n)
    many = MapOptions(grid=((1, -60.0, 60.0, PART + 1),), lines=8, modes=2)
    with monkeypatch.context() as patched, pytest.raises(InputError, match="worker was started"):
        patched.setattr(executor, "perform", started)
        run_map(model, many, model.with_name("many.h5"))
