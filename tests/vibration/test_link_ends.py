"""Joints beside a link that bends are open by what the ends of that link may do in their place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.parameters import Scale
from identify.core.thresholds import SIGMAS_95
from identify.fitting.uncertainty import Uncertainty
from identify.measured.finding import STUDY
from identify.model.effects.base import parse_effect
from identify.vibration.check import run_checks
from identify.vibration.intervals import left_open, odds_over_ends, with_left_open
from identify.vibration.problem import Problem, load_problem, with_effects, with_uncertainty
from identify.vibration.study import read_study
from identify.vibration.uncertainty import fitted_information, uncertainty

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


def _config(folder: Path, stated: str = "") -> Path:
    """The shipped example with a link that bends."""
    text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
    bends = "effects:\n  - {kind: link-flexibility, link: link2}\n"
    (folder / "bends.yaml").write_text(text.replace("effects:\n", bends) + stated)
    return folder / "bends.yaml"


@pytest.fixture(scope="module")
def shipped() -> Problem:
    """The shipped example with its data."""
    return load_problem(read_study(CONFIG))


@pytest.fixture(scope="module")
def bends(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """That with a link that bends."""
    return load_problem(read_study(_config(tmp_path_factory.mktemp("bends"))))


def _stated(problem: Problem, path: Path) -> Problem:
    """The same data and model with what a study states to be uncertain."""
    settings = read_study(path).study.uncertainty
    assert settings is not None
    return with_uncertainty(problem, settings)


def _both(problem: Problem) -> tuple[Uncertainty, Uncertainty, np.ndarray]:
    """Without and with what the ends leave open, and the values: those at which the study starts, as if known
    to one per cent.
    """
    values = np.array([p.initial for p in problem.parameters])
    found = uncertainty(problem.targets(), Scale(problem.parameters), values)
    own, std = values[: len(found.std)], np.full(len(found.std), 0.01)
    low, high = (own * np.exp(sign * SIGMAS_95 * std) for sign in (-1, 1))
    known = ("determined",) * len(std)
    plain = replace(found, std=std, low=low, high=high, status=known)
    return plain, with_left_open(problem, plain, values), values


def test_a_hinge_at_either_end_is_a_share_of_the_link_s_own_compliance(bends: Problem) -> None:
    problem = bends
    plain, wider, values = _both(problem)
    names = [p.name for p in problem.parameters]
    found = dict(zip(names, values, strict=True))
    robot = problem.robot
    length = np.linalg.norm(robot.joints[2].origin[:3, 3])
    axis = robot.joints[2].origin[:3, 3] / length
    across = robot.joints[2].axis - robot.joints[2].axis @ axis * axis
    compliance = length / found["link2.bending_1.stiffness"]  # joints 2 and 3 turn about parallel axes
    assert np.linalg.norm(across) == pytest.approx(1)
    # What the limits are wider by, with the bounds out of the way.
    for name, times in (("joint2.rz.stiffness", 1), ("joint3.rz.stiffness", 1), ("joint3.rz.damping", 2)):
        row = names.index(name)
        half = np.log(wider.high[row] / found[name]) / SIGMAS_95
        k = found[f"{name[:9]}.stiffness"]
        assert half**2 - plain.std[row] ** 2 == pytest.approx((times * 0.05 * compliance * k) ** 2, rel=1e-6)
    for name in ("joint1.rz.stiffness", "joint5.rz.stiffness", "link2.bending_1.stiffness"):
        row = names.index(name)
        assert (wider.low[row], wider.high[row]) == pytest.approx((plain.low[row], plain.high[row]))
    assert np.array_equal(wider.std, plain.std), "predictions stay as sure as they are"
    assert any("flexible_links.ends" in note for note in wider.notes)


@pytest.mark.parametrize("stated", ["uncertainty: {links: {mass: 0.02}}\n", "uncertainty: careful\n"])
def test_a_study_says_how_much(bends: Problem, tmp_path: Path, stated: str) -> None:
    """What is stated of something else alone leaves links exactly as stated."""
    problem = _stated(bends, _config(tmp_path, stated))
    plain, wider, _ = _both(problem)
    more = wider.high > plain.high * (1 + 1e-9)
    names = [p.name for p in problem.parameters[: problem.size] if p.free]
    assert {name for name, one in zip(names, more, strict=True) if one} == (
        {f"joint{n}.rz.{what}" for n in (2, 3) for what in ("stiffness", "damping")}
        if "careful" in stated
        else set()
    )


@pytest.mark.parametrize(("mass", "ends", "said"), [(1e-6, 0.5, True), (0.5, 1e-6, False)])
def test_a_check_says_whether_they_matter_most(
    mass: float, ends: float, said: bool, bends: Problem, tmp_path: Path
) -> None:
    stated = f"uncertainty: {{links: {{mass: {mass}}}, flexible_links: {{ends: {ends}}}}}\n"
    config = _config(tmp_path, stated)
    problem, findings = _stated(bends, config), run_checks(config).findings[STUDY]
    [finding] = [one for one in findings if one.check == "stated-uncertainty"]
    assert ("the ends of links that bend matter most" in finding.sentence) == said
    own = Scale(problem.parameters[: problem.size]).free
    left = left_open(problem, problem.initial)[own] ** 2
    known = np.diag(np.linalg.inv(fitted_information(problem, problem.initial)))[: len(own)]
    assert (finding.value == pytest.approx(np.mean(left / (known + left)))) == said


def test_a_model_without_such_a_link_is_as_sure_as_it_was(shipped: Problem) -> None:
    plain, wider, _ = _both(shipped)
    assert wider.low == pytest.approx(plain.low)
    assert plain.notes == wider.notes


def test_a_link_by_compliance_leaves_as_much_open(tmp_path: Path, bends: Problem) -> None:
    """Whose stiffnesses are no parameters, and may be infinite."""
    path = _config(tmp_path)
    path.write_text(path.read_text().replace("link: link2}", "link: link2, shrink: true}"))
    soft = load_problem(read_study(path))
    stiff = dict(zip((p.name for p in bends.parameters), bends.initial, strict=True))
    values = soft.initial.copy()
    for number, p in enumerate(soft.parameters):
        if p.name.endswith(".compliance"):
            values[number] = 1 / stiff[p.name.replace("compliance", "stiffness")]
    expected = dict(zip((p.name for p in bends.of_effects), left_open(bends, bends.initial), strict=True))
    found = dict(zip((p.name for p in soft.of_effects), left_open(soft, values), strict=True))
    assert found["joint2.rz.stiffness"] == pytest.approx(expected["joint2.rz.stiffness"], rel=1e-6)
    rigid = np.where([p.name.endswith(".compliance") for p in soft.parameters], 0.0, values)
    assert not left_open(soft, rigid).any()


def test_a_bearing_at_such_an_end_has_no_more_odds_than_the_end_allows(bends: Problem) -> None:
    """Half the squares of what it gives way, in standard deviations of what the link's end may do."""
    tilt = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx"]})
    own = {p.name: value for p, value in zip(bends.parameters, bends.initial, strict=True)}
    joints, [link] = bends.robot.joints, [one for one in bends.robot.links if one.name == "link2"]
    length = np.linalg.norm(joints[bends.robot.links.index(link)].origin[:3, 3])
    std = 0.05 * length / own["link2.bending_1.stiffness"]
    found = {}
    for times in (1.0, 4.0):
        own["joint2.rx.stiffness"] = 1 / (times * std)
        model = with_effects(bends, [*bends.file.study.effects, tilt], own)
        found[times] = odds_over_ends(model, model.initial, tilt)
    assert found[4.0] == pytest.approx(16 * found[1.0])
    assert 0.05 < found[1.0] < 5, "of bending and torsion, by where the axis lies"
    elsewhere = parse_effect({"kind": "joint-compliance", "joints": [5], "axes": ["rx"]})
    model = with_effects(bends, [*bends.file.study.effects, elsewhere], own)
    assert odds_over_ends(model, model.initial, elsewhere) == np.inf
