"""Maps corrected by measured postures, against an arm whose stiffness depends on the posture."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.map.asked import MapOptions
from identify.map.posture_map import look, peak_lines, rows_of
from identify.map.residuals import Source, by_steps, peak_slope, steps
from identify.map.run import run_map
from identify.map.unknown import corrected, learned_of, unknown
from identify.model.frf import frf_by_solve
from identify.results import file as result_file
from identify.results.discovery import fit_of
from identify.results.map import MapResult
from identify.vibration.fitted_model import fitted_model, tool_point
from tests.batch import planar
from tests.map.conftest import fitted, modes, stiffer

UNSEEN = planar.postures(8, seed=7)
Measured = Callable[[int], Path]


def table(folder: Path, angles: np.ndarray) -> Path:
    """A table of postures."""
    rows = [",".join(map(str, np.rad2deg(q))) for q in angles]
    (folder / "postures.csv").write_text("\n".join(["joint1_deg,joint2_deg,joint3_deg", *rows]) + "\n")
    return folder / "postures.csv"


def mapped(model: Path, folder: Path, angles: np.ndarray = UNSEEN, like: tuple[Path, ...] = ()) -> MapResult:
    """Few lines of a map of it."""
    options = MapOptions(postures=table(folder, angles), lines=60, modes=2, like=like)
    return run_map(model, options, folder / "map.h5")[0]


@pytest.fixture(scope="module")
def twelve(measured: Measured, tmp_path_factory: pytest.TempPathFactory) -> tuple[MapResult, Path]:
    """The map by twelve measured postures, and its folder."""
    folder = tmp_path_factory.mktemp("twelve")
    return mapped(measured(12), folder), folder


def test_postures_that_were_not_measured_are_told_better(twelve: tuple[MapResult, Path]) -> None:
    result = twelve[0]
    c, rows = result.correction, result.rows
    assert c is not None and result.learnt is not None
    truth = np.array([modes(q, stiffer(q))[0][:2] for q in UNSEEN])
    before, after = (np.log(one / truth) for one in (rows.frequency_hz, c.frequency_hz))
    assert np.sqrt(np.mean(after**2)) < 0.5 * np.sqrt(np.mean(before**2))
    assert np.mean((c.frequency_low_95 < truth) & (truth < c.frequency_high_95)) > 0.9
    assert (
        dict(zip(result.learnt.processes.quantity, result.learnt.processes.log_odds, strict=True))[
            "frequency"
        ]
        > 3
    )
    assert any("natural frequencies are corrected by 12 measured postures" in one for one in result.verdict)
    assert any("the errors of the model that measured postures show" in note for note in result.notes)


def test_of_two_postures_it_says_that_it_does_not_know(measured: Measured, tmp_path: Path) -> None:
    result = mapped(measured(2), tmp_path)
    c = result.correction
    assert c is not None and np.mean(c.frequency_known) < 0.3
    assert any(
        "is not determined by 2 measured postures" in one and "frequencies" in one for one in result.verdict
    )
    truth = np.array([modes(q, stiffer(q))[0][:2] for q in UNSEEN])
    assert np.mean((c.frequency_low_95 < truth) & (truth < c.frequency_high_95)) > 0.9


def test_where_nothing_is_missing_nothing_is_corrected(tmp_path: Path) -> None:
    model = fitted(tmp_path, planar.postures(8), planar.constant)
    result = mapped(model, tmp_path)
    c, rows = result.correction, result.rows
    assert c is not None
    assert np.abs(np.log(c.frequency_hz / rows.frequency_hz)).max() < 2e-3
    assert np.log(c.frequency_high_95 / c.frequency_low_95).max() < 0.03


def test_far_from_measured_postures_the_interval_widens(measured: Measured, tmp_path: Path) -> None:
    """That of the first measured posture, and of one far from all."""
    near = planar.postures(12)[0]
    c = mapped(measured(12), tmp_path, np.stack([near, near + np.array([0.0, 2.0, np.pi])])).correction
    assert c is not None
    width = np.log(c.frequency_high_95 / c.frequency_low_95)
    assert (width[1] > 1.5 * width[0]).all() and (c.frequency_known[1] < 0.5 * c.frequency_known[0]).all()


def test_csv_and_file_have_the_same_corrections(twelve: tuple[MapResult, Path]) -> None:
    kept = result_file.read(twelve[1] / "map.h5", MapResult)
    assert kept.learnt is not None and kept.correction is not None
    with (twelve[1] / "map.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    for key, values in {
        "corrected_mode2_hz": kept.correction.frequency_hz[:, 1],
        "corrected_mode1_damping_low": kept.correction.damping_low_95[:, 0],
        "corrected_peak_y_m_per_n_high": kept.correction.peak_high_95[:, 1],
    }.items():
        assert [float(row[key]) for row in rows] == pytest.approx(values)
    left = kept.learnt.left_out
    assert set(left.quantity) == {"frequency", "damping", "peak"}
    assert np.mean((left.low_95 <= left.measured) & (left.measured <= left.high_95)) > 0.85


def test_another_robot_of_the_type_helps_and_one_of_another_is_refused(
    measured: Measured, tmp_path: Path
) -> None:
    """A second arm, of other stiffness and measured in two postures, is told by the first one's twelve."""

    def softer(q: np.ndarray) -> np.ndarray:
        return 0.85 * stiffer(q)

    model = fitted(tmp_path / "second", planar.postures(2, seed=5), softer)
    truth = np.array([modes(q, softer(q))[0][:2] for q in UNSEEN])
    errors, widths = [], []
    for like in ((), (measured(12),)):
        result = mapped(model, tmp_path, like=like)
        c = result.correction
        assert c is not None
        errors.append(float(np.sqrt(np.mean(np.log(c.frequency_hz / truth) ** 2))))
        widths.append(float(np.median(np.log(c.frequency_high_95 / c.frequency_low_95))))
        assert np.mean((c.frequency_low_95 < truth) & (truth < c.frequency_high_95)) > 0.9
    assert errors[1] < 0.8 * errors[0] and widths[1] < widths[0] and result.learnt is not None
    assert result.learnt.processes.shared[0] > 0.5 and result.learnt.like == ("fit.h5",)
    (tmp_path / "no.h5").write_bytes(b"no result")
    for wrong, said in ((tmp_path / "no.h5", r"no\.h5"), (model, "named twice")):
        with pytest.raises(InputError, match=said):
            mapped(model, tmp_path, like=(wrong,))


def test_the_peaks_of_a_point_that_was_not_hit_are_not_corrected(measured: Measured) -> None:
    what = unknown([str(measured(2))], None)
    assert what is not None and set(what.seen) == {"frequency", "damping"}


def test_parameters_that_went_wrong_are_put_right_by_the_modes(tmp_path: Path) -> None:
    """What a fit can have moved is neither a process over postures nor scatter."""
    path = fitted(tmp_path, planar.postures(6), planar.constant)
    fit = fit_of(path)
    right = fitted_model(fit, str(path))
    wrong = replace(right, values=right.values * np.exp(np.resize([0.12, -0.1], len(right.values))))
    what = learned_of([Source(fit, wrong, None, 0)])
    assert what is not None and what.learned["frequency"].mean_of("scatter") < 5e-3
    systems, lines, tool = [wrong.system(q) for q in UNSEEN], np.array([10.0, 20.0]), tool_point(wrong, None)
    looked = [look(wrong, one, tool, q, lines, 2) for one, q in zip(systems, UNSEEN, strict=True)]
    rows = rows_of(looked, ["x"] * len(UNSEEN), UNSEEN)
    c = corrected(what, wrong, systems, looked, rows)
    truth = np.array([modes(q, planar.STIFFNESS)[0][:2] for q in UNSEEN])
    before, after = (np.abs(np.log(one / truth)).max() for one in (rows.frequency_hz, c.frequency_hz))
    assert before > 0.02 and after < 0.005


def test_slopes_at_the_peaks_are_those_of_a_single_line(tmp_path: Path) -> None:
    """What the map has of all lines anyway, against each peak alone and against differences."""
    model = fitted_model(fit_of(fitted(tmp_path, planar.postures(3), planar.constant)), "fit")
    tool, lines = tool_point(model, None), np.linspace(5.0, 40.0, 30)
    for posture in UNSEEN[:2]:
        system = model.system(posture)
        at, motion = (
            look(model, system, tool, posture, lines, 2),
            system.base_jacobian(tool.link, tool.position),
        )
        seen = by_steps(model, at.peak_slope)
        for axis, line in enumerate(peak_lines(at.receptance).tolist()):
            s = 2j * np.pi * lines[line]
            assert seen[axis] == pytest.approx(
                peak_slope(model, system, motion[axis], s), rel=1e-9, abs=1e-12
            )
        axis = int(np.abs(seen).max(axis=1).argmax())
        s = 2j * np.pi * lines[peak_lines(at.receptance)[axis]]
        for number, step in enumerate(1e-5 * steps(model)):
            moved = [
                model.values + side * step * (np.arange(len(model.values)) == number) for side in (1, -1)
            ]
            row = motion[axis][None]
            up, down = (
                np.abs(frf_by_solve(*system.matrices(v), np.array([s]), row, row.T, 0)) for v in moved
            )
            assert seen[axis, number] == pytest.approx(
                float(np.log(up / down).item() / 2e-5), rel=1e-5, abs=1e-8
            )
