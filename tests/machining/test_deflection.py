"""`identify deflection` against MuJoCo with springs, closed forms, and integrals over a cut."""

from __future__ import annotations

import csv
from pathlib import Path

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

import identify
from identify.cli import app
from identify.core.errors import InputError
from identify.machining.engagement import Engagement
from identify.machining.materials import Coefficients
from identify.machining.run_deflection import Load, mean_force, run_deflection
from identify.results import file as result_file
from identify.results.deflection import DeflectionResult
from identify.results.fit import FitResult
from identify.vibration.fitted_model import fitted_model
from tests.batch import planar
from tests.machining.planar_fit import POSTURE, tip_jacobian

FORCE = np.array([80.0, -50.0, 30.0])


@pytest.fixture(scope="module")
def fit(planar_fit: Path) -> Path:
    return planar_fit


@pytest.fixture(scope="module")
def found(fit: Path) -> DeflectionResult:
    return run_deflection(fit, Load(force="80,-50,30"))[0]


def _stiffness(fit: Path) -> np.ndarray:
    p = result_file.read(fit, FitResult).parameters
    value = dict(zip(p.name, p.value, strict=True))
    return np.array([value[f"joint{n}.rz.stiffness"] for n in (1, 2, 3)])


def _sprung(folder: Path, stiffness: np.ndarray, q: np.ndarray) -> mujoco.MjModel:
    """The arm as MuJoCo reads its URDF, with a spring at each joint that is at rest at a posture."""
    (folder / "arm.urdf").write_text(planar.urdf())
    model = mujoco.MjModel.from_xml_path(str(folder / "arm.urdf"))
    model.jnt_stiffness[:], model.qpos_spring[:] = stiffness, q
    model.dof_damping[:] = 2000.0
    return model


def _tip(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "link3")
    return np.asarray(data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.array([0.3, 0, 0]))


def test_static_deflection_is_that_of_mujoco_with_springs(
    fit: Path, found: DeflectionResult, tmp_path: Path
) -> None:
    model = _sprung(tmp_path, _stiffness(fit), POSTURE)
    data = mujoco.MjData(model)
    data.qpos[:] = POSTURE
    mujoco.mj_forward(model, data)
    before = _tip(model, data)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "link3")
    for _ in range(4000):
        data.qfrc_applied[:] = 0.0
        mujoco.mj_applyFT(model, data, FORCE, np.zeros(3), _tip(model, data), body, data.qfrc_applied)
        mujoco.mj_step(model, data)
    assert np.abs(data.qvel).max() < 1e-9, "at rest"
    moved = _tip(model, data) - before
    assert found.rows.tip_m[0] == pytest.approx(before, abs=1e-6)
    assert found.rows.deflection_m[0] == pytest.approx(moved, rel=0.01, abs=1e-9)
    assert np.linalg.norm(moved) > 1e-4
    softer = run_deflection(fit, Load(force="80,-50,30", posture="p2"), tmp_path / "o.h5")[0]
    assert softer.rows.deflection_m[0] != pytest.approx(moved, rel=0.05)


def test_intervals_are_those_of_the_closed_form_at_draws(fit: Path, found: DeflectionResult) -> None:
    model = fitted_model(result_file.read(fit, FitResult), "fit.h5")
    names = result_file.read(fit, FitResult).parameters.name
    own = [names.index(f"joint{n}.rz.stiffness") for n in (1, 2, 3)]
    drawn = model.draws(2000, np.random.default_rng(7))[:, own]
    j = tip_jacobian(POSTURE)
    moved = np.array([j @ (j.T @ FORCE / k) for k in drawn])
    low, high = np.percentile(moved, [2.5, 97.5], axis=0)
    width = found.rows.high_95[0] - found.rows.low_95[0]
    assert width[:2] == pytest.approx((high - low)[:2], rel=0.2)
    compliance = j @ np.diag(1 / _stiffness(fit)) @ j.T
    assert found.rows.compliance[0] == pytest.approx(
        np.linalg.eigvalsh(compliance)[::-1], rel=1e-5, abs=1e-12
    )
    for value, direction in zip(found.rows.compliance[0], found.rows.directions[0], strict=True):
        assert compliance @ direction == pytest.approx(value * direction, abs=1e-5 * compliance.max())


def test_a_compensated_path_ends_where_it_was_wanted(fit: Path, tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    rows = [[20.0, 50.0, 30.0, 100.0, 0.0, 0.0], [40.0, 60.0, -20.0, 0.0, 150.0, 0.0]]
    heads = "joint1_deg,joint2_deg,joint3_deg,fx_n,fy_n,fz_n"
    path.write_text("\n".join([heads, *(",".join(map(str, row)) for row in rows)]) + "\n")
    before = path.read_text()
    with pytest.raises(InputError, match=r"path\.csv: not a file for deflections: an input"):
        run_deflection(fit, Load(path=path), tmp_path / "path.h5")
    assert path.read_text() == before
    result, written = run_deflection(fit, Load(path=path), tmp_path / "d.h5")
    with written[1].open() as stream:
        table = list(csv.DictReader(stream))
    assert [row["name"] for row in table] == list(result.rows.name)
    model = fitted_model(result_file.read(fit, FitResult), "fit.h5")
    for row, said in zip(table, rows, strict=True):
        sent = np.deg2rad([float(row[f"joint{n}_deg"]) for n in (1, 2, 3)])
        wanted = np.array([float(row[f"wanted_{axis}_m"]) for axis in "xyz"])
        moved = np.array([float(row[f"deflection_{axis}_m"]) for axis in "xyz"])
        point = model.points[2]
        at = model.system(sent).site.engine.position(point.link, point.position)
        assert np.linalg.norm(at + moved - wanted) < 0.01 * np.linalg.norm(moved)
        original = model.system(np.deg2rad(said[:3])).site.engine.position(point.link, point.position)
        assert wanted == pytest.approx(original, abs=1e-8)
        assert np.linalg.norm(moved) > 1e-4


def test_the_dynamic_deflection_is_static_at_rest_and_the_closed_form_at_resonance(
    fit: Path, found: DeflectionResult
) -> None:
    dynamic = found.dynamic
    assert dynamic.amplitude_m[0] == pytest.approx(np.abs(found.rows.deflection_m[0]), rel=1e-6, abs=1e-15)
    p = result_file.read(fit, FitResult).parameters
    value = dict(zip(p.name, p.value, strict=True))
    damping = np.diag([value[f"joint{n}.rz.damping"] for n in (1, 2, 3)])
    peak = int(np.argmax(dynamic.amplitude_m[:, 0]))
    s, j = 2j * np.pi * dynamic.line_hz[peak], tip_jacobian(POSTURE)
    z = np.diag(_stiffness(fit)) + s * damping + s**2 * planar.mass_matrix(POSTURE)
    assert dynamic.amplitude_m[peak] == pytest.approx(
        np.abs(j @ np.linalg.solve(z, j.T @ FORCE)), rel=1e-4, abs=1e-12
    )
    assert dynamic.amplitude_m[peak, 0] > 5 * dynamic.amplitude_m[0, 0]


def test_the_mean_force_of_a_slot_is_the_closed_form() -> None:
    """Altintas, Manufacturing Automation, Eq. 2.25: a slot, with edge forces."""
    k = Coefficients(600e6, 150e6, 0.0, 20e3, 12e3)
    cut = Engagement(4, 0.0, np.pi, np.pi / 2, k)
    teeth, depth, feed = 4, 2e-3, 1e-4
    x, y, _ = mean_force(cut, depth, feed)
    assert x == pytest.approx(
        -teeth * depth / 4 * k.radial * feed - teeth * depth / np.pi * k.radial_edge, rel=1e-5
    )
    assert y == pytest.approx(
        teeth * depth / 4 * k.tangential * feed + teeth * depth / np.pi * k.tangential_edge, rel=1e-5
    )
    assert abs(mean_force(cut, depth, 2 * feed)[1] / y - 2) > 0.05, "edges do not grow with the feed"


def test_a_cut_pushes_along_the_tool_s_axes(fit: Path, tmp_path: Path) -> None:
    load = Load(tool=fit.with_name("tool.yaml"), depth_mm=0.2, feed_per_tooth_mm=0.05)
    result, _ = run_deflection(fit, load, tmp_path / "c.h5")
    along = np.array([1, 0.5, 0]) / np.hypot(1, 0.5)
    axes = np.array([along, [-along[1], along[0], 0], [0, 0, 1]])
    cut = Engagement(2, 0.0, np.pi / 2, np.pi / 2, Coefficients(600e6, 150e6))
    assert result.rows.force_n[0] == pytest.approx(axes.T @ mean_force(cut, 0.2e-3, 0.05e-3), rel=1e-6)


def test_the_command_and_the_function_write_the_same(fit: Path, tmp_path: Path) -> None:
    words = ["deflection", str(fit), "--force", "80,-50,30", "--draws", "20", "--no-report"]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "a.h5")])
    assert done.exit_code == 0, done.output
    assert "A force of 98.99 N moves p2 by" in " ".join(done.output.split())
    result = identify.deflection(fit, force="80,-50,30", draws=20, out=tmp_path / "b.h5")
    kept = result_file.read(tmp_path / "a.h5", DeflectionResult)
    assert np.array_equal(kept.rows.low_95, result.data.rows.low_95)
    assert result.plot().axes


@pytest.mark.parametrize(
    ("load", "said"),
    [
        (Load(), "no force or several"),
        (Load(force="1,2,3", path=Path("p.csv")), "no force or several"),
        (Load(force="1,2"), "FX,FY,FZ in newtons"),
        (Load(depth_mm=1.0), "a cut that is not whole"),
        (Load(tool=Path("t.yaml"), depth_mm=-1.0, feed_per_tooth_mm=0.1), "-1 mm and 0.1 mm"),
        (Load(force="1,2,3", node=9), "no point 9"),
        (Load(path=Path("p.csv"), posture="p1"), "which has its own"),
    ],
)
def test_a_load_that_cannot_be_is_refused(fit: Path, tmp_path: Path, load: Load, said: str) -> None:
    with pytest.raises(InputError, match=said):
        run_deflection(fit, load, tmp_path / "x.h5")
    assert not (tmp_path / "x.h5").exists()


def test_a_path_without_forces_is_refused(fit: Path, tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    path.write_text("joint1_deg,joint2_deg,joint3_deg,fx_n,fy_n\n1,2,3,4,5\n")
    with pytest.raises(InputError, match=r"path.csv line 2.*fz_n"):
        run_deflection(fit, Load(path=path), tmp_path / "x.h5")
