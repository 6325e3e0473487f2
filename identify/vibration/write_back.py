"""What a fit found of nuisance parameters, written back: the robot, the points and a study that uses them
(`identify fit --write-back FOLDER`).

Masses, centres and inertias of links, places of joints, points and their sensors, and joint angles get the
values that were found, so that the same data give the same model with errors near zero.  Sensitivities,
directions of impacts and delays have no place in a robot or its points: the table of corrections has them.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path

from identify.core import atomic
from identify.core.errors import InputError
from identify.core.text import listed
from identify.core.yaml_input import in_one_line, yaml_text
from identify.fitting.uncertainty import BOUNDS
from identify.results.fit import FitResult
from identify.vibration.corrections import COLUMNS, Corrections
from identify.vibration.new_study import new_study
from identify.vibration.study import StudyFile
from identify.vibration.study_points import geometry_source

CORRECTIONS, LEFT = "corrections.csv", "uncertainty_left.yaml"
_FIX = "choose another folder with `--write-back`"
_NOTE = f"""\
Robot, points and postures are those that a fit found: see {CORRECTIONS}.
What is stated uncertain is as before, because these are the data of that fit. For other tests of this robot,
{LEFT} says what it left uncertain."""
_CHANGED = (
    "the inertia found of {} is none that a body can have; the robot has the nearest that is, so that a fit"
    " finds some of these errors again"
)
_LEFT_NOTE = """\
# What a fit left uncertain of what was stated, one standard deviation each: for other tests of this robot
# with {} and {}. With the data of that fit, these would count twice.
"""


@dataclass(frozen=True)
class WriteBack:
    """Where the files of a study go; InputError, before a fit, where there is nothing to write, or a file
    would take the place of an input.
    """

    file: StudyFile
    folder: Path

    def __post_init__(self) -> None:
        study = self.file.study
        if study.uncertainty is None:
            found, expected = "nothing is stated uncertain", "`uncertainty:` in the study"
            raise InputError("--write-back", found, expected, "add `uncertainty: typical`")
        if not study.cost.likelihood:
            found, expected = f"`cost: {study.cost.kind}`, which fits no errors", "the cost frf-least-squares"
            raise InputError("--write-back", found, expected, "leave `cost` out, or `--write-back`")
        read = {self.file.path, self.file.resolve(self._described)}
        read |= {self.file.resolve(path) for path in (study.points,) if path is not None}
        inputs = {path.resolve() for path in read}
        for path in self.paths:
            if path.resolve() in inputs:
                raise InputError(str(path), "an input, which would be overwritten", "a new file", _FIX)
            atomic.check_writable(path, _FIX)

    @property
    def _described(self) -> Path:
        return self.file.study.robot.urdf or self.file.study.robot.dh or Path()

    @property
    def robot(self) -> Path:
        """The robot's description; what was a xacro has no macros any more."""
        name = self._described.name
        expanded = f"{name.removesuffix('.xacro').removesuffix('.urdf')}.urdf"
        return self.folder / (expanded if name.endswith(".xacro") else name)

    @property
    def points(self) -> Path | None:
        """The points; None for a study without any."""
        path = self.file.study.points
        if path is None and geometry_source(self.file) is None:
            return None
        return self.folder / ("points.csv" if path is None else path.name)

    @property
    def study(self) -> Path:
        """The study that uses them."""
        return self.folder / self.file.path.name

    @property
    def paths(self) -> list[Path]:
        """All files, the study first."""
        points = [] if self.points is None else [self.points]
        return [self.study, self.robot, *points, self.folder / CORRECTIONS, self.folder / LEFT]

    def write(self, result: FitResult) -> list[Path]:
        """Write what a fit of the study found; the paths."""
        found = Corrections.of(self.file, result)
        texts = {
            self.study: self._study_text(found, result),
            self.robot: found.robot_text(self.folder),
            self.points: found.points_text(),
            self.folder / CORRECTIONS: self._table(found),
            self.folder / LEFT: self._left(found),
        }
        for path in self.paths:
            atomic.write_text(path, texts[path], _FIX)
        return self.paths

    def _study_text(self, found: Corrections, result: FitResult) -> str:
        data = new_study(self.file, self.folder, "corrected", _inside(result))
        data["robot"]["dh" if self.file.study.robot.urdf is None else "urdf"] = self.robot.name
        data["robot"].pop("arguments", None)  # the file has no macros any more
        if self.points is not None:
            data["points"] = self.points.name
            for key in ("points_frame", "points_posture_deg", "registration"):
                data.pop(key, None)
        for one in data["measurements"]:
            one["posture_deg"][:] = found.posture(list(one["posture_deg"]))
        changed = [name for name, (_, changed) in found.bodies.items() if changed]
        said = f"{_NOTE}\n{_CHANGED.format(listed(changed))}" if changed else _NOTE
        data.yaml_set_comment_before_after_key("robot", before=said)
        return yaml_text(data)

    def _table(self, found: Corrections) -> str:
        stream = io.StringIO()
        table, home = csv.writer(stream, lineterminator="\n"), self._homes()
        table.writerow([*COLUMNS, "written_to"])
        table.writerows([*row, home.get(row[0], "")] for row in found.rows())
        return stream.getvalue()

    def _homes(self) -> dict[str, str]:
        """The file that errors of a kind are corrected in, of those that have one."""
        homes = dict.fromkeys(("masses", "centres of mass", "inertias"), self.robot.name)
        if self.file.study.robot.urdf is not None:
            homes["places of joints"] = self.robot.name
        if self.points is not None:
            homes |= dict.fromkeys(("places of points", "directions of sensors"), self.points.name)
        return {**homes, "joint angles": self.study.name}

    def _left(self, found: Corrections) -> str:
        settings = self.file.study.uncertainty
        assert settings is not None
        data = settings.model_dump(exclude_defaults=True)
        for group, entries in found.left().items():
            part = data.get(group, {})
            old = {**part.get("each", {})}
            each = {name: in_one_line({**old.get(name, {}), **own}) for name, own in entries.items()}
            data[group] = {**part, "each": {**old, **each}}
        points = self.points or Path("no points")
        return _LEFT_NOTE.format(self.robot.name, points.name) + yaml_text({"uncertainty": data})


def _inside(result: FitResult) -> dict[str, float]:
    """Fitted values of the parameters, except at bounds, which may lie elsewhere with another inertia."""
    p = result.parameters
    return {
        name: float(p.value[n]) for n, name in enumerate(p.name) if p.free[n] and p.status[n] not in BOUNDS
    }
