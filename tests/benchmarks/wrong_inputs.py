"""Sixty mistakes that a new user makes, each through the installed program: what does it say?

    python -m tests.benchmarks.wrong_inputs [--only NAME] [--json FILE]

`wrong_inputs.yaml` says of each what is right: `named` (it goes on, and says what is wrong), `refused` (exit
code 2, with the right cause) or `harmless` (there is nothing wrong about it), and words that a right cause
has.  Seen are one of these, `wrong cause`, `silent` (a number without a word) or `traceback`.
`results/wrong_inputs.json` keeps the first score.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io
from ruamel.yaml import YAML

from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set
from tests.frf_files import write_csv
from tests.measured.uff_text import Dataset58, some_frf, text

ROOT = Path(__file__).parents[2]
ARM, JOINTS, NAGOYA = (ROOT / "data" / name for name in ("arm_hammer_test", "joint_runs", "nagoya_two_link"))
STUDY = """schema: identify/1
name: arm
robot: {urdf: robot.urdf}
points: points.csv
measurements:
  - {file: posture1.uff, posture_deg: [13.4, 10.2, -1.9, 8.0, 50.0, 8.4],
     averages: 4, window_decay_per_s: 1.226}
band_hz: [3, 80]
effects:
  - {kind: joint-compliance, joints: all, axes: [rz]}
starts: 1
"""
CHECK, FIT, MODES = ("check", "arm.yaml"), ("fit", "arm.yaml", "--no-report"), ("modes", "--no-report")
Words = tuple[str, ...]


@dataclass(frozen=True)
class Case:
    """A mistake: what is right, words of the right cause, and how it is made: by text that is changed in a
    study (`of`), by words behind `modes` and its data, by a command after a fit, or by the function of its
    name.
    """

    name: str
    about: str
    mistake: str
    right: str
    cause: str
    changes: tuple[tuple[str, str], ...] = ()
    of: str = "arm"
    words: Words = ()
    after: Words = ()

    def make(self, folder: Path) -> tuple[Words, ...]:
        """Writes its files into a folder; its commands, of which the first that refuses is the last."""
        if self.words:
            return ((*MODES, str(ARM / "posture1.uff"), *self.words),)
        if self.after:
            return (*arm(folder)[1:], self.after)
        made = globals()[self.of](folder, *self.changes) if self.changes else globals()[self.name](folder)
        return tuple(map(tuple, made))


@dataclass(frozen=True)
class Seen:
    """What became of a case."""

    name: str
    about: str
    mistake: str
    right: str
    seen: str
    exit_code: int
    said: str


def arm(folder: Path, *changes: tuple[str, str], file: str = "arm.yaml") -> tuple[Words, ...]:
    """The arm's study and files, one of which (`file`) has other text; checked and fitted."""
    (folder / "arm.yaml").write_text(STUDY)
    for path in ARM.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    (folder / file).write_text(changed((folder / file).read_text(), changes))
    return CHECK, FIT


def changed(text: str, changes: tuple[tuple[str, str], ...]) -> str:
    """A text with other words; ValueError where it does not have those that are to go."""
    for old, new in changes:
        if old not in text:
            raise ValueError(f"the text has no {old!r}")
        text = text.replace(old, new)
    return text


def scaled(folder: Path, what: str, factor: float) -> tuple[Words, ...]:
    """The arm whose robot file has all numbers of these attributes times a factor."""

    def times(found: re.Match[str]) -> str:
        return f'{found[1]}="{" ".join(f"{factor * float(n):.12g}" for n in found[2].split())}"'

    commands = arm(folder)
    text = re.sub(rf'\b({what})="([^"]*)"', times, (folder / "robot.urdf").read_text())
    (folder / "robot.urdf").write_text(text)
    return commands


def table(folder: Path, **changes: float) -> tuple[Words, ...]:
    """A study of single joints, a curve of static stiffness, whose Denavit-Hartenberg table has some numbers
    times a factor.
    """
    text = (JOINTS / "robot.yaml").read_text()
    for key, factor in changes.items():
        text = re.sub(rf"{key}: (-?[\d.]+)", lambda m, f=factor, k=key: f"{k}: {float(m[1]) * f:.10g}", text)  # type: ignore[misc]
    (folder / "robot.yaml").write_text(text)
    return joints(folder)


def joints(folder: Path, *changes: tuple[str, str]) -> tuple[Words, ...]:
    """The study of single joints with static stiffness and base parameters alone, with other text."""
    told = read((ROOT / "configs" / "joint_runs.yaml").read_text())
    told["curves"] = [c for c in told["curves"] if c["kind"] in ("stiffness-static", "base-parameters")]
    text = written(told).replace("../data/joint_runs", str(JOINTS))
    if (folder / "robot.yaml").exists():
        text = text.replace(str(JOINTS / "robot.yaml"), "robot.yaml")
    (folder / "arm.yaml").write_text(changed(text, changes))
    return CHECK, FIT


def motion(folder: Path, *changes: tuple[str, str]) -> tuple[Words, ...]:
    """One move of two elastic axes, simulated, with other text."""
    told = read((ROOT / "configs" / "nagoya_two_link.yaml").read_text())
    told["records"] = told["records"][4:5]
    del told["extrapolate"]  # which is refused beside counts
    text = written(told).replace("../data/nagoya_two_link", str(NAGOYA))
    (folder / "arm.yaml").write_text(changed(text, changes))
    return CHECK, ("simulate", "arm.yaml", "--no-report")


@cache
def frfs() -> FrfSet:
    """Six FRFs of the arm: two channels, three forces."""
    return load_frf_set(ARM / "posture1.uff").pairs([0, 12], [0, 1, 2])


def arrays() -> dict[str, object]:
    """The same under the names that HDF5 and MATLAB files have."""
    names = {
        side: np.array([str(c) for c in getattr(frfs(), side)], dtype=object)
        for side in ("outputs", "inputs")
    }
    return {"frequency_hz": frfs().frequency_hz, "frf": frfs().frf, "unit": "m/s^2/N", **names}


def wide(
    folder: Path, magnitude: Callable[[np.ndarray], np.ndarray], phase: Callable[[np.ndarray], np.ndarray]
) -> None:
    """A CSV file of the FRFs by magnitude and phase, as a spreadsheet would hold it."""
    columns = {"frequency_hz": frfs().frequency_hz}
    for i, output in enumerate(frfs().outputs):
        for j, force in enumerate(frfs().inputs):
            columns[f"{output}/{force} magnitude"] = magnitude(np.abs(frfs().frf[:, i, j]))
            columns[f"{output}/{force} phase_deg"] = phase(np.angle(frfs().frf[:, i, j]))
    rows = "\n".join(",".join(f"{value:.8g}" for value in row) for row in zip(*columns.values(), strict=True))
    (folder / "frfs.csv").write_text(f"# unit: m/s^2/N\n{','.join(columns)}\n{rows}\n")


# The text of a config


def robot_as_study(folder: Path) -> tuple[Words, ...]:
    arm(folder)
    return (("fit", "robot.urdf", "--no-report"),)


# Robots


def parent_and_child(folder: Path) -> tuple[Words, ...]:
    return arm(
        folder,
        (
            '<parent link="base_link"/><child link="link1"/>',
            '<parent link="link1"/><child link="base_link"/>',
        ),
        file="robot.urdf",
    )


def sdf(folder: Path) -> tuple[Words, ...]:
    return arm(
        folder, ("<robot", '<sdf version="1.7"><model'), ("</robot>", "</model></sdf>"), file="robot.urdf"
    )


def misspelt_type(folder: Path) -> tuple[Words, ...]:
    return arm(folder, ('name="joint4" type="revolute"', 'name="joint4" type="continous"'), file="robot.urdf")


def robot_in_mm(folder: Path) -> tuple[Words, ...]:
    return scaled(folder, "xyz", 1e3)


def inertia_in_mm(folder: Path) -> tuple[Words, ...]:
    return scaled(folder, "i[xyz][xyz]", 1e6)


def masses_in_g(folder: Path) -> tuple[Words, ...]:
    return scaled(folder, "value", 1e3)


def table_in_mm(folder: Path) -> tuple[Words, ...]:
    return table(folder, d_m=1e3, a_m=1e3)


def second_mass(folder: Path) -> tuple[Words, ...]:
    return arm(
        folder,
        ('<mass value="75.42223416"/>', '<mass value="75.42223416"/><mass value="7"/>'),
        file="robot.urdf",
    )


def description_in_utf16(folder: Path) -> tuple[Words, ...]:
    commands = arm(folder)
    (folder / "robot.urdf").write_bytes((folder / "robot.urdf").read_text().encode("utf-16"))
    return (*commands, ("map", "reports/arm.h5", "--grid", "2:0:0:1", "--workers", "1", "--no-report"))


def table_in_radians(folder: Path) -> tuple[Words, ...]:
    return table(folder, alpha_deg=np.pi / 180)


# Points


def points_in_mm(folder: Path) -> tuple[Words, ...]:
    commands = arm(folder)
    header, *lines = (folder / "points.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines]
    text = [",".join([*row[:3], *(f"{1e3 * float(place):g}" for place in row[3:])]) for row in rows]
    (folder / "points.csv").write_text("\n".join([header, *text]) + "\n")
    return commands


def semicolons(folder: Path) -> tuple[Words, ...]:
    return arm(folder, (",", ";"), (".", ","), file="points.csv")


def workbook(folder: Path) -> tuple[Words, ...]:
    commands = arm(folder)
    (folder / "points.csv").write_bytes(
        b"PK\x03\x04\x14\x00\x06\x00\x08\x00\x00\x00!\x00" + bytes(range(256))
    )
    return commands


def copied_line(folder: Path) -> tuple[Words, ...]:
    commands = arm(folder)
    lines = (folder / "points.csv").read_text().splitlines()
    lines[6] = ",".join([*lines[6].split(",")[:2], *lines[5].split(",")[2:]])
    (folder / "points.csv").write_text("\n".join(lines) + "\n")
    return commands


# Files of data


def instead(folder: Path, name: str, content: bytes) -> tuple[Words, ...]:
    """`modes` of a file with this content."""
    (folder / name).write_bytes(content)
    return ((*MODES, name),)


def pointer(folder: Path) -> tuple[Words, ...]:
    return instead(
        folder, "a.uff", b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab\nsize 299880\n"
    )


def web_page(folder: Path) -> tuple[Words, ...]:
    return instead(
        folder, "a.csv", b"<!DOCTYPE html>\n<html><head><title>404, not found</title></head></html>\n"
    )


def compressed(folder: Path) -> tuple[Words, ...]:
    return instead(folder, "a.uff", gzip.compress((ARM / "posture1.uff").read_bytes()))


def decibels(folder: Path) -> tuple[Words, ...]:
    wide(folder, lambda size: 20 * np.log10(size), np.degrees)
    return ((*MODES, "frfs.csv"),)


def phases_in_radians(folder: Path) -> tuple[Words, ...]:
    wide(folder, lambda size: size, lambda phase: phase)
    return ((*MODES, "frfs.csv"),)


def magnitudes_alone(folder: Path) -> tuple[Words, ...]:
    scipy.io.savemat(folder / "a.mat", {**arrays(), "frf": np.abs(frfs().frf)})
    return ((*MODES, "a.mat"),)


def frequencies_that_fall(folder: Path) -> tuple[Words, ...]:
    with h5py.File(folder / "a.h5", "w") as file:
        for name, value in arrays().items():
            file[name] = value[::-1] if name in ("frequency_hz", "frf") else value  # type: ignore[index]
    return ((*MODES, "a.h5"),)


def renumbered(folder: Path, old: bytes, new: bytes) -> tuple[Words, ...]:
    """`modes` of the arm's file whose records 6 say something else."""
    data = (ARM / "posture1.uff").read_bytes()
    return instead(
        folder,
        "a.uff",
        re.sub(rb"\n    [46]     [^\n]{68,72}\n", lambda line: re.sub(old, new, line[0]), data),
    )


def nodes_of_zero(folder: Path) -> tuple[Words, ...]:
    return renumbered(folder, rb"( [\w ]{10})( {8}[ \d]\d)(   [123])(?=[ \n])", rb"\1         0\3")


def directions_of_zero(folder: Path) -> tuple[Words, ...]:
    return renumbered(folder, rb"( [\w ]{10}[ \d]{10})(   [123])(?=[ \n])", rb"\1   0")


def times_in_ms(folder: Path) -> tuple[Words, ...]:
    rng = np.random.default_rng(1)
    rows = "\n".join(f"{5 * n},{a:.5f},{b:.5f}" for n, (a, b) in enumerate(rng.normal(size=(12000, 2))))
    (folder / "a.csv").write_text(f"time_s,1:+X [m/s^2],2:+X [m/s^2]\n{rows}\n")
    return ((*MODES, "a.csv", "--output-only", "--band", "5", "80"),)


def dead_channel(folder: Path) -> tuple[Words, ...]:
    data = frfs().pairs([0, 1], [0])
    dead = data.frf.copy()
    dead[:, 1] = 0
    write_csv(folder / "a.csv", replace(data, frf=dead))
    return ((*MODES, "a.csv"),)


def falling(folder: Path) -> tuple[Words, ...]:
    """A universal file whose lines are written from the highest frequency down."""
    down = [Dataset58(some_frf(n, 40), response=(n, 3), start=80, step=-1) for n in (1, 2)]
    return instead(folder, "a.uff", text(down))


# Options


def study_in_the_way(folder: Path) -> tuple[Words, ...]:
    arm(folder)
    (folder / "other.yaml").write_text("precious: true\n")
    return (("discover", "arm.yaml", "--out", "other.h5", "--no-report"),)


def damping_in_percent(folder: Path) -> tuple[Words, ...]:
    (folder / "a.yaml").write_text(
        "modes:\n  - {frequency_hz: 12.0, damping_ratio: 1.5, shape: {'1:+X': 1.0, '2:+X': 0.2}}\n"
        "  - {frequency_hz: 27.0, damping_ratio: 2.0, shape: {'1:+X': -0.2, '2:+X': 1.0}}\n"
    )
    return (("mac", "a.yaml"),)


# Motion and joints


def degrees_as_radians(folder: Path) -> tuple[Words, ...]:
    header, *lines = (JOINTS / "loads.csv").read_text().splitlines()
    rows = [[float(cell) for cell in line.split(",")] for line in lines]
    text = "\n".join(
        ",".join(f"{np.degrees(v) if n < 6 else v:.9g}" for n, v in enumerate(row)) for row in rows
    )
    (folder / "loads.csv").write_text(f"{header}\n{text}\n")
    return joints(folder, (str(JOINTS / "loads.csv"), "loads.csv"))


# Batches, tools and plug-ins


def studies_of_one_name(folder: Path) -> tuple[Words, ...]:
    for name in ("a", "b"):
        (folder / name).mkdir()
    arm(folder / "a")
    arm(
        folder / "b",
        ("posture1", "posture2"),
        ("13.4, 10.2, -1.9, 8.0, 50.0, 8.4", "-9.5, 17.6, 11.1, -31.3, 46.4, -40.9"),
    )
    (folder / "batch.yaml").write_text("schema: identify-batch/1\nname: two\nstudies: ['*/arm.yaml']\n")
    return (("batch", "batch.yaml", "--workers", "1", "--no-report"),)


def diameter_in_m(folder: Path) -> tuple[Words, ...]:
    arm(folder)
    text = (ROOT / "configs" / "tool.yaml").read_text()
    (folder / "tool.yaml").write_text(
        text.replace("diameter_mm: 20", "diameter_mm: 0.02").replace(
            "{kind: up, width_mm: 10}", "{kind: slot}"
        )
    )
    return FIT, ("stability", "reports/arm.h5", "--tool", "tool.yaml", "--draws", "50", "--no-report")


def column_twice(folder: Path) -> tuple[Words, ...]:
    arm(folder)
    names = [f"joint{n}_deg" for n in (1, 2, 3, 4, 5, 6, 6)]
    (folder / "postures.csv").write_text(f"{','.join(names)}\n0,1,2,3,4,5,6\n")
    return FIT, ("map", "reports/arm.h5", "--postures", "postures.csv", "--no-report")


def depth_below_zero(folder: Path) -> tuple[Words, ...]:
    arm(folder)
    (folder / "tool.yaml").write_text((ROOT / "configs" / "tool.yaml").read_text())
    cut = ("--tool", "tool.yaml", "--depth", "-1", "--feed-per-tooth", "0.1")
    return FIT, ("deflection", "reports/arm.h5", *cut, "--no-report")


def plugin_that_quits(folder: Path) -> tuple[Words, ...]:
    commands = arm(folder, ("axes: [rz]}", "axes: [rz]}\n  - {kind: quits}"))
    (folder / "quitter.py").write_text("import sys\nsys.exit('no licence')\n")
    info = folder / "quitter-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: quitter\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[identify.effects]\nquits = quitter:Quits\n")
    return commands


# Running and scoring


def read(text: str) -> Any:
    """What a text in YAML says."""
    return YAML(typ="safe").load(text)


def written(told: Any) -> str:
    """The same as text."""
    yaml, stream = YAML(typ="safe"), StringIO()
    yaml.default_flow_style = False
    yaml.dump(told, stream)
    return stream.getvalue()


def cases() -> list[Case]:
    """All of them."""
    return [Case(**told) for told in read(Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8"))]


def run(case: Case) -> Seen:
    """Makes the mistake in a folder of its own, runs its commands and scores what they said."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        said, code = "", 0
        for words in case.make(folder):
            program = [str(Path(sys.executable).with_name("identify")), *words]
            path = os.pathsep.join([name, str(ROOT)])
            environment = {**os.environ, "OMP_NUM_THREADS": "1", "COLUMNS": "300", "PYTHONPATH": path}
            done = subprocess.run(
                program, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=300
            )
            said, code = said + done.stdout + done.stderr, done.returncode
            if code not in (0, 3):
                break
        short = re.sub(r" +", " ", said.replace(name, "."))
    return Seen(
        case.name, case.about, case.mistake, case.right, scored(case, short, code), code, short[-1500:]
    )


def scored(case: Case, said: str, code: int) -> str:
    """What was seen, in one of the words of this page."""
    if "Traceback (most recent call last)" in said or code not in (0, 2, 3, 4):
        return "traceback"
    right = bool(re.search(case.cause, said))
    if code == 2:
        return "refused" if right else "wrong cause"
    if right:
        return "named"
    if code == 0 and "is well above 1: finds what is missing" not in said:
        return "harmless" if case.right == "harmless" else "silent"
    return "wrong cause"


def main() -> None:
    """Runs all cases, or one, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", help="name of one case")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    seen = []
    for case in cases():
        if given.only in (None, case.name):
            seen.append(run(case))
            print(f"{seen[-1].seen:12s}{case.name:28s}{case.mistake}", flush=True)
            if given.only:
                print(seen[-1].said)
    counts = dict(Counter(one.seen for one in seen))
    print(counts)
    if given.json:
        score = {"date": f"{datetime.now(UTC):%Y-%m-%d}", "cases": len(seen), "counts": counts}
        text = json.dumps({**score, "seen": [asdict(one) for one in seen]}, indent=1, ensure_ascii=False)
        given.json.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
