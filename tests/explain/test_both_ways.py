"""An effect must show what errors of bodies cannot, and both ways: fitted to the one record and judged by the
other, and the reverse; every pair of records is reported.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.explain.effects.friction import ViscousFriction
from identify.explain.effects.harmonics import TorqueRipple
from identify.explain.gain import record_gain
from identify.explain.regression import RegressionProblem, solve
from identify.explain.run import run_explain
from identify.explain.workbench import HeldOut
from identify.fitting.memory import Memory
from identify.reports.explain.tables import pair_table
from identify.reports.kit.cells import NONE
from identify.results import file as result_file
from identify.results.explain import ExplainResult
from identify.robot.dh import read_dh
from identify.robot.inverse_dynamics import RigidArm
from tests.explain.moved import RATIO, moved, problem
from tests.motion.hidden_drive import Hidden, record, study

EXACT = "{mass_percent: 0, centre_percent: 0, inertia_percent: 0}"
FRICTION, ONE = (ViscousFriction(1),), (np.zeros(0),)


def _made(size: float, seed: int, **more: float) -> RegressionProblem:
    """Viscous friction of that size, and a body that is off by `body` standard deviations."""
    scene, rng = moved(), np.random.default_rng(seed)
    noise = rng.normal(scale=0.3, size=len(scene.time_s))
    body = scene.velocity + 0.1 * scene.acceleration
    made = problem(scene, size * scene.velocity[:, 0] + more.get("body", 0.0) * body[:, 0] + noise)
    return replace(made, bodies=body[:, :, None]) if "body" in more else made


def _gain(fitted: RegressionProblem, judge: RegressionProblem) -> float:
    before, after = solve(fitted, (), (), np.ones(1)), solve(fitted, FRICTION, ONE, np.ones(1))
    return HeldOut(fitted, judge, Memory(), "", frozenset({"one"})).gain(before, after).log_odds


def test_an_effect_gains_only_what_it_gains_either_way() -> None:
    """A coefficient that is 2.4 times as large on the judge is half right there, and wrong the other way."""
    one, other = _made(0.5, 1), _made(1.2, 2)
    fits = [solve(one, effects, ONE[: len(effects)], np.ones(1)) for effects in ((), FRICTION)]
    assert record_gain(other, *fits).log_odds > 5
    assert _gain(one, other) < 0
    assert _gain(one, _made(0.5, 3)) > 20


@pytest.mark.parametrize(("back", "gains"), [(1.0, True), (0.5, True), (-0.2, False)])
def test_a_wave_is_there_whichever_way_the_joint_turns(back: float, gains: bool) -> None:
    """With a fifth of it against the wave one way, all of it together still speaks for it."""
    wave = TorqueRipple(1, 8)

    def made(seed: int) -> RegressionProblem:
        scene, rng = moved(), np.random.default_rng(seed)
        way = np.where(scene.velocity[:, 0] > 0, 1.0, back)
        history = 0.5 * way * np.cos(8 * RATIO * scene.position[:, 0])
        return problem(scene, history + rng.normal(scale=0.3, size=len(history)))

    one, other = made(1), made(2)
    before, after = solve(one, (), (), np.ones(1)), solve(one, (wave,), (np.zeros(1),), np.ones(1))
    assert record_gain(other, before, after).log_odds > 20
    judged = HeldOut(one, other, Memory(), "", frozenset({"one"})).gain(before, after)
    assert (judged.log_odds > 20, judged.confirmed) == (gains, gains)


def test_each_effect_that_was_looked_for_has_its_price() -> None:
    one, other = _made(0.5, 1), _made(0.5, 3)
    fits = [solve(one, effects, ONE[: len(effects)], np.ones(1)) for effects in ((), FRICTION)]
    few, many = (
        HeldOut(one, other, Memory(), "", frozenset(map(str, range(count)))).gain(*fits).log_odds
        for count in (1, 100)
    )
    assert few - many == pytest.approx(np.log(100))


def test_what_a_body_may_do_on_the_judge_is_no_gain_of_an_effect() -> None:
    """Bodies that the fitted record does not know well, and that the judge asks to be otherwise."""
    one, other = _made(0.0, 1, body=0.3), _made(0.0, 2, body=0.3)
    short = replace(one, mask=one.mask & (np.arange(len(one.mask)) < 40)[:, None])
    before = solve(short, (), (), np.full(1, 0.1))
    before = replace(before, coefficients=np.zeros(1))
    after = replace(solve(short, FRICTION, ONE, np.full(1, 0.1)), coefficients=np.array([0.3, 0.0]))
    assert record_gain(other, before, after).log_odds > 5
    assert record_gain(other, before, after, short).log_odds < 0


def test_a_shifted_centre_carries_its_inertia(tmp_path: Path) -> None:
    """Against the arm with the centre really moved; a first moment alone is far off."""
    study(tmp_path, 3, Hidden())
    robot, rng = read_dh(tmp_path / "robot.yaml"), np.random.default_rng(4)
    motion = [rng.uniform(-1, 1, (5, 3)) for _ in range(3)]
    arm, shift = RigidArm(robot, *motion), np.array([0.02, -0.01, 0.005])
    link = robot.links[2]
    there, back = (
        RigidArm(
            replace(
                robot,
                links=tuple(
                    replace(one, centre=one.centre + side * shift) if one is link else one
                    for one in robot.links
                ),
            ),
            *motion,
        ).torque
        for side in (1, -1)
    )
    truth = (there - back) / 2
    assert arm.shifted(link.name, shift) == pytest.approx(truth, abs=1e-6 * np.abs(truth).max())
    alone = sum(link.mass * shift[axis] * arm.first_moment(link.name, axis) for axis in range(3))
    assert np.abs(alone - truth).max() > 0.02 * np.abs(truth).max()


def test_every_pair_of_records_is_reported(tmp_path: Path) -> None:
    """A and B have friction, and so has C; D, on which nothing depends, has none and confirms nothing."""
    hidden = Hidden((lambda m: 0.3 * np.sign(m.v),), extra={"links": False})
    config = study(tmp_path, 2, hidden, effects="[coulomb-friction]", resample_hz=50, uncertainty=EXACT)
    record(tmp_path / "c.csv", 31, 2, hidden)
    record(tmp_path / "d.csv", 32, 2, Hidden())
    config.write_text(
        config.read_text().replace(
            "{name: B, file: b.csv, use: validate}",
            "{name: C, file: c.csv}, {name: B, file: b.csv, use: validate},"
            " {name: D, file: d.csv, use: test}",
        )
    )
    result, path = run_explain(config, tmp_path / "out.h5")
    pairs = result_file.read(path, ExplainResult).targets["torque"].pairs
    listed = list(zip(pairs.fitted, pairs.judge, strict=True))
    assert listed == [(one, other) for one in "ACB" for other in "ACBD" if one != other]
    agreeing = np.array([other != "D" for _, other in listed])
    assert pairs.effect == ("joint1.coulomb-friction", "joint2.coulomb-friction")
    assert (pairs.explained[agreeing] > 0.9).all()
    assert (pairs.share[agreeing] > 0.9).all()
    assert (pairs.share[~agreeing] < 0).all(), "friction that is not there makes it worse"
    notes = [note for note in result.notes if "not confirmed by" in note]
    assert len(notes) == 2
    assert "D, fitted to A; D, fitted to C; D, fitted to B" in notes[0]
    table = pair_table(result.targets["torque"])
    assert [row[-1] for row in table.rows if row[1] != "D"] == [NONE] * 6
