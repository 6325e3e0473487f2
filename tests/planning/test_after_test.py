"""What is promised after a test, against noise in time, refits by least squares, all choices, and a fit of
the same size.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.planning.after_test import AfterTest, scores
from identify.planning.design import Criterion, random_choice, total
from identify.planning.information import FreeModel, TestNoise, measurable
from identify.planning.known import known_of, noise_growth
from identify.planning.promise import information_of_last
from identify.planning.refine import Refinement
from identify.planning.run import PlanOptions, run_plan
from identify.results.discovery import fit_of
from identify.results.file import read
from identify.results.fit import FitResult
from identify.vibration.problem import load_problem
from identify.vibration.run import run_fit
from identify.vibration.study import read_study
from identify.vibration.uncertainty import uncertainty
from tests.planning.own_test import own_test
from tests.planning.test_plan import AMONG, FLOOR, _frfs

pytestmark = pytest.mark.usefixtures("no_measured_modes")

ARM = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


@pytest.mark.parametrize("decay", [0.0, 2.0])
def test_the_variance_of_scores_is_that_of_noise_in_time(decay: float) -> None:
    """Noise of each response, and of the force, drawn as samples under an exponential window."""
    rng, record, lines, outputs = np.random.default_rng(5), 1.6, 40, 5
    size = (lines, outputs, 1, 3)
    h = 1 + 0.3 * rng.normal(size=size[:3]) + 0.3j * rng.normal(size=size[:3])
    slow = np.exp(-3.0 * np.linspace(0, record, 256))[:, None] * (
        np.tile(rng.normal(size=(256, 3)), outputs) + 0.3 * rng.normal(size=(256, 3 * outputs))
    )
    g = np.fft.fft(slow, axis=0)[60 : lines + 60].reshape(
        size
    )  # as smooth over lines as those of decaying motion
    noise = TestNoise(0.02, 0.03, decay)
    product, variance = scores(h, g, noise, record, lines)
    sigma = noise.sigma(h)
    j = (g / sigma[..., None])[:, :, 0]
    t = np.arange(256) * record / 256
    window = np.exp(-decay * t)
    samples = rng.normal(size=(4000, outputs + 1, 256)) * window
    spectra = np.fft.fft(samples, axis=-1)[..., 60 : lines + 60] * np.sqrt(2 / np.sum(window**2))
    alone = np.swapaxes(spectra[:, :outputs], 1, 2) * noise.floor
    e = (alone + noise.relative * spectra[:, outputs][..., None] * h[:, :, 0]) / sigma[:, :, 0]
    drawn = np.einsum("lof,dlo->df", np.conj(j), e).real
    assert np.diag(variance) == pytest.approx(np.var(drawn, axis=0), rel=0.12)
    assert np.all(np.diag(variance) > 1.4 * np.diag(product)), "noise of the force does not average out"


def test_noise_that_grows_along_the_frequency(planar_fit: Path) -> None:
    """As an impact has less force the higher the frequency; what is measured is divided by it."""
    frf = next(one.frf for one in read(planar_fit, FitResult).measurements.values() if one.frf is not None)
    hz = frf.frequency_hz
    flat = np.sqrt(FLOOR**2 + (0.03 * np.abs(frf.fitted)) ** 2)
    for power, times in ((0.0, 1.0), (0.4, 1.3)):
        larger = times * np.exp(power * (hz / 100) ** 2)
        drawn = flat * larger[:, None] * np.random.default_rng(4).uniform(0.7, 1.3, flat.shape)
        found = TestNoise(FLOOR, 0.03, 0.0, noise_growth([replace(frf, noise=drawn)], FLOOR, 0.03))
        assert found.larger(hz) == pytest.approx(larger * np.sqrt(1.03), rel=0.1)
        h, g = np.ones((2, 3, 1), dtype=complex), np.ones((2, 3, 1, 2), dtype=complex)
        ends = found.over(g, 2j * np.pi * hz[[0, -1]])
        assert h[0, 0, 0] / ends[:, 0, 0, 0] == pytest.approx(found.larger(hz[[0, -1]]))
    assert found.larger(hz)[-1] > 1.3 * TestNoise(FLOOR, 0.03).larger(hz)[-1] > 1.0


def test_two_models_are_told_apart_as_refits_of_both_leave_them(planar_fit: Path) -> None:
    """The least of |d + G a + G' b|^2 over noise, with what is known of a and b."""
    model = known_of(planar_fit, None, None).model
    other = replace(model, values=model.values * np.array([1.1, 1, 1, 0.8, 1, 1.3]))
    free = np.arange(6)
    pair = [FreeModel(one, free, one.values) for one in (model, other)]
    found = measurable(pair, AMONG, TestNoise(FLOOR), np.array([4.0, 64.0, 60 / 59]))
    chosen = np.array([0, 2]), np.array([1]), np.array([1])
    before = np.diag([40.0] * 12 + [0.0])
    apart = information_of_last(total(found.information, chosen) + before, 13)
    names = [parameter.name for parameter in model.system(model.posture).parameters]
    at = [[names.index(f"joint{n}.rz.{what}") for n in (1, 2, 3)] for what in ("stiffness", "damping")]
    line_hz = np.linspace(4, 64, 60)

    def predicted(values: np.ndarray) -> np.ndarray:
        parts = [_frfs(AMONG.postures[q], values[at[0]], values[at[1]], [1], line_hz)[:, 2:] for q in (0, 2)]
        h = np.concatenate([part.ravel() for part in parts]) / FLOOR
        return np.concatenate([h.real, h.imag])

    def columns(values: np.ndarray) -> list[np.ndarray]:
        steps = 1e-5 * np.eye(6)
        sides = [[predicted(values * np.exp(sign * step)) for sign in (1, -1)] for step in steps]
        return [(up - down) / 2e-5 for up, down in sides]

    rows = np.array([*columns(model.values), *columns(other.values)]).T
    difference = predicted(other.values) - predicted(model.values)
    whole = np.concatenate([rows, np.sqrt(40.0) * np.eye(12)])
    wanted = np.concatenate([difference, np.zeros(12)])
    left = wanted - whole @ np.linalg.lstsq(whole, wanted, rcond=None)[0]
    assert apart == pytest.approx(left @ left, rel=1e-3)
    assert apart < 0.5 * difference @ difference, "refitted, they are less far apart"


def test_the_refined_test_is_the_best_of_all(planar_fit: Path) -> None:
    known = known_of(planar_fit, None, None)
    known = replace(known, noise=TestNoise(FLOOR, 0.05), band=np.array([4.0, 64.0, 60 / 59]))
    weak = known.bounds
    after = AfterTest(known, [known.free_model], AMONG, weak, weak, True)
    refinement = Refinement([known.free_model], AMONG, known.noise, known.band, Criterion(weak), weak)
    score = {
        (q, i, s): float(np.linalg.slogdet(after.precision((np.array(q), np.array(i), np.array([s]))))[1])
        for q in combinations(range(5), 2)
        for i in combinations(range(4), 2)
        for s in range(2)
    }
    found, rng = [], np.random.default_rng(3)
    for _ in range(3):
        start = random_choice(np.zeros((5, 4, 2)), (2, 2, 1), rng)
        q, i, s = refinement.refined(start)
        found.append(score[tuple(q.tolist()), tuple(i.tolist()), int(s[0])])
    assert max(found) == pytest.approx(max(score.values()), rel=1e-6)
    assert np.median(list(score.values())) < max(score.values()) - 0.3


@pytest.fixture(scope="module")
def careful(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shipped arm, fitted with nuisance parameters."""
    folder = tmp_path_factory.mktemp("careful")
    text = ARM.read_text().replace("../data/", f"{ARM.parents[1] / 'data'}/")
    (folder / "arm.yaml").write_text(
        text.replace("band_hz: [3, 80]", "band_hz: [3, 45]") + "\nuncertainty: careful\n"
    )
    run_fit(folder / "arm.yaml", folder / "fit.h5", {"starts": 1})
    return folder / "fit.h5"


def _by_noise(fit: Path) -> np.ndarray:
    """Standard deviations of a fit's parameters but for what its forces disagree by."""
    problem, found = load_problem(read_study(fit.with_name("arm.yaml"))), fit_of(fit)
    assert found.uncertainty is not None
    values = np.concatenate([found.parameters.value, found.uncertainty.shift])
    return uncertainty(problem.targets(), Scale(problem.parameters), values, disagreement=False).std


def test_a_fit_s_own_test_is_promised_what_the_fit_found(careful: Path) -> None:
    known = known_of(careful, None, None)
    found = np.sqrt(np.diag(np.linalg.inv(known.information)))
    by_noise, as_told = _by_noise(careful), own_test(replace(known, settings=None), careful)
    assert own_test(known, careful) == pytest.approx(by_noise, rel=0.15)
    assert np.all(by_noise < 1.001 * found), "no plan knows what forces will disagree by"
    assert np.all(as_told < 0.8 * found), "as if all were as stated"
    quiet = TestNoise(known.noise.floor)
    assert np.all(own_test(replace(known, settings=None, noise=quiet), careful) < 0.7 * as_told), (
        "without the force's noise and the window"
    )


def test_a_plan_counts_what_was_told(careful: Path, tmp_path: Path) -> None:
    size = PlanOptions(postures=1, impacts=1, sensors=1, among=1)
    found, _ = run_plan(careful, size, tmp_path / "p.h5")
    assert any("include the stated uncertainty" in note for note in found.notes)
    assert np.all(found.promised.promised < found.promised.now)


def test_a_rival_is_told_apart(planar_fit: Path, tmp_path: Path) -> None:
    study = planar_fit.parent / "study" / "study.yaml"
    text = study.read_text()
    more = "effects:\n  - {kind: joint-compliance, joints: [2], axes: [tx]}\n"
    other = study.with_name("other.yaml")
    other.write_text(text.replace("effects:\n", more))
    run_fit(other, tmp_path / "rival.h5", {"starts": 1})
    size = PlanOptions(postures=1, impacts=1, sensors=1, among=4)
    found, _ = run_plan(planar_fit, replace(size, rival=tmp_path / "rival.h5"), tmp_path / "p.h5")
    assert found.promised.name[-1].startswith("difference to the model with radial compliance of joint 2")
    assert "standard deviations" in found.verdict[0]
    assert found.promised.promised[-1] <= 1.05 * found.promised.random[-1]
    back, _ = run_plan(tmp_path / "rival.h5", replace(size, rival=planar_fit), tmp_path / "b.h5")
    assert back.promised.name[-1].startswith("difference to the model without")
    assert back.promised.promised[-1] == pytest.approx(found.promised.promised[-1], rel=0.1)
    for wrong, said in (
        (replace(size, rival=planar_fit), "the same effects"),
        (replace(size, rival=tmp_path / "rival.h5", target=("joint1.rz.stiffness",)), "with a target"),
    ):
        with pytest.raises(InputError, match=said):
            run_plan(planar_fit, wrong, tmp_path / "x.h5")
