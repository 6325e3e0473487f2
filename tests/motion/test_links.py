"""Links that bend and twist in motion: statics in closed form, and a record by another program."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.core.errors import InputErrors
from identify.core.yaml_input import parse_yaml
from identify.model.effects.base_compliance import BaseCompliance
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.motion.changed import with_effects, with_numbers
from identify.motion.missing.new_config import study_text
from identify.motion.missing.noise import with_noise
from identify.motion.missing.springs import rigid
from identify.motion.numbers import JointNumber
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import MotionCandidate, Spring, read_motion_study
from identify.robot.engine_motion import MovingArm
from tests.generator.kobe import BASE, first_link, plant
from tests.generator.kobe_arm import kobe
from tests.generator.kobe_circle import CirclePlant
from tests.motion import drawn_arm, kobe_begins

Array = NDArray[np.float64]
EI, GJ = 2e5, 1e5


def elastic(folder: Path) -> MotionProblem:
    """An arm of two links, the first of which bends and twists."""
    drawn_arm.write(folder)
    problem = with_noise(load_motion(read_motion_study(folder / "motion.yaml")))[0]
    values = {"bending": {"initial": EI}, "torsion": {"initial": GJ}}
    return with_effects(problem, [LinkFlexibility.model_validate({"link": "link1", **values})], {})


def test_the_end_of_a_link_turns_as_a_cantilevers_does(tmp_path: Path) -> None:
    problem = elastic(tmp_path)
    arm, position = problem.arm, np.zeros(len(problem.arm.names))
    position[arm.drive] = problem.records[0].command.position[0]
    place, _, jacobian = arm.frame_motion(position, "link2", np.zeros(3))
    start, _, _ = arm.frame_motion(position, "link1", np.zeros(3))
    along, length = (place - start) / np.linalg.norm(place - start), float(np.linalg.norm(place - start))
    stiffness = problem.passive(problem.initial[None], problem.table.arrays(problem.initial[None])).stiffness[
        0
    ]
    across = np.cross(along, np.eye(3)[1])

    def moved(force: Array, moment: Array) -> tuple[Array, Array]:
        load = jacobian.T @ np.concatenate([force, moment])
        by = np.where(stiffness > 0, load / np.where(stiffness > 0, stiffness, 1.0), 0.0)
        return jacobian[:3] @ by, jacobian[3:] @ by

    shift, angle = moved(np.zeros(3), 100.0 * np.eye(3)[1])
    assert angle == pytest.approx(100.0 * length / EI * np.eye(3)[1], abs=1e-12)
    assert np.linalg.norm(shift) == pytest.approx(100.0 * length**2 / 2 / EI)
    assert moved(np.zeros(3), 100.0 * along)[1] @ along == pytest.approx(100.0 * length / GJ)
    shift, angle = moved(100.0 * across, np.zeros(3))
    assert np.linalg.norm(angle) == pytest.approx(100.0 * length**2 / 2 / EI)
    assert shift @ across == pytest.approx(100.0 * length**3 / 3 / EI)


def test_halves_of_a_link_are_the_link(tmp_path: Path) -> None:
    """Rigid, the arm has the inertia that it had, heavier bodies included."""
    problem = elastic(tmp_path)
    whole = MovingArm(problem.robot)
    turn = problem.records[0].command.position[0]
    position = np.zeros(len(problem.arm.names))
    position[problem.arm.drive] = turn
    drives = np.ix_(problem.arm.drive, problem.arm.drive)
    np.testing.assert_allclose(problem.arm.mass_matrix(position)[drives], whole.mass_matrix(turn), rtol=1e-9)
    with problem.arm.heavier(np.array([0.3, 0.1])), whole.heavier(np.array([0.3, 0.1])):
        heavy = problem.arm.mass_matrix(position)[drives]
        np.testing.assert_allclose(heavy, whole.mass_matrix(turn), rtol=1e-9)
    assert np.linalg.eigvalsh(problem.arm.mass_matrix(position))[0] > 0


def test_the_first_link_of_the_kobe_circle_is_what_the_generator_has() -> None:
    """0.2 s with what else is hidden said: the gap is least where the bending and torsion are the truth."""
    robot = kobe()
    problem = kobe_begins.first(1000).with_smoothing("tanh")
    creep = CirclePlant(robot, plant(robot, 6)).creep.tolist()
    stated = {"friction.creep_velocity": JointNumber(initial=creep, bounds=(1e-5, 1.0))}
    problem = with_numbers(problem, stated, {})
    base = {
        "axes": list(BASE.axes),
        "stiffness": {"initial": list(BASE.stiffness)},
        "damping": {"initial": list(BASE.damping)},
    }
    link = first_link(robot)
    length = float(np.linalg.norm(link.along))
    stiff, damping = (
        part * length / link.segments for part in (link.bending_stiffness, link.bending_damping)
    )

    def gap(factor: float) -> float:
        own = {"initial": factor * stiff}
        loss = {"initial": damping}
        told = {"bending": own, "torsion": own, "bending_damping": loss, "torsion_damping": loss}
        both: list[Spring] = [
            BaseCompliance.model_validate(base),
            LinkFlexibility.model_validate({"link": "link1", **told}),
        ]
        elastic = replace(with_effects(problem, both, {}), step_s=1.25e-4)
        return float(fitted_objective(elastic).costs(elastic.initial[None])[0])

    softer, truth, stiffer = gap(0.8), gap(1.0), gap(1.25)
    assert truth < 1.1
    assert softer > truth + 0.1 and stiffer > truth + 0.1


def test_a_flexible_link_is_in_the_catalogue_and_written(tmp_path: Path) -> None:
    drawn_arm.write(tmp_path)
    problem = with_noise(load_motion(read_motion_study(tmp_path / "motion.yaml")))[0]
    [kind] = [one for one in rigid(problem, problem.initial)[0] if one.whole]
    assert kind.coordinates == ("link1.bending_1", "link1.bending_2", "link1.torsion")
    effect = kind.candidate([0])
    assert effect.name == "flexibility of links (link1)"
    softer = with_effects(problem, effect.effects, {"link1.torsion.stiffness": 5e4})
    data = parse_yaml(study_text(softer, softer.initial, tmp_path), "new")
    assert data["effects"][0]["kind"] == "link-flexibility"
    assert data["effects"][0]["torsion"]["initial"] == [5e4]
    assert len(data["effects"][0]["bending"]["initial"]) == 2
    assert len(data["effects"][0]["torsion_damping"]["initial"]) == 1


def test_forms_without_motion_are_refused() -> None:
    told = {"kind": "link-flexibility", "link": "link1", "nonuniform": True}
    with pytest.raises((InputErrors, ValueError), match="nonuniform springs have no motion yet"):
        MotionCandidate.model_validate({"name": "link", "effects": [told]})
