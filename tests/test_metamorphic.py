"""One hammer test told in many ways gives the same joints: whatever says the same must not change the answer.

The test is simulated by the generator (data/arm_hammer_test), two of its sensors at one posture. Said again
without a loss, its joints are the same to a millionth; with fewer lines or digits, within a few of their
standard deviations.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.discovery.records import timed
from identify.fitting.fit import check_moves, fit
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import FrfFileOptions, load_frf_set
from identify.model.effects.pre_trigger import PRE_TRIGGER
from identify.vibration import records
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.records import check_records, with_records
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap
from tests.robots_otherwise import OTHERWISE, Described

DATA = Path(__file__).parents[1] / "data" / "arm_hammer_test"
TRUTH = json.loads((DATA / "truth.json").read_text())
NODES, POSTURE, DECAY = (6, 9, 14), [13.4, 10.2, -1.9, 8.0, 50.0, 8.4], 1.226
EXACT, NEAR = 1e-6, 4e-3


@dataclass(frozen=True)
class Told:
    """What a user has: files by name, each of a set with the unit it is written in, points, and what the
    study says; digits: of the numbers written.
    """

    files: dict[str, tuple[FrfSet, str]]
    points: list[dict[str, Any]]
    posture_deg: tuple[float, ...] = tuple(POSTURE)
    options: tuple[tuple[str, Any], ...] = ()
    digits: int = 17
    shuffled: bool = False


@cache
def plain() -> Told:
    whole = load_frf_set(DATA / "posture1.uff", FrfFileOptions(averages=4, window_decay_per_s=DECAY))
    chosen = [n for n, channel in enumerate(whole.outputs) if channel.node in NODES]
    with (DATA / "points.csv").open() as file:
        points = [row for row in csv.DictReader(file) if int(row["node"]) in {*NODES, 13, 14}]
    return Told({"a.csv": (whole.pairs(chosen, [0, 1, 2]).band(3, 80), "m/s^2/N")}, points)


FACTORS = {"m/s^2/N": 1.0, "g/N": 9.80665, "mm/s^2/N": 1e-3, "m/s^2/kN": 1e-3}


def write(path: Path, data: FrfSet, unit: str, told: Told) -> None:
    """CSV in the long layout."""
    rows = [
        f"{f!r},{output},{force},{value.real:.{told.digits}g},{value.imag:.{told.digits}g},{coherence!r}"
        for i, output in enumerate(data.outputs)
        for j, force in enumerate(data.inputs)
        for f, value, coherence in zip(
            data.frequency_hz.tolist(),
            (data.frf[:, i, j] / FACTORS[unit]).tolist(),
            np.asarray(data.coherence)[:, i, j].tolist(),
            strict=True,
        )
    ]
    if told.shuffled:
        rows = [rows[n] for n in np.random.default_rng(1).permutation(len(rows))]
    path.write_text("\n".join([f"# unit: {unit}", "frequency_hz,output,input,real,imag,coherence", *rows]))


def study(told: Told, folder: Path) -> Path:
    with (folder / "points.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(told.points[0]))
        writer.writeheader()
        writer.writerows(told.points)
    options = {"posture_deg": list(told.posture_deg), "averages": 4, "window_decay_per_s": DECAY}
    for name, (data, unit) in told.files.items():
        write(folder / name, data, unit, told)
    stiffness = {"initial": [1.3 * k for k in TRUTH["k"]], "bounds": [1e3, 1e9]}
    damping = {"initial": [0.8 * c for c in TRUTH["c"]], "bounds": [0.1, 1e6]}
    config = {
        "schema": "identify/1",
        "robot": {"urdf": str(DATA / "robot.urdf")},
        "points": "points.csv",
        "measurements": [{"file": name, **options, **dict(told.options)} for name in told.files],
        "effects": [{"kind": "joint-compliance", "stiffness": stiffness, "damping": damping}],
        "starts": 1,
    }
    path = folder / "study.yaml"
    with path.open("w") as file:
        YAML(typ="safe").dump(config, file)
    return path


def joints(told: Told, folder: Path) -> tuple[Array, float, tuple[str, ...]]:
    """Values of all parameters, the gap, and what is said of the data."""
    problem = load_problem(read_study(study(told, folder)))
    problem, found = with_records(problem, fit(fit_plan(problem)))
    notes = tuple(note for t in problem.targets().frf for note in t.data.notes)
    return found.values, gap(problem.targets(), found.values), notes


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Array:
    values, level, notes = joints(plain(), tmp_path_factory.mktemp("plain"))
    assert values[::2] == pytest.approx(TRUTH["k"], rel=NEAR)
    assert (level < 1.06, notes) == (True, ())
    return values


def only(told: Told, change: Callable[[FrfSet], FrfSet]) -> Told:
    return replace(told, files={name: (change(data), unit) for name, (data, unit) in told.files.items()})


def permuted(told: Told) -> Told:
    return replace(only(told, lambda data: data.pairs([7, 1, 8, 3, 0, 5, 2, 6, 4], [2, 0, 1])), shuffled=True)


def split(told: Told) -> Told:
    data, unit = told.files["a.csv"]
    parts = {"x.csv": ([0], range(9)), "yz.csv": ([1, 2], range(4)), "rest.csv": ([1, 2], range(4, 9))}
    return replace(told, files={n: (data.pairs([*some], one), unit) for n, (one, some) in parts.items()})


def written_in(unit: str, by_key: bool = False) -> Callable[[Told], Told]:
    def change(told: Told) -> Told:
        files = {name: (data, unit) for name, (data, _) in told.files.items()}
        return replace(told, files=files, options=(("unit", unit),) if by_key else ())

    return change


def turned_sensors(told: Told) -> Told:
    """Sensors at 9 and 14 are turned by 90 degrees about z: they have x along y and y against x."""

    def change(data: FrfSet) -> FrfSet:
        def renamed(channel: Channel) -> Channel:
            if channel.node == 6 or channel.axis == 2:
                return channel
            return Channel(channel.node, 1 if channel.axis == 1 else -2)

        one = replace(data, outputs=tuple(map(renamed, data.outputs)))
        return replace(one, inputs=tuple(map(renamed, data.inputs)))

    angles = {"rx_deg": 0, "ry_deg": 0}
    points = [{**row, **angles, "rz_deg": 0 if row["node"] == "6" else 90} for row in told.points]
    return replace(only(told, change), points=points)


def against(told: Told) -> Told:
    """Half of the channels are named against their direction, with the sign that this gives."""

    def change(data: FrfSet) -> FrfSet:
        signs = np.where(np.arange(9) % 2, 1, -1)
        turned = [
            Channel(c.node, int(s) * c.direction) for c, s in zip(data.outputs, signs.tolist(), strict=True)
        ]
        return replace(data, frf=data.frf * signs[:, None], outputs=tuple(turned))

    return only(told, change)


def a_full_turn_on(told: Told) -> Told:
    return replace(told, posture_deg=tuple(angle + 360.0 for angle in told.posture_deg))


def record_told(told: Told) -> Told:
    return replace(told, options=(("record_s", 1 / 0.6252),))


@pytest.mark.parametrize(
    "change",
    [
        permuted,
        written_in("g/N"),
        written_in("mm/s^2/N"),
        written_in("m/s^2/kN", by_key=True),
        turned_sensors,
        against,
        a_full_turn_on,
    ],
    ids=lambda change: change.__qualname__.split(".")[0],
)
def test_the_same_told_otherwise_is_the_same(
    first: Array, tmp_path: Path, change: Callable[[Told], Told]
) -> None:
    values, _, notes = joints(change(plain()), tmp_path)
    assert values == pytest.approx(first, rel=EXACT)
    assert notes == ()


@pytest.mark.parametrize("name", OTHERWISE)
def test_the_same_robot_described_otherwise_is_the_same(first: Array, tmp_path: Path, name: str) -> None:
    path = study(plain(), tmp_path)
    one = Described.of((DATA / "robot.urdf").read_text(), (tmp_path / "points.csv").read_text(), [[*POSTURE]])
    OTHERWISE[name](one)
    robot, points = one.texts()
    (tmp_path / "robot.urdf").write_text(robot, encoding="utf-8")
    (tmp_path / "points.csv").write_text(points, encoding="utf-8")
    config = YAML(typ="safe").load(path.read_text())
    config["robot"] = {"urdf": "robot.urdf"}
    config["measurements"][0]["posture_deg"] = one.postures[0]
    with path.open("w") as file:
        YAML(typ="safe").dump(config, file)
    assert fit(fit_plan(load_problem(read_study(path)))).values == pytest.approx(first, rel=EXACT)


def every(number: int, begin: int = 0) -> Callable[[Told], Told]:
    """The lines exported that are multiples of so many of the record's first, or so many on from another."""
    return lambda told: only(
        told,
        lambda data: data.lines(np.round(data.frequency_hz / 0.6252).astype(int) % number == begin % number),
    )


def coherence_to(decimals: int) -> Callable[[Told], Told]:
    return lambda told: only(
        told,
        lambda data: replace(
            data,
            coherence=np.round(np.asarray(data.coherence), decimals)
            if decimals
            else np.ones_like(data.coherence),
        ),
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (split, ""),
        (every(2), "only every second line of records of 1.6 s"),
        (every(2, 1), ""),
        (every(3), "only every third line of records of 1.6 s"),
        (every(3, 1), ""),
        (coherence_to(3), "scatter between neighbouring lines"),
        (coherence_to(0), "is 1 at every line"),
        (lambda told: replace(told, digits=4), ""),
    ],
    ids=["split", "2nd", "2nd, off", "3rd", "3rd, off", "coherence to 3 decimals", "coherence 1", "4 digits"],
)
def test_fewer_lines_and_digits_give_the_same_within_noise(
    first: Array, tmp_path: Path, change: Callable[[Told], Told], said: str
) -> None:
    values, level, notes = joints(change(plain()), tmp_path)
    assert values[::2] == pytest.approx(first[::2], rel=NEAR)
    assert values[::2] == pytest.approx(TRUTH["k"], rel=NEAR)
    assert 0.8 < level < 1.2
    assert bool(notes) == bool(said)
    assert all(said in note for note in notes)


def test_a_record_that_is_told_is_taken_and_discovery_asks_for_it(tmp_path: Path) -> None:
    few = every(2)(plain())
    told = load_problem(read_study(study(record_told(few), tmp_path)))
    [frf] = told.targets().frf
    assert frf.record == pytest.approx(1 / 0.6252)
    problem = load_problem(read_study(study(few, tmp_path)))
    assert problem.targets().frf[0].record == pytest.approx(0.5 / 0.6252, rel=1e-3)
    found = fit(fit_plan(problem))
    assert gap(told.targets(), fit(fit_plan(told)).values) < found.cost - 0.02
    with pytest.raises(InputError, match=r"every second line of records of 1\.6 s.*record_s: 1\.5"):
        check_records(problem, found.values, found.cost)
    check_records(told, found.values, found.cost)


def test_a_pre_trigger_is_held_where_longer_records_have_died_out(tmp_path: Path) -> None:
    """A fit of such records was refused, in the middle of a discovery, because nothing moves it."""
    problem = timed(load_problem(read_study(study(plain(), tmp_path))))
    for times in (1, 60):
        there = records._held(records._longer(problem, times))
        [own] = [p for p in there.parameters if p.name == PRE_TRIGGER]
        assert own.free is (times == 1)
        plan = fit_plan(there)
        check_moves(plan.parameters, plan.objective)


@pytest.mark.parametrize(
    ("squares", "steps", "asked"), [(5.0, 3.0, True), (5.0, 1.0, False), (50.0, 3.0, False)]
)
def test_the_length_is_asked_for_where_another_is_as_likely_and_matters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, squares: float, steps: float, asked: bool
) -> None:
    """Where twice as long is so much less likely and moves a value by so many standard deviations."""
    problem = load_problem(read_study(study(plain(), tmp_path)))
    found = fit(fit_plan(problem))

    def ahead(there: Problem, values: Array) -> records._Ahead:
        twice = there.measurements[0].given.record > 2.0  # type: ignore[operator]
        step = np.where(np.arange(12) == 4, steps * twice, 0.0)
        return records._Ahead(1e4 + squares * twice, step, np.ones(12))

    monkeypatch.setattr(records, "_ahead", ahead)
    settled, _ = with_records(problem, found)
    notes = settled.targets().frf[0].data.notes
    assert bool(notes) == asked
    assert all(
        "1.6 s was assumed, but 2 times as long is" in note and "would move joint3.rz.stiffness by 3" in note
        for note in notes
    )
