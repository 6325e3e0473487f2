"""No key of a config is accepted and does nothing.

Every key of a study of vibration and of the measurement, modal and motion settings is changed in a small
study: what is built from it must change, or the change must be refused.  Keys for which that is not done are
listed in `NOT_VARIED` with the reason, so that a new key must be put into one of the two.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from identify.core.config import models_in
from identify.core.errors import InputError, InputErrors
from identify.fitting.fit import fit
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.uff.write import write_uff58
from identify.modal.analysis import analyse
from identify.modal.settings import ModalSettings
from identify.motion.problem import load_motion
from identify.motion.study import MotionStudy, read_motion_study
from identify.vibration.plan import fit_plan
from identify.vibration.problem import load_problem
from identify.vibration.study import Study, read_study
from tests.modal.test_alone import roved
from tests.motion import arms
from tests.robot.random_arm import industrial_arm

Config = dict[str, Any]
Change = Callable[[Config], Any]


def leaves(model: type[BaseModel], prefix: str = "") -> Iterator[str]:
    """Every key of a study by its path, those of settings inside settings too; a plug point is one key."""
    for name, field in model.model_fields.items():
        path = f"{prefix}{field.alias or name}"
        inner = [one for one in models_in(field.annotation) if "kind" not in one.model_fields]
        if not inner or hasattr(inner[0], "INNER"):
            yield path
        for one in inner:
            if not hasattr(one, "INNER"):
                yield from leaves(one, f"{path}.")


def put(path: str, value: Any) -> Change:
    """Set the key at a path; numbers are places of lists."""

    def change(config: Config) -> None:
        *way, last = path.split(".")
        at: Any = config
        for part in way:
            at = at[int(part)] if part.isdigit() else at.setdefault(part, {})
        at[last] = value

    return change


VIBRATION: dict[str, Any] = {
    "schema": "identify/2",
    "robot.urdf": "other.urdf",
    "robot.payload.link": [{"link": "link3", "mass_kg": 9.0}],
    "robot.payload.mass_kg": [{"link": "link6", "mass_kg": 12.0}],
    "robot.payload.centre_m": [{"link": "link6", "mass_kg": 9.0, "centre_m": [0.1, 0, 0]}],
    "robot.payload.inertia_kg_m2": [{"link": "link6", "mass_kg": 9.0, "inertia_kg_m2": [1, 1, 1, 0, 0, 0]}],
    "robot.gravity_m_s2": [0, 9.81, 0],
    "robot.units.mass": "lb",
    "robot.units.length": "cm",
    "robot.units.inertia": "kg cm2",
    "joint_angles.unit": "rad",
    "joint_angles.order": [2, 1, 3, 4, 5, 6],
    "joint_angles.sign": [1, -1, 1, 1, 1, 1],
    "joint_angles.offset_deg": [0, 30, 0, 0, 0, 0],
    "joint_angles.coupling": {3: {2: -1}},
    "points": "other.csv",
    "measurements.format": "csv",
    "measurements.quantity": "receptance",
    "measurements.unit": "g/N",
    "measurements.averages": 9,
    "measurements.window_decay_per_s": 2.0,
    "measurements.record_s": 1.0,
    "measurements.columns": ["frequency_hz", "real", "imag"],
    "measurements.frequency_start_hz": 1.0,
    "measurements.frequency_step_hz": 0.5,
    "measurements.correct.factor": {"factor": 9.80665},
    "measurements.correct.quantity": {"quantity": "mobility"},
    "measurements.correct.inverse": {"inverse": True},
    "measurements.correct.frequency": {"frequency": "rad/s"},
    "measurements.correct.nodes": {"nodes": {1: 2, 2: 1}},
    "measurements.correct.outputs": {"outputs": {"1:+X": -1.0}},
    "measurements.correct.inputs": {"inputs": {"1:+Z": 10.0}},
    "measurements.correct.axes": {"axes": "base"},
    "measurements.outputs": ["1:+X"],
    "measurements.inputs": ["1:+Z"],
    "measurements.variables": {"frf": "x"},
    "measurements.channels": {"1:+X": "2:+Y"},
    "measurements.file": "third.uff",
    "measurements.repeats": ["third.uff"],
    "measurements.modes": "modes.yaml",
    "measurements.shapes": "shapes.csv",
    "measurements.posture_deg": [0, 20, 30, 0, 40, 0],
    "measurements.speed_deg_per_s": [100, 100, 100, 0, 0, 0],
    "measurements.detached": "link6",
    "measurements.noise.relative": {"relative": 0.1},
    "measurements.use": "validate",
    "measurements.estimate.excitation": {"excitation": "impacts"},
    "band_hz": [5, 25],
    "effects": [{"kind": "joint-compliance", "axes": ["rz", "rx"]}],
    "initial": {"joint1.rz.stiffness": 1e6},
    "cost": {"kind": "frf-least-squares", "residual": "log"},
    "optimizer": [{"kind": "gauss-newton", "evaluations": 2}],
    "uncertainty.like": {"like": "typical"},
    "uncertainty.links.mass": {"links": {"mass": 0.1}},
    "uncertainty.links.centre_m": {"links": {"centre_m": 0.01}},
    "uncertainty.links.inertia": {"links": {"inertia": 0.1}},
    "uncertainty.links.each.mass": {"links": {"each": {"link3": {"mass": 0.1}}}},
    "uncertainty.links.each.centre_m": {"links": {"each": {"link3": {"centre_m": 0.1}}}},
    "uncertainty.links.each.inertia": {"links": {"each": {"link3": {"inertia": 0.1}}}},
    "uncertainty.points.position_m": {"points": {"position_m": 0.01}},
    "uncertainty.points.direction_deg": {"points": {"direction_deg": 2}},
    "uncertainty.points.each.position_m": {"points": {"each": {1: {"position_m": 0.01}}}},
    "uncertainty.points.each.direction_deg": {"points": {"each": {1: {"direction_deg": 2}}}},
    "uncertainty.channels.gain": {"channels": {"gain": 0.02}},
    "uncertainty.channels.force_gain": {"channels": {"force_gain": 0.02}},
    "uncertainty.channels.each.gain": {"channels": {"each": {"1:+X": {"gain": 0.02}}}},
    "uncertainty.impacts.direction_deg": {"impacts": {"direction_deg": 2}},
    "uncertainty.joints.angle_deg": {"joints": {"angle_deg": 0.5}},
    "uncertainty.kinematics.position_m": {"kinematics": {"position_m": 0.01}},
    "uncertainty.sets.delay_s": {"sets": {"delay_s": 1e-3}},
    "starts": 2,
    "start_factor": 9.0,
    "target_cost": 1e9,
    "seed": 7,
}
"""Path -> another value; of the settings of a measurement or an uncertainty the whole of what holds it."""

REFUSED = {
    "schema",
    "measurements.columns",
    "measurements.frequency_start_hz",
    "measurements.frequency_step_hz",
    "measurements.format",
    "measurements.quantity",
    "measurements.unit",
    "measurements.variables",
    "measurements.modes",
    "measurements.shapes",
    "measurements.estimate.excitation",
    "measurements.correct.axes",
}
"""Changes that contradict the file or have no meaning here."""

_NAMES = "a label of results alone"
_ELSEWHERE = "varied where its formula is tested, on data that have what it acts on: "
NOT_VARIED = {
    "name": _NAMES,
    "measurements.name": _NAMES,
    "reference": "read for reports alone",
    "like": "needs a fitted robot: tests/vibration/test_like.py",
    "modal_choices": "keys of `modal` in a file: tests/test_modes_command.py",
    "robot.dh": "either of two keys: tests/robot/test_read.py",
    "robot.arguments": "of a xacro: tests/robot/test_source.py",
    "robot.tip": "of several arms: tests/robot/test_chain.py",
    "robot.lock": "of joints beside the arm: tests/robot/test_chain.py",
    "robot.mounted_rpy_deg": "another way to say gravity: tests/robot/test_read.py",
    "robot.units.angle": "the arm here turns nothing: tests/setup/test_bodies.py",
    "robot.mass_kg": "only compared: tests/robot/test_plausible.py",
    "measurements.estimate": _ELSEWHERE + "tests/test_time_histories.py",
    "measurements.motor_": "needs motors: tests/vibration/test_motors.py",
    "measurements.impact": _ELSEWHERE + "tests/model/effects/test_nonlinear.py",
    "uncertainty.impacts.strength": _ELSEWHERE + "tests/vibration/costs",
    "uncertainty.impacts.duration": _ELSEWHERE + "tests/vibration/costs",
    "uncertainty.flexible_links": _ELSEWHERE + "tests/model/effects/test_link_form.py",
    "modal": "MODAL below",
    "registration": "in place of points: tests/vibration/test_registered_points.py",
    "points_": "two keys that go together: tests/vibration/test_study_points.py",
}
"""Path, or what it begins with -> why it is not varied here."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Robots, sets of points and files of FRFs of any size, which no fit need explain."""
    path = tmp_path_factory.mktemp("keys")
    rng = np.random.default_rng(1)
    outputs = tuple(Channel(node, axis) for node in (1, 2) for axis in (1, 3))
    inputs = (Channel(2, 3), Channel(1, 3))
    for number, name in enumerate(("arm", "other", "third")):
        (path / f"{name}.urdf").write_text(industrial_arm(number + 1))
        head = "node,name,link,x_m,y_m,z_m\n"
        (path / f"{name}.csv").write_text(f"{head}1,a,link3,0.1,0,0.{number + 1}\n2,b,link6,0,0.1,0.2\n")
        s = 2j * np.pi * (2.0 + 2 * np.arange(20))[:, None, None]
        # Smooth, as of something that is connected: one resonance, of any size in any channel.
        frf = 1e-3 * rng.normal(size=(4, 2)) * s**2 / (s**2 + 8 * s + (2 * np.pi * 21) ** 2)
        coherence = rng.uniform(0.6, 0.99, size=(20, 4, 2))
        data = FrfSet(2.0 + 2 * np.arange(20), frf, outputs, inputs, "accelerance", coherence)
        write_uff58(path / f"{name}.uff", data)
    return path


def vibration() -> Config:
    measurement = {"posture_deg": [0, 10, 20, 0, 30, 0], "averages": 4, "window_decay_per_s": 1.0}
    return {
        "schema": "identify/1",
        "robot": {"urdf": "arm.urdf", "payload": [{"link": "link6", "mass_kg": 9.0}]},
        "points": "arm.csv",
        "measurements": [
            {"file": "arm.uff", **measurement},
            {"file": "other.uff", **measurement, "posture_deg": [0, 0, 0, 0, 0, 0]},
        ],
        "effects": [{"kind": "joint-compliance", "axes": ["rz"]}],
        "optimizer": [{"kind": "gauss-newton", "evaluations": 4}],
        "starts": 3,
    }


def built(folder: Path, config: Config) -> bytes:
    """What a study comes to: its parameters, the cost where it begins, and where its starts lead."""
    (folder / "study.yaml").write_text(json.dumps(config))
    problem = load_problem(read_study(folder / "study.yaml"))
    plan = fit_plan(problem)
    told = [[p.name, p.initial, p.lower, p.upper, p.free] for p in plan.parameters]
    numbers = [plan.objective.costs(plan.initial[None])]
    if "uncertainty" not in config:  # whose fits take longer, and whose parameters say it all
        numbers += [np.array([*one.initial, *one.final, one.cost]) for one in fit(plan).starts]
    return json.dumps([told, *(array.tolist() for array in numbers)]).encode()


@pytest.fixture(scope="module")
def before(folder: Path) -> bytes:
    return built(folder, vibration())


def varied(path: str, value: Any) -> Change:
    """Settings inside a list of one kind, or inside another, are replaced as a whole."""
    head, _, rest = path.partition(".")
    if head == "measurements":
        key = rest.partition(".")[0]
        return put(f"measurements.0.{key}", value)
    if path.startswith("robot.payload"):
        return put("robot.payload", value)
    return put(head if head == "uncertainty" else path, value)


@pytest.mark.parametrize("path", VIBRATION)
def test_a_key_of_a_study_of_vibration_does_something(path: str, folder: Path, before: bytes) -> None:
    config = vibration()
    varied(path, VIBRATION[path])(config)
    if path in REFUSED:
        with pytest.raises((InputError, InputErrors)):
            built(folder, config)
    else:
        assert built(folder, config) != before


def test_the_same_study_is_the_same(folder: Path, before: bytes) -> None:
    """Otherwise any change would do."""
    assert built(folder, vibration()) == before


def test_every_key_of_a_study_of_vibration_is_varied_or_says_why_not() -> None:
    told = set(leaves(Study))
    missing = [
        key for key in told if key not in VIBRATION and not any(key.startswith(one) for one in NOT_VARIED)
    ]
    assert not missing
    gone = {key for key in VIBRATION if key not in told}
    gone |= {one for one in NOT_VARIED if not any(key.startswith(one) for key in told)}
    assert not gone, "keys that are no more"


@pytest.mark.parametrize(
    ("measurement", "said"),
    [
        (
            {"modes": "m.yaml", "window_decay_per_s": 0.695},
            "`window_decay_per_s` has no meaning beside `modes`",
        ),
        ({"modes": "m.yaml", "noise": {"relative": 0.1}}, "`noise` has no meaning beside `modes`"),
        ({"modes": "m.yaml", "impact": {"peak_n": 100}}, "`impact` has no meaning beside `modes`"),
        ({"modes": "m.yaml", "outputs": ["1:+X"]}, "`outputs` has no meaning beside `modes`"),
        ({"modes": "m.yaml", "shapes": "s.csv"}, "`shapes` goes with `modes` in .csv"),
        ({"file": "f.uff", "shapes": "s.csv"}, "`shapes` has no meaning beside `file`"),
        ({"file": "f.uff", "estimate": {}, "unit": "g/N"}, "`unit` has no meaning beside `estimate`"),
        (
            {"file": "f.uff", "estimate": {"excitation": "random"}, "window_decay_per_s": 1},
            "`window_decay_per_s` has no meaning beside `estimate`",
        ),
        (
            {"file": "f.uff", "estimate": {"segment_s": 1}},
            "`segment_s` has no meaning with `excitation: impacts`",
        ),
        (
            {"file": "f.uff", "estimate": {"excitation": "random", "force_window_s": 1}},
            "`force_window_s` has no meaning with `excitation: random`",
        ),
    ],
)
def test_keys_of_another_kind_of_measurement_are_refused(
    measurement: Config, said: str, folder: Path
) -> None:
    config = {**vibration(), "measurements": [{**measurement, "posture_deg": [0] * 6}]}
    (folder / "study.yaml").write_text(json.dumps(config))
    with pytest.raises(InputErrors) as caught:
        read_study(folder / "study.yaml")
    assert said in str(caught.value)


MODAL: dict[str, Any] = {
    "estimator": "lsce",
    "band_hz": (5, 35),
    "references": ("2:+Z",),
    "min_order": 6,
    "max_order": 12,
    "max_damping_ratio": 0.0125,
    "cluster_radius": 1e-4,
    "min_presence": 1.0,
    "max_frequency_spread": 1e-9,
    "max_damping_spread": 1e-9,
    "min_mpc": 1.0,
    "max_mpd_deg": 1e-3,
    "modes_hz": (12.0,),
    "keep_hz": (12.0,),
    "drop_hz": (12.0,),
    "refine": True,
    "residuals": (),
}
MODAL_NOT_VARIED = {
    "min_contribution": "needs a mode that explains less than all: tests/modal/test_analysis.py",
    "duplicate_mac": "needs clusters that are close: tests/modal/test_analysis.py",
    "direction": "needs responses in several: tests/modal/test_layout.py",
}


def modes(**settings: Any) -> bytes:
    found = analyse(roved(1, 1, 1, 1), ModalSettings(**{"refine": False, **settings}))
    reasons = [(one.frequency_hz, one.reason) for one in found.rejected]
    kept = [(one.frequency_hz, one.by_hand) for one in found.modes]
    diagram = [len(found.diagram.poles), found.diagram.cluster.tolist(), found.settings.max_damping_ratio > 0]
    return json.dumps([reasons, kept, diagram, found.table.frequency_hz.tolist(), found.total_error]).encode()


@pytest.fixture(scope="module")
def modes_before() -> bytes:
    return modes()


@pytest.mark.parametrize("key", MODAL)
def test_a_key_of_modal_settings_does_something(key: str, modes_before: bytes) -> None:
    assert modes(**{key: MODAL[key]}) != modes_before


def test_every_key_of_modal_settings_is_varied_or_says_why_not() -> None:
    assert set(ModalSettings.model_fields) == set(MODAL) | set(MODAL_NOT_VARIED)


MOTION: dict[str, Any] = {
    "schema": "identify-motion/2",
    "encoder_counts": [512],
    "step_s": 5e-4,
    "extrapolate": True,
    "gear.ratio": 60.0,
    "friction.coulomb": 9.0,
    "friction.viscous": 9.0,
    "records.start_deg": [5.0],
    "records.moves.joint": 2,
    "records.moves.start_s": 0.02,
    "records.moves.by_deg": 3.0,
    "records.moves.speed_deg_s": 20.0,
    "records.moves.acceleration_deg_s2": 900.0,
    "records.moves.smoothing_s": 0.02,
    "records.excitation.joint": {"joint": 1, "torque_n_m": 9.0, "band_hz": [1, 20], "period_s": 0.1},
    "records.excitation.torque_n_m": {"joint": 1, "torque_n_m": 5.0, "band_hz": [1, 20], "period_s": 0.1},
    "records.duration_s": 0.5,
    "records.measured.signals": True,
    "servo": {"kind": "cascade", "position_gain": 5.0, "velocity_gain": 100.0},
    "motor": {"kind": "torque", "rotor_inertia": 2e-3},
    "bodies.mass": 0.2,
    "balancer.sine": 5.0,
    "balancer.cosine": 5.0,
    "motor.torque_gain": 0.8,
    "servo.latency": 2e-3,
}
MOTION_NOT_VARIED = {
    "name": _NAMES,
    "records.name": _NAMES,
    "robot": "VIBRATION above, by the same reader",
    "effects": "tests/motion/test_simulate.py",
    "tool": "of a path: tests/motion/test_kobe_circle.py",
    "records.path": "tests/motion/test_kobe_circle.py",
    "records.excitation": "two keys above; the signal: tests/motion/test_explain.py",
    "records.measured": "where a signal stands: tests/measured; a command: below",
    "records.phases_s": "which samples are judged apart, in the result alone",
    "records.recorded_motion_hz": "needs a recording: tests/motion/test_fed.py",
    "records.use": "which records are fitted: needs a recording",
    "inverse_dynamics_hz": "needs a recording: tests/motion/test_fed.py",
    "gear": "cubic stiffness, backlash and ripples need an elastic joint: tests/motion/test_gear.py",
    "friction": "tests/motion/test_friction_smoothing.py",
    "bodies": "two keys above, each a number as others are",
    "balancer": "two keys above, each a number as others are",
    "noise": "weights of a fit: needs a recording",
    "candidates": "tried after a fit: tests/motion/test_explain.py",
    "optimizer": "of a fit, by the plan that VIBRATION varies",
    "starts": "of a fit, by the plan that VIBRATION varies",
    "start_factor": "of a fit, by the plan that VIBRATION varies",
    "target_cost": "of a fit, by the plan that VIBRATION varies",
    "seed": "of a fit, by the plan that VIBRATION varies",
}


def motion() -> Config:
    record = {"name": "a", "start_deg": [0.0], "duration_s": 0.4, "moves": [arms.move(1, 5, 90)]}
    return {
        "schema": "identify-motion/1",
        "robot": {"dh": "robot.yaml"},
        "motor": {"kind": "torque", "rotor_inertia": 1e-3},
        "gear": {"ratio": 50.0},
        "friction": {"coulomb": 2.0, "viscous": 1.0},
        "servo": {"kind": "cascade", "position_gain": 20.0, "velocity_gain": 100.0},
        "records": [record],
    }


def simulated(folder: Path, config: Config) -> bytes:
    (folder / "robot.yaml").write_text(json.dumps(arms.one_link(9.81)))
    (folder / "motion.yaml").write_text(json.dumps(config))
    problem = load_motion(read_motion_study(folder / "motion.yaml"))
    found = problem.run(problem.initial[None], problem.records)
    return found.coordinates.tobytes() + found.torque.tobytes()


def changed_motion(path: str, folder: Path) -> Config:
    config, value = deepcopy(motion()), MOTION[path]
    record = config["records"][0]
    if path == "records.measured.signals":
        times = np.linspace(0, 0.2, 41)
        rows = np.column_stack([times, 100 * times**2])
        np.savetxt(folder / "own.csv", rows, delimiter=",", header="time_s,c1", comments="")
        signals = {"command_position": {"at": "c{joint}", "unit": "deg"}}
        record["measured"] = {"file": "own.csv", "signals": signals}
        del record["moves"]
        return config
    for name in ("records.moves.", "records."):
        if path.startswith(name):
            key = path.removeprefix(name).partition(".")[0]
            (record["moves"][0] if name.endswith("moves.") else record)[key] = value
            return config
    put(path, value)(config)
    return config


@pytest.mark.parametrize("path", MOTION)
def test_a_key_of_a_study_of_motion_does_something(path: str, tmp_path: Path) -> None:
    config = changed_motion(path, tmp_path)
    before = motion()
    if path == "records.measured.signals":  # beside one that stands still
        del before["records"][0]["moves"]
    if path in ("schema", "records.moves.joint"):  # the arm has one joint
        with pytest.raises((InputError, InputErrors)):
            simulated(tmp_path, config)
    else:
        assert simulated(tmp_path, config) != simulated(tmp_path, before)


def test_every_key_of_a_study_of_motion_is_varied_or_says_why_not() -> None:
    told = set(leaves(MotionStudy))
    missing = [
        key for key in told if key not in MOTION and not any(key.startswith(one) for one in MOTION_NOT_VARIED)
    ]
    assert not missing
