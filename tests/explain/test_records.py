"""Real logs: several records of a use, uneven time stamps, and noise told from ripple."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from identify.core.correlated import white_level
from identify.core.errors import InputError, InputErrors
from identify.explain.run import run_explain
from identify.explain.study import read_explain_study
from identify.reports.explain.tables import residual_table
from identify.results import file as result_file
from identify.results.explain import ExplainResult
from tests.motion.hidden_drive import ZERO_DEG, Hidden, move, record, study

ROOT = Path(__file__).parents[2]
KINDS = "[coulomb-friction, viscous-friction, joint-compliance, sensor-latency]"
_HIDDEN = Hidden((lambda m: 0.3 * np.sign(m.v) + 0.5 * m.v,), latency_s=(0.004,) * 5)


def _more(folder: Path, config: Path, records: str, **records_of: int) -> Path:
    """The study with further records of other seeds."""
    for name, seed in records_of.items():
        record(folder / f"{name}.csv", seed, 2, _HIDDEN)
    text = config.read_text()
    old = "records: [{name: A, file: a.csv}, {name: B, file: b.csv, use: validate}]"
    assert old in text
    path = folder / "more.yaml"
    path.write_text(text.replace(old, f"records: [{records}]"))
    return path


FOUR = (
    "{name: A, file: a.csv}, {name: C, file: c.csv}, {name: B, file: b.csv, use: validate},"
    " {name: D, file: d.csv, use: validate}"
)


def test_several_records_to_fit_and_several_to_judge_narrow_the_intervals(tmp_path: Path) -> None:
    config = study(tmp_path, 2, _HIDDEN, effects=KINDS, resample_hz=50)
    one, _ = run_explain(config, tmp_path / "one.h5")
    four, path = run_explain(_more(tmp_path, config, FOUR, c=31, d=32), tmp_path / "four.h5")
    for target in ("torque", "deflection"):
        assert set(four.targets[target].effects.name) == set(one.targets[target].effects.name)
        widths = [r.targets[target].values.high_95 - r.targets[target].values.low_95 for r in (one, four)]
        assert np.median(widths[0]) > 1.1 * np.median(widths[1])
    kept = result_file.read(path, ExplainResult).targets["deflection"]
    assert [curves.name for curves in kept.curves.values()] == ["A", "C", "B", "D"]
    assert list(kept.curves) == ["fit", "fit 2", "validate", "validate 2"]
    assert kept.curves["fit 2"].time_s[0] == 0


def test_a_record_for_testing_is_reported_and_nothing_depends_on_it(tmp_path: Path) -> None:
    """One that has nothing of what the others have gets worse; all else is the same, also with processes."""
    config = study(tmp_path, 2, _HIDDEN, effects=KINDS, resample_hz=50)
    record(tmp_path / "clean.csv", 41, 2, Hidden())
    tests = ", {name: C, file: c.csv, use: test}, {name: D, file: clean.csv, use: test}"
    pair = "{name: A, file: a.csv}, {name: B, file: b.csv, use: validate}"
    plain, _ = run_explain(config, tmp_path / "plain.h5")
    tested, path = run_explain(_more(tmp_path, config, pair + tests, c=33), tmp_path / "tested.h5", workers=2)
    before, after = plain.targets["torque"], tested.targets["torque"]
    assert after.effects.name == before.effects.name
    assert np.array_equal(after.values.value, before.values.value)
    assert not before.tests
    kept = result_file.read(path, ExplainResult).targets["torque"].tests
    assert kept["C"].explained.min() > 0.9
    assert kept["D"].explained.max() < 0
    assert any("On test record C" in sentence for sentence in tested.verdict)
    table = residual_table(result_file.read(path, ExplainResult).targets["torque"])
    assert [column.heading for column in table.columns][-4:] == [
        "C, before",
        "C, after",
        "D, before",
        "D, after",
    ]
    assert "Only reported: C and D" in table.note


@pytest.mark.parametrize(
    ("records", "more", "said"),
    [
        (FOUR, "positions: relative", "waves over an angle begin elsewhere"),
        (FOUR.replace("validate", "test"), "", "one with `use: validate`"),
        (FOUR.replace("name: D", "name: C").replace("d.csv, use: validate", "d.csv, use: test"), "", "'C'"),
    ],
)
def test_uses_that_do_not_fit_together(tmp_path: Path, records: str, more: str, said: str) -> None:
    config = _more(tmp_path, study(tmp_path, 2, Hidden()), records)
    config.write_text(config.read_text() + more + "\n")
    with pytest.raises(InputErrors, match=said):
        read_explain_study(config)


def test_records_in_a_row_have_one_sample_rate(tmp_path: Path) -> None:
    config = _more(tmp_path, study(tmp_path, 2, _HIDDEN, effects=KINDS), FOUR, c=31, d=32)
    data = (tmp_path / "c.csv").read_text().splitlines()
    (tmp_path / "c.csv").write_text("\n".join([data[0], *data[1::2]]) + "\n")
    with pytest.raises(InputError, match="different sample rates"):
        run_explain(config, tmp_path / "out.h5")


def _jittered(path: Path, seed: int, gap: float = 0.0) -> None:
    """A record of the arm without anything hidden but a latency, stamped 2 to 16 ms apart; gap: s without a
    sample in its middle.
    """
    rng = np.random.default_rng(seed)
    base = move(seed, 2, 25.0)
    steps = rng.uniform(0.002, 0.016, 1300)
    steps[650] += gap
    time = np.cumsum(steps) + 0.2
    time = time[time < 11.5]
    step = 1e-4
    q = base.at(time)
    v = (base.at(time + step) - base.at(time - step)) / (2 * step)
    link = base.at(time - 0.004)
    names, columns = ["time_s"], [time]
    for joint in range(2):
        rigid = np.interp(time, base.time, base.rigid[:, joint]) / (160.0, 180.0)[joint]
        names += [f"{what}{joint + 1}" for what in ("position", "speed", "torque", "link")]
        zero = ZERO_DEG[joint]
        columns += [np.degrees(q[:, joint]) - zero, np.degrees(v[:, joint])]
        columns += [rigid + rng.normal(scale=0.02, size=len(time)), np.degrees(link[:, joint]) - zero]
    np.savetxt(
        path, np.column_stack(columns), delimiter=",", header=",".join(names), comments="", fmt="%.12g"
    )


def test_jittered_stamps_are_resampled_where_the_study_asks_for_it(tmp_path: Path) -> None:
    config = study(tmp_path, 2, Hidden(), effects="[sensor-latency]", resample_hz=100)
    for seed, name in ((51, "a.csv"), (52, "b.csv")):
        _jittered(tmp_path / name, seed, gap=0.3)
    found, _ = run_explain(config, tmp_path / "out.h5")
    deflection = found.targets["deflection"]
    assert deflection.values.value == pytest.approx([0.004, 0.004], rel=0.02)
    treated = " ".join(found.conditioning)
    assert re.search(r"time stamps 2(\.\d+)? to 3\d\d ms apart \(mean 9\.\d+", treated)
    assert "1 gaps longer than 25 ms" in treated
    used = deflection.curves["fit"]
    gap = np.flatnonzero(~used.used[100:-100, 0])
    assert 25 < len(gap) < 80
    config.write_text(config.read_text().replace("resample_hz: 100\n", ""))
    with pytest.raises(InputError, match="resample_hz"):
        run_explain(config, tmp_path / "out.h5")


def test_times_that_go_back_are_refused(tmp_path: Path) -> None:
    config = study(tmp_path, 2, Hidden(), effects="[sensor-latency]", resample_hz=100)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    lines[10], lines[11] = lines[11], lines[10]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match="does not rise, at sample 11"):
        run_explain(config, tmp_path / "out.h5")


def test_the_noise_level_is_the_same_for_slow_and_fast_records() -> None:
    """Ripple of eight waves per motor turn at three speeds; without the speed it counts as noise."""
    levels: list[list[float]] = [[], []]
    for number, top in enumerate((0.05, 0.3, 0.9)):
        time = np.arange(3000) / 250.0
        angle, speed = top * np.sin(time), top * np.cos(time)
        noise = np.random.default_rng(number).normal(scale=0.05, size=len(time))
        torque = noise + 0.6 * speed * np.cos(8 * 250 * angle)
        used = np.abs(speed) > 0.002
        for found, known in zip(levels, (speed, None), strict=True):
            found.append(white_level(torque, used, known))
    assert levels[0] == pytest.approx([0.05] * 3, rel=0.35)
    assert max(levels[1]) > 1.6 * max(levels[0])


def test_a_joint_that_stands_all_the_time_is_named(tmp_path: Path) -> None:
    data = ROOT / "data/joint_runs"
    table = np.genfromtxt(data / "judge.csv", delimiter=",", skip_header=1)
    table[:, [1, 4]] = table[0, [1, 4]]
    names = (data / "judge.csv").read_text().splitlines()[0]
    np.savetxt(tmp_path / "stands.csv", table, delimiter=",", header=names, comments="", fmt="%.10g")
    (tmp_path / "study.yaml").write_text(f"""schema: identify-explain/1
name: stands
robot: {{dh: '{data / "robot.yaml"}'}}
drives: {{gear_ratio: [180, 160, 140], rotor_inertia_kg_m2: [0.012, 0.012, 0.008]}}
records:
  - {{name: A, file: '{data / "excited.csv"}', use: fit}}
  - {{name: B, file: stands.csv, use: validate}}
signals:
  motor_position: {{at: "joint{{joint}}.motor_rad", unit: rad}}
  motor_torque: {{at: "joint{{joint}}.torque_N_m", unit: N m}}
time: {{at: time_s, unit: s}}
lowpass_hz: 10
""")
    with pytest.raises(InputError, match="record B: joint 1 stands all the time"):
        run_explain(tmp_path / "study.yaml", tmp_path / "run.h5")
