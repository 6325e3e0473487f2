"""A robot that moves while it vibrates: Coriolis terms by two routes, FRFs and gradients without symmetry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputErrors
from identify.model.effects.base import parse_effect
from identify.model.frf import frf, frf_and_gradient, frf_by_solve
from identify.model.system import System, assemble, build_site, list_parameters
from identify.robot.description import Robot
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.arms import arm, initial
from tests.robot.random_arm import industrial_arm, random_posture

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
EFFECTS = [parse_effect({"kind": "joint-compliance", "axes": ["rz", "rx", "ty"]})]
RATES = np.array([1.0, -2.0, 1.5, 0.5, -1.0, 2.0])
S = 2j * np.pi * np.linspace(3, 60, 9)


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """One arm for all."""
    return arm(tmp_path_factory.mktemp("arm"))


def _system(robot: Robot, rates: np.ndarray | None) -> tuple[System, np.ndarray]:
    site = build_site(robot, random_posture(1), EFFECTS)
    return assemble(robot, site, EFFECTS, rates), initial(list_parameters(robot, site, EFFECTS))


def test_coriolis_power_is_half_that_of_the_changing_inertia(robot: Robot) -> None:
    """q' C(q, q') q' = q' dM/dt q' / 2; what is linearised is quadratic, so its derivative times q' is twice
    C q'.
    """
    turning = np.zeros(len(_system(robot, None)[0].coordinates))
    names = list(_system(robot, None)[0].coordinates)
    for number, rate in enumerate(RATES, start=1):
        turning[names.index(f"joint{number}.rz")] = rate
    step, masses = 1e-6, []
    for sign in (1, -1):
        site = build_site(robot, random_posture(1) + sign * step * RATES, EFFECTS)
        masses.append(assemble(robot, site, EFFECTS).mass)
    growing = (masses[0] - masses[1]) / (2 * step)
    coriolis = _system(robot, RATES)[0].coriolis
    assert coriolis is not None
    assert turning @ coriolis @ turning / 2 == pytest.approx(turning @ growing @ turning / 2, rel=1e-6)
    assert np.abs(coriolis - coriolis.T).max() > 0.1 * np.abs(coriolis).max(), "it has no symmetry"


def test_coriolis_terms_are_those_of_the_second_engine(robot: Robot) -> None:
    """Sign and size of every entry: the derivative of Pinocchio's inverse dynamics by the rates."""
    pytest.importorskip("pinocchio", reason="the second engine (pin) has no wheel here")
    from tests.robot.pinocchio_reference import Reference

    system, _ = _system(robot, RATES)
    assert system.coriolis is not None
    reference = Reference(industrial_arm(1), random_posture(1), "base_link")
    expected = reference.coriolis(RATES)[np.ix_(system.free, system.free)]
    assert np.abs(system.coriolis - expected).max() < 1e-8 * np.abs(expected).max()
    values = initial(list_parameters(robot, system.site, EFFECTS))
    added = system.matrices(values)[1] - _system(robot, None)[0].matrices(values)[1]
    assert np.abs(added - expected).max() < 1e-8 * np.abs(expected).max()


def test_frfs_and_gradients_of_a_moving_robot(robot: Robot) -> None:
    (system, values), (still, _) = _system(robot, 3 * RATES), _system(robot, None)
    point = np.array([0.05, 0.1, 0.2])
    out = system.jacobian("link6", point)[:3]
    force = out[:2].T.copy()
    h = frf(*system.matrices(values), S, out, force, 2)
    assert h == pytest.approx(frf_by_solve(*system.matrices(values), S, out, force, 2), rel=1e-8, abs=1e-12)
    assert np.linalg.norm(h - frf(*still.matrices(values), S, out, force, 2)) > 1e-3 * np.linalg.norm(h)
    free = np.arange(len(values))
    both = frf_and_gradient(system.matrices(values), system.factors, S, out, force, 2, free)
    assert both[0] == pytest.approx(h, rel=1e-8, abs=1e-12)
    for number in (0, 1, 8, 13):
        step = 1e-4 * values[number] * (np.arange(len(values)) == number)
        up, down = (
            frf_by_solve(*system.matrices(values + sign * step), S, out, force, 2) for sign in (1, -1)
        )
        expected = (up - down) / (2 * step[number])
        assert both[1][..., number] == pytest.approx(expected, rel=1e-3, abs=1e-5 * np.abs(expected).max())


def test_speeds_are_one_per_joint(tmp_path: Path) -> None:
    text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
    (tmp_path / "config.yaml").write_text(
        text.replace("    averages: 4\n", "    averages: 4\n    speed_deg_per_s: [1, 2]\n", 1)
    )
    with pytest.raises(InputErrors, match=r"measurements\.0\.speed_deg_per_s: 2 speeds; expected 6"):
        load_problem(read_study(tmp_path / "config.yaml"))
