"""The loop finds what is hidden in hammer tests that were simulated by a generator which shares no code with
it, and nothing else.  Set-ups are taken as stated: test_shipped.py has the search for what is wrong with them
before a discovery.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.discovery.loop import with_likelihood
from identify.discovery.run import run_discover
from identify.fitting.selection.workbench import Story
from identify.model.effects.pre_trigger import PreTrigger
from identify.results import file as result_file
from identify.results.discovery import DiscoveryResult, fit_of
from identify.vibration.costs.base import parse_cost
from identify.vibration.fitted_model import fitted_model
from identify.vibration.run import run_fit
from identify.vibration.study import read_study
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

pytestmark = pytest.mark.usefixtures("no_measured_modes")

CONFIG = Path(__file__).parents[2] / "configs" / "hidden_effects.yaml"
NODES = [5, 9, 12, 14]


def hidden(folder: Path, case: str, seed: int, nodes: Sequence[int] = NODES, postures: int = 3) -> Path:
    """A small hammer test with something hidden: two postures to fit, few points; its config."""
    arm = MAKES["compact"](seed).at_points(list(nodes))
    spec = TestSpec(arm=arm, seed=seed, postures=postures, averages=2, binary=True, linear=True)
    spec = hide(spec, case)
    generate(replace(spec, case=case), folder / case)
    return config_of(folder / case, folder, extra="starts: 1")


@pytest.fixture(scope="module")
def tilted(tmp_path_factory: pytest.TempPathFactory) -> tuple[DiscoveryResult, list[Path], list[str]]:
    """A joint that tilts, found: the result, what was written, what was said."""
    folder, said = tmp_path_factory.mktemp("tilt"), []
    config = hidden(folder, "tilt_j2", 3)
    out = folder / "out" / "found.h5"
    result, written = run_discover(config, out, {}, Story(say=said.append), workers=1, as_stated=True)
    return result, written, said


def test_the_hidden_effect_is_named_and_nothing_else(
    tilted: tuple[DiscoveryResult, list[Path], list[str]],
) -> None:
    result, _, said = tilted
    assert result.added.sentence == ("tilt compliance of joint 2 (rx, ry)",)
    assert result.before.gap > 3
    assert result.after.gap < 1.1
    assert result.after.gap_validation < 1.2
    assert "tilt compliance of joint 2" in result.verdict[0]
    assert re.search(r"joint2\.rx\.stiffness = \S+ N m/rad \(\S+ to \S+\)", result.added.named[0])
    assert any("tilt compliance of joint 2" in sentence for sentence in said)


def test_impacts_are_fitted_along_where_friction_leaves_what_they_explain(tmp_path: Path) -> None:
    spec = hide(
        TestSpec(
            MAKES["large"](1).at_points([6, 9, 14]),
            seed=3,
            postures=1,
            averages=2,
            sample_rate_hz=256.0,
            band_hz=(2.5, 45.0),
            oversampling=4,
        ),
        "friction_j2",
    )
    generate(replace(spec, case="rubbing", levels=(0.3, 3.0)), tmp_path / "rubbing")
    about = json.loads((tmp_path / "rubbing" / "test.json").read_text())
    for one in about["files"]:
        one["level_n"] *= 0.6 if one["level_n"] < 150 else 1.4
    (tmp_path / "rubbing" / "test.json").write_text(json.dumps(about))
    config = config_of(tmp_path / "rubbing", tmp_path, extra="starts: 1")
    result, written = run_discover(config, tmp_path / "found.h5", {}, Story(), workers=1, as_stated=True)
    assert result.added.sentence == ("dry friction of joint 2 (rz)",)
    assert result.after.gap < 1.1
    assert any("strengths and duration of the impacts" in sentence for sentence in result.verdict)
    [new] = [path for path in written if path.suffix == ".yaml"]
    again = read_study(new).study.uncertainty
    assert again is not None and again.std("impacts", "strength") == pytest.approx(0.1)
    assert again.std("links", "mass") == 0


def test_the_truth_is_in_the_intervals(tilted: tuple[DiscoveryResult, list[Path], list[str]]) -> None:
    result, written, _ = tilted
    truth = json.loads((written[0].parents[1] / "tilt_j2.truth.json").read_text())
    p = result.after.parameters
    for number, k in enumerate(truth["k"], start=1):
        row = p.name.index(f"joint{number}.rz.stiffness")
        assert p.value[row] == pytest.approx(k, rel=0.02)


def test_every_step_says_where_and_what(tilted: tuple[DiscoveryResult, list[Path], list[str]]) -> None:
    result, _, _ = tilted
    first = result.steps["0"]
    assert first.kept
    assert first.options.sentence[0] == first.best
    assert first.options.log_odds[0] > 50
    assert len(set(first.options.sentence)) == len(first.options.sentence)
    assert f"{first.gap:.2f} times the noise" in first.where
    shares = first.parts.share[[kind == "band" for kind in first.parts.kind]]
    assert shares.sum() == pytest.approx(1, abs=1e-6)
    assert first.decision.endswith("It was added.")


def test_start_values_are_those_of_the_study_and_the_effects(
    tilted: tuple[DiscoveryResult, list[Path], list[str]],
) -> None:
    result, written, _ = tilted
    asked = json.loads((written[0].parents[1] / "tilt_j2" / "test.json").read_text())[
        "initial_stiffness_nm_per_rad"
    ]
    for fitted in (result.before, result.after):
        p = fitted.parameters
        assert [
            p.initial[p.name.index(f"joint{n}.rz.stiffness")] for n in range(1, len(asked) + 1)
        ] == pytest.approx(asked)
        assert np.array_equal(fitted.starts.initial[0], p.initial)
        assert not np.allclose(p.initial, p.value, rtol=0.01)


def test_the_gap_shrinks_band_by_band(tilted: tuple[DiscoveryResult, list[Path], list[str]]) -> None:
    result, _, _ = tilted
    assert result.map_before.gap.shape == (
        3,
        len(result.map_before.bands_hz) - 1,
        len(result.map_before.channels),
    )
    assert np.nanmax(result.map_after.gap) < np.nanmax(result.map_before.gap) / 2
    assert np.nanmedian(result.map_after.gap) == pytest.approx(1, abs=0.2)


def test_the_new_config_starts_where_discovery_ended(
    tilted: tuple[DiscoveryResult, list[Path], list[str]], tmp_path: Path
) -> None:
    result, written, _ = tilted
    assert written[1].suffix == ".yaml"
    assert "found by identify discover" in written[1].read_text()
    refitted, _ = run_fit(written[1], tmp_path / "r.h5", {"starts": 1})
    assert refitted.gap == pytest.approx(result.after.gap, rel=1e-3)
    assert refitted.effects == result.after.effects


def test_the_result_file_holds_all_of_it(tilted: tuple[DiscoveryResult, list[Path], list[str]]) -> None:
    result, written, _ = tilted
    read = result_file.read(written[0], DiscoveryResult)
    assert read.verdict == result.verdict
    assert read.added.config == result.added.config
    assert np.array_equal(read.map_after.gap, result.map_after.gap, equal_nan=True)
    assert read.after.gap == fit_of(written[0]).gap == result.after.gap != result.before.gap
    effects = [effect.sentence() for effect in fitted_model(fit_of(written[0]), "found").effects]
    of_robot = [one for one in result.after.effects if one != PreTrigger().sentence()]
    assert effects == of_robot
    assert list(read.steps) == list(result.steps)


def test_a_finished_run_is_not_run_again(tilted: tuple[DiscoveryResult, list[Path], list[str]]) -> None:
    result, written, _ = tilted
    again, _ = run_discover(
        written[0].parents[1] / "tilt_j2.yaml", written[0], {}, Story(), workers=1, resume=True
    )
    assert again.seconds == result.seconds


def test_nothing_is_added_where_nothing_is_hidden(tmp_path: Path) -> None:
    result, written = run_discover(hidden(tmp_path, "none", 4), tmp_path / "found.h5", {}, Story(), workers=1)
    assert result.added.sentence == ()
    assert written == [tmp_path / "found.h5"]
    assert result.verdict[0].startswith("Nothing is missing")


@pytest.fixture(scope="module")
def delayed(tmp_path_factory: pytest.TempPathFactory) -> tuple[DiscoveryResult, Path]:
    """Late responses, found without measurements to validate with: the result, and the config."""
    folder = tmp_path_factory.mktemp("delay")
    config = hidden(folder, "delay", 3, NODES[1:], postures=2)
    result, _ = run_discover(config, folder / "r.h5", {}, Story(), workers=1, as_stated=True)
    return result, config


def test_without_validation_channels_are_left_out_instead(delayed: tuple[DiscoveryResult, Path]) -> None:
    result, _ = delayed
    assert result.added.sentence == ("time delay of all responses",)
    assert "held out" in result.elsewhere
    assert np.isfinite(result.steps["0"].gap_validation)


def test_an_interrupted_run_goes_on_to_the_same_end(
    delayed: tuple[DiscoveryResult, Path], tmp_path: Path
) -> None:
    """Interrupted once the dense fit has been made."""
    (whole, config), out = delayed, tmp_path / "parts.h5"

    def stop(sentence: str) -> None:
        if "refitted on all lines" in sentence:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_discover(config, out, {}, Story(say=stop), workers=1, as_stated=True)
    part = PartFile.read(tmp_path / "parts.h5.part")
    assert part is not None
    assert len(part.records) > 0
    rest, _ = run_discover(config, out, {}, Story(), workers=1, resume=True, as_stated=True)
    assert rest.added.sentence == whole.added.sentence != ()
    assert rest.added.config == whole.added.config
    assert rest.after.parameters.value.tolist() == whole.after.parameters.value.tolist()


def test_resume_refuses_another_study(tmp_path: Path) -> None:
    out, part = tmp_path / "r.h5", PartFile(tmp_path / "r.h5.part", "another")
    part.flush()
    with pytest.raises(InputError, match="another config"):
        run_discover(CONFIG, out, {}, Story(), workers=1, resume=True)


def test_modal_tables_alone_are_refused(tmp_path: Path) -> None:
    answer = CliRunner().invoke(
        app, ["discover", str(CONFIG.with_name("umons_tx200.yaml")), "--workers", "1"]
    )
    assert isinstance(answer.exception, InputError)
    assert "give the FRFs that the modes were found in" in str(answer.exception)


@pytest.mark.parametrize(
    ("cost", "said"),
    [("frf-area", "study's frf-area,"), ({"kind": "frf-least-squares", "residual": "log"}, "with options,")],
)
def test_the_likelihood_takes_the_place_of_another_cost(cost: object, said: str) -> None:
    """It was ignored, and the result gave the likelihood's value for it; then it was refused."""
    file = read_study(CONFIG.with_name("arm_hammer_test.yaml"))
    assert with_likelihood(file) == (file, "")
    study = file.study.model_copy(update={"cost": parse_cost(cost)})
    changed, note = with_likelihood(file.model_copy(update={"study": study}))
    assert changed.study == file.study and said in note
