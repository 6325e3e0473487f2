"""Spindle and tool coupled to the arm, against the whole as one system."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.machining.coupled import CoupledTip, Substructure, substructure
from identify.machining.mounted import Mounted, mounted
from identify.machining.one_limit import limit_at
from identify.machining.run import run_stability
from identify.machining.run_deflection import Load, run_deflection
from identify.machining.tool import Coupling, read_tool
from identify.map.asked import MapOptions
from identify.map.run import run_map
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.results.stability import StabilityResult
from identify.vibration.fitted_model import fitted_model
from tests.batch.conftest import in_this_process
from tests.generator import milling
from tests.generator.arm import Point
from tests.generator.universal import Function, dataset
from tests.machining.planar_fit import POSTURE, TOOL

LINES = np.linspace(2.0, 400.0, 800)
MASSES, STIFFNESS, DAMPING = (0.8, 1.5), 1.2e6, 60.0


def _free() -> np.ndarray:
    """(lines, 6, 6): accelerances of two masses on a spring along each axis: tip, then flange, hanging
    free.
    """
    s = 2j * np.pi * LINES[:, None, None]
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    z = s**2 * np.diag(MASSES) + (s * DAMPING + STIFFNESS) * pair
    return np.kron(s**2 * np.linalg.inv(z), np.eye(3))


def test_masses_on_an_arm_are_one_system() -> None:
    """Also turned: an arm that is not alike in all directions."""
    rng = np.random.default_rng(1)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    root = rng.normal(size=(3, 3))
    mass, stiffness = np.eye(3) + root @ root.T, 1e6 * (np.eye(3) + 0.3 * (root + root.T) @ (root + root.T))
    damping = 1e-4 * stiffness

    def arm(line_hz: np.ndarray) -> np.ndarray:
        s = 2j * np.pi * line_hz[:, None, None]
        return np.linalg.inv(s**2 * mass + s * damping + stiffness)

    tip = CoupledTip(Substructure(LINES, _free()), arm, turn)
    at = LINES[20:700:40]
    s = 2j * np.pi * at[:, None, None]
    spring = s * DAMPING + STIFFNESS
    whole = np.zeros((len(at), 6, 6), dtype=complex)
    whole[:, :3, :3] = s**2 * MASSES[0] * np.eye(3) + spring * np.eye(3)
    whole[:, :3, 3:] = whole[:, 3:, :3] = -spring * np.eye(3)
    inside = s**2 * mass + s * damping + stiffness
    whole[:, 3:, 3:] = inside + (s**2 * MASSES[1] + spring) * np.eye(3)
    expected = np.linalg.inv(whole)[:, :3, :3]
    assert tip.receptance(at) == pytest.approx(expected, rel=1e-6, abs=1e-9 * np.abs(expected).max())
    assert tip.receptance(-at) == pytest.approx(np.conj(tip.receptance(at)))
    assert tip.receptance(at) != pytest.approx(arm(at), rel=0.05), "the arm alone is another"
    low = tip.receptance(np.array([0.0, LINES[0]]))
    assert low[0] == pytest.approx(low[1])


def test_a_rigid_body_with_rotations_moves_the_tip_as_one_body() -> None:
    """A rigid tool of some length on a flange that turns and shifts: the tip is a lever."""
    rng = np.random.default_rng(2)
    mass, inertia, lever = 4.0, np.diag([0.02, 0.03, 0.01]), np.array([0.0, 0.05, -0.2])
    body = np.block([[mass * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), inertia]])
    x, y, z = lever
    cross = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])  # w x lever
    moves = np.concatenate([np.concatenate([np.eye(3), cross], axis=1), np.eye(6)])  # tip, then flange
    free = np.broadcast_to(moves @ np.linalg.inv(body) @ moves.T, (len(LINES), 9, 9)).astype(complex)
    root = rng.normal(size=(6, 6))
    stiffness, own = 1e5 * (np.eye(6) + 0.1 * root @ root.T), 10 * np.eye(6)

    def arm(line_hz: np.ndarray) -> np.ndarray:
        s = 2j * np.pi * line_hz[:, None, None]
        return np.linalg.inv(s**2 * own + (1 + 1e-4 * s) * stiffness)

    at = np.array([5.0, 11.0, 30.0])
    s = 2j * np.pi * at[:, None, None]
    both = np.linalg.inv(s**2 * (own + body) + (1 + 1e-4 * s) * stiffness)
    expected = moves[:3] @ both @ moves[:3].T
    found = CoupledTip(Substructure(LINES, free), arm, np.eye(3)).receptance(at)
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-9 * np.abs(expected).max())
    hinged = CoupledTip(Substructure(LINES, free[:, :6, :6]), lambda hz: arm(hz)[:, :3, :3], np.eye(3))
    assert np.abs(hinged.receptance(at) - expected).max() > 0.1 * np.abs(expected).max()


@pytest.fixture(scope="module")
def spindle(planar_fit: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tool file with the coupling beside it."""
    folder = tmp_path_factory.mktemp("spindle")
    ends = [(node, axis) for node in (1, 2) for axis in range(3)]
    free = _free()
    functions = [
        Function(LINES, free[:, i, j], *_ends(*ends[i]), *_ends(*ends[j])) for i in range(6) for j in range(6)
    ]
    (folder / "spindle.uff").write_bytes(b"".join(dataset(one, False) for one in functions))
    text = TOOL + "coupling: {file: spindle.uff, tip: 1, flange: 2}\n"
    (folder / "tool.yaml").write_text(text.replace("[3000, 9000]", "[5000, 9000]"))
    return folder / "tool.yaml"


def _ends(node: int, axis: int) -> tuple[Point, int]:
    return Point(node, f"p{node}", "spindle", np.zeros(3)), axis


@pytest.fixture(scope="module")
def on(planar_fit: Path, spindle: Path) -> Mounted:
    model = fitted_model(result_file.read(planar_fit, FitResult), "fit.h5")
    return mounted(model, read_tool(spindle).study, POSTURE, "tool")


def test_slopes_go_through_the_coupling(on: Mounted) -> None:
    lines = np.array([1.0, 9.0, -23.0, 150.0])
    found = on.uncertain.slopes(lines, np.arange(len(on.model.values)))
    for number, value in enumerate(on.model.values):
        step = 1e-5 * value * np.eye(len(on.model.values))[number]
        up, down = (
            replace(on, model=replace(on.model, values=on.model.values + sign * step)).tip(lines)
            for sign in (1, -1)
        )
        slope = (up - down) / (2e-5 * value)
        assert found[..., number] == pytest.approx(slope, rel=1e-3, abs=1e-5 * np.abs(slope).max())


def test_the_limit_is_that_of_a_simulation_of_the_whole(
    planar_fit: Path, spindle: Path, on: Mounted, tmp_path: Path
) -> None:
    result, _ = run_stability(planar_fit, spindle, tmp_path / "s.h5", speeds=2)
    assert any("spindle.uff" in note for note in result.notes)
    assert any("ball joint" in note for note in result.notes)
    assert result.checks.semi_discretization is None
    arm = [np.asarray(one.real) for one in on.system.matrices(on.model.values)]
    moved = on.axes @ on.system.base_jacobian(on.point.link, on.point.position)
    size = len(arm[0])
    pull = np.concatenate([-moved, np.eye(3)], axis=1)
    mass, damping, stiffness = (np.pad(one, (0, 3)) for one in arm)
    mass[:size, :size] += MASSES[1] * moved.T @ moved
    mass[size:, size:] += MASSES[0] * np.eye(3)
    whole = mass, damping + DAMPING * pull.T @ pull, stiffness + STIFFNESS * pull.T @ pull
    tip = np.concatenate([np.zeros((3, size)), np.eye(3)], axis=1)
    cut = milling.Cut(2, on.cut.entry, on.cut.exit, 6e8, 1.5e8)
    for rpm, depth, low, high in list(zip(*_columns(result), strict=True))[:1]:
        simulated, _ = milling.exact_limit(milling.Arm(*whole, tip), cut, rpm, depth, (80, 160))
        assert depth == pytest.approx(simulated, rel=0.01)
        assert low < simulated < high
    alone = replace(on, tool=on.tool.model_copy(update={"coupling": None}))
    assert abs(limit_at(alone, 5000.0)[0] / result.limits.depth_m[0] - 1) > 0.05
    table = tmp_path / "postures.csv"
    row = ",".join(f"{np.rad2deg(angle):.9f}" for angle in POSTURE)
    table.write_text(f"joint1_deg,joint2_deg,joint3_deg\n{row}\n")
    options = MapOptions(postures=table, limit="depth", cutter=spindle, rpm=(5000.0,), lines=2, modes=1)
    with in_this_process():
        mapped, _ = run_map(planar_fit, options, tmp_path / "m.h5", workers=1)
    assert mapped.limit is not None
    assert mapped.limit.value[0, 0] == pytest.approx(result.limits.depth_m[0], rel=5e-3)


def _columns(result: StabilityResult) -> tuple[np.ndarray, ...]:
    limits = result.limits
    return limits.rpm, limits.depth_m, limits.low_95, limits.high_95


def test_a_coupling_that_cannot_be_is_refused(planar_fit: Path, spindle: Path, tmp_path: Path) -> None:
    file = str(spindle.with_name("spindle.uff"))
    with pytest.raises(InputError, match=r"spindle\.uff.*the response of 1:\+X by a force at 3:\+X"):
        substructure(Coupling(file=file, tip=1, flange=3))
    load = Load(tool=spindle, depth_mm=0.2, feed_per_tooth_mm=0.05)
    with pytest.raises(InputError, match="say nothing of rest"):
        run_deflection(planar_fit, load, tmp_path / "d.h5")
    both = tmp_path / "both.yaml"
    mode = "modes: [{frequency_hz: 850, damping_ratio: 0.02, stiffness_n_per_m: 2.0e+7}]\n"
    both.write_text(spindle.read_text() + mode)
    with pytest.raises(InputErrors, match="either `coupling` or `modes`"):
        read_tool(both)
