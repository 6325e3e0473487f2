"""The measured dynamic stiffness of a place: postures that agree where the place is right, the law through
it, and the effect that carries a law of no other.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from identify.core.arrays import Array, Complex
from identify.core.parameters import Scale
from identify.discovery.curves import curve_of, wanted
from identify.discovery.decimated import decimated
from identify.discovery.loop import Discovery
from identify.discovery.places import curve
from identify.discovery.places.catalogue import with_misalignment
from identify.discovery.places.curve import MeasuredCurve, measured_curve
from identify.discovery.places.laws import LAWS, rank_laws
from identify.discovery.places.predict import StructuralModel, model_of
from identify.discovery.places.screen import Job, PlaceFit, PlaceFitter
from identify.discovery.places.views import views_of
from identify.discovery.places.weighted import WeightedFit, weighted_fit
from identify.discovery.task import Task, Trial
from identify.model.effects.base import EFFECTS, parse_effect
from identify.model.effects.place import Beside, Release
from identify.model.frf import dynamic_stiffness
from identify.vibration.costs.target import FrfTarget
from identify.vibration.nuisances.nuisance import NOTHING
from identify.vibration.nuisances.settings import UncertaintySettings
from identify.vibration.problem import Problem, load_problem, with_effects, with_uncertainty
from identify.vibration.study import read_study
from tests.arms import arm, system
from tests.hidden import truth, write_config

CASE = "tilt_j2_101"


@pytest.fixture(scope="module")
def fitter(tmp_path_factory: pytest.TempPathFactory) -> PlaceFitter:
    """Few lines of a test with a joint 2 that tilts, from its true drives."""
    config = write_config(CASE, tmp_path_factory.mktemp(CASE), truth(CASE)["k"])
    return PlaceFitter(decimated(load_problem(read_study(config))))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """All lines of the same test."""
    return load_problem(read_study(write_config(CASE, tmp_path_factory.mktemp("whole"))))


def _measured(fitter: PlaceFitter, whole: Problem, joint: int) -> tuple[MeasuredCurve, PlaceFit]:
    place = Release((f"joint{joint}.rx", f"joint{joint}.ry"))
    [fit] = fitter.fit([Job(place, fitter.problem.initial)], 20)
    model = fitter.model(place)
    assert isinstance(model, StructuralModel)
    assert fit is not None
    others = model_of(place, views_of(whole, "validate"))
    assert isinstance(others, StructuralModel)
    return measured_curve(model, fit, Scale(fitter.problem.parameters), others), PlaceFit(place, fit)


def test_postures_agree_where_the_place_is_right(fitter: PlaceFitter, whole: Problem) -> None:
    """Also the one that was not fitted; at the next joint none does."""
    right, found = _measured(fitter, whole, 2)
    wrong, _ = _measured(fitter, whole, 3)
    assert found.fit.gap < 1.1
    assert len(right.agreement) == 3
    assert right.agreement.max() < 2
    assert wrong.agreement.min() > 3


def test_a_line_of_which_nothing_is_known_has_no_band(
    fitter: PlaceFitter, whole: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ended in "Eigenvalues did not converge"."""

    def broken(*given: object) -> WeightedFit:
        end = weighted_fit(*given)  # type: ignore[arg-type]
        inverse = end.normal.inverse.copy()
        inverse[0] = np.nan
        return replace(end, normal=replace(end.normal, inverse=inverse))

    monkeypatch.setattr(curve, "weighted_fit", broken)
    pooled = _measured(fitter, whole, 2)[0].pooled
    assert np.isnan(pooled.std_real).all(axis=1).sum() == 1
    assert np.isfinite(pooled.std_real).all(axis=1).sum() == len(pooled.std_real) - 1


def test_the_law_of_a_spring_and_damper_is_seen(fitter: PlaceFitter, whole: Problem) -> None:
    """Not that of hysteresis, whose imaginary part would not grow; the real part is the same at all
    frequencies within its band, and the band is not wide.
    """
    curve, found = _measured(fitter, whole, 2)
    model = fitter.model(found.place)
    assert isinstance(model, StructuralModel)
    ranked = rank_laws(
        found.fit, model.stiffness(found.fit.unknown), model.lines(found.fit.values), model.sign
    )
    assert [one.law.name for one in ranked[:4]].count("spring and damper k + s c") == 1
    by_name = {one.law.name: one for one in ranked}
    damper, hysteresis = by_name["spring and damper k + s c"], by_name["hysteretic spring k (1 + j eta)"]
    assert damper.gap < 1.1
    assert hysteresis.gap > damper.gap + 0.2
    k = damper.values[0, 0]
    apart = (curve.pooled.values[:, 0].real - k) / curve.pooled.std_real[:, 0]
    assert np.sqrt(np.median(apart**2)) < 1.5
    assert np.median(curve.pooled.std_real[:, 0]) < 0.2 * k


def test_a_measured_impedance_is_spring_damper_and_branches(tmp_path: Path) -> None:
    """Its own coordinates taken out, a coordinate meets k + s c + s k_1 c_1 / (k_1 + s c_1); the mass between
    them is not seen.
    """
    drives = {"kind": "joint-compliance"}
    plain = {"kind": "joint-compliance", "joints": [2], "axes": ["rx"]}
    robot = arm(tmp_path)
    values = {"stiffness": {"initial": 3e5}, "damping": {"initial": 50.0}}
    branch = {"branch_stiffness": {"initial": 2e5}, "branch_damping": {"initial": 900.0}}
    new, parameters, _ = system(
        robot, [drives, {"kind": "measured-impedance", "at": ["joint2.rx"], **values, **branch}]
    )
    old, others, _ = system(robot, [drives, {**plain, **values}])
    s = 1.0 + 2j * np.pi * np.linspace(5, 60, 7)
    z = dynamic_stiffness(*new.matrices(np.array([p.initial for p in parameters])), s)
    inner = [n for n, name in enumerate(new.coordinates) if "branch" in name]
    outer = [new.coordinates.index(name) for name in old.coordinates]
    left = z[:, outer][:, :, outer] - z[:, outer][:, :, inner] @ np.linalg.solve(
        z[:, inner][:, :, inner], z[:, inner][:, :, outer]
    )
    change = left - dynamic_stiffness(*old.matrices(np.array([p.initial for p in others])), s)
    number = old.coordinates.index("joint2.rx")
    wanted = s * 2e5 * 900.0 / (2e5 + s * 900.0)
    assert len(inner) == 1
    assert np.allclose(change[:, number, number], wanted, rtol=2e-3)
    change[:, number, number] = 0
    assert np.abs(change).max() < 1e-6 * np.abs(wanted).max()


def _with_noisy_forces(
    problem: Problem, seed: int, misalignment: float = 0.0
) -> tuple[Problem, tuple[float, float]]:
    """The problem with what its model with a joint 2 that tilts about rx, or an axis that is misaligned
    towards ry, predicts, noise on every force (in all responses to it alike) and on every response; and
    stiffness and damping of that tilt.
    """
    spring = (4e6, 3e3)
    tilt = parse_effect(
        {
            "kind": "measured-impedance",
            "at": ["joint2.rx"],
            "branches": 0,
            "misalignment": {"joint2.ry": misalignment} if misalignment else {},
            "stiffness": {"initial": spring[0]},
            "damping": {"initial": spring[1]},
        }
    )
    whole = with_effects(problem, (*problem.file.study.effects, tilt), {})
    rng, measured = np.random.default_rng(seed), []
    for m, true in zip(problem.measurements, whole.measurements, strict=True):
        assert isinstance(m.target, FrfTarget)
        assert isinstance(true.target, FrfTarget)
        h = true.target.predict(whole.initial)
        level = 1e-2 * np.sqrt(np.mean(np.abs(h) ** 2))

        def random(*shape: int) -> Complex:
            return np.asarray(rng.normal(size=(*shape, 2)) @ np.array([1.0, 1j]))

        frf = h * (1 + 0.02 * random(len(h), 1, h.shape[2])) + level * random(*h.shape)
        noise = np.sqrt(level**2 + (0.02 * np.abs(h)) ** 2)
        data = replace(m.target.data, frf=frf, noise=noise)
        target = replace(m.target, data=data, noise=noise)
        measured.append(replace(m, given=replace(m.given, data=data), target=target))
    return replace(problem, measurements=tuple(measured)), spring


def test_the_band_holds_the_truth_where_forces_are_noisy(fitter: PlaceFitter) -> None:
    """At nineteen lines in twenty, give or take what chance does to 80 numbers in each of six tests; it is
    not wide either.
    """
    apart, width = [], []
    for seed in range(6):
        problem, (k, c) = _with_noisy_forces(fitter.problem, seed)
        again = PlaceFitter(problem)
        place = Release(("joint2.rx",))
        [fit] = again.fit([Job(place, problem.initial)], 20)
        model = again.model(place)
        assert isinstance(model, StructuralModel)
        assert fit is not None
        curve = measured_curve(model, fit, Scale(problem.parameters)).pooled
        s = model.lines(fit.values)
        off = curve.values[:, 0] - (k + c * s[np.argsort(s.imag, kind="stable")])
        apart += [off.real / curve.std_real[:, 0], off.imag / curve.std_imag[:, 0]]
        width.append(np.median(curve.std_real[:, 0]) / k)
    assert 0.92 < np.mean(np.abs(np.concatenate(apart)) < 1.96) < 0.985
    assert max(width) < 0.02  # twice as wide where the forces' noise is not told from that of the responses


def test_the_band_holds_the_truth_about_an_axis_of_its_own_direction(fitter: PlaceFitter) -> None:
    """Which is found, with its interval; about the coordinate itself the curve is off by more."""
    misalignment, counted = 0.02, {True: list[Array](), False: list[Array]()}
    for seed in range(3):
        problem, (k, c) = _with_noisy_forces(fitter.problem, seed, misalignment)
        again, straight = PlaceFitter(problem), Release(("joint2.rx",))
        assert with_misalignment(Release(("joint2.rx", "joint2.ry")), problem).towards == ()
        for place in (straight, with_misalignment(straight, problem)):
            model, scale = again.model(place), again.scale(place)
            [fit] = again.fit([Job(place, np.array([p.initial for p in scale.parameters]))], 20)
            assert isinstance(model, StructuralModel)
            assert fit is not None
            curve = measured_curve(model, fit, scale)
            s = model.lines(fit.values)
            off = curve.pooled.values[:, 0] - (k + c * s[np.argsort(s.imag, kind="stable")])
            counted[place is not straight] += [
                off.real / curve.pooled.std_real[:, 0],
                off.imag / curve.pooled.std_imag[:, 0],
            ]
        [(by, std)] = curve.misalignment
        assert abs(by - misalignment) < 3 * std
        assert std < 0.2 * misalignment
    share = {turned: np.mean(np.abs(np.concatenate(off)) < 1.96) for turned, off in counted.items()}
    assert 0.91 < share[True] < 0.99
    assert share[False] < 0.8


@pytest.mark.parametrize("stated", [True, False])
def test_errors_of_what_was_told_are_held(fitter: PlaceFitter, stated: bool) -> None:
    """Masses, places, gains, impacts and delays as they are: then a spring and damper that are missing are
    what is measured, and leave nothing.
    """
    told = with_uncertainty(fitter.problem, UncertaintySettings(like="typical", sets={"delay_s": 1e-4}))
    values = told.initial.copy()
    values[told.size :] = np.random.default_rng(0).normal(size=len(values) - told.size)
    named = {p.name: float(v) for p, v in zip(told.parameters, values, strict=True)}
    (spring, damper), measured = (4e6, 3e3), []
    lawful = {"stiffness": {"initial": spring}, "damping": {"initial": damper}}
    tilt = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"], **lawful})
    known = with_effects(told, told.file.study.effects, named)
    true = with_effects(told, [*told.file.study.effects, tilt], named)
    for m, other in zip(known.measurements, true.measurements, strict=True):
        assert isinstance(m.target, FrfTarget)
        assert isinstance(other.target, FrfTarget)
        data = replace(m.target.data, frf=other.target.predict(true.initial))
        target = replace(m.target, data=data, **({} if stated else {"nuisances": None}))
        measured.append(replace(m, target=target))
    problem = replace(known, measurements=tuple(measured))
    if not stated:
        problem = replace(problem, parameters=problem.of_effects, nuisances=NOTHING)
    again, place = PlaceFitter(problem), Release(("joint2.rx", "joint2.ry"))
    [fit] = again.fit([Job(place, known.initial[: known.size])], 20)
    model = again.model(place)
    assert isinstance(model, StructuralModel)
    assert fit is not None
    z = model.stiffness(fit.unknown)[:, 0, 0]
    law = spring + damper * model.lines(fit.values)
    apart = np.median(np.abs(z - law) / np.abs(law))
    assert (apart < 1e-3 and fit.gap < 0.01) if stated else (apart > 0.02 and fit.gap > 2), (apart, fit.gap)


def test_every_effect_at_a_place_has_a_curve_there(
    fitter: PlaceFitter, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But a link that is not uniform, a load cell and a drive that relaxes: they bring their places along."""
    monkeypatch.setattr("identify.discovery.places.settled._STEPS", 0)
    monkeypatch.setattr("identify.discovery.places.laws.LAWS", LAWS[:2])
    problem, measured = fitter.problem, dict[str, bool]()
    known = tuple(problem.file.study.effects)
    taken = {name for effect in known for name in effect.free_coordinates(problem.robot)}
    for kind in EFFECTS.usable().values():
        every = kind.instances(problem.robot, problem.points)
        free = (one for one in every if not taken & set(one.free_coordinates(problem.robot)))
        if (effect := next(free, None)) is None or kind.last_resort:
            continue
        for form in [effect, *(effect.variants() if effect.has_form else [])]:
            model = with_effects(problem, (*known, form), {})
            values = {p.name: p.initial for p in model.parameters}
            final = Trial(Task(known, (form,), values), values, 100.0, 100)
            step = SimpleNamespace(added=[SimpleNamespace(effect=form)], final=final)
            for one in wanted(problem, cast(Discovery, step)):
                measured[form.sentence()] = curve_of(model, one) is not None
    without = sorted(sentence for sentence, there in measured.items() if not there)
    assert len(measured) >= 10
    assert all(any(w in one for w in ("nonuniform", "load cell", "relaxation")) for one in without), without
    assert len(without) == 3


@pytest.mark.parametrize("looked_at_beside_it", [True, False])
def test_what_is_left_is_measured_only_where_it_was_looked_at_beside_the_final_model(
    looked_at_beside_it: bool,
) -> None:
    """A place that was looked at before an effect was added may be where that effect acts."""
    problem = SimpleNamespace(file=SimpleNamespace(study=SimpleNamespace(uncertainty=None)), measurements=[])
    model, final = (
        Trial(Task((), effects, {}), {}, 200.0, 100)
        for effects in ((), (parse_effect({"kind": "time-delay"}),))
    )
    before, after = ([SimpleNamespace(place=Release((name,)))] for name in ("joint2.rx", "joint3.rx"))
    steps = [SimpleNamespace(before=model), SimpleNamespace(before=final if looked_at_beside_it else model)]
    found = SimpleNamespace(final=final, added=[], steps=steps, places=(before, after))
    every = wanted(cast(Problem, problem), cast(Discovery, found))
    assert [one.place for one in every] == ([Release(("joint3.rx",))] if looked_at_beside_it else [])
    [acting] = wanted(cast(Problem, problem), cast(Discovery, found), at="joint4.rz")
    assert acting.place == Beside(("joint4.rz",))
