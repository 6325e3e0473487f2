"""What is mutated: files of every kind that comes from outside, and how each is read, as facts to compare."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from pydantic import BaseModel
from scipy.io import savemat

from identify.batch.settings import read_batch
from identify.core.config import family_of
from identify.excite.study import read_excite_study
from identify.explain.study import read_explain_study
from identify.joints.study import read_joint_study
from identify.machining.tool import read_tool
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set, load_time_history
from identify.measured.modal_tables import ModalTable, read_modal_table, write_modal_table
from identify.measured.quality import check
from identify.measured.record_files import RecordFile
from identify.measured.uff.write import write_uff58
from identify.motion.study import read_motion_study
from identify.reports.kinds import read_any
from identify.results import file as result_file
from identify.results.file import CHECKSUM
from identify.robot.description import Robot
from identify.robot.dh import read_dh
from identify.robot.points import read_points
from identify.robot.urdf import read_urdf
from identify.vibration.problem import load_problem
from identify.vibration.reference import read_reference
from identify.vibration.study import read_study
from tests.frf_files import write_csv, write_hdf5
from tests.hostile.mutate import BYTES, TEXT, Mutant
from tests.measured.frf_sets import some_set
from tests.measured.mat_files import content, write_v73
from tests.reports.modes_sample import modes_result
from tests.shared import ROOT as SHARED

ROOT = Path(__file__).parents[2]
MEASURED = SHARED / "data/kuka_kr300_weigand/data_FF_A.mat"
_VARIABLES = ["rec.time_cont", "rec.act_pos_mot_deg", "rec.act_torque_abs_nm"]
Facts = Mapping[str, Any]
"""What was read, by owner: an array, or anything that can be compared by its text."""


@dataclass(frozen=True)
class Kind:
    """name; the file; how it is read; by which mutations; owners: how many facts a small mutation of one line
    may change; exact: whether each number of a fact stands in bytes of its own.
    """

    name: str
    file: Path
    read: Callable[[Path], Facts]
    text: bool = True
    owners: int = 2
    exact: bool = False

    @property
    def mutations(self) -> tuple[Any, ...]:
        """The mutations that suit the file."""
        return TEXT if self.text else BYTES


def frf_facts(path: Path) -> Facts:
    """An FRF file, with the checks that `identify check` makes of it."""
    data = load_frf_set(path)
    check(data, {})
    return set_facts(data)


def set_facts(data: FrfSet) -> Facts:
    """A fact for every FRF, and what all share."""
    shared = {"quantity": data.quantity, "decay": data.window_decay_per_s, "averages": data.averages}
    pairs = {
        f"{output}/{input_}": data.frf[:, i, j]
        for i, output in enumerate(data.outputs)
        for j, input_ in enumerate(data.inputs)
        if data.measured[i, j]
    }
    return {**shared, **pairs, "frequency": data.frequency_hz}


def robot_facts(read: Callable[[Path], Robot], path: Path) -> Facts:
    """A fact for every link and joint."""
    robot = read(path)
    links = {f"link {x.name}": np.concatenate([[x.mass], x.centre, x.inertia.ravel()]) for x in robot.links}
    joints = {
        f"joint {x.name}": np.concatenate([x.origin.ravel(), x.axis, x.mount.ravel()]) for x in robot.joints
    }
    frames = {f"frame {name}": pose for name, (_, pose) in robot.frames.items()}
    return {**links, **joints, **frames}


def point_facts(path: Path) -> Facts:
    """A fact for every point."""
    return {str(n): (p.link, p.position.tolist(), p.axes.tolist()) for n, p in read_points(path).items()}


def modal_facts(read: Callable[[Path], ModalTable], path: Path) -> Facts:
    """A fact for every mode, by its frequency, as they are sorted."""
    table = read(path)
    shapes = table.shapes if table.shapes is not None else np.zeros((len(table), 0))
    rows = zip(table.frequency_hz.tolist(), table.damping_ratio.tolist(), shapes.tolist(), strict=True)
    return {f"mode {f}": (f, d, s) for f, d, s in rows}


def history_facts(path: Path) -> Facts:
    """A fact for every channel of time histories."""
    history = load_time_history(path)
    channels = {str(name): history.data[..., i] for i, name in enumerate(history.channels)}
    return {**channels, "rate": history.sample_rate_hz}


def record_facts(names: list[str], path: Path) -> Facts:
    """A fact for every array of a recorded motion."""
    file = RecordFile(path)
    return {name: file.array(name) for name in names}


def reference_facts(known: list[str], path: Path) -> Facts:
    """A fact for every parameter and mode."""
    found = read_reference(path, known)
    modes = [] if found.modes is None else found.modes.frequency_hz.tolist()
    return {**found.parameters, **{f"mode {f}": f for f in modes}}


def config_facts(path: Path) -> Facts:
    """The settings of a study by their first key."""
    readers: dict[str, Callable[[Path], Any]] = {
        "identify-motion": read_motion_study,
        "identify-explain": read_explain_study,
        "identify-joints": read_joint_study,
        "identify-batch": read_batch,
        "identify-tool": read_tool,
        "identify-excite": read_excite_study,
    }
    read = readers.get(family_of(path), read_study)(path)
    study: BaseModel = read.settings if hasattr(read, "settings") else read.study
    return {key: str(value) for key, value in study}


def problem_facts(path: Path) -> Facts:
    """A study with all its files, as a fit reads them before the work."""
    problem = load_problem(read_study(path))
    return {p.name: (p.initial, p.lower, p.upper, p.free) for p in problem.parameters}


def result_facts(path: Path) -> Facts:
    """A result, whole: nothing of it may change unnoticed."""
    return {"result": str(read_any(path))}


def kinds(folder: Path) -> list[Kind]:
    """Every kind, with the files written to a folder; the shipped files stay where they are."""
    data, made = ROOT / "data", folder
    frfs = some_set()
    write_uff58(made / "text.uff", frfs)
    write_uff58(made / "binary.uff", frfs, binary=True)
    write_csv(made / "frf.csv", frfs)
    write_hdf5(made / "frf.h5", frfs)
    savemat(made / "frf.mat", content(frfs))
    write_v73(made / "frf73.mat", content(frfs))
    runs = data / "joint_runs/speed08.csv"
    columns = runs.read_text().splitlines()[0].split(",")
    shaped = read_modal_table(data / "umons_tx200/modes_measured.yaml")
    write_modal_table(made / "modes.csv", shaped)
    result_file.write(modes_result(), made / "result.h5")
    (made / "old.h5").write_bytes((made / "result.h5").read_bytes())
    with h5py.File(made / "old.h5", "r+") as file:
        del file.attrs[CHECKSUM]
    umons = data / "umons_tx200"
    study = (ROOT / "configs/umons_tx200.yaml").read_text().replace("../data", data.as_posix())
    (made / "problem.yaml").write_text(study)
    known = [p.name for p in load_problem(read_study(made / "problem.yaml")).parameters]
    listed = [
        Kind("uff text", made / "text.uff", frf_facts, exact=True),
        Kind("uff shipped", data / "arm_hammer_test/posture1.uff", frf_facts, exact=True),
        Kind("uff binary", made / "binary.uff", frf_facts, text=False, exact=True),
        Kind("csv", made / "frf.csv", frf_facts, exact=True),
        Kind("hdf5", made / "frf.h5", frf_facts, text=False),
        Kind("hdf5 shipped", data / "kobe_36dof/detached.h5", frf_facts, text=False),
        Kind("mat", made / "frf.mat", frf_facts, text=False),
        Kind("urdf", data / "arm_hammer_test/robot.urdf", partial(robot_facts, read_urdf)),
        Kind("dh", umons / "robot.yaml", partial(robot_facts, read_dh)),
        Kind("points", data / "arm_hammer_test/points.csv", point_facts),
        Kind("modes yaml", umons / "modes_measured.yaml", partial(modal_facts, read_modal_table)),
        Kind("modes csv", made / "modes.csv", partial(modal_facts, read_modal_table)),
        Kind("reference", umons / "reference.yaml", partial(reference_facts, known)),
        Kind("result", made / "result.h5", result_facts, text=False, owners=0),
        Kind("result without checksum", made / "old.h5", result_facts, text=False),
        Kind("study with its files", made / "problem.yaml", problem_facts, owners=1000),
    ]
    listed += [
        Kind("mat v7.3", made / "frf73.mat", frf_facts, text=False),
        Kind("histories uff", data / "fast_chirp_rx160/zone1_pass1.uff", history_facts, text=False),
        Kind("records csv", runs, partial(record_facts, columns)),
    ]
    if MEASURED.exists():
        listed.append(Kind("records mat", MEASURED, partial(record_facts, _VARIABLES), text=False))
    configs = sorted((ROOT / "configs").glob("*.yaml"))
    return listed + [Kind(f"config {path.stem}", path, config_facts) for path in configs]


def excess(kind: Kind, mutant: Mutant, original: bytes, before: Facts, after: Facts) -> str:
    """What of an accepted file changed beyond what was mutated, in words; empty where nothing did."""
    changed = [key for key in before if key in after and not _same(before[key], after[key])]
    if kind.owners == 0:
        return "changed: " + ", ".join(changed) if changed else ""
    touched = original[mutant.first : mutant.last]
    if mutant.what in ("line", "copied", "overwritten", "zeroed", "cut") or _global(original, mutant.first):
        return ""
    allowed = kind.owners + 2 * touched.count(b"\n")
    if len(changed) > allowed:
        return f"{len(changed)} facts changed, at most {allowed} touched: {', '.join(changed[:4])}"
    for key in changed if kind.exact and not _in_header(original, mutant.first) else ():
        one, other = np.atleast_1d(before[key]), np.atleast_1d(after[key])
        many = int(np.sum(one != other)) if one.shape == other.shape else 0
        if many > len(touched) + 1:
            return f"{many} values of {key} changed by {len(touched)} bytes"
    return ""


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and bool(np.array_equal(one, other, equal_nan=True))
    return str(one) == str(other)


def _global(original: bytes, at: int) -> bool:
    """Whether a place in a file says something of all of it: a comment line with units, a first line."""
    line = original[original.rfind(b"\n", 0, at) + 1 : at + 40]
    before = original[:at]
    in_164 = before.rfind(b"\n   164") > before.rfind(b"\n    58")
    return line.startswith(b"#") or b"\n" not in before or in_164


def _in_header(original: bytes, at: int) -> bool:
    """Whether a place is among the header lines of a dataset 58."""
    starts = [match.end() for match in re.finditer(rb"\n    58", original[:at])]
    return bool(starts) and original.count(b"\n", starts[-1], at) < 13
