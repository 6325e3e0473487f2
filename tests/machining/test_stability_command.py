"""`identify stability` on a fitted planar arm, against closed forms and a simulation of the true arm."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import identify
from identify.cli import app
from identify.core.errors import InputError, InputErrors
from identify.machining.mounted import mounted
from identify.machining.run import run_stability
from identify.machining.semi_discretization import TimeDomain
from identify.machining.sentences import verdict
from identify.machining.tool import read_tool
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.results.stability import StabilityResult
from identify.vibration.fitted_model import fitted_model, posture_of
from tests.batch import planar
from tests.generator import milling
from tests.machining.planar_fit import POSTURE, TOOL, tip_jacobian
from tests.reports.stability_sample import stability_result


@pytest.fixture(scope="module")
def fit(planar_fit: Path) -> Path:
    return planar_fit


@pytest.fixture(scope="module")
def found(fit: Path) -> StabilityResult:
    return run_stability(fit, fit.with_name("tool.yaml"), speeds=7, draws=60)[0]


def test_the_tip_is_that_of_the_closed_form(fit: Path, found: StabilityResult) -> None:
    along = np.array([1, 0.5, 0]) / np.hypot(1, 0.5)
    assert found.axes == pytest.approx(np.array([along, [-along[1], along[0], 0], [0, 0, 1]]), abs=1e-12)
    p = result_file.read(fit, FitResult).parameters
    value = dict(zip(p.name, p.value, strict=True))
    k, c = ([value[f"joint{n}.rz.{what}"] for n in (1, 2, 3)] for what in ("stiffness", "damping"))
    s = 2j * np.pi * found.tip.line_hz[:, None, None]
    out = found.axes @ tip_jacobian(POSTURE)
    z = np.diag(k) + s * np.diag(c) + s**2 * planar.mass_matrix(POSTURE)
    h = out @ np.linalg.solve(z, np.broadcast_to(out.T, (len(s), 3, 3)))
    assert found.tip.receptance == pytest.approx(h, rel=1e-5, abs=1e-12)
    assert np.abs(found.tip.receptance[:, 0, 1]).max() > 0.1 * np.abs(found.tip.receptance[:, 0, 0]).max()


def test_limits_are_those_of_a_simulation_of_the_true_arm(found: StabilityResult) -> None:
    cut = milling.Cut(2, 0.0, np.pi / 2, 6e8, 1.5e8)
    matrices = planar.mass_matrix(POSTURE), np.diag(planar.DAMPING), np.diag(planar.STIFFNESS)
    tip = found.axes @ tip_jacobian(POSTURE)
    limit = found.limits.depth_m[0]
    depths = limit * np.linspace(0.9, 1.1, 5)
    simulated = milling.limit(milling.Arm(*matrices, tip), cut, found.limits.rpm[0], depths, 3.0)
    assert limit == pytest.approx(simulated, rel=0.01)
    assert found.limits.zeroth_order[0] != pytest.approx(found.limits.depth_m[0], rel=0.03)


def test_bands_are_those_of_limits_at_drawn_parameters(fit: Path, found: StabilityResult) -> None:
    """In time, where the bands come from the mean of the cut alone."""
    model = fitted_model(result_file.read(fit, FitResult), "fit.h5")
    on = mounted(model, read_tool(fit.with_name("tool.yaml")).study, POSTURE, "tool")
    row = 4
    drawn = [
        TimeDomain(on.structure(values), on.cut, 40.0).limit(
            found.limits.rpm[row], found.limits.depth_m[row], 0.005
        )
        for values in model.draws(16, np.random.default_rng(5))
    ]
    half = (found.limits.high_95[row] - found.limits.low_95[row]) / 2
    assert half == pytest.approx(1.96 * np.std(drawn, ddof=1), rel=0.5)
    assert np.std(drawn) > 3e-4 * np.mean(drawn)


def test_what_is_uncertain_widens_the_bands(fit: Path, found: StabilityResult, tmp_path: Path) -> None:
    wide = []
    for said in ("{coefficients: 0.1}", "{posture_deg: 2.0}"):
        tool = tmp_path / "tool.yaml"
        tool.write_text(f"{TOOL}uncertainty: {said}\n")
        result, _ = run_stability(fit, tool, tmp_path / "wide.h5", speeds=2, draws=24)
        wide.append(result.limits.high_95[0] / result.limits.low_95[0])
    assert np.log(wide[0]) == pytest.approx(2 * 1.96 * 0.1, rel=0.4)
    narrow = found.limits.high_95[0] / found.limits.low_95[0]
    assert wide[1] > 1.05 * narrow


def test_another_posture_has_another_limit(fit: Path, found: StabilityResult, tmp_path: Path) -> None:
    tool = fit.with_name("tool.yaml")
    angles = np.rad2deg(planar.postures(2)[1])
    said = ",".join(f"{angle:.9f}" for angle in angles)
    other, _ = run_stability(fit, tool, tmp_path / "o.h5", said, speeds=2, draws=20)
    read = result_file.read(fit, FitResult)
    named = posture_of("p2", read, fitted_model(read, "fit.h5"))
    assert other.posture_deg == pytest.approx(np.rad2deg(named), abs=1e-6)
    assert other.limits.depth_m[0] != pytest.approx(found.limits.depth_m[0], rel=0.05)


def test_the_command_and_the_function_write_the_same(fit: Path, tmp_path: Path) -> None:
    words = [
        "stability",
        str(fit),
        "--tool",
        str(fit.with_name("tool.yaml")),
        "--speeds",
        "2",
        "--draws",
        "20",
    ]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "a.h5"), "--no-report"])
    assert done.exit_code == 0, done.output
    assert "the cut is stable at every speed up to" in " ".join(done.output.split())
    result = identify.stability(fit, fit.with_name("tool.yaml"), out=tmp_path / "b.h5", speeds=2, draws=20)
    kept = result_file.read(tmp_path / "a.h5", StabilityResult)
    assert np.array_equal(kept.limits.depth_m, result.data.limits.depth_m)
    assert np.array_equal(kept.limits.low_95, result.data.limits.low_95)
    assert result.plot("Depth limits").axes


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("node: 2", "node: 7", "no point 7"),
        ("node: 2", "place: {link: link9, position_m: [0, 0, 0]}", "unknown link 'link9'"),
        ("feed: [1, 0.5, 0]", "feed: [0, 0, 1]", "a feed along the spindle"),
        ("width_mm: 8", "width_mm: 20", "at most the diameter"),
        (
            "diameter_mm: 16",
            "diameter_mm: 0.016",
            "diameter_mm: found 0.016; expected greater than or equal to",
        ),
        ("kind: up, width_mm: 8", "kind: up", "expected with up and down"),
        ("coefficients: {tangential_n_per_mm2: 600, radial_n_per_mm2: 150}", "material: oak", "'oak'"),
        ("teeth: 2", "teeth: 2\nmaterial: aluminium-6061-t6", "either `material` or `coefficients`"),
        ("spindle_rpm: [3000, 9000]", "spindle_rpm: [9000, 3000]", "the lower speed first"),
        ("max_depth_mm: 5", "max_depth: 5", "max_depth_mm"),
    ],
)
def test_a_tool_that_cannot_be_is_refused(fit: Path, tmp_path: Path, old: str, new: str, said: str) -> None:
    tool = tmp_path / "tool.yaml"
    assert old in TOOL
    tool.write_text(TOOL.replace(old, new))
    with pytest.raises((InputError, InputErrors), match=said):
        run_stability(fit, tool, tmp_path / "x.h5")
    assert not (tmp_path / "x.h5").exists()


def test_other_wrong_input_is_refused(fit: Path, tmp_path: Path) -> None:
    tool = fit.with_name("tool.yaml")
    with pytest.raises(InputError, match=r"3 angles in degrees .* or one of p1, p2"):
        run_stability(fit, tool, tmp_path / "x.h5", "1,2")
    with pytest.raises(InputError, match="--out"):
        run_stability(fit, tool, fit)
    with pytest.raises(InputError):
        run_stability(tool, tool, tmp_path / "x.h5")


@pytest.mark.parametrize(("coupled_mm", "beyond"), [(2.0, True), (4.2, False), (np.inf, False)])
def test_a_cut_deeper_than_the_limit_of_mode_coupling_is_explained(coupled_mm: float, beyond: bool) -> None:
    """The deepest stable cut of the sample is 3.5 mm."""
    sample = stability_result()
    coupling = np.array([1e-3 * coupled_mm, 1.9e-3, 2.1e-3, 18.5])
    said = " ".join(verdict(sample.limits, sample.checks, coupling, 10e-3))
    assert "The deepest stable cut is at 7,000 rpm: 3.5 mm" in said
    assert ("deeper cuts are stable only at speeds where the wave" in said) == beyond
