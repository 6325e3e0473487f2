"""The contract that every registered effect keeps, at all of its places on an arm."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from identify.model.effects.base import EFFECTS, Effect, parse_effect
from identify.model.effects.measurement import MeasurementEffect
from identify.model.effects.nonlinear import NonlinearEffect
from identify.model.frf import frf_and_gradient, frf_by_solve
from identify.model.modes import complex_modes
from identify.model.system import System
from identify.robot.description import Robot
from tests.arms import arm, initial
from tests.targets import POINTS, model, predictor

KINDS = EFFECTS.names()
OTHERS = [
    parse_effect({"kind": "joint-compliance", "axes": ["rz"]}),
    parse_effect({"kind": "base-compliance", "axes": ["tx", "ty", "tz", "rx", "ry", "rz"]}),
]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """One arm with a payload for all."""
    inertia = np.diag([0.02, 0.03, 0.04])
    return arm(tmp_path_factory.mktemp("arm")).with_payload("link6", 4.0, np.array([0.05, 0, 0.1]), inertia)


def _places(kind: str, robot: Robot) -> list[Effect]:
    places: list[Effect] = list(EFFECTS.get(kind).instances(robot, POINTS))
    return places


def _some(kind: str, robot: Robot) -> list[Effect]:
    """First, middle and last place: enough for what takes long."""
    places = _places(kind, robot)
    return [places[number] for number in sorted({0, len(places) // 2, len(places) - 1})]


def _with_others(place: Effect) -> list[Effect]:
    """The place on an arm whose drives and base are elastic, so that every link moves in every direction."""
    return [*(effect for effect in OTHERS if effect.kind != place.kind), place]


def test_sentences_tell_all_places_of_all_kinds_apart(robot: Robot) -> None:
    sentences = [place.sentence() for kind in KINDS for place in _places(kind, robot)]
    assert len(set(sentences)) == len(sentences)
    assert all(sentence and sentence[0].islower() and not sentence.endswith(".") for sentence in sentences)


@pytest.mark.parametrize("kind", KINDS)
def test_it_sits_in_all_its_places(kind: str, robot: Robot) -> None:
    places = _places(kind, robot)
    assert places
    for place in places:
        system, parameters = model(robot, _with_others(place))
        effect, numbers = system.effects[-1]
        own = [parameters[number] for number in numbers]
        assert effect is place
        assert len(parameters) == len(system.terms["stiffness"])
        assert all(p.lower <= p.initial <= p.upper and p.unit and p.free for p in own)
        if isinstance(place, (MeasurementEffect, NonlinearEffect)):
            assert not np.isin(system.factors.owner, numbers).any()
        else:
            springs = system.compliances
            given = () if springs is None else (*springs.compliance, *springs.retardation)
            entering = np.concatenate([system.factors.owner, given])
            assert np.isin(numbers, entering).all(), "each of its parameters enters the matrices"


@pytest.mark.parametrize("kind", KINDS)
def test_it_can_be_written_to_a_config_and_read_again(kind: str, robot: Robot) -> None:
    for place in _places(kind, robot):
        written = json.loads(
            json.dumps(place.model_dump(mode="json", exclude_defaults=True) | {"kind": kind})
        )
        assert parse_effect(written) == place


@pytest.mark.parametrize("kind", KINDS)
def test_it_refuses_unknown_options(kind: str, robot: Robot) -> None:
    place = _places(kind, robot)[0]
    with pytest.raises(ValidationError, match="typo"):
        EFFECTS.get(kind).model_validate({**place.model_dump(), "typo": 1})


@pytest.mark.parametrize("kind", KINDS)
def test_matrices_are_affine_symmetric_and_stable(kind: str, robot: Robot) -> None:
    for place in _some(kind, robot):
        system, parameters = model(robot, _with_others(place))
        values = initial(parameters)
        for at_zero, at_one, at_two in zip(
            *(system.matrices(scale * values) for scale in (0, 1, 2)), strict=True
        ):
            affine = pytest.approx(at_one - at_zero, rel=1e-9, abs=1e-9 * np.abs(at_one).max())
            assert at_two - at_one == affine or system.compliances is not None
            assert at_one == pytest.approx(at_one.T, abs=1e-9 * np.abs(at_one).max())
        bodies = np.array(
            ["servo" not in name for name in system.coordinates]
        )  # a controller has states, but no mass
        mass = system.matrices(values)[0][np.ix_(bodies, bodies)]
        assert np.linalg.eigvalsh(mass).min() > 0
        modes = complex_modes(*system.matrices(values))
        assert np.all(modes.eigenvalues.real < 0)


@pytest.mark.parametrize(
    "kind", [kind for kind in KINDS if not issubclass(EFFECTS.get(kind), NonlinearEffect)]
)
def test_gradients_of_frfs_are_exact(kind: str, robot: Robot) -> None:
    """A part of the structure with respect to its own parameters; a reading with respect to all, because it
    changes all derivatives.
    """
    rng = np.random.default_rng(0)
    for place in _some(kind, robot):
        system, parameters = model(robot, _with_others(place))
        target = predictor(system, lines=15)
        span = np.array([p.initial if p.log else p.upper - p.lower for p in parameters])
        values = initial(parameters) + 1e-3 * rng.uniform(0.1, 1, len(span)) * span
        if isinstance(place, MeasurementEffect) or system.compliances is not None:
            free, predict = rng.permutation(len(values)), target.predict
            _, gradient = target.gradient(values, free)
        else:
            free, at = rng.permutation(system.effects[-1][1]), (target.data.s, target.out, target.force, 2)
            _, gradient = frf_and_gradient(system.matrices(values), system.factors, *at, free)

            def predict(moved: np.ndarray, system: System = system, at: tuple[Any, ...] = at) -> np.ndarray:
                return frf_by_solve(*system.matrices(moved), *at)

        for column, number in enumerate(free):
            unit = span[number] * (np.arange(len(values)) == number)
            # Curvature limits large steps, rounding small ones: the first that does ends it.
            real = system.compliances is not None  # and not negative
            expected = (
                _change(predict, values, step * unit, real=real) / (step * span[number])
                for step in ((1e-5, 1e-4, 3e-5, 1e-6, 3e-7, 1e-7) if real else (1e-4, 2e-3, 1e-5))
            )
            assert any(
                np.abs(gradient[..., column] - one).max() < 1e-6 * np.abs(one).max() for one in expected
            ), (place.sentence(), parameters[number].name)


def _change(
    predict: Callable[[np.ndarray], np.ndarray], values: np.ndarray, step: np.ndarray, *, real: bool = False
) -> np.ndarray:
    """Change of H per `step` (parameters,): H is analytic, so the mean over four directions in the complex
    plane is exact to order four; compliances are real, whose central difference is exact to order two.
    """
    directions = (1, -1) if real else (1, 1j, -1, -1j)
    return np.asarray(
        sum(predict(values + direction * step) / (len(directions) * direction) for direction in directions)
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_population_is_predicted_as_its_members(kind: str, robot: Robot) -> None:
    place = _some(kind, robot)[-1]
    system, parameters = model(robot, _with_others(place))
    target, rng = predictor(system, lines=7), np.random.default_rng(1)
    span = np.array([p.initial if p.log else (p.upper - p.lower) / 20 for p in parameters])
    population = initial(parameters) + 0.1 * rng.uniform(0, 1, (4, len(span))) * span
    together = target.predict(population)
    assert together.shape == (4, 7, 9, 3)
    assert together == pytest.approx(
        np.array([target.predict(values) for values in population]), rel=1e-8, abs=1e-12
    )


@pytest.mark.parametrize("kind", KINDS)
def test_what_was_taken_off_contributes_nothing(kind: str, robot: Robot) -> None:
    for place in _places(kind, robot):
        short, _ = model(robot, _with_others(place), detached="link4")
        assert {name.split(".")[0] for name in short.coordinates} <= {
            "base",
            "joint1",
            "joint2",
            "joint3",
            "link1",
            "link2",
            "link3",
        }
        ends = (
            "link4",
            "link5",
            "link6",
            "joint 4",
            "joint 5",
            "joint 6",
            "payload 1",
        )  # which link6 carries
        gone = any(word in place.sentence() for word in ends)
        if not isinstance(place, (MeasurementEffect, NonlinearEffect)):
            springs = short.compliances
            entering = short.factors.owner if springs is None else springs.compliance[springs.owner]
            assert np.isin(short.effects[-1][1], entering).any() != gone, place.sentence()
