"""Where a result comes from: versions, time, what was asked, and the input files with their hashes."""

from __future__ import annotations

import hashlib
import platform
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from identify import __version__
from identify.results import fit as results
from identify.results.setting_table import study_settings
from identify.vibration.problem import Problem
from identify.vibration.study import StudyFile

_PACKAGES = ("numpy", "scipy", "mujoco", "h5py", "pymoo", "pyswarms")
"""What computes: a run resumed with another version of any of these would not be the same run."""


def provenance(name: str, text: str, inputs: Sequence[tuple[str, str]], settings: results.SettingTable | None = None) -> results.Provenance:
    """Provenance now; name and text of what was asked (no name where there was no config file), inputs: (file, sha256)."""
    return results.Provenance(
        identify=__version__,
        python=sys.version.split()[0],
        platform=f"{platform.system()} {platform.machine()}",
        packages=tuple(f"{package} {version(package)}" for package in _PACKAGES),
        written=datetime.now(UTC).isoformat(timespec="seconds"),
        config_path=name,
        config_sha256=hashlib.sha256(text.encode()).hexdigest(),
        config=text,
        input_files=tuple(file for file, _ in inputs),
        input_sha256=tuple(digest for _, digest in inputs),
        settings=settings,
    )


def provenance_of(problem: Problem) -> results.Provenance:
    """Provenance of a run of a study."""
    file = problem.file
    measured = [(str(m.settings.source), m.target.data.sha256) for m in problem.measurements]
    return provenance(file.path.name, file.text, [*robot_inputs(file), *measured], study_settings(file))


def robot_inputs(file: StudyFile) -> list[tuple[str, str]]:
    """The files that describe the robot and its points, each with its sha256."""
    robot = file.study.robot.urdf or file.study.robot.dh or Path()
    paths = [robot] + ([file.study.points] if file.study.points else [])
    return [(str(path), sha256(file.resolve(path))) for path in paths]


def description_of(file: StudyFile) -> results.Description:
    """The texts of the robot's and the points' files."""
    robot, points = file.study.robot.urdf or file.study.robot.dh or Path(), file.study.points
    text = "" if points is None else _text(file.resolve(points))
    return results.Description(robot.name, _text(file.resolve(robot)), text)


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8-sig", errors="replace")  # a name in another encoding must not cost a finished fit


def sha256(path: Path) -> str:
    """The sha256 of a file, as hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
