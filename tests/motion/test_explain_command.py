"""`identify explain` from the command line: result, reports, and refusals in a sentence."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import InputError, InputErrors
from identify.core.part_file import PartFile
from identify.explain.run import run_explain
from identify.explain.study import read_explain_study
from identify.fitting.memory import Memory
from identify.fitting.selection.workbench import Story
from identify.reports.write import write_reports
from identify.results import file as result_file
from identify.results.explain import ExplainResult
from identify.results.fit import FitResult
from tests.motion.hidden_drive import Hidden, Motion, study
from tests.reports.pdf_text import lines
from tests.shared import shared

FRICTION = "[coulomb-friction, viscous-friction, sensor-latency]"


def _friction(m: Motion) -> np.ndarray:
    return 1.5 * np.sign(m.v) + m.v


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return study(
        tmp_path_factory.mktemp("study"),
        2,
        Hidden((_friction,), latency_s=(0.004, 0.004, 0, 0, 0)),
        effects=FRICTION,
    )


@pytest.fixture(scope="module")
def written(config: Path) -> Path:
    path = config.with_name("run.h5")
    found = CliRunner().invoke(app, ["explain", str(config), "--out", str(path)])
    assert found.exit_code == 0, found.output
    assert "Coulomb friction of joint 1" in " ".join(found.output.split())
    assert "These records cannot say" in found.output
    return path


def test_an_interrupted_run_goes_on_to_the_same_end_bit_for_bit(
    config: Path, written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Interrupted while the deflection is explained; what was computed before is not computed again."""

    def stop(sentence: str) -> None:
        if sentence.startswith("deflection: latency"):
            raise KeyboardInterrupt

    out = tmp_path / "run.h5"
    with pytest.raises(KeyboardInterrupt):
        run_explain(config, out, Story(say=stop))
    part = PartFile.read(tmp_path / "run.h5.part")
    assert part is not None
    before = len(part.records)
    computed: list[str] = []
    recalled = Memory.recall

    def counting(memory: Memory, key: str, compute: Callable[[], Any]) -> Any:
        if key not in memory:
            computed.append(key)
        return recalled(memory, key, compute)

    monkeypatch.setattr(Memory, "recall", counting)
    rest, _ = run_explain(config, out, resume=True)
    whole = result_file.read(written, ExplainResult)
    assert 0 < len(computed) < before
    for target, found in whole.targets.items():
        assert np.array_equal(rest.targets[target].values.value, found.values.value)
        assert np.array_equal(rest.targets[target].effects.evidence, found.effects.evidence)
        assert np.array_equal(rest.targets[target].rms_judge, found.rms_judge)
    assert rest.verdict == whole.verdict
    computed.clear()
    again, _ = run_explain(config, out, resume=True)
    assert again.seconds == rest.seconds
    assert not computed


def test_several_processes_find_the_same_bit_for_bit(
    config: Path, written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And compute ahead some of what the loop asks for: it finds that in its memory."""
    own: list[str] = []
    every: list[str] = []
    recalled, kept = Memory.recall, Memory.__setitem__

    def counting(memory: Memory, key: str, compute: Callable[[], Any]) -> Any:
        if key not in memory:
            own.append(key)
        return recalled(memory, key, compute)

    def keeping(memory: Memory, key: str, value: Any) -> None:
        every.append(key)
        kept(memory, key, value)

    monkeypatch.setattr(Memory, "recall", counting)
    monkeypatch.setattr(Memory, "__setitem__", keeping)
    found, _ = run_explain(config, tmp_path / "two.h5", workers=2)
    assert len(own) < len(every) == len(set(every))
    whole = result_file.read(written, ExplainResult)
    for target, one in whole.targets.items():
        other = found.targets[target]
        assert np.array_equal(other.values.value, one.values.value)
        assert np.array_equal(other.effects.evidence, one.effects.evidence)
        assert np.array_equal(other.rms_judge, one.rms_judge)
    assert found.verdict == whole.verdict


def test_the_result_is_kept_whole(written: Path) -> None:
    kept = result_file.read(written, ExplainResult)
    torque, deflection = kept.targets["torque"], kept.targets["deflection"]
    assert len(torque.effects.name) == 4
    assert deflection.effects.kind == ("sensor-latency",) * 2
    assert torque.explained.min() > 0.95
    assert torque.curves["validate"].measured.shape == (1500, 2)
    assert len(kept.provenance.input_files) == 3
    with pytest.raises(InputError, match="an explained motion"):
        result_file.read(written, FitResult)


def test_reports_say_what_the_result_says(written: Path) -> None:
    page, printed = (written.with_suffix(suffix) for suffix in (".html", ".pdf"))
    kept = result_file.read(written, ExplainResult)
    text = page.read_text("utf-8")
    for sentence in (*kept.verdict, kept.targets["torque"].effects.sentence[0]):
        assert sentence.replace("'", "&#39;") in text
    flat = " ".join(lines(printed))
    assert "What these records do not determine" in flat
    assert kept.targets["torque"].effects.sentence[0] in flat
    before = page.read_bytes(), printed.read_bytes()
    write_reports(written)
    assert (page.read_bytes(), printed.read_bytes()) == before


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("use: validate", "use: fit", "one with `use: validate`"),
        ("name: hidden", "name: hidden\nspeed: 3", "speed"),
        (FRICTION, "[friction]", "unknown kind 'friction'"),
        ("time: {at: time_s}", "sample_rate_hz: 0", "greater than 0"),
    ],
)
def test_configs_that_say_something_impossible(
    config: Path, tmp_path: Path, old: str, new: str, said: str
) -> None:
    bad = tmp_path / "bad.yaml"
    text = config.read_text()
    assert old in text
    bad.write_text(text.replace(old, new))
    with pytest.raises((InputError, InputErrors), match=re.escape(said)):
        read_explain_study(bad)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("a.csv", "absent.csv", "put the data there"),
        ("gear_ratio: [160.0, 180.0]", "gear_ratio: [160.0]", "2, one per joint"),
        ("'torque{joint}'", "'force{joint}'", "nothing of that name"),
        ("stationary_below_deg_per_s: 0.5", "joints: [4]", "unknown joint 4"),
        (
            "stationary_below_deg_per_s: 0.5",
            "standing_deg_per_s: 0.5",
            "expected `stationary_below_deg_per_s`",
        ),
        ("stationary_below_deg_per_s: 0.5", "lowpass_hz: 80", "below 62.5 Hz"),
    ],
)
def test_studies_that_cannot_be_run(config: Path, old: str, new: str, said: str) -> None:
    bad = config.with_name("bad.yaml")
    text = config.read_text()
    assert old in text
    bad.write_text(text.replace(old, new))
    with pytest.raises((InputError, InputErrors), match=re.escape(said)):
        run_explain(bad, config.with_name("bad.h5"))


def test_measured_records_of_a_kr300(tmp_path: Path) -> None:
    """The main effects alone, at a fifth of the sample rate: agreement of two trajectories, and of axes that
    are built alike.
    """
    folder = shared("data", "kuka_kr300_weigand")
    text = (Path(__file__).parents[2] / "configs" / "kuka_kr300.yaml").read_text()
    text = text.replace("../../shared/data/kuka_kr300_weigand", str(folder)).replace(
        "../data", str(Path(__file__).parents[2] / "data")
    )
    kinds = "[coulomb-friction, viscous-friction, gravity-balancer, sensor-latency, joint-compliance]"
    config = tmp_path / "kr300.yaml"
    config.write_text(text + f"effects: {kinds}\nresample_hz: 50\n")
    found = run_explain(config, tmp_path / "out.h5")[0]
    torque, deflection = found.targets["torque"], found.targets["deflection"]
    assert {"joint2.gravity-balancer", "joint1.viscous-friction", "joint2.coulomb-friction"} <= set(
        torque.effects.name
    )
    assert torque.explained.min() > 0.7
    latencies = [
        value
        for value, name in zip(deflection.values.value, deflection.values.name, strict=True)
        if name == "latency"
    ]
    assert len(latencies) == 3
    assert np.allclose(latencies, 3.05e-3, atol=1e-4)
    assert deflection.explained.min() > 0.95
