"""How wide the intervals of a vibration fit are: against the scatter of scores and of fits that are drawn,
not only whether the truth is inside.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from identify.core.parameters import Parameter, Scale
from identify.fitting.uncertainty import joint_uncertainty
from identify.measured.modal_tables import ModalTable
from identify.model.effects.base import parse_effect
from identify.model.modes import complex_modes
from identify.model.system import assemble, build_site, list_parameters
from identify.vibration.costs.make_target import ModalTarget, Targets
from identify.vibration.costs.target import FrfTarget
from identify.vibration.uncertainty import _joint_disagreement, _wider, score_variance, uncertainty
from tests.arms import arm, initial
from tests.robot.random_arm import random_posture
from tests.targets import targets

Complex = NDArray[np.complex128]
LINES, OUTPUTS = 200, 4


def _white(rng: np.random.Generator, *shape: int) -> Complex:
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def _smeared(rng: np.random.Generator, keeps: complex) -> Complex:
    """Noise (lines, outputs) of which every line keeps a part of the last, as an exponential window leaves
    it.
    """
    new = np.sqrt(1 - abs(keeps) ** 2) * _white(rng, LINES + 60, OUTPUTS)
    return np.asarray(lfilter([1.0], [1.0, -keeps], new, axis=0))[60:]


@pytest.mark.parametrize("keeps", [0.0, 0.5, 0.3 + 0.4j])
def test_stated_variance_is_that_of_scores_that_are_drawn(keeps: complex) -> None:
    """Derivatives that go evenly over the lines, with a turn that a complex correlation notices."""
    rng, line = np.random.default_rng(1), np.arange(LINES)
    j = np.empty((LINES, OUTPUTS, 3), dtype=complex)
    j[..., 0] = 1 + 0.3j
    j[..., 1] = 0.5 * np.linspace(-1, 1, OUTPUTS)
    j[..., 2] = np.exp(0.8j * line)[:, None]
    h, drawn, stated = _white(rng, LINES, OUTPUTS), [], []
    for _ in range(250):
        e = _smeared(rng, keeps)
        drawn.append(np.einsum("lof,lo->f", np.conj(j), e).real)
        stated.append(score_variance(e, j, h))
        assert stated[-1] == pytest.approx(stated[-1].T, rel=1e-9, abs=1e-9)
    scatter, said = np.cov(np.array(drawn).T), np.mean(stated, axis=0)
    assert np.diag(said) == pytest.approx(np.diag(scatter), rel=0.25)
    assert np.diag(said).sum() == pytest.approx(np.diag(scatter).sum(), rel=0.12)


def test_the_part_along_the_force_counts_once() -> None:
    """Scores that only the part of the residual along evenly running FRFs moves, smeared over lines."""
    rng = np.random.default_rng(4)
    h = np.outer(np.exp(0.05j * np.arange(LINES)), _white(rng, OUTPUTS))
    drawn, stated = [], []
    for _ in range(100):
        e = _smeared(rng, 0.5)
        drawn.append(float(np.sum(np.conj(h) * e).real))
        stated.append(score_variance(e, h[..., None], h)[0, 0])
    assert 0.75 < np.mean(stated) / np.var(drawn) < 1.6


def _few(folder: Path) -> tuple[FrfTarget, Scale, np.ndarray]:
    """Four lines of two responses: 48 numbers for 12 parameters."""
    data, parameters = targets(folder, noise=0.02)
    frf, outputs, lines = data.frf[0], [0, 4], np.isin(np.arange(60), (9, 20, 33, 47))
    assert frf.noise is not None
    thin = frf.data.lines(lines).pairs(outputs, [0, 1, 2])
    noise = frf.noise[lines][:, outputs]
    return (
        replace(frf, data=thin, noise=noise, out=frf.out[outputs]),
        Scale(tuple(parameters)),
        initial(parameters),
    )


def _stated(
    target: FrfTarget, scale: Scale, truth: np.ndarray, level: float
) -> tuple[np.ndarray, np.ndarray]:
    """Mean variance that is stated over draws of noise, and what linear least squares has, (free,): the
    residuals are what a fit leaves of the noise.
    """
    h = target.predict(truth)
    _, gradient = target.gradient(truth, scale.free)
    assert target.noise is not None
    scaled = gradient * scale.slope(scale.to_x(truth)) / target.noise[..., None]
    rows = np.concatenate([scaled.real, scaled.imag]).reshape(-1, len(scale.free))
    fitted, _ = np.linalg.qr(rows)
    variances = []
    for seed in range(100):
        e = level * np.random.default_rng(seed).normal(size=len(rows))
        left = (e - fitted @ (fitted.T @ e)).reshape(2, *h.shape)
        data = replace(target.data, frf=h - (left[0] + 1j * left[1]) * target.noise)
        variances.append(uncertainty(Targets((replace(target, data=data),)), scale, truth).std ** 2)
    return np.mean(variances, axis=0), level**2 * np.diag(np.linalg.inv(rows.T @ rows))


def test_what_the_fit_itself_took_from_the_residual_is_given_back(tmp_path: Path) -> None:
    """Noise three times as large as stated, known from the residual of few numbers only: a quarter of its
    square is in the parameters.
    """
    said, analytic = _stated(*_few(tmp_path), level=3.0)
    assert 0.95 < np.mean(said / analytic) < 1.3
    assert np.min(said / analytic) > 0.9


def test_intervals_are_no_narrower_than_the_stated_noise_makes_them(tmp_path: Path) -> None:
    """A residual that is small by chance, or by too large a stated noise, does not narrow anything."""
    said, analytic = _stated(*_few(tmp_path), level=0.3)
    assert said == pytest.approx(analytic / 0.3**2, rel=0.02)


def test_one_mode_and_one_spring(tmp_path: Path) -> None:
    """f goes with the root of k and zeta with c: half a per cent of frequency is one per cent of
    stiffness, and ten per cent of damping ratio are ten of the damper.
    """
    robot = replace(arm(tmp_path), gravity=np.zeros(3))
    effects = [parse_effect({"kind": "joint-compliance", "joints": [1], "axes": ["rz"]})]
    site = build_site(robot, random_posture(1), effects)
    system, parameters = assemble(robot, site, effects), list_parameters(robot, site, effects)
    values = initial(parameters)
    modes = complex_modes(*system.matrices(values))
    table = ModalTable(modes.frequency_hz, modes.damping_ratio)
    scale = Scale(tuple(parameters))
    found = uncertainty(Targets(modal=(ModalTarget("one", table, system),)), scale, values)
    assert found.std[0] == pytest.approx(0.01, rel=0.01)
    assert found.std[1] == pytest.approx(0.1, rel=0.02)
    stated = replace(table, frequency_std_hz=table.frequency_hz * 0.02)
    wider = uncertainty(Targets(modal=(ModalTarget("one", stated, system),)), scale, values)
    assert wider.std[0] == pytest.approx(0.04, rel=0.01)


def test_noise_on_the_force_is_told_from_noise_of_responses() -> None:
    """It multiplies all responses to the force alike: scores that only such noise moves vary as drawn."""
    rng = np.random.default_rng(5)
    h = 3 * _white(rng, LINES, OUTPUTS)
    along, drawn, stated = 0.2 * h, [], []
    j = np.stack([along, _white(rng, LINES, OUTPUTS)], axis=2)
    for _ in range(250):
        e = _white(rng, LINES, OUTPUTS) + 0.8 * _white(rng, LINES, 1) * h
        drawn.append(np.einsum("lof,lo->f", np.conj(j), e).real)
        stated.append(score_variance(e, j, h))
    scatter, said = np.var(drawn, axis=0), np.diag(np.mean(stated, axis=0))
    assert said == pytest.approx(scatter, rel=0.25)
    independent = np.einsum("lof,lof->f", np.conj(j), j).real
    assert said[0] > 5 * independent[0], "negative control: counted as independent it is far too little"


def test_what_few_forces_say_of_one_value_is_weighed_with_what_they_say_of_all() -> None:
    """Half of each: a few forces agree about one value, or disagree, by chance."""
    ratio, known = np.array([9.0, 1.0, 0.2, 50.0]), np.array([True, True, True, False])
    of_all = 10.2 / 3
    expected = [(9 + of_all) / 2, (1 + of_all) / 2, (0.2 + of_all) / 2, of_all]
    assert _wider(ratio, known) == pytest.approx(np.sqrt(expected))
    assert _wider(np.full(4, 0.3), known) == pytest.approx(1.0), "nothing is narrowed"


FORCES, NUMBERS, ERRORS = 4, 30, 24


def _widened(seed: int, shared: float, correlated: float = 1.0) -> np.ndarray:
    """By how much the two parameters of a linear problem of four forces are widened, beside many nuisance
    parameters: each force has an error of its own in common, residuals vary by so much more than as if
    they were independent.
    """
    rng = np.random.default_rng(seed)
    own = Scale(tuple(Parameter(name, "", 0.0, -1e4, 1e4, log=False) for name in "ab"))
    errors = tuple(
        Parameter(f"e{n}", "", 0.0, -np.inf, np.inf, log=False, nuisance=True) for n in range(ERRORS)
    )
    scale = Scale((*own.parameters, *errors))
    size = 2 + ERRORS
    rows = rng.normal(size=(FORCES, NUMBERS, size)) * np.array([30.0, 20.0, *[3.0] * ERRORS])
    truth = np.concatenate([np.zeros(2), rng.normal(size=ERRORS)])
    data = rows @ truth + rng.normal(size=(FORCES, NUMBERS))
    data += shared * rng.normal(size=(FORCES, 1)) * rows[..., 0] / 30
    flat, prior = rows.reshape(-1, size), scale.prior_information()
    information = flat.T @ flat
    value = np.linalg.solve(information + np.diag(prior), flat.T @ data.ravel())
    parts = np.einsum("bni,bnj->bij", rows, rows)
    scores = np.einsum("bni,bn->bi", rows, rows @ value - data)
    mask = np.arange(size) >= 2
    noise = correlated * information
    plain = joint_uncertainty(information, lambda c: c @ noise @ c.T, mask, flat.size, own, value[:2])
    assert plain.joint is not None
    return _joint_disagreement(plain, plain.joint, list(zip(parts, scores, strict=True)), scale, own)


def test_forces_that_do_not_disagree_are_not_said_to_where_much_is_left_open() -> None:
    """Leaving one of four out moves a value far beside so many errors, and noise alone does that."""
    assert np.mean([_widened(seed, 0.0) for seed in range(60)]) < 1.15
    assert np.mean([_widened(seed, 4.0) for seed in range(60)]) > 1.5


def test_noise_that_is_too_small_by_chance_makes_no_disagreement() -> None:
    """The variance of the scores may come out as next to nothing: independent residuals have more."""
    assert np.mean([_widened(seed, 0.0, correlated=0.01) for seed in range(30)]) < 1.15
