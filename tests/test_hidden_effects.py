"""The true effect, added to the config, closes the gap on simulated hammer tests made outside this
project.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from identify.discovery.new_config import config_text
from identify.discovery.run import run_discover
from identify.fitting.selection.workbench import Story
from identify.model.effects.link_flexibility import LinkFlexibility
from identify.vibration.nuisances.settings import FORMS_ALONE
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.hidden import fitted, truth, write_config

CASES = {
    "absorber_l3_101": ["{kind: appended-resonator, link: link3, axis: y}"],
    "base_and_tilt_101": [
        "{kind: base-compliance, axes: [rx, ry]}",
        "{kind: joint-compliance, joints: [3], axes: [rx, ry]}",
    ],
    "delay_101": ["{kind: time-delay}"],
    "payload_101": ["{kind: added-mass, link: link6, extent: body}"],
    "polarity_101": ['{kind: channel-polarity, channel: "link5_2:+Y"}'],
    "radial_j2_101": ["{kind: joint-compliance, joints: [2], axes: [tx, ty]}"],
    "tilt_j2_101": ["{kind: joint-compliance, joints: [2], axes: [rx, ry]}"],
}


@pytest.mark.parametrize("case", CASES)
def test_the_true_effect_leaves_noise_and_the_true_stiffness(case: str, tmp_path: Path) -> None:
    lines = [f"  - {effect}" for effect in CASES[case]]
    result = fitted(case, tmp_path, "\n".join([*lines, "starts: 1"]))
    value = result.values
    assert result.gap < 1.2
    assert result.gap_validation < 1.4
    assert [value[f"joint{n}.rz.stiffness"] for n in range(1, 7)] == pytest.approx(truth(case)["k"], rel=0.01)
    if case == "delay_101":
        assert value["responses.delay"] == pytest.approx(truth(case)["effects"][0]["seconds"], rel=0.01)
    if case == "payload_101":
        assert value["link6.mass"] == pytest.approx(truth(case)["effects"][0]["mass_kg"], rel=0.005)


@pytest.mark.parametrize("wrong", ["joints: [3], axes: [rx, ry]"])
def test_a_wrong_effect_does_not(wrong: str, tmp_path: Path) -> None:
    extra = f"  - {{kind: joint-compliance, {wrong}}}\nstarts: 1"
    assert fitted("tilt_j2_101", tmp_path, extra).gap > 10


def test_a_beam_stands_for_a_chain_of_segments(tmp_path: Path) -> None:
    """The truth is a chain of four; at least 85 % of what is above noise must go, on fitted and on validation
    data.
    """
    gaps = []
    for extra in ("", "  - {kind: link-flexibility, link: link2}\n"):
        result = fitted("link2_flex_101", tmp_path, extra + "starts: 1")
        gaps.append((result.gap, result.gap_validation))
    for before, after in zip(*gaps, strict=True):
        assert after - 1 < 0.15 * (before - 1)


def test_a_form_that_was_fitted_along_is_in_the_new_study(tmp_path: Path) -> None:
    file = read_study(write_config("link2_flex_101", tmp_path))
    searched = file.model_copy(update={"study": file.study.model_copy(update={"uncertainty": FORMS_ALONE})})
    found = (LinkFlexibility(link="link2", nonuniform=True), "found")
    text = config_text(searched, [found], {}, tmp_path)
    assert "its form was fitted" in text
    (tmp_path / "new.yaml").write_text(text)
    again = load_problem(read_study(tmp_path / "new.yaml"))
    assert again.nuisances.entries
    assert {one.group for one in again.nuisances.entries} == {"form"}


@pytest.mark.exam
def test_the_form_of_a_chain_of_segments_is_fitted_along(tmp_path: Path) -> None:
    """No beam is quite a link, and the new study says so; four of the fourteen sensors show it."""
    config = write_config("link2_flex_101", tmp_path, extra="starts: 1")
    seen = ", ".join(f'"{node}:+{axis}"' for node in (5, 6, 9, 14) for axis in "XYZ")
    text = config.read_text().replace("use:", f"outputs: [{seen}], use:")
    config.write_text(text.replace("band_hz: [3, 80]", "band_hz: [3, 45]"))
    result, written = run_discover(config, tmp_path / "found.h5", {}, Story(), workers=1, as_stated=True)
    assert result.added.sentence == ("flexibility of link2 (bending, torsion, nonuniform)",)
    assert result.after.gap < 1.06
    assert result.map_after.gap.max() < result.map_before.gap.max()
    assert "its form was fitted" in written[1].read_text()
    again = load_problem(read_study(written[1]))
    assert [one.group for one in again.nuisances.entries] == ["form"] * len(again.nuisances.entries)
    assert again.nuisances.entries
