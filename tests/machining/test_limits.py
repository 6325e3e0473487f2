"""Depth limits against published numbers, closed forms, and a simulation in time that shares no code."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.linalg import eigvals

from identify.machining.engagement import Engagement
from identify.machining.exact_limit import ExactLimit, exact_coupling, exact_limit
from identify.machining.lobes import Limits, inverse_eigenvalues, mode_coupling, zeroth_order
from identify.machining.materials import Coefficients
from identify.machining.multi_frequency import multi_frequency
from identify.machining.semi_discretization import TimeDomain
from identify.machining.structure import Structure
from identify.machining.tool import ToolMode
from identify.model.frf import frf_by_solve
from tests.generator import milling

ALUMINIUM = Coefficients(6e8, 2e8)


def _structure(axes: list[tuple[int, float, float, float]]) -> Structure:
    """Uncoupled oscillators, each (axis, stiffness, Hz, damping ratio)."""
    k, hz, zeta = (np.array([one[n] for one in axes]) for n in (1, 2, 3))
    omega = 2 * np.pi * hz
    out = np.zeros((3, len(axes)))
    for column, one in enumerate(axes):
        out[one[0], column] = 1.0
    return Structure(np.diag(k / omega**2), np.diag(2 * zeta * k / omega), np.diag(k), out)


def _insperger() -> Structure:
    """Insperger and Stepan's oscillator, along the feed: 0.03993 kg, 922 Hz, 1.1 %."""
    return _structure([(0, 0.03993 * (2 * np.pi * 922) ** 2, 922.0, 0.011)])


def _altintas() -> Structure:
    """Altintas and Budak's end mill, two directions."""
    return _structure([(0, 5.59e6, 603.0, 0.039), (1, 5.715e6, 666.0, 0.035)])


def _cut(teeth: int, entry: float, leave: float, of: Coefficients = ALUMINIUM) -> Engagement:
    return Engagement(teeth, entry, leave, np.pi / 2, of)


def _zeroth(structure: Structure, cut: Engagement, rpm: np.ndarray) -> Limits:
    lines = structure.lines_hz(800)
    inverse = inverse_eigenvalues(cut.mean, structure.receptance(lines))
    return zeroth_order(inverse, lines, cut.teeth, rpm)


def _several(structure: Structure, cut: Engagement, rpm: np.ndarray, hz: float) -> np.ndarray:
    def tip(lines: np.ndarray) -> np.ndarray:
        matrices = structure.mass, structure.damping, structure.stiffness
        return frf_by_solve(*matrices, 2j * np.pi * lines, structure.out, structure.out.T, 0)

    return multi_frequency(cut, tip, structure.lines_hz(300), hz, rpm).depth


def _arm(structure: Structure) -> milling.Arm:
    return milling.Arm(structure.mass, structure.damping, structure.stiffness, structure.out)


def _simulated(structure: Structure, cut: Engagement, rpm: float, near: float, seconds: float) -> float:
    k = cut.cutting
    sketch = milling.Cut(cut.teeth, cut.entry, cut.exit, k.tangential, k.radial, k.axial)
    return milling.limit(_arm(structure), sketch, rpm, near * np.linspace(0.9, 1.1, 5), seconds)


def test_the_multipliers_of_a_slot_are_the_published_ones() -> None:
    """Ding et al. 2010, Int. J. Mach. Tools Manuf. 50, on Insperger and Stepan's oscillator at 5,000 rpm."""
    domain = TimeDomain(_insperger(), _cut(2, 0.0, np.pi), 922.0)
    for depth, published in ((0.2e-3, 0.8192), (0.5e-3, 1.0726), (0.7e-3, 1.2197), (1.0e-3, 1.4040)):
        assert domain.multiplier(5000.0, depth, steps=200) == pytest.approx(published, rel=5e-4)
        assert domain.multiplier(5000.0, 1.1 * depth, steps=200) != pytest.approx(published, rel=5e-3)


def _alpha(p: float, kr: float) -> np.ndarray:
    """Directional factors (2, 2) of the cut up to an angle (Altintas and Budak 1995, Eq. 9)."""
    s, c = np.sin(2 * p), np.cos(2 * p)
    rows = [[c - 2 * kr * p + kr * s, -s - 2 * p + kr * c], [-s + 2 * p + kr * c, -c - 2 * kr * p - kr * s]]
    return np.array(rows) / 2


def test_the_mean_of_the_cut_is_the_closed_form() -> None:
    """Altintas and Budak 1995, Eq. 9."""
    entry, leave, kr = 0.3, 1.9, 0.07
    found = _cut(3, entry, leave, Coefficients(6e8, kr * 6e8)).mean

    closed = 0.5 * 6e8 * 3 / (2 * np.pi) * (_alpha(leave, kr) - _alpha(entry, kr))
    assert found[:2, :2] == pytest.approx(closed, rel=1e-9)
    assert not found[2].any() and not found[:, 2].any()
    assert _cut(3, entry, leave).mean[:2, :2] != pytest.approx(closed, rel=1e-2)


def _chart(leave: float, teeth: int, kt: float, kr: float, rpm: np.ndarray) -> np.ndarray:
    """Limits (rpm,), m, of the end mill by the closed form of two directions (Altintas and Budak 1995;
    Altintas, Manufacturing Automation, 2nd ed. 2012, p. 156): a0 L^2 + a1 L + 1 = 0 at every chatter
    frequency, depth and speed from the phase of L; entry at 0.
    """
    omega = 2 * np.pi * np.linspace(300.0, 3000.0, 54_001)
    x, y = (
        1 / (k * (1 - (omega / w) ** 2 + 2j * z * omega / w))
        for k, w, z in ((5.59e6, 2 * np.pi * 603, 0.039), (5.715e6, 2 * np.pi * 666, 0.035))
    )

    (xx, xy), (yx, yy) = _alpha(leave, kr) - _alpha(0.0, kr)
    a0, a1 = x * y * (xx * yy - xy * yx), xx * x + yy * y
    best = np.full(len(rpm), np.inf)
    for sign in (1, -1):
        root = -(a1 + sign * np.sqrt(a1**2 - 4 * a0)) / (2 * a0)
        depth = -2 * np.pi * root.real / (teeth * kt) * (1 + (root.imag / root.real) ** 2)
        epsilon = np.mod(np.pi - 2 * np.arctan(root.imag / root.real), 2 * np.pi)
        for lobe in range(12):
            at = 60 * omega / (teeth * (epsilon + 2 * np.pi * lobe))
            for k, speed in enumerate(rpm):
                crossed = np.flatnonzero((at[:-1] - speed) * (at[1:] - speed) <= 0)
                crossed = crossed[(np.abs(np.diff(at))[crossed] < 50.0) & (depth[crossed] > 0)]
                best[k] = min([best[k], *depth[crossed]])
    return best


@pytest.mark.parametrize("leave", [np.pi / 2, np.pi])
def test_the_chart_of_two_directions_is_the_closed_form(leave: float) -> None:
    """The zeroth order of Altintas and Budak's end mill, half immersion and a slot, over the whole chart."""
    cut, rpm = _cut(3, 0.0, leave, Coefficients(6e8, 0.07 * 6e8)), np.linspace(4100.0, 14900.0, 25)
    closed = _chart(leave, 3, 6e8, 0.07, rpm)
    found = _zeroth(_altintas(), cut, rpm).depth
    assert np.ptp(closed) > closed.min(), "lobes, not a straight line"
    np.testing.assert_allclose(found, closed, rtol=1e-2)
    assert np.abs(found / _chart(leave, 3, 6e8, 0.2, rpm) - 1).max() > 2e-2


def test_harmonics_and_steps_are_of_one_function() -> None:
    cut = _cut(4, 0.4, 2.2)
    steps = cut.steps(400, 0.0)
    harmonics = cut.harmonics(np.arange(4))
    assert harmonics[0] == pytest.approx(cut.mean, abs=1.0)
    assert steps.mean(axis=0) == pytest.approx(cut.mean, rel=1e-9)
    angle = 2 * np.pi * (np.arange(400) + 0.5) / 400
    for number in (1, 3):
        summed = np.mean(steps * np.exp(-1j * number * angle)[:, None, None], axis=0)
        assert summed == pytest.approx(harmonics[number], rel=2e-4)
    assert harmonics[1] != pytest.approx(harmonics[2], rel=0.1)
    helical = Engagement(4, 0.4, 2.2, np.pi / 2, ALUMINIUM, lag_per_m=60.0)
    assert helical.steps(400, 0.01).mean(axis=0) == pytest.approx(cut.mean, rel=1e-6)
    assert np.ptp(helical.steps(400, 0.01)[:, 0, 0]) < 0.9 * np.ptp(steps[:, 0, 0])


def test_the_least_depth_of_one_oscillator_is_the_closed_form() -> None:
    """Tlusty: 2 k zeta (1 + zeta) over the mean coefficient, which a fine grid of speeds comes to."""
    structure, cut = _insperger(), _cut(2, 0.0, np.pi)
    stiffness, zeta = float(structure.stiffness[0, 0]), 0.011
    found = _zeroth(structure, cut, np.linspace(4500.0, 6500.0, 4001)).depth.min()
    assert found == pytest.approx(2 * stiffness * zeta * (1 + zeta) / abs(cut.mean[0, 0]), rel=1e-3)


@pytest.mark.parametrize(
    ("swept", "rpm"), [((np.pi / 2, np.pi), 15000.0), ((0.0, np.pi), 12000.0), ((2.69, np.pi), 9000.0)]
)
def test_both_routes_to_the_exact_limit_agree(swept: tuple[float, float], rpm: float) -> None:
    structure, cut = _insperger(), _cut(2, *swept)
    near = float(_zeroth(structure, cut, np.array([rpm])).depth[0])
    in_time = TimeDomain(structure, cut, 922.0).limit(rpm, near, 0.05)
    assert _several(structure, cut, np.array([rpm]), 922.0)[0] == pytest.approx(in_time, rel=0.03)


def test_zeroth_order_does_not_see_a_flip_lobe() -> None:
    """At the first flip lobe the true limit is half of what the mean of the cut says."""
    structure, cut = _insperger(), _cut(2, np.pi / 2, np.pi)
    domain = TimeDomain(structure, cut, 922.0)
    near = float(_zeroth(structure, cut, np.array([15000.0])).depth[0])
    depth = domain.limit(15000.0, near, 0.05)
    assert depth < 0.6 * near
    assert domain.chatter_hz(15000.0, depth) % 500.0 == pytest.approx(250.0, abs=2.0), (
        "half the tooth frequency"
    )


def test_an_end_mill_with_two_directions_chatters_where_a_simulation_says() -> None:
    """Altintas and Budak's example: half immersion, up-milling, three teeth, 600 N/mm^2, Kr 0.07."""
    structure, cut, rpm = _altintas(), _cut(3, 0.0, np.pi / 2, Coefficients(6e8, 0.07 * 6e8)), 6000.0
    near = float(_zeroth(structure, cut, np.array([rpm])).depth[0])
    limit = TimeDomain(structure, cut, 700.0).limit(rpm, near, 0.1)
    assert limit == pytest.approx(_simulated(structure, cut, rpm, limit, 0.35), rel=0.02)
    assert limit == pytest.approx(_several(structure, cut, np.array([rpm]), 700.0)[0], rel=0.02)


def test_cross_terms_and_an_axial_force_matter() -> None:
    """A structure whose axes are turned against the tool's, simulated too."""
    cut = _cut(2, 0.0, np.pi / 2, Coefficients(6e8, 1e8, 2e8))
    plain = _structure([(0, 1.0e6, 14.0, 0.04), (1, 1.6e6, 17.0, 0.04), (2, 1.2e6, 24.0, 0.04)])
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turned = Structure(plain.mass, plain.damping, plain.stiffness, turn)
    limits = []
    for structure in (plain, turned):
        near = float(_zeroth(structure, cut, np.array([1800.0])).depth[0])
        limits.append(TimeDomain(structure, cut, 24.0).limit(1800.0, near, 0.1))
    assert limits[1] == pytest.approx(_simulated(turned, cut, 1800.0, limits[1], 8.0), rel=0.03)
    assert abs(limits[1] / limits[0] - 1) > 0.2, "the same modes, turned, have another limit"


def test_mode_coupling_is_where_the_state_matrix_becomes_unstable() -> None:
    structure = Structure(
        np.diag([20.0, 20.0]),
        np.diag([60.0, 60.0]),
        np.diag([1.2e5, 1.5e5]),
        np.eye(3)[:, :2] @ _rotation(0.6),
    )
    cut = _cut(2, 0.0, np.pi / 2, Coefficients(6e8, 1.5e8))
    lines = structure.lines_hz(800)
    found = mode_coupling(inverse_eigenvalues(cut.mean, structure.receptance(lines)), lines)
    depth = float(found.depth)
    assert _growth(structure, 1.002 * depth * cut.mean) > 0 > _growth(structure, 0.998 * depth * cut.mean)
    stiff = Structure(structure.mass, structure.damping, 100 * structure.stiffness, structure.out)
    other = mode_coupling(inverse_eigenvalues(cut.mean, stiff.receptance(lines)), lines)
    assert float(other.depth) > 10 * depth


def _rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _growth(structure: Structure, coupling: np.ndarray) -> float:
    size = len(structure.mass)
    stiffness = structure.stiffness - structure.out.T @ coupling @ structure.out
    lower = -np.linalg.solve(structure.mass, np.hstack([stiffness, structure.damping]))
    return float(eigvals(np.vstack([np.eye(size, 2 * size, size), lower])).real.max())


def test_modes_of_the_tool_are_added() -> None:
    arm = _structure([(0, 1.0e6, 14.0, 0.04), (1, 1.6e6, 17.0, 0.04)])
    mode = ToolMode(direction="radial", frequency_hz=900.0, damping_ratio=0.02, stiffness_n_per_m=1e7)
    lines = np.array([0.0, 15.0, 880.0])
    both = arm.with_modes([mode]).receptance(lines)
    s = 2j * np.pi * lines
    alone = 1 / (1e7 * (1 + 2 * 0.02 * s / (2 * np.pi * 900) + (s / (2 * np.pi * 900)) ** 2))
    added = both - arm.receptance(lines)
    assert added == pytest.approx(alone[:, None, None] * np.diag([1, 1, 0]), abs=1e-12)
    assert np.abs(alone).min() > 1e-8


def _tip(structure: Structure, lines: np.ndarray) -> np.ndarray:
    at = structure.receptance(np.abs(lines))
    return np.where(lines[:, None, None] < 0, np.conj(at), at)


@pytest.mark.parametrize(
    ("swept", "rpm"), [((np.pi / 2, np.pi), 15000.0), ((0.0, np.pi), 12000.0), ((0.0, np.pi / 2), 6000.0)]
)
def test_the_exact_limit_is_that_of_a_simulation_with_a_vanishing_step(
    swept: tuple[float, float], rpm: float
) -> None:
    structure, cut = _altintas(), _cut(3, *swept)
    near = float(_zeroth(structure, cut, np.array([rpm])).depth[0])
    domain = TimeDomain(structure, cut, 660.0)
    first = domain.limit(rpm, near, 0.05)
    exact = exact_limit(cut, partial(_tip, structure), 660.0, rpm, (first, domain.chatter_hz(rpm, first)))
    k = cut.cutting
    sketch = milling.Cut(cut.teeth, cut.entry, cut.exit, k.tangential, k.radial, k.axial)
    simulated, step = milling.exact_limit(_arm(structure), sketch, rpm, near)
    assert exact is not None
    assert exact.depth == pytest.approx(simulated, rel=1e-4 + 0.05 * step)
    assert exact.depth != pytest.approx(1.01 * simulated, rel=1e-4 + 0.05 * step)


def test_the_slope_of_a_limit_is_that_of_another_structure() -> None:
    """By refitted limits of a slightly stiffer and a more damped end mill."""
    cut, rpm, hz = _cut(3, 0.0, np.pi / 2), 6000.0, 660.0

    def end_mill(stiffness: float, damping: float) -> Structure:
        return _structure([(0, 5.59e6 * stiffness, 603.0, 0.039), (1, 5.715e6, 666.0, 0.035 * damping)])

    def limit(structure: Structure) -> ExactLimit:
        found = exact_limit(cut, partial(_tip, structure), hz, rpm, (2.485e-3, 676.0))
        assert found is not None
        return found

    here = limit(end_mill(1.0, 1.0))
    for change in ((1e-3, 0.0), (0.0, 1e-3)):
        up, down = (end_mill(1 + sign * change[0], 1 + sign * change[1]) for sign in (1, -1))
        difference = (_tip(up, here.lines_hz) - _tip(down, here.lines_hz)) / 2
        promised = float(np.sum(here.slope * difference).real)
        assert (limit(up).depth - limit(down).depth) / 2 == pytest.approx(promised, rel=1e-3)
        assert abs(promised) > 1e-5 * here.depth


def test_a_helix_is_in_the_exact_limit() -> None:
    structure = _altintas()
    straight, helical = (
        Engagement(3, 0.0, np.pi / 2, np.pi / 2, ALUMINIUM, lag_per_m=lag) for lag in (0.0, 300.0)
    )
    found = []
    for cut in (straight, helical):
        domain = TimeDomain(structure, cut, 660.0)
        depth = domain.limit(6000.0, 2.4e-3, 0.05)
        near = depth, domain.chatter_hz(6000.0, depth)
        exact = exact_limit(cut, partial(_tip, structure), 660.0, 6000.0, near)
        assert exact is not None
        assert exact.depth == pytest.approx(depth, rel=0.01)
        found.append(exact.depth)
    assert found[1] != pytest.approx(found[0], rel=0.02)


def test_the_limit_of_mode_coupling_is_refined() -> None:
    structure = _structure([(0, 1.44e6, 15.0, 0.02), (1, 1.6e6, 16.0, 0.02)])
    turn = np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    turned = Structure(structure.mass, structure.damping, structure.stiffness, turn @ structure.out)
    cut = _cut(4, 0.0, np.pi, Coefficients(7e8, 3e8))
    lines = turned.lines_hz(200)
    near = mode_coupling(inverse_eigenvalues(cut.mean, turned.receptance(lines)), lines)
    exact = exact_coupling(cut, partial(_tip, turned), (float(near.depth), float(near.chatter_hz)))
    assert exact is not None
    assert exact.depth == pytest.approx(float(near.depth), rel=0.01)
    unstable = [
        float(
            np.linalg.eigvals(
                np.block(
                    [
                        [np.zeros((2, 2)), np.eye(2)],
                        [
                            np.linalg.solve(
                                turned.mass,
                                part * exact.depth * turned.out.T @ cut.mean @ turned.out - turned.stiffness,
                            ),
                            -np.linalg.solve(turned.mass, turned.damping),
                        ],
                    ]
                )
            ).real.max()
        )
        for part in (1 - 1e-6, 1 + 1e-6)
    ]
    assert unstable[0] < 0 < unstable[1]
