"""The generator of simulated hammer tests against closed forms, its own linear model, Pinocchio and pyuff."""

from __future__ import annotations

import ast
import json
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.generator import TestSpec, generate
from tests.generator.cases import CASES, hide
from tests.generator.chain import Chain
from tests.generator.estimate import Estimate, h1
from tests.generator.faults import ChannelGain, ChannelPolarity, ChannelSwap, TimeDelay, TurnedSensor
from tests.generator.generate import describe, tell
from tests.generator.hammer import Impact, swing
from tests.generator.linear import linearise
from tests.generator.makes import MAKES, random_arm
from tests.generator.measure import (
    draw_postures,
    make_chain,
    make_plant,
    stated_decay,
    strike_all,
    with_noise_of,
)
from tests.generator.nonlinear import FrictionSprings, HardeningStiffness, JointFriction
from tests.generator.plant import Plant
from tests.generator.rigid import Array, from_rpy, to_rpy
from tests.generator.structure import LinkFlexibility, cut
from tests.generator.tree import at_posture
from tests.generator.universal import Function, dataset

DATA = Path(__file__).parents[1] / "data" / "arm_hammer_test"
GENTLE = TestSpec(
    random_arm(5), force_n=10.0, noise_force=0.0, noise_response=0.0, averages=1, window_decay_per_s=3.0
)
"""Small motions and no noise: everything is linear."""
SHIPPED = TestSpec(MAKES["large"](1).at_points([2, 4, 5, 6, 8, 9, 10, 12, 13, 14]), seed=1, binary=True)


def measured(spec: TestSpec, level: float = 1.0) -> tuple[dict[tuple[str, int], Estimate], Plant]:
    """FRFs of the first posture of a test and what they were taken from."""
    plant = make_plant(spec, draw_postures(spec)[0])
    chain = make_chain(spec, stated_decay(spec, []), [plant])
    return strike_all(spec, plant, chain, level, np.random.default_rng(spec.seed)), plant


def laplace(decay: float, frequency_hz: Array) -> NDArray[np.complex128]:
    """Where an exponential window puts FRFs."""
    return np.asarray(decay + 2j * np.pi * frequency_hz, dtype=np.complex128)


def expected(spec: TestSpec, plant: Plant, frequency_hz: Array) -> NDArray[np.complex128]:
    """FRFs (lines, outputs, 3) of the linear model where the exponential window puts them."""
    assert spec.window_decay_per_s is not None
    return linearise(plant, spec.hammer_points[0]).accelerance(laplace(spec.window_decay_per_s, frequency_hz))


def mismatch(frfs: dict[tuple[str, int], Estimate], model: NDArray[np.complex128]) -> float:
    """Largest RMS difference over RMS of any force direction."""
    worst = 0.0
    for (_, axis), estimate in frfs.items():
        scale = np.sqrt(np.mean(np.abs(model[:, :, axis]) ** 2))
        worst = max(worst, float(np.sqrt(np.mean(np.abs(estimate.h1 - model[:, :, axis]) ** 2)) / scale))
    return worst


def test_nothing_is_imported_from_identify() -> None:
    """No inverse crime."""
    files = sorted((Path(__file__).parent / "generator").glob("*.py"))
    assert len(files) > 15
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(name.split(".")[0] == "identify" for name in names), file.name


def test_recorded_impact_has_the_spectrum_of_a_half_sine() -> None:
    """The closed-form Laplace transform at decay + j omega, filter and sampling notwithstanding."""
    chain = Chain(
        rate=512.0, duration=1.6, oversampling=16, noise_force=0.0, noise_response=0.0, window_decay=3.0
    )
    impact = Impact(peak=180.0, start=0.4 * chain.step, width=6.5e-3, along=np.array([0.0, 0.0, 1.0]))
    record = chain.window() * chain.force(
        impact.reading(chain.step * np.arange(chain.steps)), np.random.default_rng(0)
    )
    s = 3.0 + 2j * np.pi * np.fft.rfftfreq(chain.samples, 1 / 512.0)[:128]
    exact = 180.0 * (np.pi / 6.5e-3) * (1 + np.exp(-s * 6.5e-3)) / (s**2 + (np.pi / 6.5e-3) ** 2)
    found = np.fft.rfft(record)[:128] / 512.0
    before = np.angle(exact[1] / found[1]) / (2 * np.pi * 512.0 / chain.samples)
    assert before == pytest.approx(0.0285, abs=1e-3)  # pre-trigger
    assert found * np.exp(s * before) == pytest.approx(exact, rel=1e-3)


def test_records_pass_80_hz_and_stop_what_would_alias() -> None:
    """A sine at 80 Hz keeps its level; one at 440 Hz, which would appear at 72 Hz, vanishes."""
    chain = Chain(
        rate=512.0, duration=1.6, oversampling=16, noise_force=0.0, noise_response=0.0, window_decay=0.0
    )
    time = chain.step * np.arange(chain.steps)
    low, high = (
        chain.force(np.sin(2 * np.pi * f * time), np.random.default_rng(0))[200:-50] for f in (80.0, 440.0)
    )
    assert np.sqrt(2 * np.mean(low**2)) == pytest.approx(1.0, rel=1e-2)
    assert np.abs(high).max() < 2e-4


def test_simulated_decay_has_the_poles_of_the_linear_model() -> None:
    """Matrix pencil of the free decay: frequency to 0.1 %, damping to 1 %: integration adds no damping of its
    own.
    """
    plant = make_plant(GENTLE, draw_postures(GENTLE)[0])
    impact = Impact(peak=10.0, start=0.0, width=6e-3, along=np.array([0.48, 0.6, 0.64]))
    motion = plant.respond(GENTLE.hammer_points[0], impact.force, impact.end, 1 / 8192, 5000)[64::16].reshape(
        -1, 42
    )
    rows = len(motion) // 2
    hankel = np.hstack([motion[n : n + rows] for n in range(60)])
    left, sizes, _ = np.linalg.svd(hankel, full_matrices=False)
    assert sizes[11] > 20 * sizes[12]
    step = np.linalg.lstsq(left[:-1, :12], left[1:, :12], rcond=None)[0]
    poles = 512 * np.log(np.linalg.eigvals(step).astype(complex))
    found = np.array(sorted(poles[poles.imag > 0], key=abs))
    true = linearise(plant, GENTLE.hammer_points[0]).poles
    assert np.abs(found) == pytest.approx(np.abs(true), rel=1e-3)
    assert -found.real / np.abs(found) == pytest.approx(-true.real / np.abs(true), rel=1e-2)


def test_urdf_is_the_robot_that_was_simulated(tmp_path: Path) -> None:
    """Mass matrix and gravity stiffness from the written URDF by Pinocchio, skew link frames included."""
    pin = pytest.importorskip("pinocchio")
    arm = next(arm for arm in map(random_arm, range(20)) if np.abs(arm.joints[3].axis).max() < 0.999)
    spec = replace(GENTLE, arm=replace(arm, damping=np.zeros(6)))
    posture = draw_postures(spec)[0]
    linear = linearise(make_plant(spec, posture), spec.hammer_points[0])
    file = tmp_path / "robot.urdf"
    file.write_text(arm.urdf(), encoding="utf-8")
    model = pin.buildModelFromUrdf(str(file))
    tip = model.addFrame(
        pin.Frame("tip", 6, 0, pin.SE3(np.eye(3), arm.points[-1].xyz), pin.FrameType.OP_FRAME)
    )
    data, q = model.createData(), np.radians(posture)
    mass = np.triu(pin.crba(model, data, q))
    mass += np.triu(mass, 1).T
    stiffness = np.diag(arm.stiffness) + pin.computeGeneralizedGravityDerivatives(model, data, q)
    jacobian = pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL)[:3]
    assert -mass @ linear.a[6:, :6] == pytest.approx(stiffness, abs=1e-6 * arm.stiffness.max())
    assert mass @ linear.b[6:] == pytest.approx(jacobian.T, abs=1e-6)


@pytest.mark.parametrize(
    "case", ["none", "base_rocking+tilt_j3", "link2_flex", "absorber_l3+ground_spring_l2+rotor_j2"]
)
def test_frfs_are_those_of_the_linear_model(case: str) -> None:
    """Impacts, filter, window and H1 without noise give the FRF at decay + j omega."""
    spec = hide(GENTLE, case)
    frfs, plant = measured(spec)
    model = expected(spec, plant, next(iter(frfs.values())).frequency_hz)
    assert mismatch(frfs, model) < 1e-3


def test_small_motions_of_the_linear_model_are_those_of_time_steps() -> None:
    spec = hide(replace(GENTLE, force_n=0.01), "tilt_j2")
    (steps, _), (exact, _) = (measured(one) for one in (spec, replace(spec, linear=True)))
    for where, one in steps.items():
        assert np.abs(exact[where].h1 - one.h1).max() < 3e-4 * np.abs(one.h1).max()


def test_faults_change_the_channels_they_name() -> None:
    """Delay is e^{-s tau} on everything; sign, factor, order and turn are on one sensor."""
    faults = (
        TimeDelay(1.3e-3),
        ChannelPolarity("link2_1", "y"),
        ChannelGain("link3_1", "x", 1.3),
        ChannelSwap("link4_1", ("x", "z")),
        TurnedSensor("link5_1", "z", 30.0),
    )
    spec = replace(GENTLE, effects=faults)
    frfs, plant = measured(spec)
    frequency = next(iter(frfs.values())).frequency_hz
    model = expected(spec, plant, frequency).reshape(len(frequency), 14, 3, 3)
    model = model * np.exp(-(3.0 + 2j * np.pi * frequency) * 1.3e-3)[:, None, None, None]
    model[:, 4, 1] *= -1
    model[:, 6, 0] *= 1.3
    model[:, 8] = model[:, 8, [2, 1, 0]]
    cosine, sine = np.cos(np.pi / 6), np.sin(np.pi / 6)
    x, y = model[:, 10, 0].copy(), model[:, 10, 1].copy()
    model[:, 10, 0], model[:, 10, 1] = cosine * x + sine * y, cosine * y - sine * x
    assert mismatch(frfs, model.reshape(len(frequency), 42, 3)) < 1e-3


def test_errors_and_coherence_are_those_of_the_stated_noise() -> None:
    """H1 of a sensor that reads twice the force, noisily: its scatter is sigma^2 sum(w^2) / sum |F|^2, and
    its coherence says so.
    """
    chain = Chain(
        rate=512.0, duration=1.6, oversampling=16, noise_force=0.0, noise_response=0.5, window_decay=3.0
    )
    rng = np.random.default_rng(4)
    impacts = [swing(rng, 2, 100.0, 0.0, chain.step) for _ in range(4)]
    readings = [impact.reading(chain.step * np.arange(chain.steps)) for impact in impacts]
    names = [str(number) for number in range(40)]
    forces = np.array([chain.window() * chain.force(reading, rng) for reading in readings])
    responses = np.array(
        [chain.responses(np.tile(2 * reading[:, None, None], (1, 40, 3)), names, rng) for reading in readings]
    )
    estimate = h1(forces, chain.window()[:, None] * responses.reshape(4, chain.samples, -1), chain.rate).band(
        2.5, 80.0
    )
    power = np.sum(np.abs(np.fft.rfft(forces, axis=1)[:, 4:128]) ** 2, axis=0)
    variance = 0.25 * np.sum(chain.window() ** 2) / power
    told = np.abs(estimate.h1) ** 2 * (1 - estimate.coherence) / estimate.coherence / 3
    assert np.mean(np.abs(estimate.h1 - 2) ** 2 / variance[:, None]) == pytest.approx(1.0, rel=0.05)
    assert np.mean(told / variance[:, None]) == pytest.approx(1.0, rel=0.05)


def test_each_posture_may_have_a_noise_of_its_own() -> None:
    """Nothing else of the chain changes, and postures without a number have the noise of the test."""
    spec = replace(SHIPPED, noisier=(0.5, 4.0))
    chain = make_chain(spec, 3.0, [make_plant(spec, draw_postures(spec)[0])])
    own = [with_noise_of(spec, chain, number) for number in range(3)]
    assert [one.noise_force for one in own] == pytest.approx([0.05, 0.4, 0.1])
    assert [one.noise_response for one in own] == pytest.approx([0.005, 0.04, 0.01])
    assert replace(own[1], noise_force=0.1, noise_response=0.01) == chain


def test_force_level_matters_only_where_it_should() -> None:
    """Ten times the force: same FRFs on a linear arm, other ones with friction, a hardening spring or a
    spring on a slider in joint 2.
    """
    spec = replace(GENTLE, duration_s=0.8, oversampling=8)
    joint = spec.arm.stiffness[1]
    changes = []
    for effects in (
        (),
        (JointFriction(2, 0.3, 1e-5),),
        (HardeningStiffness(2, 5e9 * joint),),
        (FrictionSprings(2, (joint,), (0.3,)),),
    ):
        soft, hard = (measured(replace(spec, effects=effects), level)[0] for level in (1.0, 10.0))
        changes.append(
            mismatch(hard, np.stack([soft[(spec.hammer_points[0], axis)].h1 for axis in range(3)], axis=2))
        )
    assert changes[0] < 1e-3
    assert min(changes[1:]) > 0.03


def test_a_spring_on_a_slider_loses_what_the_slider_takes() -> None:
    """4 T (X - T / k) in a cycle of amplitude X; below T / k nothing, where it is a spring of k (Iwan)."""
    chain, angles = FrictionSprings(2, (200.0, 50.0), (1.0, 0.5)), np.linspace(0, 4 * np.pi, 4001)
    for most, lost in ((0.004, 0.0), (0.03, 4 * (0.03 - 0.005) + 4 * 0.5 * (0.03 - 0.01))):
        memory, torques = chain.start(), []
        for angle in most * np.sin(angles):
            torques.append(chain.torque(angle, 0.0, memory))
            memory = chain.after(angle, memory)
        path = most * np.sin(angles)[2000:]
        assert -np.trapezoid(np.array(torques)[2000:], path) == pytest.approx(lost, abs=2e-4)
    assert chain.torque(1e-3, 0.0, chain.start()) == pytest.approx(-0.25)


def test_weighed_accelerometers_feel_the_tilt() -> None:
    """A link that tilts about a level axis by theta reads g theta more: 4 % at 2.5 Hz for 1 m above the axis,
    nothing at 80 Hz.
    """
    posture = draw_postures(GENTLE)[0]
    plain, weighed = (
        linearise(make_plant(replace(GENTLE, weighed=w), posture), "link6_2") for w in (False, True)
    )
    difference = weighed.c[:, :6] - plain.c[:, :6]
    plant = make_plant(GENTLE, posture)
    plant.rest()
    mujoco.mj_forward(plant.model, plant.data)
    site = plant.data.site("link6_2")
    up = np.array([0.0, 0.0, 9.81])
    about = site.xmat.reshape(3, 3).T @ np.cross(up, plant.data.xaxis.T, axisb=0, axisc=0)
    assert difference[-3:] == pytest.approx(about, abs=1e-6)


@pytest.mark.parametrize(
    "name", [f"{kind}_j3" for kind in CASES if kind != "flex"] + ["link3_flex", "link6_flex"]
)
def test_every_case_rests_and_decays(name: str) -> None:
    """All that can be hidden leaves a stable arm at rest; its truth can be written."""
    spec = hide(replace(GENTLE, seed=7), name)
    postures = draw_postures(spec)[:1]
    plant = make_plant(spec, postures[0])
    plant.rest()
    mujoco.mj_forward(plant.model, plant.data)
    assert np.abs(plant.data.qacc).max() < 1e-9
    linear = linearise(plant, "link6_2")
    assert np.linalg.eigvals(linear.a).real.max() < 0
    truth = json.loads(tell(spec, postures, [linear]))
    assert len(truth["effects"]) == len(truth["hidden"]) == 1
    assert truth["effects"][0]["kind"] == spec.effects[0].kind


def test_unknown_case_is_refused() -> None:
    """The message lists what there is."""
    with pytest.raises(ValueError, match="tilt"):
        hide(GENTLE, "gremlin_j2")


def test_a_link_that_is_nearly_a_plate_is_cut_too() -> None:
    """Its largest moment is the sum of the others but for less than a cut leaves."""
    plate = replace(random_arm(1).links[2].inertia, tensor=np.diag([0.4, 0.6, 0.995]))
    whole, *rest = cut(plate, np.array([0.0, 0.0, 1.0]), np.linspace(0.0, 1.0, 6))
    for piece in rest:
        assert piece.tensor == pytest.approx(plate.tensor / 5)
        whole = whole + piece
    assert whole.tensor == pytest.approx(plate.tensor)


def test_a_link_with_stiff_hinges_is_the_rigid_link() -> None:
    """Pieces add up to the body, and the arm keeps its slow poles."""
    body = GENTLE.arm.links[2].inertia
    whole, *rest = cut(body, np.array([0.6, 0.0, 0.8]), np.linspace(0.0, 1.0, 6))
    for piece in rest:
        whole = whole + piece
    assert whole.mass == pytest.approx(body.mass)
    assert whole.centre == pytest.approx(body.centre)
    assert whole.tensor == pytest.approx(body.tensor)
    x, y, z = GENTLE.arm.joints[2].xyz
    stiff = replace(GENTLE, effects=(LinkFlexibility("link2", (x, y, z), 1e11, 1e11, 1e5, 1e5),))
    rigid, cut_up = (linearise(make_plant(spec, spec.arm.home), "link6_2").poles for spec in (GENTLE, stiff))
    assert cut_up[:6] == pytest.approx(rigid, rel=1e-4)


@pytest.mark.parametrize("binary", [False, True])
def test_universal_files_are_read_by_pyuff(tmp_path: Path, binary: bool) -> None:
    """Values, frequencies, nodes, directions and labels come back."""
    pyuff = pytest.importorskip("pyuff")
    rng = np.random.default_rng(3)
    frequency = np.linspace(2.5, 6.25, 7)
    frf, coherence = rng.normal(size=7) + 1j * rng.normal(size=7), rng.random(7)
    response, reference = GENTLE.arm.points[3], GENTLE.arm.points[13]
    ends = (response, 1, reference, 2)
    parts = [dataset(Function(frequency, values, *ends), binary) for values in (frf, coherence)]
    file = tmp_path / "two.uff"
    file.write_bytes(b"".join(parts))
    first, second = pyuff.UFF(str(file)).read_sets()
    assert (first["func_type"], second["func_type"]) == (4, 6)
    for found, values in ((first, frf), (second, coherence)):
        assert found["data"] == pytest.approx(values, rel=1e-5)
        assert found["x"] == pytest.approx(frequency, rel=1e-5)
        assert (found["rsp_node"], found["rsp_dir"], found["ref_node"], found["ref_dir"]) == (4, 2, 14, 3)
    assert (first["ordinate_axis_units_lab"].strip(), first["orddenom_axis_units_lab"].strip()) == (
        "m/s2",
        "N",
    )


def test_files_of_a_test(tmp_path: Path) -> None:
    """Names and keys as documented, the truth outside the folder, the same bytes again from the same seed."""
    arm = random_arm(5).at_points([9, 14])
    spec = replace(
        GENTLE, arm=arm, postures=1, levels=(0.5, 2.0), duration_s=0.3, oversampling=8, band_hz=(5.0, 60.0)
    )
    for folder in ("one", "two"):
        generate(spec, tmp_path / folder)
    names = ["points.csv", "posture1_level0.5.uff", "posture1_level2.uff", "robot.urdf", "test.json"]
    assert sorted(file.name for file in (tmp_path / "one").iterdir()) == names
    assert all(
        (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes() for name in names
    )
    test = json.loads((tmp_path / "one" / "test.json").read_text(encoding="utf-8"))
    assert [file["level_n"] for file in test["files"]] == [5.0, 20.0]
    assert test["exponential_window_decay_per_s"] == 3.0
    ratio = np.array(test["initial_stiffness_nm_per_rad"]) / arm.stiffness
    assert np.all((ratio > 0.59) & (ratio < 1.71))
    truth = json.loads((tmp_path / "one.truth.json").read_text(encoding="utf-8"))
    assert truth["effects"] == [] and truth["k"] == arm.stiffness.tolist()
    points = (tmp_path / "one" / "points.csv").read_text(encoding="utf-8").splitlines()
    assert [line.split(",")[:3] for line in points[1:]] == [
        ["9", "link4_1", "link4"],
        ["14", "link6_2", "link6"],
    ]


def test_rotations_go_there_and_back() -> None:
    """Roll, pitch and yaw, at the singular pitch too."""
    for rpy in ([0.3, -1.2, 2.5], [0.7, np.pi / 2, -0.4], [-2.0, -np.pi / 2, 1.0]):
        assert from_rpy(to_rpy(from_rpy(rpy))) == pytest.approx(from_rpy(rpy), abs=1e-9)


def test_joints_on_their_own_are_where_the_make_puts_them() -> None:
    """The large arm's joint frequencies, from the stiffness and the inertia that the joint carries."""
    arm = MAKES["large"](1)
    tree = at_posture(arm, arm.home)
    inertia = [
        tree.outboard_about(f"link{number}", joint.axis) for number, joint in enumerate(arm.joints, start=1)
    ]
    assert np.sqrt(arm.stiffness / inertia) / (2 * np.pi) == pytest.approx(
        [13.0, 14.0, 22.0, 51.0, 38.0, 74.0]
    )
    assert 1000 < sum(link.inertia.mass for link in arm.links) < 1200


def _words(text: str) -> tuple[str, list[float]]:
    """A text without its numbers, and the numbers."""
    number = r"-?\d+\.?\d*(?:e[+-]?\d+)?"
    return re.sub(number, "#", text), [float(found) for found in re.findall(number, text)]


def test_shipped_data_are_what_their_source_says() -> None:
    """Texts and truth of data/arm_hammer_test come from the stated seed; its FRFs are those of the truth to
    within the stated noise.
    """
    pyuff = pytest.importorskip("pyuff")
    postures = draw_postures(SHIPPED)
    plants = [make_plant(SHIPPED, posture) for posture in postures]
    linear = [linearise(plant, "link6_2") for plant in plants]
    decay = stated_decay(SHIPPED, linear)
    for name, text in describe(SHIPPED, postures, decay).items():
        words, again = (_words((DATA / name).read_text(encoding="utf-8")), _words(text))
        assert words[0] == again[0]
        assert words[1] == pytest.approx(again[1], rel=1e-7, abs=1e-9)
    shipped, told = (
        json.loads(text)
        for text in ((DATA / "truth.json").read_text(encoding="utf-8"), tell(SHIPPED, postures, linear))
    )
    assert (
        shipped["k"] == pytest.approx(told["k"])
        and shipped["c"] == pytest.approx(told["c"])
        and shipped["effects"] == []
    )
    for number, model in enumerate(linear, start=1):
        sets = [
            item
            for item in pyuff.UFF(str(DATA / f"posture{number}.uff")).read_sets()
            if item["func_type"] == 4
        ]
        assert len(sets) == 90
        found = np.array([item["data"] for item in sets]).T.reshape(-1, 3, 30).transpose(0, 2, 1)
        exact = model.accelerance(laplace(decay, sets[0]["x"]))
        force = 2 / np.pi * 180.0 * 6.5e-3 * 512.0 * np.exp(-0.0285 * decay)
        floor = 1e-2 * np.sqrt(np.sum(np.exp(-2 * decay * np.arange(819) / 512.0)) / 4) / force
        assert np.sqrt(np.mean(np.abs(found[:48, :3]) ** 2)) == pytest.approx(
            floor, rel=0.2
        )  # the base stands still
        assert np.sqrt(np.mean(np.abs(found - exact) ** 2) / np.mean(np.abs(exact) ** 2)) < 0.01
