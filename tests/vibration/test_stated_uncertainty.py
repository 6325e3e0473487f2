"""Nuisance parameters, fitted along: derivatives, bodies that can exist, settings, intervals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core import threads
from identify.core.errors import InputErrors
from identify.core.parameters import Scale
from identify.discovery.trial import fitted, likelihood, minimum
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.machining.uncertain import uncertain_tip
from identify.map.posture_map import map_postures
from identify.measured.finding import STUDY
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.model.modes import complex_modes, frequency_and_damping_gradient
from identify.model.nuisances.inertia import changed, moments
from identify.reports.fit.tables import part_table, stated_table
from identify.results.fit import FitResult
from identify.robot.description import Link
from identify.vibration import elsewhere
from identify.vibration.check import run_checks
from identify.vibration.costs import information as information_module
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.costs.information import information
from identify.vibration.costs.target import FrfTarget
from identify.vibration.elsewhere import predictive_squares
from identify.vibration.fitted_model import fitted_model, tool_point
from identify.vibration.nuisances.stated import times_as_large
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.run import run_fit
from identify.vibration.study import read_study
from identify.vibration.uncertainty import fitted_information, uncertainty
from tests.generator.dirt import CAREFUL, Dirt, soil
from tests.generator.generate import generate
from tests.generator.linear import linearise
from tests.generator.makes import MAKES
from tests.generator.measure import draw_postures, make_plant
from tests.generator.spec import TestSpec
from tests.hidden import config_of

pytestmark = pytest.mark.usefixtures("no_measured_modes")

_EVERYTHING = """uncertainty:
  like: typical
  channels: {force_gain: 0.02}
  kinematics: {position_m: 0.001}
  sets: {delay_s: 1.0e-4}
  links: {each: {link6: {mass: 0.3}}}
"""


def _tested(folder: Path, dirt: Dirt, seed: int, stated: str) -> tuple[Path, TestSpec]:
    """A test of an arm that is not as stated, its config, and what it really was."""
    arm = MAKES["random"](seed)
    spec = TestSpec(arm=arm.at_points([4, 6, 8, 10, 12, 14]), seed=seed, postures=2, binary=True, linear=True)
    true = soil(spec, dirt)
    generate(true, folder / "case")
    return config_of(folder / "case", folder, extra=stated), true


@pytest.fixture(scope="module")
def careful(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, TestSpec]:
    return _tested(tmp_path_factory.mktemp("careful"), CAREFUL, 3, "uncertainty: careful")


@pytest.fixture(scope="module")
def everything(careful: tuple[Path, TestSpec], tmp_path_factory: pytest.TempPathFactory) -> Problem:
    text = careful[0].read_text().replace("uncertainty: careful\n", _EVERYTHING)
    path = tmp_path_factory.mktemp("everything") / "config.yaml"
    path.write_text(text)
    return load_problem(read_study(path))


def _check_slopes(problem: Problem, values: np.ndarray, numbers: Iterable[int], size: float = 1e-4) -> None:
    """Assert that derivatives by some unknowns are those of differences of that size."""
    target = problem.targets().frf[0]
    h, slopes = target.gradient(values, np.arange(len(values)))
    for number in numbers:
        step = np.zeros(len(values))
        step[number] = size
        difference = (target.predict(values + step) - target.predict(values - step)) / (2 * size)
        off = np.linalg.norm(slopes[..., number] - difference)
        name = problem.parameters[number].name
        assert off <= 1e-5 * np.linalg.norm(difference) + 1e-9 * np.linalg.norm(h), name


def test_derivatives_of_every_kind_are_those_of_differences(everything: Problem) -> None:
    problem, rng = everything, np.random.default_rng(0)
    size = problem.size
    values = problem.initial.copy()
    values[size:] = 0.3 * rng.normal(size=len(values) - size)
    kinds: dict[str, list[int]] = {}
    for number, one in enumerate(problem.nuisances.entries):
        kinds.setdefault(f"{one.group} {one.change}", []).append(size + number)
    chosen = [rng.choice(numbers) for numbers in kinds.values()]
    assert len(chosen) >= 30
    _check_slopes(problem, values, chosen)


def test_derivatives_of_forms_are_those_of_differences(everything: Problem) -> None:
    """Those of a link that bends; without it there are none."""
    known = tuple(everything.file.study.effects)
    problem, rng = (
        with_effects(everything, (*known, LinkFlexibility(link="link2", nonuniform=True)), {}),
        np.random.default_rng(1),
    )
    forms = [n for n, one in enumerate(problem.nuisances.entries) if one.group == "form"]
    assert {one.name for one in problem.nuisances.entries} >= {
        "link2.mass_at_end.error",
        "link2.slope_1_by_slope_at_6.error",
    }
    back = with_effects(problem, known, {})
    assert back.nuisances == everything.nuisances
    size = problem.size
    values = problem.initial.copy()
    values[size:] = 0.02 * rng.normal(size=len(values) - size)
    # Where a section hardly has mass, smaller differences are lost in rounding.
    _check_slopes(problem, values, rng.choice(forms, 12, replace=False) + size, 1e-3)


def test_a_prediction_goes_as_far_as_the_fit_leaves_it_open(careful: tuple[Path, TestSpec]) -> None:
    """A fit that says nothing of stiffness and damping does not contradict data that a step from where it
    ended does not reach.
    """
    problem = load_problem(read_study(careful[0]))
    measurements = tuple(
        replace(m, given=replace(m.given, settings=m.settings.model_copy(update={"use": "validate"})))
        for m in problem.measurements
    )
    problem = replace(problem, measurements=measurements)
    arm = careful[1].arm
    true = {f"joint{n}.rz.stiffness": k for n, k in enumerate(arm.stiffness, start=1)}
    true |= {f"joint{n}.rz.damping": c for n, c in enumerate(arm.damping, start=1)}
    values = problem.at({p.name: 1.03 * true.get(p.name, 0.0) for p in problem.parameters})
    known = np.eye(len(values))
    known[: problem.size, : problem.size] *= 1e-6
    squares, count = predictive_squares(problem, known, values)
    assert np.sqrt(squares / count) < 1.1
    squares, _ = predictive_squares(problem, 1e6 * known, values)
    assert np.sqrt(squares / count) > 5


def test_data_fitted_together_say_what_the_parabola_says_at_the_end_of_a_fit(
    careful: tuple[Path, TestSpec],
) -> None:
    """And data that contradict the fit do so however they are taken."""
    problem = load_problem(read_study(careful[0]))
    fit, other = problem.measurements
    use = other.settings.model_copy(update={"use": "validate"})
    problem = replace(problem, measurements=(fit, replace(other, given=replace(other.given, settings=use))))
    values, cost = fitted(problem, problem.initial, 30, 1e-9)
    squares, count = predictive_squares(problem, fitted_information(problem, values), values)
    assert cost < 1.1
    assert squares / count < 1.1**2
    assert elsewhere._together(problem, values, values) == pytest.approx(squares, rel=0.01)
    assert isinstance(other.target, FrfTarget)
    wrong = replace(other.target, data=replace(other.target.data, frf=2 * other.target.data.frf))
    contradicted = replace(problem.measurements[1], target=wrong)
    problem = replace(problem, measurements=(fit, contradicted))
    squares, count = predictive_squares(problem, fitted_information(problem, values), values)
    assert squares / count > 2


def test_blocks_give_the_information_of_all_rows(everything: Problem) -> None:
    problem = everything
    targets, free = problem.targets(), np.arange(len(problem.parameters))
    values = problem.initial.copy()
    values[problem.size :] = 0.1
    r, j = FrfLeastSquares().objective(targets).residuals(values, free)
    rows, slopes = [], []
    for target in targets.frf:
        h, g = target.gradient_pairs(values, free)
        e, g = (h - target.measured) / target.sigma, g / target.sigma[..., None]
        rows += [e.real.ravel(), e.imag.ravel()]
        slopes += [part.reshape(-1, len(free)) for part in (g.real, g.imag)]
    full, residual = np.concatenate(slopes), np.concatenate(rows)
    prior = np.where(free >= problem.size, 1.0, 0.0)
    product = full.T @ full + np.diag(prior)
    scale = np.sqrt(np.diag(product))
    assert np.abs((j.T @ j - product) / np.outer(scale, scale)).max() < 1e-10
    score = (j.T @ r - full.T @ residual - prior * values) / scale
    assert np.abs(score).max() < 1e-9 * np.linalg.norm(residual)


def test_information_is_the_same_in_however_many_threads(
    careful: tuple[Path, TestSpec], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, asked = load_problem(read_study(careful[0])), list[int]()
    targets, free = problem.targets(), np.arange(len(problem.parameters))
    assert len(targets.frf) > 1

    def counted(work, parts):  # type: ignore[no-untyped-def]
        asked.append(threads.threads())
        return threads.each(work, parts)

    monkeypatch.setattr(information_module, "each", counted)
    found = []
    for count in (1, 2):
        monkeypatch.setattr(threads, "threads", lambda count=count: count)
        objective = FrfLeastSquares().objective(targets)
        assert isinstance(objective, PosteriorObjective)
        found.append(
            (
                information(targets.frf, problem.initial, free).product,
                objective.product(problem.initial, free),
            )
        )
    assert asked == [1, 1, 2, 2]
    assert np.array_equal(found[0], found[1])


@pytest.mark.parametrize("apart", [0.0, 0.03])
def test_forces_that_disagree_about_a_stiffness_widen_its_interval(
    careful: tuple[Path, TestSpec], apart: float
) -> None:
    """As if joint 2 were softer for some forces than for others, which no nuisance parameter explains."""
    problem, rng, struck = load_problem(read_study(careful[0])), np.random.default_rng(4), []
    name, truth = "joint2.rz.stiffness", problem.initial
    stiffness = [p.name for p in problem.parameters].index(name)
    for number, m in enumerate(problem.measurements):
        target = m.target
        assert isinstance(target, FrfTarget)
        assert target.noise is not None
        h = target.data.frf.copy()
        for force in range(h.shape[2]):
            values = truth.copy()
            values[stiffness] *= 1 + apart * (-1) ** (number + force)
            h[:, :, force] = target.predict(values)[:, :, force]
        h += target.noise * (rng.normal(size=h.shape) + 1j * rng.normal(size=h.shape))
        struck.append(replace(m, target=replace(target, data=replace(target.data, frf=h))))
    problem = replace(problem, measurements=tuple(struck))
    optimizer = GaussNewton(evaluations=20, tolerance=1e-6)
    values, _ = minimum(problem, truth, optimizer, likelihood(problem))
    scale = Scale(problem.parameters)
    found, plain = (
        uncertainty(problem.targets(), scale, values, disagreement=every) for every in (True, False)
    )
    row = [problem.parameters[n].name for n in scale.free].index(name)
    wider = found.std[row] / plain.std[row]
    said = [note for note in found.notes if "the forces of the postures disagree" in note]
    if apart:
        assert wider > 2
        assert found.low[row] < truth[stiffness] < found.high[row]
        assert "most about joint" in said[0]
    else:
        assert wider < 1.5
        assert said == []


@pytest.mark.parametrize(("size", "said"), [(0.7, ""), (4.0, " times as large as stated")])
def test_intervals_are_not_relied_on_beside_errors_far_beyond_the_statement(
    everything: Problem, size: float, said: str
) -> None:
    """A spring that was missing left 1.04, errors fifteen times as large as stated and five of six
    stiffnesses outside their intervals.
    """
    values, rng, measured = everything.initial.copy(), np.random.default_rng(2), []
    values[everything.size :] = size * rng.normal(size=len(values) - everything.size)
    for m in everything.measurements:
        assert isinstance(m.target, FrfTarget)
        data = replace(m.target.data, frf=m.target.predict(values))
        measured.append(replace(m, target=replace(m.target, data=data)))
    problem = replace(everything, measurements=tuple(measured))
    found = uncertainty(problem.targets(), Scale(problem.parameters), values)
    assert any("relied" in note for note in found.notes) == bool(said)
    assert said in " ".join(found.notes)


def test_errors_are_larger_than_stated_where_chance_does_not_make_them_so() -> None:
    """By what the data tell of them: what they leave as open as it was stated says nothing."""
    rng = np.random.default_rng(0)
    spread = np.full(60, 0.6)
    chance = rng.normal(size=60) * np.sqrt(1 - spread**2)
    assert times_as_large(chance, spread) == 1.0
    assert times_as_large(3 * chance, spread) == pytest.approx(3, rel=0.2)
    assert times_as_large(np.full(60, 3.0), np.ones(60)) == 1.0


def test_a_link_stays_a_body_whatever_its_errors() -> None:
    rng = np.random.default_rng(1)
    link = Link("link1", 10.0, np.array([0.1, 0.0, 0.2]), np.diag([0.5, 0.4, 0.12]))
    for change in 3.0 * rng.normal(size=(200, 10)):
        one = changed(link, change)
        assert one.mass > 0
        assert np.linalg.eigvalsh(one.inertia)[0] > 0
    unchanged = changed(link, np.zeros(10))
    assert np.allclose(unchanged.inertia, link.inertia)
    (first,), (slopes,) = moments([link], np.full((1, 10), 0.01))
    moved = moments([link] * 10, 0.01 + 1e-6 * np.eye(10))[0]
    assert np.allclose((moved - first) / 1e-6, slopes.T, atol=1e-5)


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ("uncertainty: sloppy", "expected careful, typical"),
        ("uncertainty: {links: {mass: -0.1}}", "links.mass"),
        ("uncertainty: {links: {weight: 0.1}}", "unknown key"),
        ("uncertainty: {links: {mass: 0}}", "nothing is uncertain"),
    ],
)
def test_a_statement_that_makes_no_sense_is_refused(
    careful: tuple[Path, TestSpec], tmp_path: Path, stated: str, said: str
) -> None:
    path = tmp_path / "config.yaml"
    path.write_text(careful[0].read_text().replace("uncertainty: careful", stated))
    with pytest.raises(InputErrors) as raised:
        load_problem(read_study(path))
    assert said in str(raised.value)


def test_a_check_says_which_statement_matters_most(careful: tuple[Path, TestSpec]) -> None:
    [finding] = [one for one in run_checks(careful[0]).findings[STUDY] if one.check == "stated-uncertainty"]
    assert "matter most" in finding.sentence
    assert finding.value is not None
    assert 0 < finding.value < 1


@pytest.fixture(scope="module")
def fits(careful: tuple[Path, TestSpec]) -> tuple[FitResult, FitResult]:
    """With what was stated said to be uncertain, and without."""
    path, _ = careful
    with_it, _ = run_fit(path, path.with_name("with.h5"), {"starts": 1})
    without = path.with_name("without.yaml")
    without.write_text(path.read_text().replace("uncertainty: careful", "").replace("name: case", "name: no"))
    return with_it, run_fit(without, path.with_name("without.h5"), {"starts": 1})[0]


def test_stated_uncertainty_explains_what_was_not_as_told(
    careful: tuple[Path, TestSpec], fits: tuple[FitResult, FitResult]
) -> None:
    (_, true), (with_it, plain) = careful, fits
    assert with_it.gap < 1.15
    assert plain.gap > 3
    assert with_it.uncertainty is not None
    assert plain.uncertainty is None
    rows = stated_table(with_it.uncertainty).rows
    assert len(rows) == len(with_it.uncertainty.shift)
    parts = with_it.uncertainty.parts
    assert np.all((parts.sum(axis=1) > 0) & (parts.sum(axis=1) < 1))
    assert part_table(with_it, with_it.uncertainty).rows[0][0] == with_it.parameters.name[0]
    assert not [note for note in with_it.notes if "relied" in note]
    assert [note for note in plain.notes if "uncertainty: typical" in note]
    assert [note for note in plain.notes if "relied" in note]
    p = with_it.parameters
    rows = [n for n, name in enumerate(p.name) if name.endswith("rz.stiffness")]
    inside = (p.low_95[rows] <= true.arm.stiffness) & (true.arm.stiffness <= p.high_95[rows])
    assert inside.sum() >= 5
    assert np.all(p.std[rows] < 0.05)
    q = plain.parameters
    outside = (q.low_95[rows] > true.arm.stiffness) | (true.arm.stiffness > q.high_95[rows])
    assert outside.sum() >= 2


def test_a_map_holds_the_true_modes_where_nothing_was_measured(
    careful: tuple[Path, TestSpec], fits: tuple[FitResult, FitResult]
) -> None:
    """Of the arm as it was simulated, at postures that no fit has seen."""
    spec = replace(careful[1], postures=6, seed=99)
    postures = draw_postures(spec)
    truth = [np.abs(linearise(make_plant(spec, q), "link6_2").poles)[:6] / (2 * np.pi) for q in postures]
    held, widths = [], []
    for result in fits:
        model = fitted_model(result, "fit")
        rows = map_postures(
            model, tool_point(model, None), list("abcdef"), np.radians(postures), np.ones(1), 6
        )
        inside = (rows.frequency_low_95 <= truth) & (np.array(truth) <= rows.frequency_high_95)
        held.append(float(inside.mean()))
        widths.append(float(np.median(rows.frequency_high_95 / rows.frequency_low_95)))
    assert held[0] > 0.9
    assert widths[0] < 1.1
    assert held[1] < 0.7, "the errors matter"


def test_a_map_knows_the_slopes_of_what_was_told(fits: tuple[FitResult, FitResult]) -> None:
    """Frequencies of the robot with an error changed, by differences; of masses, and of no others."""
    model = fitted_model(fits[0], "fit")
    off, posture = model.off, model.posture + 0.2
    assert off is not None
    system = model.system(posture)
    factors, root = model.sensitivity(system, posture)
    found = complex_modes(*system.matrices(model.values))
    slopes, _ = frequency_and_damping_gradient(found, factors, len(root))
    first = len(model.values)
    for link, change in ((1, 0), (3, 2), (5, 5)):
        sides = []
        for step in (1e-4, -1e-4):
            inertia = off.inertia.copy()
            inertia[link, change] += step
            other = {one.name: changed(one, c) for one, c in zip(off.links, inertia, strict=True)}
            robot = replace(model.robot, links=tuple(other.get(one.name, one) for one in model.robot.links))
            there = replace(model, robot=robot)
            sides.append(complex_modes(*there.system(posture).matrices(model.values)).frequency_hz)
        difference = (sides[0] - sides[1]) / 2e-4
        assert slopes[:, first + 10 * link + change] == pytest.approx(
            difference, abs=1e-3 * np.abs(difference).max()
        )


def test_draws_of_the_tip_spread_as_its_slopes_say(fits: tuple[FitResult, FitResult]) -> None:
    """Compliance at rest and receptance between modes; with parameters alone they would be narrower."""
    model = fitted_model(fits[0], "fit")
    posture, point, none = model.posture + 0.2, tool_point(model, None), np.zeros(len(model.values))
    system = model.system(posture)
    out = system.base_jacobian(point.link, point.position)
    drawn = model.drawn_matrices(system, posture, 600, np.random.default_rng(1), none)
    tip = uncertain_tip(model, system, point, np.eye(3), posture, none)
    own, root = replace(tip, root=tip.root * (np.arange(len(tip.root)) < len(none))[:, None]), tip.root
    assert len(root) > len(none)
    for hz in (0.0, 40.0):
        z = drawn[2] + 2j * np.pi * hz * drawn[1] - (2 * np.pi * hz) ** 2 * drawn[0]
        spread = out @ np.linalg.solve(z, np.broadcast_to(out.T, (600, *out.T.shape)))
        scatter = 1.96 * np.sqrt(np.mean(np.abs(spread - spread.mean(axis=0)) ** 2, axis=0))
        line = np.array([hz])
        assert np.diagonal(scatter) == pytest.approx(np.diagonal(tip.half_band(line)[0]), rel=0.15)
    bands = [np.diagonal(one.half_band(np.array([40.0]))[0]) for one in (tip, own)]
    assert bands[1] != pytest.approx(bands[0], rel=0.05)
