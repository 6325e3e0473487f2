"""Several effects at once, a whole sensor, and nothing, in hammer tests simulated by a generator that shares
no code with the fit.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identify.core.threads import one_thread
from identify.discovery.decimated import decimated
from identify.discovery.records import timed
from identify.discovery.sparse import prune
from identify.discovery.sparse.dense import bodies, instruments, of_all, with_more
from identify.discovery.sparse.dictionary import Beside, candidates
from identify.discovery.sparse.evidence import supports, weighed
from identify.discovery.sparse.fit import Found, afresh, dense_fit, gone_on, refitted, usual_fit
from identify.discovery.sparse.named import named
from identify.discovery.sparse.objective import Penalised, Point
from identify.discovery.sparse.prune import smallest_that_predicts
from identify.discovery.sparse.search import (
    _ended,
    _further,
    _likeliest,
    _with_instruments,
    _with_others,
    explain,
    promising,
)
from identify.discovery.sparse.trials import trials
from identify.discovery.sparse.unknowns import Unknowns
from identify.fitting.selection.workbench import Story
from identify.model.effects.base import Effect
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.effects.sensor_mass import SensorMass
from identify.model.effects.sensor_matrix import SensorMatrix
from identify.vibration.all_springs import all_springs
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import Problem, load_problem, with_effects, with_uncertainty
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

NODES = [5, 9, 12, 14]


class Hammered:
    """Small hammer tests, two postures fitted, each simulated and read once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._read = dict[str, Problem]()

    def of(
        self, case: str, seed: int, doubled: int = 0, nodes: Sequence[int] = NODES, extra: str = ""
    ) -> Problem:
        """The sensor at the point `doubled`, or with -1 all of them, read twice as much; extra: lines of the
        study.
        """
        name = self._name(case, seed, nodes) + extra.replace(": ", "_")
        if name not in self._read:
            arm = MAKES["compact"](seed).at_points(list(nodes))
            spec = TestSpec(arm, seed=seed, postures=2, averages=2, binary=True, oversampling=4, linear=True)
            generate(replace(hide(spec, case), case="test"), self._folder / name)
            config = config_of(self._folder / name, self._folder, extra=extra)
            self._read[name] = decimated(timed(load_problem(read_study(config))))
        problem = self._read[name]
        return replace(problem, measurements=tuple(_read_twice(m, doubled) for m in problem.measurements))

    def truth(self, case: str, seed: int) -> dict[str, Any]:
        """What was hidden in a test."""
        path = self._folder / f"{self._name(case, seed, NODES)}.truth.json"
        [hidden] = json.loads(path.read_text())["effects"]
        return dict(hidden)

    def _name(self, case: str, seed: int, nodes: Sequence[int]) -> str:
        return "_".join([case, *map(str, (seed, *nodes))])


@pytest.fixture(scope="module")
def hammered(tmp_path_factory: pytest.TempPathFactory) -> Hammered:
    return Hammered(tmp_path_factory.mktemp("hammered"))


def one_posture(problem: Problem) -> Problem:
    """The first posture alone."""
    return replace(problem, measurements=problem.measurements[:1])


def _read_twice(measurement: Any, node: int) -> Any:
    data = measurement.given.data
    gain = np.array([2.0 if node in (channel.node, -1) else 1.0 for channel in data.outputs])
    noise = measurement.target.noise * gain[:, None]
    told = replace(data, frf=data.frf * gain[:, None], noise=noise)
    target = replace(measurement.target, data=told, noise=noise)
    return replace(measurement, given=replace(measurement.given, data=told), target=target)


def test_three_effects_are_found_together(hammered: Hammered) -> None:
    with one_thread():
        named = explain(hammered.of("base_rocking+tilt_j2+radial_j3", 5)).named
    assert {one.effect.sentence() for one in named} == {
        "compliance of the base (rx, ry)",
        "tilt compliance of joint 2 (rx, ry)",
        "radial compliance of joint 3 (tx, ty)",
    }
    assert all(one.evidence > 20 for one in named)


def test_guesses_that_are_far_off_lead_there_too(hammered: Hammered) -> None:
    """Every drive is guessed to be 15 times as soft as it is usually guessed."""
    with one_thread():
        problem = hammered.of("tilt_j2", 4)
        known, guesses = problem.file.study.effects, {p.name: p.initial for p in problem.parameters}
        softer = {name: value / 15 for name, value in guesses.items() if name.endswith("rz.stiffness")}
        problem = with_effects(problem, known, {**guesses, **softer})
        assert usual_fit(problem, ()).gap < 1.1


def test_a_delay_leads_no_drive_astray(hammered: Hammered) -> None:
    problem = hammered.of("delay", 7)
    structure = (*all_springs(problem, shrink=True), *of_all(problem))
    found = dense_fit(problem, structure)
    assert found.gap < 1.1
    assert np.sum(found.unknowns.springs & (found.x > 0)) < 6  # nothing gives way in place of the delay
    # With errors of every sensor as well, the delay is there once.
    [more] = _with_instruments(problem, Story())
    assert [effect.kind for effect in more.effects].count("time-delay") == 1
    assert more.gap < 1.1
    delay = next(effect for effect in of_all(problem) if effect.kind == "time-delay")
    assert delay not in list(of_all(with_more(problem, [delay])))


@pytest.mark.parametrize(
    ("doubled", "said"),
    [
        (9, {"gain of channel 9"}),
        pytest.param(-1, {"gain of all FRFs"}, marks=pytest.mark.exam),
        (0, set()),
    ],
)
def test_a_whole_sensor_is_named_and_a_right_one_is_not(
    hammered: Hammered, doubled: int, said: set[str]
) -> None:
    with one_thread():
        problem = hammered.of("none", 4, doubled)
        # In one posture bodies stand for a gain of all FRFs.
        named = explain(problem if doubled < 0 else one_posture(problem)).named
    assert {one.effect.sentence() for one in named} == said
    for one in named:
        assert list(one.values.values()) == pytest.approx([2.0], rel=0.01)


def test_a_sensor_pays_for_the_numbers_of_its_fault_alone(hammered: Hammered) -> None:
    """A gain just large enough to pay for five numbers is one, not the nine of a matrix."""
    with one_thread():
        problem = hammered.of("none", 4, doubled=9)
        found = dense_fit(problem, (SensorMatrix(points=[9]),))
        unknowns = found.unknowns
        [own] = (unit.amplitudes for unit in unknowns.units)
        known = weighed(unknowns, found.x, found.product, 1.0)
        [large] = supports(unknowns, found.x, known).values()
        x = found.x.copy()
        x[own] *= np.sqrt(5 * known.price / large)
        [odds] = supports(unknowns, x, known).values()
    assert odds == pytest.approx(4 * known.price, rel=0.2)


def test_what_a_closed_gap_hides_is_looked_for_where_it_pays(hammered: Hammered) -> None:
    """Noise that is so large that the gap alone leaves nothing open."""
    with one_thread():
        problem = one_posture(hammered.of("absorber_l3", 4))
        bearing = all_springs(problem, shrink=True)[2:3]
        away = dense_fit(problem, bearing).gap
        loud = tuple(_noisier(m, away / 1.05) for m in problem.measurements)
        problem, right = replace(problem, measurements=loud), one_posture(hammered.of("none", 4))
        fit = dense_fit(problem, bearing)
        assert promising(problem, fit.values)
        assert not promising(right, dense_fit(right, bearing).values)
        [more] = _further(fit, Story(), 1)
        [as_it_is] = _further(dense_fit(right, bearing), Story(), 1)
    assert fit.gap < 1.1
    assert [one.kind for one in fit.new(more.effects)] == ["appended-resonator"]
    assert as_it_is.effects == bearing


def _noisier(measurement: Any, times: float) -> Any:
    noise = measurement.target.noise * times
    told = replace(measurement.given.data, noise=noise)
    target = replace(measurement.target, data=told, noise=noise)
    return replace(measurement, given=replace(measurement.given, data=told), target=target)


def test_a_resonator_is_found_by_its_score_before_it_is_fitted(hammered: Hammered) -> None:
    """No spring stands for it; the axis and the link are those that gain most at amplitude zero."""
    with one_thread():
        problem = hammered.of("absorber_l3", 4)
        found = dense_fit(problem, tuple(all_springs(problem, shrink=True)))
        best, *_ = candidates(found.problem, Beside.of(found.unknowns, found.x, found.product))
    hidden = hammered.truth("absorber_l3", 4)
    assert (
        best.effect.sentence()
        == f"appended resonator (mass, centre, inertia) on link3 along {hidden['axis']}"
    )
    k, m = (best.values[f"link3.resonator_{hidden['axis']}.{what}"] for what in ("stiffness", "mass"))
    assert np.sqrt(k / m) / (2 * np.pi) == pytest.approx(hidden["frequency_hz"], rel=0.1)


def test_what_pays_beside_the_best_enters_in_the_same_round(hammered: Hammered) -> None:
    """And what would say the same once more does not."""
    with one_thread():
        problem = hammered.of("absorber_l3+absorber_l5", 5)
        fit = dense_fit(problem, tuple(all_springs(problem, shrink=True)[:2]))
        alone = [one for one in trials(fit) if len(fit.new(one.effects)) == 1]
        of_link = {
            link: max(
                (one for one in alone if getattr(one.effects[-1], "link", "") == link),
                key=lambda one: one.gain,
            )
            for link in ("link3", "link6")
        }
        one, other = (gone_on(fit, trial.effects, trial.values) for trial in of_link.values())
        both = _with_others(fit, one, [other])
        again = _with_others(fit, one, [one])
    assert both.gap < min(one.gap, other.gap) - 0.05
    assert fit.new(both.effects) == [one.effects[-1], other.effects[-1]]
    assert again.effects == one.effects


def test_what_gives_way_nowhere_has_no_name(hammered: Hammered) -> None:
    """A model with it may be kept, because it predicts unseen data best."""
    problem = hammered.of("none", 4)
    with one_thread():
        fit = dense_fit(problem, tuple(all_springs(problem, shrink=True)))
    assert fit.unknowns.units
    assert named(fit, {unit.name: 0.0 for unit in fit.unknowns.units}, 1.0) == []


def test_after_the_time_that_was_given_nothing_new_is_begun(hammered: Hammered) -> None:
    said = list[str]()
    with one_thread():
        story = Story(said.append, until=0.0)
        found = explain(hammered.of("absorber_l3", 4), story)
    assert story.late
    assert not any(one.startswith("With ") for one in said)
    assert not any(one.effect.kind == "appended-resonator" for one in found.named)


def test_of_models_that_predict_alike_the_smallest_is_kept(hammered: Hammered) -> None:
    """The data for validation are those of the test itself."""
    with one_thread():
        problem = hammered.of("tilt_j2", 4)
        structure = tuple(all_springs(problem, shrink=True))
        found = dense_fit(problem, structure)
        assert found.gap < 1.2
        kept = refitted(found, [u for u in found.unknowns.units if u.name.startswith(("joint2", "joint5"))])
        without = refitted(kept, [u for u in kept.unknowns.units if u.name != "joint2.tilt"])
        few = refitted(kept, [u for u in kept.unknowns.units if u.name == "joint2.tilt"])
        path: list[tuple[Found, dict[str, float]]] = [(found, {}), (kept, {}), (few, {}), (without, {})]
        assert smallest_that_predicts(path, left_by)[0] is few


def test_where_all_models_leave_something_the_best_predictor_is_kept() -> None:
    def model(closed: bool, evidence: float, gap: float) -> Any:
        found = SimpleNamespace(log_evidence=evidence, study=None, effects=(), values={"gap": gap})
        return SimpleNamespace(closed=closed, found=found)

    def unseen(_study: Problem, _effects: Sequence[Effect], values: dict[str, float]) -> float:
        return values["gap"]

    likely, predictive, closed = model(False, 9.0, 1.5), model(False, 1.0, 1.2), model(True, -5.0, 3.0)
    assert _likeliest([likely, predictive], unseen) is predictive
    assert _likeliest([likely, predictive], None) is likely
    assert _likeliest([likely, predictive, closed], unseen) is closed
    assert _likeliest([], unseen) is None


def test_what_proves_to_be_needed_stays_whatever_the_curvature_says(
    hammered: Hammered, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Said to be without evidence are all units: those stay without which the fit ends far worse."""
    with one_thread():
        found = dense_fit(
            hammered.of("tilt_j2", 4), (all_springs(hammered.of("tilt_j2", 4), shrink=True)[1],)
        )
        monkeypatch.setattr(
            prune, "supports", lambda unknowns, *_: {one.name: -1.0 for one in unknowns.units}
        )
        kept = prune.pruned(found, lambda _: None)
    assert list(kept.evidence) == ["joint2.tilt"]
    assert kept.evidence["joint2.tilt"] > 100
    assert kept.found.gap == pytest.approx(found.gap, abs=0.05)


def test_whatever_may_be_missing_has_a_name_of_its_own(hammered: Hammered) -> None:
    problem = hammered.of("none", 4)
    every = (*all_springs(problem, shrink=True), *instruments(problem), *bodies(problem))
    names = [unit.name for unit in Unknowns(with_more(problem, every), len(problem.file.study.effects)).units]
    assert len(set(names)) == len(names) > 40


def test_an_axis_that_something_else_stood_for_gives_way_once_that_is_gone(hammered: Hammered) -> None:
    with one_thread():
        problem = hammered.of("tilt_j2", 4)
        found = dense_fit(problem, (all_springs(problem, shrink=True)[1],))
        tilt = [unit for unit in found.unknowns.units if unit.name == "joint2.tilt"]
        rigid = np.array([name == "joint2.ry.compliance" for name in found.unknowns.names])
        again = refitted(replace(found, x=np.where(rigid, 0.0, found.x)), tilt)
    assert again.gap == pytest.approx(found.gap, abs=0.02)
    assert again.values["joint2.ry.compliance"] == pytest.approx(
        found.values["joint2.ry.compliance"], rel=0.05
    )


def left_by(study: Problem, effects: Sequence[Effect], values: dict[str, float]) -> float:
    """The gap on the data that are fitted."""
    model = with_more(study, effects)
    return gap(model.targets(), np.array([values.get(p.name, p.initial) for p in model.parameters]))


def test_a_base_that_rocks_about_axes_of_its_own_is_coupled(hammered: Hammered) -> None:
    """Stiffest and softest about axes that are turned from x and y: K has what the generator made of it."""
    with one_thread():
        [base] = explain(one_posture(hammered.of("turned_rocking", 9))).named
    assert base.effect.sentence() == "compliance of the base (rx, ry, coupled)"
    hidden = hammered.truth("turned_rocking", 9)
    found = [base.values[f"base.{axes}.stiffness"] for axes in ("rx", "ry", "rx_ry")]
    assert found == pytest.approx(_turned(hidden["stiffness"], hidden["turned_deg"]), rel=0.05)


def _turned(stiffness: Sequence[float], turned_deg: float) -> list[float]:
    """k_x, k_y and k_xy."""
    turned = np.deg2rad(turned_deg)
    across = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    true = across @ np.diag(stiffness) @ across.T
    return [true[0, 0], true[1, 1], true[0, 1]]


@pytest.mark.parametrize(
    ("case", "ratio", "turned_deg", "said", "nodes", "postures"),
    [
        ("turned_tilt_j2", 20.0, 67.5, "tilt compliance of joint 2 (rx, ry, coupled)", NODES, 1),
        ("turned_radial_j3", 4.0, 4.0, "radial compliance of joint 3 (tx, ty, coupled)", NODES[1:], 2),
    ],
    ids=["between", "near an axis"],
)
def test_a_bearing_is_softest_in_whatever_direction_it_is(
    case: str,
    ratio: float,
    turned_deg: float,
    said: str,
    nodes: Sequence[int],
    postures: int,
    tmp_path: Path,
) -> None:
    """Between the axes and halfway between these, where no two compliances of those four are the truth; and
    near an axis, where next to nothing is open without it.
    """
    arm = MAKES["compact"](5).at_points(list(nodes))
    spec = TestSpec(arm, seed=5, postures=postures, averages=2, binary=True, oversampling=4, linear=True)
    test = hide(spec, case)
    [effect] = test.effects
    softest = min(effect.stiffness)
    bearing = replace(effect, stiffness=(softest, ratio * softest), turned_deg=turned_deg)
    generate(replace(test, effects=(bearing,), case="test"), tmp_path / "test")
    config = config_of(tmp_path / "test", tmp_path)
    with one_thread():
        [named] = explain(decimated(timed(load_problem(read_study(config))))).named
    assert named.effect.sentence() == said
    found = [value for name, value in named.values.items() if name.endswith("stiffness")]
    assert found == pytest.approx(_turned(bearing.stiffness, turned_deg), rel=0.05)


def test_a_strut_is_scored_along_any_direction(hammered: Hammered) -> None:
    """Far more is foreseen of it than of the same stiffness along all axes; few lines do not tell the end of
    link2 from link3.
    """
    with one_thread():
        [strut] = explain(one_posture(hammered.of("ground_spring", 8))).named
    assert strut.effect.sentence().startswith("spring between link")


def test_the_first_steps_are_taken_where_rigid_bearings_hold_a_sensor_still(hammered: Hammered) -> None:
    """On link1 along its axis a rigid arm moves nothing, whose logarithm is no number."""
    with one_thread():
        problem = hammered.of("base_rocking", 5, nodes=[1, 9, 12, 14])
        fit = Penalised(Unknowns(with_more(problem, all_springs(problem, shrink=True)), 0), logarithmic=True)
        x = fit.unknowns.reference
        local = fit.local(x)
        assert np.isfinite(local.product).all()
        assert local.product[-1, -1] == pytest.approx(fit.squares(x))
        number, step = fit.unknowns.names.index("base.rx.compliance"), 1e-15
        change = fit.squares(x + step * np.eye(len(x))[number]) - fit.squares(x)
        assert change == pytest.approx(2 * step * local.product[-1, number], rel=0.01)


def test_what_errors_make_up_for_is_scored_by_how_far_out_they_are(hammered: Hammered) -> None:
    """A rotor beside uncertain inertias leaves hardly a residual."""
    problem = hammered.of("rotor_j3", 6, extra="uncertainty: careful")
    with one_thread():
        bearing = all_springs(problem, shrink=True)[2]
        fit = dense_fit(problem, (bearing,))
        first, *_ = candidates(fit.problem, Beside.of(fit.unknowns, fit.x, fit.product))
        with_it = dense_fit(problem, (bearing, first.effect))
    assert first.effect.sentence() == "rotor inertia of joint 3 behind the gear"
    assert fit.gap < 1.15
    assert first.gain == pytest.approx(fit.unpriced - with_it.unpriced, rel=0.25)


def test_errors_beyond_belief_do_not_hide_what_they_made_up_for(hammered: Hammered) -> None:
    """They go back slowly beside the rotor that they made up for, and had not in the steps of a trial."""
    problem = hammered.of("rotor_j3", 6, extra="uncertainty: typical")
    with one_thread():
        fit = dense_fit(problem, tuple(all_springs(problem, shrink=True)[2:3]))
        rotor, *_ = candidates(fit.problem, Beside.of(fit.unknowns, fit.x, fit.product))
        few = {name: value / 1000 for name, value in rotor.values.items()}
        trial = gone_on(fit, (*fit.effects, rotor.effect), few, 4)
        slow, afresh_too = (_ended(fit, trial, np.inf, believed=believed) for believed in (True, False))
    assert fit.gap < 1.1
    assert slow.unpriced - afresh_too.unpriced > 20


def test_a_fit_that_was_led_astray_comes_back_afresh(hammered: Hammered) -> None:
    """From rigid bearings and nominal values, as it began."""
    with one_thread():
        problem = hammered.of("rotor_j3", 6, extra="uncertainty: careful")
        fit = dense_fit(problem, tuple(all_springs(problem, shrink=True)[1:3]))
        away = np.where(fit.unknowns.springs, fit.unknowns.limits[1] / 50, fit.x)
        astray = replace(fit, x=np.where(fit.unknowns.nuisances, 2.0, away))
        again = afresh(astray)
    assert Penalised(fit.unknowns).squares(astray.x) > 1e3 * Penalised(fit.unknowns).squares(fit.x)
    assert again.objective == pytest.approx(fit.objective, abs=2.0)


def test_where_many_give_way_they_are_found_together_with_a_link(hammered: Hammered) -> None:
    """Small ones hide each other on the way from rigid, and in place of the link."""
    with one_thread():
        problem = hammered.of("link4_flex+tilt_j5+tilt_j4", 5)
        bearings = [one for one in all_springs(problem, shrink=True) if not isinstance(one, LinkFlexibility)]
        rigid = dense_fit(problem, tuple(bearings))
        usual = usual_fit(with_uncertainty(problem, FORMS_ALONE), ())
    assert rigid.gap > 2
    assert usual.gap < 1.1
    units = {unit.name: usual.unknowns.moved(unit, usual.x, usual.product) for unit in usual.unknowns.units}
    assert {"link4", "joint4.tilt", "joint5.tilt"} == set(sorted(units, key=lambda name: -units[name])[:3])


def test_what_holds_rotors_may_give_way_from_the_start(
    hammered: Hammered, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Links and bearings would stand for it."""
    problem = hammered.of("held_j2", 6)
    with one_thread():
        fits = [usual_fit(problem, ())]
        monkeypatch.setattr("identify.discovery.sparse.fit.rotors", lambda problem: [])
        fits.append(usual_fit(problem, ()))
    largest = [
        max(fit.unknowns.units, key=lambda unit, fit=fit: fit.unknowns.moved(unit, fit.x, fit.product)).name
        for fit in fits
    ]
    assert largest == ["joint2.rotor", "link2"]
    assert fits[0].gap < 1.01
    assert fits[1].gap > 1.03


def test_a_spring_far_softer_than_is_usual_costs_little_more(hammered: Hammered) -> None:
    """Half Cauchy priors: their slope and what they cost agree, and a far outlier pays a logarithm."""
    problem = hammered.of("none", 4)
    with one_thread():
        unknowns = usual_fit(problem, ()).unknowns
    priced = {unknowns.names[n].split(".")[1] for n in np.flatnonzero(Penalised(unknowns).alone)}
    assert priced == {"rotor"}, "what has a prior has no price"
    usual = unknowns.usual_compliance
    bearings = np.flatnonzero(usual > 0)
    assert {unknowns.names[n].partition(".")[0] for n in bearings} >= {"base", "joint1", "joint6"}
    x = unknowns.reference.copy()
    x[bearings[0]] = 100 * usual[bearings[0]]
    assert unknowns.unlikely(x) == pytest.approx(np.log(1 + 100**2))
    step = np.zeros(len(x))
    step[bearings[0]] = usual[bearings[0]]
    slope = (unknowns.unlikely(x + step) - unknowns.unlikely(x - step)) / 2
    assert slope == pytest.approx(
        unknowns.precision_at(x)[bearings[0]] * x[bearings[0]] * usual[bearings[0]], rel=1e-3
    )


def test_nuisance_parameters_are_not_priced(hammered: Hammered) -> None:
    """Their priors pay for them: a link is not dearer for its uncertain form."""
    problem = hammered.of("tilt_j2", 4)
    link = [LinkFlexibility(link="link2", shrink=True)]
    plain, formed = (
        Unknowns(with_more(one, link), 1) for one in (problem, with_uncertainty(problem, FORMS_ALONE))
    )
    assert formed.nuisances.sum() > 20
    assert formed.size == plain.size


def test_what_is_there_is_not_tried_once_more(hammered: Hammered) -> None:
    """The mass of the sensors may enter by its score, and is an instrument, too."""
    with one_thread():
        problem = hammered.of("tilt_j2", 4)
        fit = dense_fit(problem, tuple(all_springs(problem, shrink=True)[1:2]))
        more = gone_on(fit, (*fit.effects, SensorMass()), {}, 1)
        new = [one.sentence() for trial in trials(more) for one in more.new(trial.effects)]
    assert new
    assert SensorMass().sentence() not in new


def test_where_a_step_was_foreseen_badly_the_bend_is_followed(
    hammered: Hammered, monkeypatch: pytest.MonkeyPatch
) -> None:
    with one_thread():
        problem = hammered.of("tilt_j2", 4)
        unknowns = Unknowns(with_more(problem, all_springs(problem, shrink=True)), 0)
        fit, begin = Penalised(unknowns), Point(unknowns.to_x(unknowns.problem.initial))
        for _ in range(10):
            begin = fit.step(begin)
        followed = fit.step(begin)
        monkeypatch.setattr(Penalised, "_bend", lambda self, x, change, local: np.zeros(len(x)))
        straight = fit.step(begin)
    assert followed.fall > straight.fall > 0


def test_a_fit_ends_sooner_the_more_is_missing_from_it(hammered: Hammered) -> None:
    problem = hammered.of("none", 4)
    fit = Penalised(Unknowns(problem, 0))
    closed, near, far = (fit._least(gap) for gap in (1.0, 1.2, 3.0))
    assert closed == pytest.approx(0.05)
    assert closed < near < far < 0.01 * fit.count


def test_a_fit_that_cannot_reach_its_rival_ends(hammered: Hammered) -> None:
    with one_thread():
        problem = hammered.of("tilt_j2", 4)
        unknowns = Unknowns(with_more(problem, all_springs(problem, shrink=True)), 0)
        fit, begin = Penalised(unknowns), unknowns.to_x(unknowns.problem.initial)
        assert fit.minimise(Point(begin), 6, rival=-1e9).steps == 1
        assert fit.minimise(Point(begin), 6).steps == 6
