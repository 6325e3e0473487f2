"""Motors as channels of a study: two inertias in closed form, held or not, units, beside a hammer; arms."""

from __future__ import annotations

import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import identify
from identify.core.errors import InputError, InputErrors
from identify.discovery.run import run_discover
from identify.fitting.selection.workbench import Story
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import read_modal_table
from identify.measured.uff.shapes import read_shapes
from identify.results.fit import FitResult
from identify.vibration.check import run_checks
from identify.vibration.costs.frf_least_squares import FrfLeastSquares
from identify.vibration.fitted_model import fitted_model
from identify.vibration.intervals import intervals
from identify.vibration.misfit import misfit
from identify.vibration.problem import Problem, load_problem
from identify.vibration.run import run_fit
from identify.vibration.study import read_study
from tests.frf_files import write_csv
from tests.generator import motor_log
from tests.shared import shared

MOTOR = Channel.parse("joint1:motor")
HZ = np.linspace(2.0, 60.0, 117)
ROTOR, LINK, STIFFNESS, DAMPING, FRICTION, HOLDING = 1.5, 2.0, 8000.0, 6.0, 12.0, 3e4
ARM_M = 0.5
TRUE = {
    "joint1.rz.stiffness": STIFFNESS,
    "joint1.rz.damping": DAMPING,
    "joint1.rotor.inertia": ROTOR / 1e4,
    "joint1.rotor.friction": FRICTION,
}
NOISE = 0.01


def _drive(held: float = 0.0) -> np.ndarray:
    """(lines, 2, 2): receptances of motor and link, at the gear output, of two inertias on a spring, the
    motor held by as stiff a spring.
    """
    s = 2j * np.pi * HZ
    gear = DAMPING * s + STIFFNESS
    z = np.array([[ROTOR * s**2 + FRICTION * s + gear + held, -gear], [-gear, LINK * s**2 + gear]])
    return np.linalg.inv(np.moveaxis(z, -1, 0))


def _file(
    path: Path, frf: np.ndarray, outputs: list[Channel], inputs: list[Channel], share: float = NOISE
) -> None:
    """Mobilities with noise of that share of each FRF, known by coherence."""
    rng = np.random.default_rng(zlib.crc32(path.name.encode()))
    frf = frf * (2j * np.pi * HZ)[:, None, None]
    noise = share / np.sqrt(2) * np.abs(frf)
    noisy = frf + noise * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))
    coherence = np.full(frf.shape, 1 / (1 + 15 * share**2))
    write_csv(path, FrfSet(HZ, noisy, tuple(outputs), tuple(inputs), "mobility", coherence, averages=16))


ROTORS = {
    "kind": "rotor-inertia",
    "joints": [1],
    "gear_ratio": [100],
    "inertia": {"initial": 3e-4},
    "friction": {"initial": 4.0},
}


def _study(
    folder: Path,
    entries: list[dict[str, Any]],
    rotor: dict[str, Any] | None = None,
    stiffness: float = 2.5e4,
    **keys: Any,
) -> Path:
    (folder / "robot.yaml").write_text(
        "name: drive\nconvention: standard\njoints: [{name: j1, d_m: 0, a_m: 0, alpha_deg: 0}]\n"
        "links: [{name: link1, mass_kg: 1, centre_m: [0, 0, 0],"
        f" inertia_kg_m2: [{LINK}, {LINK}, {LINK}, 0, 0, 0]}}]\n"
    )
    (folder / "points.csv").write_text(f"node,name,link,x_m,y_m,z_m\n1,arm,link1,{ARM_M},0,0\n")
    study = {
        "schema": "identify/1",
        "name": "drive",
        "robot": {"dh": "robot.yaml"},
        "points": "points.csv",
        "measurements": [{"posture_deg": [20.0], "averages": 16, **one} for one in entries],
        "effects": [
            {"kind": "joint-compliance", "axes": ["rz"], "stiffness": {"initial": stiffness}},
            ROTORS if rotor is None else rotor,
        ],
        **keys,
    }
    if rotor == {}:
        study["effects"].pop()
    path = folder / "study.yaml"
    path.write_text(yaml.safe_dump(study, sort_keys=False))
    return path


def _motor(folder: Path, held: float = 0.0, side: float = 1.0) -> str:
    _file(folder / "motor.csv", side * _drive(held)[:, :1, :1], [MOTOR], [MOTOR])
    return "motor.csv"


def _fitted(path: Path, starts: int = 1) -> FitResult:
    return run_fit(path, path.with_name("out.h5"), {"starts": starts})[0]


def _held(result: FitResult, true: dict[str, float]) -> list[bool]:
    table = result.parameters
    rows = {n: (low, high) for n, low, high in zip(table.name, table.low_95, table.high_95, strict=True)}
    return [rows[name][0] <= value <= rows[name][1] for name, value in true.items()]


def test_a_motor_is_written_as_it_is_read() -> None:
    for text in ("joint2:motor", "joint12:-motor", "joint2:reference"):
        assert str(Channel.parse(text)) == text
    assert Channel.parse(" Joint2:Motor ") == Channel(-2, 6)
    assert Channel.parse("joint2:motor").motor == 2
    assert Channel.parse("12:+RZ").motor is None and not Channel.parse("12:S").is_reference
    for text in ("joint0:motor", "joint:motor", "joint2:+X"):
        with pytest.raises(InputError, match="joint2:motor"):
            Channel.parse(text)


def _predicted(problem: Problem, number: int = 0) -> np.ndarray:
    target = problem.targets().frf[number]
    values = {**{p.name: p.initial for p in problem.parameters}, **TRUE}
    if "joint1.rotor.stiffness" in values:
        values |= {"joint1.rotor.stiffness": HOLDING, "joint1.rotor.damping": 1e-9}
    return target.predict_pairs(problem.at(values))[:, 0] / (2j * np.pi * HZ)


def test_the_model_of_a_motor_is_that_of_two_inertias(tmp_path: Path) -> None:
    """Antiresonance of the link on its spring, resonance of both inertias: k / J_l and k / J_l + k / J_r."""
    problem = load_problem(read_study(_study(tmp_path, [{"file": _motor(tmp_path)}])))
    found = _predicted(problem)
    assert found == pytest.approx(_drive()[:, 0, 0], rel=1e-9)
    size = np.abs(found * HZ)
    lowest, highest = HZ[np.argmin(size)], HZ[10:][np.argmax(size[10:])]
    assert lowest == pytest.approx(np.sqrt(STIFFNESS / LINK) / (2 * np.pi), abs=0.6)
    assert highest == pytest.approx(np.sqrt(STIFFNESS / LINK + STIFFNESS / ROTOR) / (2 * np.pi), abs=0.6)


def test_the_torque_holds_what_holds_the_rotor_unless_it_is_added(tmp_path: Path) -> None:
    """A controller's stiffness is in the torque that it logs, not in the plant; a torque beside the
    controller's meets it.
    """
    held = {**ROTORS, "holding_stiffness": {"initial": HOLDING}}
    file = _motor(tmp_path)
    total = load_problem(read_study(_study(tmp_path, [{"file": file}], held)))
    assert _predicted(total) == pytest.approx(_drive()[:, 0, 0], rel=1e-9)
    entry = {"file": file, "motor_torque": "added"}
    added = load_problem(read_study(_study(tmp_path, [entry], held)))
    assert _predicted(added) == pytest.approx(_drive(HOLDING)[:, 0, 0], rel=1e-6)


def test_a_servo_lets_go_too(tmp_path: Path) -> None:
    servo = {
        **{key: value for key, value in ROTORS.items() if key != "kind"},
        "kind": "servo",
        "position_gain_per_s": 20.0,
        "integral_time_s": 0.02,
        "current_bandwidth_hz": 400.0,
    }
    file = _motor(tmp_path)
    total = load_problem(read_study(_study(tmp_path, [{"file": file}], servo)))
    assert _predicted(total) == pytest.approx(_drive()[:, 0, 0], rel=1e-9)
    added = load_problem(read_study(_study(tmp_path, [{"file": file, "motor_torque": "added"}], servo)))
    assert np.abs(_predicted(added) / _drive()[:, 0, 0] - 1).max() > 0.1


def test_a_drive_is_found_without_a_hammer(tmp_path: Path) -> None:
    path = _study(tmp_path, [{"file": _motor(tmp_path)}])
    checked = run_checks(path)
    assert not checked.refused
    assert not [one for some in checked.findings.values() for one in some if one.level == "fail"]
    result = _fitted(path)
    assert result.gap == pytest.approx(1, abs=0.2)
    assert all(_held(result, TRUE))
    half = (result.parameters.high_95 - result.parameters.low_95) / 2 / result.parameters.value
    assert np.all(half < 0.1)


def test_intervals_are_no_wider_where_one_log_tells_most(tmp_path: Path) -> None:
    """Nobody holds a motor askew: that one of six logs alone is precise is no disagreement between them."""
    for number in range(6):
        share = 0.1 if number else 0.003
        _file(tmp_path / f"{number}.csv", _drive()[:, :1, :1], [MOTOR], [MOTOR], share)
    path = _study(tmp_path, [{"file": f"{number}.csv"} for number in range(6)])
    problem = load_problem(read_study(path))
    table = _fitted(path).parameters
    found = intervals(problem, problem.at(dict(zip(table.name, table.value, strict=True))))
    assert np.all(found.std < 1.5 * found.independent_std)


@pytest.mark.parametrize("sides", [["torque", "motion"], ["torque"]])
def test_values_of_the_shaft_are_told_by_the_gear_ratio(tmp_path: Path, sides: list[str]) -> None:
    """100 turns: an angle of the shaft is 100 times as large, a torque a hundredth."""
    factor = 100.0 ** len(sides)
    entry = {"file": _motor(tmp_path, side=factor), "motor_side": sides}
    result = _fitted(_study(tmp_path, [entry]))
    assert all(_held(result, TRUE))
    assert result.gap == pytest.approx(1, abs=0.2)
    wrong = load_problem(read_study(_study(tmp_path, [{"file": "motor.csv"}])))
    assert np.abs(wrong.targets().frf[0].measured[:, 0] / _drive()[:, 0, 0]).min() > 50


def test_a_hammer_and_a_motor_tell_one_drive(tmp_path: Path) -> None:
    """Struck, the controller holds the rotor and the motor is seen to move; driven, the arm is."""
    arm = [Channel(1, 2)]
    struck = np.stack([ARM_M**2 * _drive(HOLDING)[:, 1, 1], ARM_M * _drive(HOLDING)[:, 0, 1]], axis=1)
    _file(tmp_path / "hammer.csv", struck[:, :, None], [*arm, MOTOR], arm)
    driven = np.stack([_drive()[:, 0, 0], ARM_M * _drive()[:, 1, 0]], axis=1)
    _file(tmp_path / "motor.csv", driven[:, :, None], [MOTOR, *arm], [MOTOR])
    held = {
        **ROTORS,
        "holding_stiffness": {"initial": 1e4},
        "holding_damping": {"initial": 0.01, "fixed": True},
    }
    keys = {"file": "motor.csv"}, {"file": "hammer.csv"}
    result = _fitted(_study(tmp_path, list(keys), held))
    assert result.gap == pytest.approx(1, abs=0.2)
    assert sum(_held(result, {**TRUE, "joint1.rotor.stiffness": HOLDING})) >= 4


def test_a_brake_holds_the_rotor_where_its_torque_is_no_input(tmp_path: Path) -> None:
    """Nothing is said of what holds it: struck, the link moves on its spring alone."""
    s = 2j * np.pi * HZ
    locked = ARM_M**2 / (LINK * s**2 + DAMPING * s + STIFFNESS)
    _file(tmp_path / "hammer.csv", locked[:, None, None], [Channel(1, 2)], [Channel(1, 2)])
    both = [{"file": _motor(tmp_path)}, {"file": "hammer.csv"}]
    problem = load_problem(read_study(_study(tmp_path, both)))
    assert [len(m.system.coordinates) for m in problem.measurements] == [2, 1]
    assert _predicted(problem, 1) == pytest.approx(locked, rel=1e-9)


def test_nuisances_know_motors(tmp_path: Path) -> None:
    """Slopes are those of differences; a motor is held askew by nobody, and lies nowhere."""
    entry = {"file": _motor(tmp_path)}
    problem = load_problem(read_study(_study(tmp_path, [entry], uncertainty="typical")))
    names = [p.name for p in problem.parameters if p.nuisance]
    assert any("joint1:motor" in name and "gain" in name for name in names)
    assert not any("impact" in name for name in names)
    objective = FrfLeastSquares().objective(problem.targets())
    values, free = problem.initial + 1e-3, np.arange(len(problem.initial))
    gradient = objective.product(values, free)[:-1, -1] * 2
    for number in (0, 3, problem.size, len(values) - 1):
        step = np.zeros(len(values))
        step[number] = 1e-6 * max(1.0, abs(values[number]))
        squares = [objective.product(values + sign * step, free)[-1, -1] for sign in (1, -1)]
        slope = (squares[0] - squares[1]) / (2 * step[number])
        assert gradient[number] == pytest.approx(slope, rel=1e-3, abs=1e-6 * np.abs(gradient).max())


@pytest.mark.parametrize(
    ("rotor", "entry", "said"),
    [
        ({}, {}, r"no rotor of joint 1 that turns by itself.*friction: \{\}"),
        ({**ROTORS, "friction": None}, {}, "no rotor of joint 1 that turns by itself"),
        (None, {"motor_torque": "added"}, "a rotor that is held fast.*holding_stiffness"),
        ({}, {"motor_side": ["torque"]}, "whose gear ratio is not stated"),
    ],
)
def test_what_a_motor_needs_is_said(
    tmp_path: Path, rotor: dict[str, Any] | None, entry: dict[str, Any], said: str
) -> None:
    path = _study(tmp_path, [{"file": _motor(tmp_path), **entry}], rotor)
    with pytest.raises((InputError, InputErrors), match=said):
        load_problem(read_study(path))


def test_other_commands_take_a_fit_of_motors(tmp_path: Path) -> None:
    """What is made of it afterwards: a misfit with the rotor free, and universal files of points alone."""
    arm = [Channel(1, 2)]
    driven = np.stack([_drive()[:, 0, 0], ARM_M * _drive()[:, 1, 0]], axis=1)
    _file(tmp_path / "motor.csv", driven[:, :, None], [MOTOR, *arm], [MOTOR])
    path = _study(tmp_path, [{"file": "motor.csv"}])
    result = _fitted(path)
    model = fitted_model(result, "out.h5")
    assert model.driven == {"motor": frozenset({1})}
    assert np.all(misfit(result, model) < 0.01)
    assert len(model.system(np.zeros(1)).coordinates) == 1, "as by a brake"
    written = identify.export_model(tmp_path / "out.h5", to="uff")
    assert [file.name for file in written] == ["out_motor.uff"]
    identify.modes(tmp_path / "motor.csv", out=tmp_path / "modes.h5", averages=16)
    table = read_modal_table(tmp_path / "modes.yaml", None)
    assert MOTOR in table.channels
    assert {one.node for one in read_shapes(tmp_path / "modes.uff").channels} == {1}


@pytest.mark.parametrize("entry", [{"motor_side": ["torque"]}, {"motor_torque": "added"}])
def test_keys_of_motors_need_motors(tmp_path: Path, entry: dict[str, Any]) -> None:
    arm = [Channel(1, 2)]
    _file(tmp_path / "hammer.csv", _drive(HOLDING)[:, 1:, 1:], arm, arm)
    path = _study(tmp_path, [{"file": "hammer.csv", **entry}])
    with pytest.raises((InputError, InputErrors), match="leave the key out"):
        load_problem(read_study(path))


def test_a_delay_is_discovered_in_what_a_motor_tells(tmp_path: Path) -> None:
    late = np.exp(-2j * np.pi * HZ * 1e-3)[:, None, None] * _drive()[:, :1, :1]
    _file(tmp_path / "motor.csv", late, [MOTOR], [MOTOR])
    path = _study(tmp_path, [{"file": "motor.csv"}])
    result = run_discover(path, tmp_path / "out.h5", {}, Story(), workers=1)[0]
    assert [one for one in result.added.sentence if "delay" in one]
    assert result.after.gap < 1.2
    assert sum(_held(result.after, TRUE)) >= 3


def test_the_motor_bench_is_as_stiff_as_its_reference(tmp_path: Path) -> None:
    """A measured multisine in a .mat file: 558 N m/rad, 4.85e-3 kg m^2 (SOURCE.md)."""
    file = shared("data", "fditools_motor_bench", "MultisineTypeA.mat")
    signals = {"joint1:motor [N m]": "iq_adx", "joint1:motor [rad]": "theta_mx"}
    estimate = {"excitation": "broadband", "period_s": 1.0, "sample_rate_hz": 2500, "signals": signals}
    rotor = {**ROTORS, "gear_ratio": [1], "inertia": {"initial": 2e-3}, "friction": {}}
    entry = {"file": str(file), "estimate": estimate, "averages": None}
    path = _study(tmp_path, [{k: v for k, v in entry.items() if v}], rotor, 2000.0, band_hz=[12, 240])
    text = path.read_text().replace("  averages: 16\n", "")
    path.write_text(text)
    robot = path.with_name("robot.yaml")
    robot.write_text(robot.read_text().replace(f"[{LINK}, {LINK}, {LINK}", "[0.00488, 0.00488, 0.00488"))
    table = _fitted(path, starts=10).parameters
    found = dict(zip(table.name, table.value, strict=True))
    assert found["joint1.rz.stiffness"] == pytest.approx(558, rel=0.01)
    assert found["joint1.rotor.inertia"] == pytest.approx(4.85e-3, rel=0.02)


def test_a_fit_that_leaves_no_mode_ends(tmp_path: Path) -> None:
    """Where damping takes the last oscillation away: it ended in a traceback."""
    path = _study(tmp_path, [{"file": _motor(tmp_path)}])
    study = yaml.safe_load(path.read_text())
    study["effects"][0]["damping"] = {"initial": 1e6, "fixed": True}
    path.write_text(yaml.safe_dump(study))
    done = identify.fit(path, out=tmp_path / "out.h5", starts=1)
    [measured] = done.data.measurements.values()
    assert measured.modes.frequency_hz.size == 0


def test_an_arm_is_found_by_the_logs_of_its_controllers(tmp_path: Path) -> None:
    """Of 20 in the benchmark (tests/benchmarks/motor_side.py) one, logged for shorter."""
    test = motor_log.drawn(4)
    short = replace(
        test, postures=test.postures[:1], logging=replace(test.logging, seconds=12.0, rate_hz=500.0)
    )
    result = _fitted(motor_log.study(tmp_path, short))
    assert 0.8 < result.gap < 1.2
    assert np.mean(_held(result, motor_log.truth(short))) > 0.8
