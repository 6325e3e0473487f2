"""The screen of places: low-rank formulas against assembled models, derivatives against differences, and the
right place on a test that somebody else simulated.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.arrays import Array, Complex
from identify.core.parameters import Scale
from identify.discovery.decimated import decimated
from identify.discovery.places.predict import ReadingModel, StructuralModel, Unknown, misalignments, model_of
from identify.discovery.places.screen import PlaceFitter, screen_places
from identify.discovery.places.semiparametric import fit_place
from identify.discovery.places.update import a_of, recharted, symmetric, triangle
from identify.discovery.places.views import View, views_of
from identify.model.effects.base import parse_effect
from identify.model.effects.place import Attachment, Beside, Column, Place, Release, Rows
from identify.vibration.problem import Problem, load_problem, with_effects
from identify.vibration.study import read_study
from tests.hidden import truth, write_config

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"
TILT = Release(("joint2.rx", "joint2.ry"))
TURNED = Release(("joint2.rx",), ("joint2.ry",))


@pytest.fixture(scope="module")
def problem() -> Problem:
    return decimated(load_problem(read_study(CONFIG)))


@pytest.fixture(scope="module")
def views(problem: Problem) -> list[View]:
    return views_of(problem)


def _at(model: StructuralModel, values: Array, stiffness: Complex) -> Unknown:
    """The unknown of a dynamic stiffness (lines, d, d)."""
    reference = model.start(values).reference
    return Unknown(triangle(a_of(stiffness, reference, model.sign)), reference)


def _attached(problem: Problem) -> tuple[Place, dict[str, Any]]:
    link = problem.robot.links[4]
    at = (float(link.centre[0]), float(link.centre[1]), float(link.centre[2]))
    return Attachment(link.name, at), {
        "kind": "spring-to-ground",
        "link": link.name,
        "stiffness": {"initial": 3e5, "bounds": [1e4, 1e8]},
        "damping": {"initial": 50.0, "bounds": [1.0, 1e4]},
    }


def _laws(problem: Problem) -> list[tuple[Place, dict[str, Any]]]:
    place, strut = _attached(problem)
    assert isinstance(place, Attachment)
    turned = Attachment(place.link, place.at_m, place.axes, "base")
    tilt = {"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]}
    askew = Attachment(place.link, place.at_m, place.axes, "base", along=(0.6, 0.0, 0.8))
    misalignment = {
        "kind": "measured-impedance",
        "at": ["joint2.rx"],
        "branches": 0,
        "misalignment": {"joint2.ry": 0.2},
    }
    return [
        (TILT, tilt),
        (turned, strut),
        (askew, strut | {"direction": [3.0, 0.0, 4.0]}),
        (TURNED, misalignment),
    ]


@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_a_place_with_a_law_is_the_model_with_the_effect(
    problem: Problem, views: list[View], number: int
) -> None:
    """The end of the record included; at another place the same law is another model."""
    place, effect = _laws(problem)[number]
    full = with_effects(problem, [*problem.file.study.effects, parse_effect(effect)], {})
    known, own = len(problem.initial), full.initial[len(problem.initial) :]
    model = StructuralModel(place, views)  # type: ignore[arg-type]
    values = np.array([*problem.initial, *effect.get("misalignment", {}).values()])
    s = model.lines(values)
    stiffness = np.array([np.diag(own[0::2] + line * own[1::2]) for line in s])
    unknown = _at(model, values, stiffness)
    parts = model.predict(unknown, values, np.arange(known), model.rests(unknown, values))
    squares = model.squares(unknown, values, model.rests(unknown, values))
    wanted = sum(
        float(np.sum(np.abs((m.target.predict(full.initial) - m.target.data.frf) / m.target.noise) ** 2))  # type: ignore[union-attr,operator]
        for m in full.measurements
    )
    assert squares == pytest.approx(wanted, rel=1e-8)
    assert len(parts) == len(views)
    elsewhere = StructuralModel(Release(("joint3.rx", "joint3.ry")), views)
    other = _at(elsewhere, problem.initial, np.array([np.diag([1e6, 1e6]) + 0j] * len(s)))
    rests = elsewhere.rests(other, problem.initial)
    assert abs(elsewhere.squares(other, problem.initial, rests) - wanted) > 1e-3 * wanted


@pytest.mark.parametrize(
    "place",
    [TILT, TURNED, Beside(("joint3.rz",)), Column(), Rows(1, (1, 2, 3))],
    ids=lambda place: place.sentence(),
)
def test_derivatives_are_those_of_differences(problem: Problem, views: list[View], place: Place) -> None:
    """By each unknown of a line, by parameters and by how far an axis is misaligned, where something is
    missing already.
    """
    node = views[0].target.data.outputs[-1].node
    model = model_of(Rows(node, (1, 2, 3)) if isinstance(place, Rows) else place, views)
    values = np.array([*problem.initial, *(0.1 for _ in misalignments(place))])
    free = np.arange(len(values))
    start = model.start(values)
    rng = np.random.default_rng(1)
    size = 0.1 if isinstance(model, ReadingModel) else 0.3 / np.median(np.abs(start.reference))
    there = size * (rng.normal(size=start.values.shape) + 1j * rng.normal(size=start.values.shape))
    unknown = Unknown(there, start.reference)
    rests = model.rests(start, values)
    one = model.predict(unknown, values, free, rests)[0]
    for number in range(there.shape[1]):
        moved = there.copy()
        moved[:, number] += 1e-6 * size
        other = model.predict(Unknown(moved, start.reference), values, free, rests)[0]
        difference = (other.residual - one.residual) / (1e-6 * size)
        assert np.abs(difference - one.by_unknown[..., number]).max() < 1e-4 * np.abs(difference).max()
    for number in (2, 3, len(values) - 1):
        changed = values.copy()
        changed[number] *= 1 + 1e-6
        other = model.predict(unknown, changed, free, rests)[0]
        difference = (other.residual - one.residual) / (1e-6 * values[number])
        assert np.abs(difference - one.by_parameter[..., number]).max() < 1e-3 * np.abs(difference).max()


def test_other_parameter_values_leave_the_stiffness_of_a_place(problem: Problem, views: list[View]) -> None:
    model = StructuralModel(TILT, views)
    stiffness = np.array([np.diag([2e6, 1e6]) + 1j * np.diag([1e4, 2e4])] * len(model.lines(problem.initial)))
    unknown = _at(model, problem.initial, stiffness)
    other = model.refreshed(unknown, 1.3 * problem.initial)
    assert not np.allclose(other.values, unknown.values, rtol=0.01)
    assert np.allclose(model.stiffness(other), stiffness, rtol=1e-9, atol=1e-3)


def test_a_symmetric_matrix_and_its_triangle() -> None:
    entries = np.arange(1.0, 7.0)[None] + 0j
    matrix = symmetric(entries, 3)
    assert np.array_equal(matrix, np.swapaxes(matrix, 1, 2)) and np.array_equal(triangle(matrix), entries)
    assert matrix[0, 0, 2] == 3 and matrix[0, 1, 1] == 4


def test_the_right_place_is_first_on_a_test_of_others(tmp_path: Path) -> None:
    """From a model that is 49 times the noise away to the noise, without a law; the next place is far off."""
    case = "tilt_j2_101"
    thin = decimated(load_problem(read_study(write_config(case, tmp_path, truth(case)["k"]))))
    fitter = PlaceFitter(thin)
    tilts: list[Place] = [Release((f"joint{n}.rx", f"joint{n}.ry")) for n in (1, 2, 3, 4)]
    found = screen_places([*tilts, Column()], fitter, thin.initial)
    assert found[0].place == TILT
    assert found[0].fit.gap < 1.1
    assert found[1].fit.gap > 10
    again = fit_place(model_of(TILT, fitter.views), Scale(thin.parameters), found[0].fit.values, 2)
    assert again.unknowns == 2 * 3 * len(again.unknown.values)


def test_an_unknown_that_nothing_stands_for_is_no_number() -> None:
    a, zero = np.ones((2, 1, 1), dtype=complex), np.zeros((2, 1, 1), dtype=complex)
    assert np.isnan(recharted(a, a, zero)).all()
    assert np.allclose(recharted(a, a, 0.5 * a), 2.0)
