"""Assembly: what is released moves, matrices are affine in the parameters, detached links are gone, faults
are named.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.model.effects.base import parse_effect
from identify.model.system import assemble, build_site, list_parameters
from tests.arms import ALL_EFFECTS, arm, initial, system
from tests.robot.random_arm import random_posture

DRIVE = {"kind": "joint-compliance", "axes": ["rz"]}


def test_matrices_are_affine_in_the_parameters_and_symmetric(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    values = initial(parameters)
    for at_zero, at_one, at_two in zip(*(model.matrices(scale * values) for scale in (0, 1, 2)), strict=True):
        assert at_two - at_one == pytest.approx(at_one - at_zero, rel=1e-9, abs=1e-9 * np.abs(at_one).max())
        assert at_one == pytest.approx(at_one.T)


def test_factors_are_the_terms(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    f = model.factors
    for number in range(len(parameters)):
        for power, role in enumerate(("stiffness", "damping", "mass")):
            columns = (f.owner == number) & (f.power == power)
            rebuilt = (f.vectors[:, columns] * f.weight[columns]) @ f.vectors[:, columns].T
            assert rebuilt == pytest.approx(
                model.terms[role][number], abs=1e-9 * max(1.0, np.abs(model.terms[role][number]).max())
            )


def test_detached_links_and_their_joints_are_gone_but_keep_their_parameters(tmp_path: Path) -> None:
    robot, posture = arm(tmp_path), random_posture(1)
    effects = [parse_effect(effect) for effect in ALL_EFFECTS]
    parameters = list_parameters(robot, build_site(robot, posture, effects), effects)
    short = assemble(robot, build_site(robot, posture, effects, "link4"), effects)
    assert {name.split(".")[0] for name in short.coordinates} == {"base", "joint1", "joint2", "joint3"}
    assert len(short.terms["stiffness"]) == len(parameters)
    whole = assemble(robot, build_site(robot, posture, effects), effects)
    values = initial(parameters)
    assert short.matrices(values)[0][0, 0] < whole.matrices(values)[0][0, 0]
    for number, parameter in enumerate(parameters):
        gone = parameter.name.startswith(("joint4", "joint5", "joint6", "link4"))
        assert gone == (number not in short.factors.owner), parameter.name


def test_nothing_released_is_an_error(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    effects = [parse_effect({"kind": "added-mass", "link": "link2"})]
    with pytest.raises(InputError, match="nothing can move"):
        assemble(robot, build_site(robot, random_posture(1), effects), effects)


def test_a_parameter_claimed_twice_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"effects\.1: parameter joint1\.rz\.damping is claimed"):
        system(arm(tmp_path), [DRIVE, DRIVE])
