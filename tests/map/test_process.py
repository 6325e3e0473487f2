"""The process over postures on numbers drawn from a known one, and from none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from identify.map.process import LENGTHS, SIZES, Cell, Learned, Seen, _evidence, _Prior, learn

MODES = 4


def drawn(
    rng: np.random.Generator, postures: int, size: float, scatter: float, robots: int = 1, shared: float = 1.0
) -> tuple[Seen, np.ndarray]:
    """Relative errors of modes at postures of three joints, from smooth errors of a stiffness matrix (a sum
    of waves over the joints, of about a radian); of several robots, these postures on each.
    """
    wave, phase = rng.standard_normal((3, 40)), rng.uniform(0, 2 * np.pi, 40)
    common = rng.standard_normal((40, 6, 6))
    found: list[tuple[np.ndarray, np.ndarray, int, float]] = []
    for robot in range(robots):
        own = rng.standard_normal((40, 6, 6))
        amounts = np.sqrt(shared) * common + np.sqrt(1 - shared) * own
        for _ in range(postures):
            q = rng.uniform(-0.8, 0.8, 3)
            matrix = np.tensordot(np.cos(q @ wave + phase), amounts, axes=1) * np.sqrt(2 / 40)
            shapes = np.linalg.qr(np.eye(6) + 0.2 * rng.standard_normal((6, 6)))[0][:MODES]
            found += [(q, psi, robot, float(psi @ matrix @ psi)) for psi in shapes]
    q, psi, robot, y = (np.array(column) for column in zip(*found, strict=True))
    return Seen(
        q, psi.astype(complex), robot, np.zeros((len(y), 0))
    ), size * y + scatter * rng.standard_normal(len(y))


def told(learned: Learned, seen: Seen, y: np.ndarray) -> tuple[float, float]:
    """RMS error over that of no correction, and the share inside."""
    mean, low, high, _ = learned.at(seen)
    error = np.sqrt(np.mean((y - mean) ** 2) / np.mean(y**2))
    return float(error), float(np.mean((low < y) & (y < high)))


def test_a_smooth_error_is_learned_and_held_by_its_interval() -> None:
    errors, inside, odds = [], [], []
    for seed in range(4):
        seen, y = drawn(np.random.default_rng(seed), 30, 0.05, 0.003)
        known = np.arange(len(y)) < 14 * MODES
        learned = learn(seen.rows(known), y[known])
        odds.append(learned.log_odds)
        error, held = told(learned, seen.rows(~known), y[~known])
        errors.append(error)
        inside.append(held)
    assert np.mean(odds) > 5 and np.mean(errors) < 0.65
    assert 0.9 < np.mean(inside) <= 1.0


def test_scatter_is_taken_for_nothing_else() -> None:
    odds, inside, moved = [], [], []
    for seed in range(8):
        seen, y = drawn(np.random.default_rng(seed), 20, 0.0, 0.02)
        known = np.arange(len(y)) < 10 * MODES
        learned = learn(seen.rows(known), y[known])
        error, held = told(learned, seen.rows(~known), y[~known])
        odds.append(learned.log_odds)
        moved.append(error)
        inside.append(held)
    assert np.median(odds) < 0 and max(moved) < 1.1
    assert 0.92 < np.mean(inside) < 0.99


def test_far_from_all_postures_the_interval_is_that_of_the_prior() -> None:
    seen, y = drawn(np.random.default_rng(3), 14, 0.05, 0.003)
    learned = learn(seen, y)
    near, far = (
        seen.rows(np.array([0])),
        Seen(seen.posture[:1] + np.pi, seen.shape[:1], seen.robot[:1], seen.absorbed[:1]),
    )
    (_, low, high, known), (mean, wide_low, wide_high, less) = learned.at(near), learned.at(far)
    assert known[0] > 0.9 and less[0] < 0.1 < known[0]
    assert abs(mean[0]) < 0.2 * (wide_high - wide_low)[0]
    assert (wide_high - wide_low)[0] > 4 * (high - low)[0]


def test_of_two_postures_little_is_known_elsewhere() -> None:
    known, inside = [], []
    for seed in range(8):
        seen, y = drawn(np.random.default_rng(seed), 12, 0.05, 0.003)
        first = np.arange(len(y)) < 2 * MODES
        learned = learn(seen.rows(first), y[first])
        _, low, high, share = learned.at(seen.rows(~first))
        known.append(np.mean(share))
        inside.append(np.mean((low < y[~first]) & (y[~first] < high)))
    assert np.mean(known) < 0.35
    assert np.mean(inside) > 0.9


def test_another_robot_tells_as_much_as_they_share() -> None:
    found = {}
    for shared in (0.95, 0.0):
        rows = []
        for seed in range(2):
            seen, y = drawn(np.random.default_rng(seed), 16, 0.05, 0.003, robots=2, shared=shared)
            own = np.flatnonzero(seen.robot == 0)
            few, rest = own[: 4 * MODES], own[4 * MODES :]
            both = np.concatenate([few, np.flatnonzero(seen.robot == 1)])
            alone, learned = learn(seen.rows(few), y[few]), learn(seen.rows(both), y[both])
            errors = [told(one, seen.rows(rest), y[rest]) for one in (alone, learned)]
            rows.append((learned.mean_of("shared"), errors[1][0] / errors[0][0], errors[1][1]))
        found[shared] = np.mean(rows, axis=0)
    (alike, gain, inside), (apart, loss, held) = found[0.95], found[0.0]
    assert alike > 0.75 and apart < 0.5
    assert gain < 0.85 and loss < 1.1
    assert min(inside, held) > 0.85


def test_the_evidence_is_that_of_a_normal_distribution() -> None:
    rng = np.random.default_rng(1)
    seen, y = drawn(rng, 3, 0.05, 0.01)
    length = float(LENGTHS[2])
    kernel = seen.kernel(seen, length, 1.0)
    absorbed = rng.standard_normal((len(y), 3))
    table = _evidence(_Prior(kernel, length, 1.0, -0.3), SIZES, absorbed, y)
    a, s = 11, 9
    signal = SIZES[a] ** 2 * kernel + absorbed @ absorbed.T
    cov = signal + SIZES[s] ** 2 * np.eye(len(y))
    assert table[a, s] == pytest.approx(multivariate_normal(np.zeros(len(y)), cov).logpdf(y) - 0.3)
    seen = Seen(seen.posture, seen.shape, seen.robot, absorbed)
    known = np.arange(len(y)) < len(y) - 3
    cell = Cell(float(SIZES[a]), length, 1.0, float(SIZES[s]), 1.0)
    mean, low, high, _ = Learned(seen.rows(known), y[known], (cell,), 0.0).at(seen.rows(~known))
    gain = cov[np.ix_(~known, known)] @ np.linalg.inv(cov[np.ix_(known, known)])
    left = np.diag(cov)[~known] - np.diag(gain @ cov[np.ix_(known, ~known)])
    np.testing.assert_allclose(mean, gain @ y[known], rtol=1e-6)
    np.testing.assert_allclose(high - low, 2 * 1.96 * np.sqrt(left), rtol=1e-3)


def test_numbers_of_modes_have_no_part() -> None:
    """Shapes say which mode is which, whatever their order, sign and phase."""
    seen, y = drawn(np.random.default_rng(2), 8, 0.05, 0.003)
    order = np.random.default_rng(0).permutation(len(y))
    turned = Seen(seen.posture[order], -1j * seen.shape[order], seen.robot[order], seen.absorbed[order])
    places = seen.rows(np.arange(5))
    for one, other in zip(learn(seen, y).at(places), learn(turned, y[order]).at(places), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)
