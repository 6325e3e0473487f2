"""`identify stability` on a tip that was tapped: against the structure behind the FRFs, and a closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import identify
from identify.cli import app
from identify.core.errors import InputError, InputErrors
from identify.machining.exact_limit import ExactLimit, exact_limit
from identify.machining.materials import Coefficients
from identify.machining.run import run_stability
from identify.machining.tapped import tip_modes
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.uff.write import write_uff58
from identify.results.stability import StabilityResult
from tests.machining.test_limits import _altintas, _chart, _cut, _tip

MILL = _altintas()
LINES = np.arange(100.0, 2000.0, 2.0)
LEVEL = 20.0
"""Of the accelerances, m/s^2/N, about."""
TOOL = """schema: identify-tool/1
name: end mill
teeth: 3
diameter_mm: 20
spindle_axis: [0, 0, -1]
feed: [1, 0, 0]
cut: {kind: up, width_mm: 10}
coefficients: {tangential_n_per_mm2: 600, radial_n_per_mm2: 42}
spindle_rpm: [6000, 9000]
max_depth_mm: 20
"""


def _tapped(folder: Path, noise: float = 0.0, seed: int = 1, turned: bool = False, every: int = 1) -> Path:
    """Altintas and Budak's end mill, tapped along x and y, at every so many of the lines; turned: the sensor
    looks along -y and x.
    """
    lines = LINES[::every]
    s = 2j * np.pi * lines
    frf = MILL.receptance(lines)[:, :2, :2] * (s**2)[:, None, None]
    rng = np.random.default_rng(seed)
    frf = frf + noise * LEVEL * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))
    channels = (Channel(7, 1), Channel(7, 2))
    if turned:
        turn = np.array([[0.0, -1.0], [1.0, 0.0]])
        frf = turn @ frf @ turn.T
    folder.mkdir(exist_ok=True)
    path = folder / "tip.uff"
    write_uff58(path, FrfSet(lines, frf, channels, channels, "accelerance", source="tip"))
    (folder / "tool.yaml").write_text(TOOL)
    return path


def _limits(path: Path, tool: Path | None = None, speeds: int = 3) -> StabilityResult:
    return run_stability(
        path, tool or path.with_name("tool.yaml"), path.with_name("out.h5"), speeds=speeds, draws=200
    )[0]


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _tapped(tmp_path_factory.mktemp("tip") / "clean", noise=1e-5)


@pytest.fixture(scope="module")
def found(clean: Path) -> StabilityResult:
    return _limits(clean)


def test_the_mean_of_the_cut_gives_the_published_closed_form(found: StabilityResult) -> None:
    """The quadratic equation of Altintas and Budak (1995) for two directions, at half immersion."""
    closed = _chart(np.pi / 2, 3, 600e6, 0.07, found.limits.rpm)
    assert found.limits.zeroth_order == pytest.approx(closed, rel=0.01)


def _truth(found: StabilityResult) -> list[ExactLimit]:
    """Of the structure itself."""
    cut = _cut(3, 0.0, np.pi / 2, Coefficients(600e6, 42e6))
    rows = zip(found.limits.rpm, found.limits.depth_m, found.limits.chatter_hz, strict=True)
    every = [exact_limit(cut, partial(_tip, MILL), 700.0, rpm, (depth, hz)) for rpm, depth, hz in rows]
    assert None not in every
    return [one for one in every if one is not None]


def test_limits_are_those_of_the_structure_that_was_tapped(found: StabilityResult) -> None:
    exact = _truth(found)
    assert found.limits.depth_m == pytest.approx([one.depth for one in exact], rel=3e-3)
    heard = found.limits.chatter_hz
    assert heard == pytest.approx([one.strongest_hz for one in exact], abs=2.0)
    assert np.all((heard > 550) & (heard < 750)), "not its image below half the tooth frequency"
    said = " ".join(found.notes)
    assert "taken as rigid: X by Z, Y by Z and Z" in said
    assert "joint angles" not in said
    assert not found.joints and not found.posture_deg.size


def test_axes_of_the_file_may_lie_otherwise(tmp_path: Path, found: StabilityResult) -> None:
    path = _tapped(tmp_path / "turned", noise=1e-5, turned=True)
    tool = path.with_name("tool.yaml")
    tool.write_text(TOOL.replace("feed: [1, 0, 0]", "feed: [0, 1, 0]"))
    assert _limits(path).limits.depth_m == pytest.approx(found.limits.depth_m, rel=1e-3)
    tool.write_text(TOOL)
    assert _limits(path).limits.depth_m != pytest.approx(found.limits.depth_m, rel=0.02)


def test_noise_makes_the_bands_as_wide_as_limits_scatter(tmp_path: Path) -> None:
    tries = [
        _limits(_tapped(tmp_path / f"{seed}", noise=2e-3, seed=seed, every=2), speeds=2) for seed in range(4)
    ]
    depth = np.array([one.limits.depth_m for one in tries])
    half = np.mean([(one.limits.high_95 - one.limits.low_95) / 2 for one in tries], axis=0)
    ratio = 1.96 * depth.std(axis=0, ddof=1) / half
    assert np.all((ratio > 0.3) & (ratio < 2.5))


@pytest.mark.parametrize("tests", [2, pytest.param(8, marks=pytest.mark.exam)])
def test_modes_of_the_tip_give_its_limits(tests: int, tmp_path: Path) -> None:
    """Tests with noise of their own: the truth lies in the bands, which are no wider than errors."""
    off = []
    for seed in range(tests):
        path = _tapped(tmp_path / f"{seed}", noise=2e-3, seed=seed, every=2)
        identify.modes(path, out=path.with_name("modes.h5"))
        result = _limits(path.with_name("modes.h5"), path.with_name("tool.yaml"))
        true = np.array([one.depth for one in _truth(result)])
        off.append((result.limits.depth_m - true) / (result.limits.high_95 - result.limits.low_95) * 2 * 1.96)
    assert len(result.mode_hz) >= 2
    assert "that of the modes in the file" in " ".join(result.notes)
    assert np.mean(np.abs(off) < 1.96) > 0.7
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 1.7


def test_poles_move_a_tip_as_differences_say() -> None:
    """A frequency by its standard deviation alone, then a damping."""
    told = {"frequency_hz": [603.0, 850.0], "damping_ratio": [0.04, 0.03]}
    spread = {"frequency_std_hz": [0.02, 0.01], "damping_std": [1e-5, 2e-5]}
    modes: Any = SimpleNamespace(**{key: np.array(value) for key, value in {**told, **spread}.items()})
    s = 2j * np.pi * LINES
    known = tip_modes(modes, LINES, s, 0, MILL.receptance(LINES), np.zeros((3, 3)))
    changes = known.shared(LINES)
    for number in range(4):
        mode, what = number % 2, number // 2
        moved = replace(known, poles=known.poles + known.moved[number] * np.eye(2)[mode])
        assert changes[..., number] == pytest.approx(
            moved.receptance(LINES) - known.receptance(LINES), rel=1e-2, abs=1e-4 * np.abs(changes).max()
        )
        pole = moved.poles[mode]
        if what == 0:
            assert np.abs(pole) / (2 * np.pi) - told["frequency_hz"][mode] == pytest.approx(
                spread["frequency_std_hz"][mode], rel=1e-4
            )
        else:
            assert -pole.real / np.abs(pole) - told["damping_ratio"][mode] == pytest.approx(
                spread["damping_std"][mode], rel=1e-2
            )


def test_the_command_writes_a_page_without_a_robot(clean: Path, tmp_path: Path) -> None:
    words = ["stability", str(clean), "--tool", str(clean.with_name("tool.yaml")), "--speeds", "2"]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "o.h5")])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "o.html").read_text()
    assert "In the file&#39;s axes" in page or "In the file's axes" in page
    assert "Joints at" not in page


def test_uneven_teeth_are_told(clean: Path, tmp_path: Path) -> None:
    tool = tmp_path / "tool.yaml"
    fast = TOOL.replace("[6000, 9000]", "[12000, 15000]")
    tool.write_text(fast.replace("teeth: 3", "teeth: 3\npitch_deg: [110, 120, 130]"))
    result = _limits(clean, tool, speeds=2)
    assert "The teeth are at uneven angles" in " ".join(result.verdict)
    assert result.checks.multi_frequency[0] == pytest.approx(result.limits.depth_m[0], rel=0.02)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("teeth: 3", "teeth: 3\nnode: 8", r"drive points at node 7; expected FRFs of the tip"),
        (
            "max_depth_mm: 20",
            "max_depth_mm: 20\nmodes: [{frequency_hz: 800, damping_ratio: 0.02, stiffness_n_per_m: 1.0e+7}]",
            "leave `modes` out",
        ),
        ("feed: [1, 0, 0]", "feed: [0, 0, 1]", "a feed along the spindle"),
        ("teeth: 3", "teeth: 3\npitch_deg: [100, 120]", "an angle for each of the teeth, 360 in all"),
        ("teeth: 3", "teeth: 3\npitch_deg: [100, 120, 130]", "an angle for each of the teeth, 360 in all"),
    ],
)
def test_what_does_not_fit_is_refused(clean: Path, tmp_path: Path, old: str, new: str, said: str) -> None:
    tool = tmp_path / "tool.yaml"
    tool.write_text(TOOL.replace(old, new))
    with pytest.raises((InputError, InputErrors), match=said):
        run_stability(clean, tool, tmp_path / "x.h5")


def test_other_wrong_input_is_refused(clean: Path, tmp_path: Path) -> None:
    tool = clean.with_name("tool.yaml")
    with pytest.raises(InputError, match="--posture"):
        run_stability(clean, tool, tmp_path / "x.h5", "home")
    far = FrfSet(LINES, np.ones((len(LINES), 1, 1)) * 1j, (Channel(1, 1),), (Channel(2, 1),), "accelerance")
    write_uff58(tmp_path / "far.uff", far)
    with pytest.raises(InputError, match="no drive point"):
        run_stability(tmp_path / "far.uff", tool, tmp_path / "x.h5")
