"""Each of the commonest mistakes has a hypothesis that puts it right, and the right study needs none."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.measured.correction import Correction, turned
from identify.measured.frf_records import FrfFileOptions
from identify.measured.loaders import load_frf_set
from identify.measured.uff.write import write_uff58
from identify.robot.units import POUND_KG
from identify.setup.bounds import sag, too_stiff
from identify.setup.constants import nearest
from identify.setup.kinds.readout import radians_per_second
from identify.setup.registry import KINDS
from identify.setup.score import Score, scored
from identify.setup.stated import Stated
from identify.vibration.given import base_axes
from tests.setup import studies


def _moved(number: int, by: float) -> list[dict[str, Any]]:
    measurements = studies.each()
    for one in measurements:
        one["posture_deg"] = [a + by * (n == number - 1) for n, a in enumerate(one["posture_deg"])]
    return measurements


def _angles(change: Any) -> list[dict[str, Any]]:
    return [{**one, "posture_deg": change(one["posture_deg"])} for one in studies.each()]


def _mixed() -> list[dict[str, Any]]:
    first, second = studies.each()
    return [{**first, "posture_deg": second["posture_deg"]}, {**second, "posture_deg": first["posture_deg"]}]


NODES: dict[str, float | str] = {
    f"{one}:+{axis}": f"{other}:+{axis}" for one, other in ((4, 9), (9, 4)) for axis in "XYZ"
}
TOLD: dict[str, tuple[list[dict[str, Any]], str, str]] = {
    "order reversed": (_angles(lambda a: a[::-1]), "joint-order", "last joint"),
    "one sign": (_angles(lambda a: [a[0], -a[1], *a[2:]]), "joint-sign", "joint 2"),
    "offset of 90": (_moved(2, -90), "joint-zero", "joint 2 of the robot file is at 90"),
    "postures mixed up": (_mixed(), "postures", "mixed up"),
    "radians": (_angles(lambda a: np.radians(a).tolist()), "radians", "radians"),
    "from the ground": (_angles(lambda a: [*a[:2], a[2] + a[1], *a[3:]]), "from-ground", "from link 2"),
}
"""What is stated of the measurements, and the code and words of the hypothesis."""
READ: dict[str, tuple[Correction, str, str]] = {
    "points exchanged": (Correction(outputs=NODES), "points-exchanged", "4 and 9"),
    "sign of a channel": (Correction(outputs={"9:+Y": -1.0}), "sensor-sign", "9:+Y"),
    "cube": (Correction(outputs={"9:+X": "9:+Y", "9:+Y": "9:-X"}), "sensor-turned", "point 9"),
    "force by ten": (Correction(inputs={"14:+Y": 10.0}), "size", "14:+Y"),
    "forces over responses": (Correction(inverse=True), "inverse", "1/H"),
    "velocities": (Correction(quantity="mobility"), "quantity", "accelerations"),
}
"""What the files make of the FRFs."""


def _in_the_room(folder: Path) -> list[dict[str, Any]]:
    """Files whose channels are along the axes of the base."""
    found = studies.each()
    problem = studies.right()[0].problem()
    for one, m in zip(found, problem.measurements, strict=True):
        engine = m.system.site.engine
        axes = {node: base_axes(engine, point).T for node, point in problem.points.items()}
        path = folder / Path(one["file"]).name
        data = studies.frfs(path.name)
        told = turned(data, axes, path.name)
        write_uff58(path, replace(told, coherence=data.coherence, noise=None))
        one["file"] = str(path)
    return found


def _shifted(folder: Path) -> str:
    """A points file with every point on the link before its own."""
    names = ["base_link", *(f"link{n}" for n in range(1, 7))]
    before = dict(zip(names[1:], names, strict=False))
    head, *rows = (studies.DATA / "points.csv").read_text().splitlines()
    moved = [row.split(",") for row in rows]
    lines = [",".join([*row[:2], before.get(row[2], row[2]), *row[3:]]) for row in moved]
    (folder / "points.csv").write_text("\n".join([head, *lines, ""]))
    return str(folder / "points.csv")


def _in_pounds(folder: Path) -> dict[str, str]:
    """A robot file whose masses, not inertias, are in pounds."""
    text = (studies.DATA / "robot.urdf").read_text()
    pounds = re.sub(r'mass value="([^"]*)"', lambda m: f'mass value="{float(m[1]) / POUND_KG:.9g}"', text)
    (folder / "robot.urdf").write_text(pounds)
    return {"urdf": str(folder / "robot.urdf")}


FILES: dict[str, tuple[str, Callable[[Path], Any], str, str]] = {
    "axes of the room": ("measurements", _in_the_room, "axes", "axes of the base"),
    "links shifted": ("points", _shifted, "links-shifted", "next link"),
    "masses in pounds": ("robot", _in_pounds, "robot-units", "masses of the robot file are in pounds"),
}
"""The key with files of its own, and the code and words of the hypothesis."""


@pytest.fixture
def right() -> tuple[Stated, Score]:
    return studies.right()


def test_the_right_study_explains_its_data(right: tuple[Stated, Score]) -> None:
    assert right[1].cost < 1.0
    assert abs(right[1].level) < 0.05
    assert not too_stiff(right[1])


@pytest.mark.parametrize("name", [*TOLD, *READ, *FILES])
def test_a_mistake_has_its_hypothesis(name: str, tmp_path: Path, right: tuple[Stated, Score]) -> None:
    key: str = "measurements"
    told: Any
    if name in TOLD:
        told, code, words = TOLD[name]
    elif name in READ:
        correction, code, words = READ[name]
        told = studies.misread(tmp_path, correction)
    else:
        key, make, code, words = FILES[name]
        told = make(tmp_path)
    wrong = studies.of(tmp_path, studies.config(**{key: told}))
    plain = scored(wrong.problem())
    assert plain.cost > 1.2 * right[1].cost
    found = [one for one in KINDS[_HOLDING.get(code, code)](wrong, plain) if one.code == code]
    named = [one for one in found if words in one.sentence]
    assert named, [one.sentence for one in found]
    problems = [wrong.changed(one.edits).problem() for one in named]
    cost = min(scored(problem, start).cost for problem in problems for start in (None, plain.values))
    assert cost < _AS_GOOD.get(name, 1.05) * right[1].cost


_AS_GOOD = {"links shifted": 1.25}
"""Points of the base are on it whichever link is told."""
_HOLDING = {"sensor-sign": "sensor-turned", "size": "sizes", "links-shifted": "links"}
"""The kind that yields hypotheses of other codes."""


@pytest.mark.parametrize(
    ("wrong", "kind", "said"),
    [
        (Correction(outputs={"9:+X": -1.0}), "sensor-turned", "channel 9:+X has the other sign"),
        (Correction(inputs={"14:+Y": -1.0}), "sizes", "the force at 14:+Y has the other sign"),
    ],
)
def test_what_is_reversed_is_seen_along_the_axes_of_the_base(
    wrong: Correction, kind: str, said: str, tmp_path: Path
) -> None:
    measurements = _in_the_room(tmp_path)
    for one in measurements:
        path = Path(one["file"])
        write_uff58(path, wrong.applied(load_frf_set(path, FrfFileOptions()), path.name))
        one["correct"] = {"axes": "base"}
    told = studies.of(tmp_path, studies.config(measurements=measurements))
    plain = scored(told.problem())
    [found] = [one for one in KINDS[kind](told, plain) if one.sentence == said]
    assert scored(told.changed(found.edits).problem(), plain.values).cost < 0.5 * plain.cost


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1 / 9.80665, "in g where"), (10.0, "by ten"), (1000.0, "mm"), (4.448, "lbf"), (2.2046, "pounds")],
)
def test_a_common_factor_is_read_off(
    factor: float, words: str, tmp_path: Path, right: tuple[Stated, Score]
) -> None:
    """g labelled m/s^2, the hammer's sensitivity, mm/s^2, lbf, and a robot in pounds."""
    wrong = studies.of(tmp_path, studies.config(measurements=studies.each(correct={"factor": factor})))
    plain = scored(wrong.problem())
    assert plain.cost == pytest.approx(right[1].cost, rel=0.05), "a factor hides no other mistake"
    assert words in " ".join(nearest(np.exp(plain.level)).reasons)


def test_frequencies_in_rad_per_s_are_seen_by_the_drives(tmp_path: Path) -> None:
    """Accelerances are the same functions of scaled frequencies, so only the size of stiffnesses tells."""
    right = studies.of(tmp_path, studies.config(measurements=studies.each(correct={"frequency": "rad/s"})))
    stiff = scored(right.problem())
    assert sag(stiff) > sag(studies.right()[1])  # what was read as rad/s is lower by 2 pi
    assert not list(radians_per_second(right, stiff)), "it is stated already"


def test_a_force_that_is_off_beside_a_common_factor_is_told_from_it(tmp_path: Path) -> None:
    """The common factor of a fit is between that of this force and that of the others."""
    force = str(studies.frfs().inputs[0])
    wrong = studies.each(correct={"factor": 4.448, "inputs": {force: 10.0}})
    told = studies.of(tmp_path, studies.config(measurements=wrong))
    found = [
        one for one in KINDS["sizes"](told, scored(told.problem())) if f"the force at {force}" in one.sentence
    ]
    best = max(found, key=lambda one: one.promise).sentence
    assert best in [f"the force at {force} reads {factor} times what it should" for factor in (9.807, 10)]
