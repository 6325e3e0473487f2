"""What may be missing from motion is promised where it is, however far from what is stated: of records by
`tests.generator`.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError, InputErrors
from identify.core.yaml_input import parse_yaml
from identify.fitting.fit import Fit
from identify.motion.changed import coarse, with_effects, with_numbers
from identify.motion.judging import FittedMotion
from identify.motion.missing import screen
from identify.motion.missing.catalogue import Kind, log_prior
from identify.motion.missing.linear import Place, Sight, solutions
from identify.motion.missing.new_config import study_text
from identify.motion.missing.noise import with_noise
from identify.motion.missing.screen import promises
from identify.motion.missing.springs import SpringKind, rigid
from identify.motion.missing.worth import worth
from identify.motion.numbers import JointNumber
from identify.motion.plan import fitted_objective
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from tests.generator import hidden_motion
from tests.motion import drawn_arm


def drawn(folder: Path, kind: str = "", **told: object) -> MotionProblem:
    """An arm of two links of which the study says some keys of friction otherwise."""
    drawn_arm.write(folder, kind)
    data = json.loads((folder / "motion.yaml").read_text())
    data["friction"] |= told
    (folder / "motion.yaml").write_text(json.dumps(data))
    return with_noise(load_motion(read_motion_study(folder / "motion.yaml")))[0]


def as_it_is(problem: MotionProblem) -> FittedMotion:
    return FittedMotion(problem, Fit(problem.initial, 1.0, (), np.zeros((0, 5)), 0.0))


def test_a_creep_speed_far_from_what_is_stated_is_promised_far_from_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hidden_motion, "CREEP", 0.02)
    monkeypatch.setattr(screen, "_springs", lambda model: (None, []))
    found = promises(as_it_is(drawn(tmp_path, creep_velocity=1e-3)))
    assert found[0].effect.name.startswith("creep velocity of joint")
    starts = [found[0].starts[f"joint{n + 1}.friction.creep_velocity"] for n in found[0].places]
    assert all(4e-3 < start < 4e-2 for start in starts)


def test_what_is_searched_begins_where_it_was(tmp_path: Path) -> None:
    gain = {"servo.position_gain": JointNumber(initial=10.0, bounds=(1.0, 99.0))}
    dry = {"friction.coulomb": JointNumber(initial=1.0, bounds=(0.1, 99.0))}
    there = with_numbers(drawn(tmp_path), gain, {"joint2.servo.position_gain": 17.0})
    then = with_numbers(there, dry, {"joint1.friction.coulomb": 3.0})
    names = [f"joint{n}.{what}" for what in ("friction.coulomb", "servo.position_gain") for n in (1, 2)]
    values = {p.name: p.initial for p in then.parameters}
    assert [values[name] for name in names] == [3.0, 1.0, 10.0, 17.0]


def test_a_number_is_searched_within_what_it_is_known_to(tmp_path: Path) -> None:
    """Each joint's own, and so written into the better study."""
    problem = drawn(tmp_path, coulomb={"initial": [40.0, 5.0], "within": 0.01})
    found = [(p.lower, p.upper) for p in problem.parameters]
    assert found == [pytest.approx((39.6, 40.4)), pytest.approx((4.95, 5.05))]
    moved = with_numbers(problem, {}, {"joint2.friction.coulomb": 5.02})
    told = parse_yaml(study_text(moved, moved.initial, tmp_path), "new")["friction"]["coulomb"]
    assert told == {"initial": [40.0, 5.02], "within": 0.01}
    with pytest.raises(InputErrors, match="in place of `bounds`"):
        drawn(tmp_path / "both", coulomb={"initial": 5.0, "within": 0.01, "bounds": [1.0, 9.0]})
    with pytest.raises(InputErrors, match=r"coulomb\.within"):
        drawn(tmp_path / "wide", coulomb={"initial": 5.0, "within": 1.0})
    with pytest.raises(InputError, match="the smaller bound first"):
        drawn(tmp_path / "none", viscous={"initial": 0.0, "within": 0.1})


def test_springs_begin_as_good_as_rigid_in_steps_as_long_as_before(tmp_path: Path) -> None:
    """All classes at once, a link between two joints with light halves among them, stay in the controller's
    steps and change hardly anything.
    """
    problem = drawn(tmp_path)
    kinds, stiffest = rigid(problem, problem.initial)
    assert [kind.name.rpartition(" ")[2] for kind in kinds] == ["gear", "compliance", "base", "links"]
    assert coarse(stiffest).step_s == pytest.approx(problem.step_s)
    rows = [fitted_objective(one).smooth(one.initial) for one in (problem, coarse(stiffest))]
    assert np.linalg.norm(rows[1] - rows[0]) < 0.3
    usual = np.concatenate([kind.stiffness for kind in kinds])
    stiff = [p.initial for p in stiffest.springs if p.name.endswith("stiffness")]
    assert sorted(stiff) == pytest.approx(sorted(1e3 * usual), rel=1e-4)


def test_mounts_give_way_all_round_and_links_whole() -> None:
    base = SpringKind("base", ("base.rx", "base.ry", "base.rz", "base.tx"), np.ones(4), np.ones(4))
    assert base.places == [[0, 1], [2], [3]]
    names = [f"link{n}.{way}" for n in (1, 2) for way in ("bending_1", "bending_2", "torsion")]
    links = SpringKind("links", tuple(names), np.full(6, 4.0), np.full(6, 0.2), whole=True)
    assert links.places == [[0, 1, 2], [3, 4, 5]]
    starts = links.starts({3: 1 / 16, 4: 0.0, 5: 1 / 4})
    assert [starts[f"link2.{way}.stiffness"] for way in ("bending_1", "bending_2", "torsion")] == [16, 16, 4]
    assert [starts[f"link2.{way}.damping"] for way in ("bending_1", "torsion")] == pytest.approx([0.8, 0.2])


def test_of_a_class_of_springs_those_are_left_out_that_would_be_negative() -> None:
    """A set that begins with the place that does best alone, and one that begins with another, in which the
    first has no part any more.
    """
    rng = np.random.default_rng(1)
    names = tuple(f"joint{n}.rz" for n in (1, 2, 3))
    kind = SpringKind("gears", names, np.ones(3), np.ones(3))
    one, two = rng.normal(size=(2, 400))
    both = one + two + 0.05 * rng.normal(size=400)
    columns = [both, one, 1.2 * two - 0.02 * one]
    residual = -(2 * one + 3 * two) + 0.01 * rng.normal(size=400)
    sight = Sight(residual, residual, np.zeros((400, 0)), 400.0, 3)
    found = solutions([Place(kind, n, column[:, None]) for n, column in enumerate(columns)], sight)
    best = max(found, key=lambda solution: solution.log_odds)
    assert [place.number for place in best.places] in ([1, 2], [2, 1])
    assert all((one.amplitudes > 0).all() for one in found)
    link = SpringKind("links", ("link1.bending_1", "link1.torsion"), np.ones(2), np.ones(2), whole=True)
    [whole] = solutions([Place(link, 0, np.column_stack([one, one - 0.5 * two]))], sight)
    assert (whole.amplitudes >= 0).all()


def test_of_two_that_do_the_same_the_usual_one_is_promised() -> None:
    """A body that is to be six times as heavy, and a rotor of twice its inertia."""
    rng = np.random.default_rng(2)
    column, ones = rng.normal(size=(400, 1)), np.ones((1, 1))
    body = Kind("mass", ("bodies.mass",), 0 * ones, 0.1 * ones[0], least=-0.9)
    rotor = Kind("rotor", ("motor.rotor_inertia",), 1e-3 * ones, ones[0], relative=True)
    residual = -column[:, 0] + 0.01 * rng.normal(size=400)
    sight = Sight(residual, residual, np.zeros((400, 0)), 400.0, 2)
    found = {
        one.places[0].kind.name: one
        for one in solutions([Place(body, 0, column / 5), Place(rotor, 0, column)], sight)
    }
    more = found["rotor"].log_odds - found["mass"].log_odds
    assert more == pytest.approx(np.log(101 / (1 + np.log(2) ** 2)), rel=1e-3)
    assert log_prior(body, [0], {"joint1.bodies.mass": 5.0}) == pytest.approx(-np.log(2501))
    assert log_prior(rotor, [0], {"joint1.motor.rotor_inertia": 1e-3}) == 0


@pytest.mark.exam
def test_a_spring_that_nothing_shows_is_worth_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Torsion and bending out of its plane of a link of a planar arm leave its own bending its worth."""
    monkeypatch.setattr(hidden_motion, "DURATION_S", 1.7)
    monkeypatch.setattr(hidden_motion, "PARTS", 4)
    problem = drawn(tmp_path, "flexibility of links")
    there = as_it_is(problem)
    every = promises(there, [screen._springs(there)])
    found = [one for one in every if one.effect.name.startswith("flexibility of links")]
    assert [one.effect.name for one in found] == ["flexibility of links (link1)"]
    promise = found[0]
    assert isinstance(promise.kind, SpringKind)
    softer = coarse(with_effects(problem, promise.effect.effects, promise.starts))
    model = FittedMotion(softer, Fit(softer.initial, 2.0, (), np.zeros((0, 5)), 0.0))
    assert worth(model, promise.kind, promise.places).log_odds > 10


def test_ticks_at_which_nothing_was_measured_need_not_be_kept(tmp_path: Path) -> None:
    problem = drawn(tmp_path)
    objective = fitted_objective(problem)
    assert objective._every == hidden_motion.EVERY
    values, records = problem.initial[None], objective.records
    whole, part = (problem.run(values, records, every=every) for every in (1, 4))
    for one, other in zip(whole.arrays, part.arrays, strict=True):
        np.testing.assert_array_equal(one[:, ::4], other)
    moved = np.diff(whole.coordinates, axis=1) / problem.file.study.servo.period_s
    speed = (moved[:, 1:] + moved[:, :-1]) / 2
    np.testing.assert_allclose(whole.velocities[:, 1:-1], speed, atol=2e-3 * np.abs(speed).max())
