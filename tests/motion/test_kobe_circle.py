"""A tool led round a circle: command by inverse kinematics, elastic arms beside closed forms, the circular
test, six axes a joint.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from identify.core.errors import InputError, InputErrors
from identify.motion.evaluate import evaluate_simulation
from identify.motion.path import Circle, Tool, joint_path
from identify.motion.problem import MotionProblem
from identify.motion.tool import far_tool, tool_paths
from identify.motion.tracker import registered
from identify.results.circular import circular_test
from identify.robot.engine import Engine
from identify.robot.engine_motion import MovingArm
from identify.robot.posture import AXES, at_posture
from identify.robot.urdf import read_urdf
from tests.motion import arms

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
LENGTH, MASS, TIP, COLUMN = 0.4, 10.0, 0.2, 0.5
"""Of a planar arm: both links, m; mass at the tip, kg; inertia of link 2 about it and of link 1 about its
joint, kg m^2.
"""
CIRCLE = {"radius_mm": 5, "feed_mm_min": 4000, "turns": 1.5, "start_s": 0.02}
SERVO = {**arms.CASCADE, "position_gain": 25.0, "velocity_gain": 2000.0, "velocity_integral": 20.0}
SPRINGS = (2.5e5, 1.6e5, 1.5e6)
"""N m/rad about both joints, N/m across link 2."""


def planar() -> dict[str, Any]:
    """Two links that turn about the ground's z; all mass of the second is at the tip, and that of the first
    at its joint.
    """
    link = {
        "name": "upper",
        "mass_kg": 2.0,
        "centre_m": [-LENGTH, 0, 0],
        "inertia_kg_m2": [COLUMN, COLUMN, COLUMN, 0, 0, 0],
    }
    fore = {"name": "fore", "mass_kg": MASS, "centre_m": [0, 0, 0], "inertia_kg_m2": [TIP, TIP, TIP, 0, 0, 0]}
    joints = [{"name": name, "d_m": 0.0, "a_m": LENGTH, "alpha_deg": 0.0} for name in ("a", "b")]
    return {
        "name": "planar",
        "convention": "standard",
        "joints": joints,
        "links": [link, fore],
        "gravity_m_s2": [0, 0, 0],
    }


def study(folder: Path, stiff: float | None = None, **keys: Any) -> MotionProblem:
    """The planar arm on a circle with springs, so many times as stiff, or none."""
    effects = []
    if stiff is not None:
        inertia = MASS * LENGTH**2
        effects = [
            _spring([1, 2], "rz", [stiff * k for k in SPRINGS[:2]], inertia),
            _spring([2], "ty", [stiff * SPRINGS[2]], MASS),
        ]
    record = {"name": "circle", "start_deg": [-20.0, 80.0], "duration_s": 0.85, "path": CIRCLE}
    given = {"effects": effects, "servo": SERVO, "tool": {"link": "fore"}, "records": [record], **keys}
    return arms.study(folder, planar(), **given)


def _spring(joints: list[int], axis: str, stiffness: list[float], inertia: float) -> dict[str, Any]:
    damping = [0.2 * float(np.sqrt(k * inertia)) for k in stiffness]
    both = {
        "stiffness": {"initial": stiffness, "fixed": True},
        "damping": {"initial": damping, "fixed": True},
    }
    return {"kind": "joint-compliance", "joints": joints, "axes": [axis], **both}


def paths(problem: MotionProblem) -> dict[str, Array]:
    """Places of the tool in the judged turn, (ticks, 2), m."""
    record = problem.records[0]
    found = tool_paths(problem, record, problem.run(problem.initial[None], problem.records).coordinates[0])
    circle = record.settings.path
    assert circle is not None
    turn = circle.judged(problem.file.study.servo.period_s * np.arange(len(found["end"]), dtype=float))
    return {name: circle.flat(places)[turn] for name, places in found.items()}


def test_six_joints_lead_the_tool_at_its_feed_without_turning_it() -> None:
    arm, tool, start = (
        MovingArm(read_urdf(ROOT / "data/kobe_36dof/robot.urdf")),
        Tool(link="link6", at_m=(0.24, 0.09, 0.0)),
        _posture(),
    )
    time = np.arange(0, 2.3, 2e-3)
    circle = Circle(plane="YZ", radius_mm=8, feed_mm_min=3000, turns=1.5, clockwise=True, start_s=0.1)
    centre = arm.frame_position(start, tool.link, np.array(tool.at_m)) - [0, 8e-3, 0]
    angles = joint_path(arm, tool, start, circle.points(centre + np.array([0, 8e-3, 0]), time), "test")
    places = arm.frame_position(angles, tool.link, np.array(tool.at_m))
    np.testing.assert_allclose(np.linalg.norm(places - centre, axis=1), 8e-3, atol=1e-9)
    assert np.abs(places[:, 0] - centre[0]).max() < 1e-9
    going = circle.judged(time)
    assert np.sum(going) * 2e-3 == pytest.approx(2 * np.pi * 8e-3 / 0.05, abs=3e-3)
    speed = np.linalg.norm(np.gradient(places, 2e-3, axis=0), axis=1)[going]
    np.testing.assert_allclose(speed, 0.05, rtol=1e-4)
    assert places[60, 2] < centre[2]
    turned = (
        arm.frame_motion(angles[700], tool.link, np.zeros(3))[1]
        - arm.frame_motion(start, tool.link, np.zeros(3))[1]
    )
    assert np.abs(turned).max() < 1e-9 < np.abs(angles[700] - start).max()


def test_places_far_apart_are_met_as_exactly() -> None:
    """Two centimetres, where one step of Newton's method leaves a tenth of a millimetre."""
    arm, tool = MovingArm(read_urdf(ROOT / "data/kobe_36dof/robot.urdf")), Tool(link="link6")
    first = arm.frame_position(_posture(), tool.link, np.zeros(3))
    places = first + np.linspace(0, 0.1, 6)[:, None] * [0.0, 0.0, 1.0]
    angles = joint_path(arm, tool, _posture(), places, "test")
    np.testing.assert_allclose(arm.frame_position(angles, tool.link, np.zeros(3)), places, atol=1e-9)


def _posture() -> Array:
    return np.radians([0, 15, -10, 0, 30, 0])


def test_frame_jacobian_is_the_slope_of_the_place() -> None:
    arm, point = (
        MovingArm(read_urdf(ROOT / "data/kobe_36dof/robot.urdf"), ["joint2.tx", "joint3.rx"]),
        np.array([0.1, 0.2, 0.3]),
    )
    at = np.random.default_rng(1).normal(scale=0.3, size=len(arm.names))
    jacobian = arm.frame_motion(at, "link5", point)[2]
    for column in range(len(at)):
        moved = np.tile(at, (2, 1))
        moved[:, column] += [1e-6, -1e-6]
        up, down = arm.frame_position(moved, "link5", point)
        np.testing.assert_allclose((up - down) / 2e-6, jacobian[:3, column], atol=1e-8)


def test_without_elasticity_the_end_is_where_the_encoders_say(tmp_path: Path) -> None:
    """Rigid: the same to rounding.  Nine times stiffer: nine times closer."""
    rigid = paths(study(tmp_path / "rigid"))
    np.testing.assert_allclose(rigid["end"], rigid["feedback"], atol=1e-12)
    assert np.abs(rigid["feedback"] - rigid["command"]).max() < 2e-4
    soft, hard = (paths(study(tmp_path / f"{stiff:g}", stiff)) for stiff in (1.0, 9.0))
    off = [float(np.abs(path["end"] - path["feedback"]).max()) for path in (soft, hard)]
    assert off[0] > 5e-6
    assert off[0] / off[1] == pytest.approx(9, rel=0.1)


def test_a_slow_circle_deflects_the_arm_as_its_compliance_says(tmp_path: Path) -> None:
    """Each spring gives way to the inertia of tip and links that it carries: sum of j (-j.m a - I alpha) / k
    over the springs.
    """
    problem, (first, second) = study(tmp_path, 1.0), np.radians([-20.0, 80.0])
    upper = LENGTH * np.array([-np.sin(first), np.cos(first)])
    fore = LENGTH * np.array([-np.sin(first + second), np.cos(first + second)])
    found, rate = paths(problem), 4.0 / 60 / 5e-3
    outwards = rate**2 * (found["command"] - found["command"].mean(axis=0))  # less the acceleration
    turn = np.linalg.solve(np.column_stack([upper + fore, fore]), -outwards.T).T  # of both joints, rad/s^2
    both = turn.sum(axis=1)
    loads = (
        (upper + fore, MASS * outwards @ (upper + fore) - TIP * both - COLUMN * turn[:, 0]),
        (fore, MASS * outwards @ fore - TIP * both),
        (fore / LENGTH, MASS * outwards @ fore / LENGTH),
    )
    expected = sum(np.outer(load / k, way) for (way, load), k in zip(loads, SPRINGS, strict=True))
    difference = found["end"] - found["feedback"]
    assert np.abs(difference - expected).max() < 0.04 * np.abs(expected).max()
    without_bearing = expected - np.outer(loads[2][1] / SPRINGS[2], loads[2][0])
    assert np.abs(difference - without_bearing).max() > 0.1 * np.abs(expected).max()


def test_friction_makes_quadrant_glitches_that_settle_with_the_step(tmp_path: Path) -> None:
    """Smaller steps change the path less and less; without friction the feedback is rounder."""
    rubs, ends = {"coulomb": [20.0, 10.0]}, []
    for number, step in enumerate((5e-4, 2.5e-4, 1.25e-4)):
        problem = study(tmp_path / str(number), 1.0, friction=rubs, step_s=step)
        ends.append(paths(problem)["end"])
    errors = [float(np.abs(path - ends[2]).max()) for path in ends[:2]]
    assert errors[1] < 2e-6
    assert errors[0] > 1.8 * errors[1]
    rubbed, smooth = (
        circular_test(paths(study(tmp_path / name, 1.0, **keys))["feedback"]) for name, keys in _WITH.items()
    )
    assert rubbed.deviation > 3 * smooth.deviation


_WITH: dict[str, dict[str, Any]] = {"rubs": {"friction": {"coulomb": [20.0, 10.0]}}, "smooth": {}}


def test_the_mean_circle_leaves_what_is_not_round() -> None:
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    path = [0.3, -0.2] + (5e-3 + 2e-5 * np.cos(3 * angle))[:, None] * np.column_stack(
        [np.cos(angle), np.sin(angle)]
    )
    found = circular_test(path)
    np.testing.assert_allclose(found.centre, [0.3, -0.2], atol=1e-10)
    assert found.radius == pytest.approx(5e-3, rel=1e-9)
    assert found.deviation == pytest.approx(4e-5, rel=1e-3)
    assert found.rms == pytest.approx(2e-5 / np.sqrt(2), rel=1e-6)
    enlarged = np.linalg.norm(found.enlarged(20.0), axis=1)
    assert np.ptp(enlarged) == pytest.approx(8e-4, rel=1e-3)


def test_six_axes_at_every_joint_weigh_what_they_do_at_rest() -> None:
    """Mass and weight of 6 drives and 36 elastic coordinates against the engine of the frequency domain; a
    drive turns as rz does.
    """
    robot = read_urdf(ROOT / "data/kobe_36dof/robot.urdf")
    arm = MovingArm(robot, [f"joint{number}.{axis}" for number in range(1, 7) for axis in AXES])
    assert len(arm.names) == 42
    position = np.zeros(42)
    position[arm.drive] = _posture()
    engine, mass = Engine(at_posture(robot, _posture())), arm.mass_matrix(position)
    wanted = [engine.mechanism.coordinate(name.replace("drive", "rz"), "test") for name in arm.names]
    np.testing.assert_allclose(mass, engine.mass_matrix()[np.ix_(wanted, wanted)], atol=1e-9)
    weight = arm.inverse_dynamics(position, np.zeros(42), np.zeros(42))
    total = sum(link.mass for link in robot.links[1:])
    assert weight[arm.names.index("joint1.tz")] == pytest.approx(total * 9.81, rel=1e-3)


def test_results_keep_paths_and_circular_tests(tmp_path: Path) -> None:
    record = evaluate_simulation(study(tmp_path, 1.0)).records["circle"]
    assert record.paths is not None
    assert record.circles is not None
    assert set(record.paths) == set(record.circles) == {"command", "feedback", "end"}
    assert record.paths["end"].values.shape == (len(record.time_s), 3)
    assert record.circles["command"].radius == pytest.approx(5e-3, rel=1e-6)
    assert record.circles["end"].radius > record.circles["feedback"].radius  # inertia pulls outwards


def test_recorded_paths_are_judged_beside_the_simulated(tmp_path: Path) -> None:
    """A tracker that sees a circle of another radius, in mm, while the motors report that they stood still at
    the start.
    """
    time = np.arange(0, 0.8, 4e-3)
    swept = Circle(radius_mm=5, feed_mm_min=4000, turns=1.5, start_s=0.02).sweep.angle(time)
    rows = np.column_stack(
        [
            time,
            700 + 7 * np.cos(swept),
            7 * np.sin(swept),
            0 * time,
            0 * time,
            np.radians(80) + 1e-3 * np.sin(swept),
        ]
    )
    (tmp_path / "seen").mkdir()
    np.savetxt(
        tmp_path / "seen/c.csv", rows, delimiter=",", header="time_s,x,y,z,q1,q2", comments="", fmt="%.9f"
    )
    signals = {"motor_position": {"at": "q{joint}", "unit": "rad"}}
    tracker = {"file": "c.csv", "signals": signals, "tool": {"at": ["x", "y", "z"], "unit": "mm"}}
    record = {
        "name": "circle",
        "start_deg": [-20.0, 80.0],
        "duration_s": 0.85,
        "path": CIRCLE,
        "measured": tracker,
    }
    circles = evaluate_simulation(study(tmp_path / "seen", records=[record])).records["circle"].circles
    assert circles is not None
    assert circles["recorded end"].radius == pytest.approx(7e-3, rel=1e-3)
    assert circles["recorded end"].centre == pytest.approx([0.7, 0.0], abs=1e-5)
    assert circles["recorded feedback"].error.shape == circles["recorded end"].error.shape
    with pytest.raises(InputError, match="nothing of that name"):
        study(
            tmp_path / "seen", records=[{**record, "measured": {**tracker, "tool": {"at": ["x", "y", "w"]}}}]
        )


def test_glitches_are_told_apart_by_joint(tmp_path: Path) -> None:
    """As two studies, one with the friction of the joint and one without, simulated by themselves."""
    told = {"friction": {"coulomb": [20.0, 10.0]}, "records": [_led(glitches=True)]}
    result = evaluate_simulation(study(tmp_path / "both", 1.0, **told)).records["circle"]
    found, circles = result.glitches, result.circles
    assert found is not None
    assert circles is not None
    assert set(found.joint) == {1, 2}
    less = study(tmp_path / "one", 1.0, friction={"coulomb": [0.0, 10.0]}, records=[_led()])
    without = evaluate_simulation(less).records["circle"].circles
    assert without is not None
    angle = circles["feedback"].angle
    for at, feedback, end in zip(
        *(row[found.joint == 1] for row in (found.angle, found.feedback, found.end)), strict=True
    ):
        behind = np.mod(angle - at, 2 * np.pi) < np.pi / 6
        for name, glitch in (("feedback", feedback), ("end", end)):
            added = (circles[name].error - without[name].error)[behind]
            assert abs(glitch) == pytest.approx(np.abs(added).max(), abs=1e-9)
    assert np.abs(found.feedback).min() > 1e-6
    smooth = study(tmp_path / "none", 1.0, records=[_led(glitches=True)])
    assert evaluate_simulation(smooth).records["circle"].glitches is None


def _led(**path: Any) -> dict[str, Any]:
    return {"name": "circle", "start_deg": [-20.0, 80.0], "duration_s": 0.85, "path": {**CIRCLE, **path}}


def test_a_tracker_with_a_frame_and_a_clock_of_its_own_is_laid_on_the_drives() -> None:
    """A formula of a circle with a bump, begun and ended at rest, seen turned, shifted and 13.7 ms early."""
    time = np.arange(0, 1.2, 2e-3)

    def place(at: Array) -> Array:
        since = np.clip(at - 0.2, 0, 0.8) / 0.8
        angle = 3 * np.pi * (since - np.sin(2 * np.pi * since) / 2 / np.pi)
        bump = 5e-3 + 4e-5 * np.exp(-(((angle - 4) / 0.2) ** 2))
        return np.stack([bump * np.cos(angle), bump * np.sin(angle), 0 * angle], axis=1)

    turn, shift = Rotation.from_euler("zyx", [40, 70, -20], degrees=True), np.array([2.0, -1.0, 0.5])
    noise = np.random.default_rng(3).normal(scale=1e-6, size=(len(time), 3))
    seen = turn.apply(place(time - 0.0137)) + shift + noise
    found = registered(seen, time, place(time), 0.5)
    assert found.offset_s == pytest.approx(0.0137, abs=1e-5)
    assert found.angle == pytest.approx(turn.magnitude(), abs=1e-3)
    np.testing.assert_allclose(found.places, place(time), atol=1e-5)
    assert found.left < 3e-6
    assert "13.7" in found.sentence("circle")
    wrong = registered(seen, time, place(time), 0.005)  # not far enough to find it
    assert wrong.left > 10 * found.left


def test_a_record_in_the_frame_of_its_tracker_is_judged_as_in_that_of_the_base(tmp_path: Path) -> None:
    """Motors that follow a circle of formula, and a tracker that sees another one turned over."""
    (tmp_path / "seen").mkdir()
    time = np.arange(0, 0.8, 4e-3)
    swept = Circle(radius_mm=5, feed_mm_min=4000, turns=1.5, start_s=0.02).sweep.angle(time)
    radius = 5 + 0.03 * np.cos(3 * swept)
    flat = np.stack([700 + radius * np.cos(swept), radius * np.sin(swept), 0 * time], axis=1)
    turned = Rotation.from_euler("x", 90, degrees=True).apply(flat) + np.array([10.0, 20.0, 30.0])
    for name, places in (("base", flat), ("own", turned)):
        rows, head = np.column_stack([time, places, 0 * time, 0 * time]), "time_s,x,y,z,q1,q2"
        np.savetxt(tmp_path / f"seen/{name}.csv", rows, "%.9f", ",", header=head, comments="")
    deviations, notes = [], []
    torque = {"motor_torque": {"at": "q{joint}", "unit": "N m"}}
    for frame in ("base", "own"):
        tracker = {"at": ["x", "y", "z"], "unit": "mm", "frame": frame}
        measured = {"file": f"{frame}.csv", "signals": torque, "tool": tracker}
        result = evaluate_simulation(study(tmp_path / "seen", records=[{**_led(), "measured": measured}]))
        circles = result.records["circle"].circles
        assert circles is not None
        deviations.append(circles["recorded end"].deviation)
        notes.append([note for note in result.notes if "tracker" in note])
    assert deviations[0] == pytest.approx(6e-5, rel=0.02)
    assert deviations[1] == pytest.approx(deviations[0], rel=0.02)
    assert not notes[0]
    [note] = notes[1]
    assert "turn of 90" in note


def test_paths_that_cannot_be_are_refused(tmp_path: Path) -> None:
    record = {"name": "c", "start_deg": [-20.0, 80.0], "duration_s": 2.0, "path": CIRCLE}
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"tool": None}, "expected the point that is led"),
        ({"tool": {"link": "hand"}}, "unknown link 'hand'"),
        ({"records": [{**record, "moves": [arms.move(1, 1, 10)]}]}, "both given"),
        ({"records": [{**record, "duration_s": 0.5}]}, "the path ends after"),
        (
            {
                "records": [
                    {**record, "path": {**CIRCLE, "radius_mm": 700, "feed_mm_min": 60000}, "duration_s": 12.0}
                ]
            },
            "a path that the arm can follow",
        ),
        ({"records": [{**record, "path": {**CIRCLE, "plane": "ZX"}}]}, "a path that the arm can follow"),
    ]
    for keys, sentence in wrong:
        with pytest.raises((InputError, InputErrors)) as caught:
            study(tmp_path, **keys)
        assert sentence in str(caught.value), (keys, str(caught.value))


@pytest.mark.parametrize(("x_m", "told"), [(0.1, []), (160.0, ["far-place"])])
def test_a_tool_that_is_not_on_the_arm_is_told(x_m: float, told: list[str], tmp_path: Path) -> None:
    there = study(tmp_path, tool={"link": "fore", "at_m": [x_m, 0, 0]})
    assert [one.check for one in far_tool(there)] == told
