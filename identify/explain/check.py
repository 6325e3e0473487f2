"""`identify check` of a study of recorded motion: all that `explain` would load is loaded and looked at."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.core.errors import InputError
from identify.explain.run import Records, conditioned, known_of, read_records
from identify.explain.study import USES, ExplainFile, read_explain_study
from identify.measured.conditioning import in_a_row
from identify.measured.finding import STUDY, Checked, Finding, kept
from identify.measured.quality_records import check_records
from identify.measured.quality_robot import check_robot
from identify.robot.description import Robot
from identify.robot.read import read_robot


def run_checks(config: Path) -> Checked:
    """Load all that `identify explain` would load of a study and look at it.

    Raises InputError or InputErrors where the config itself cannot be read; other refusals are kept.
    """
    file, refused = read_explain_study(config), list[InputError]()
    robot = kept(lambda: read_robot(file.study.robot, file.path.parent), refused)
    records = None if robot is None else kept(lambda: read_records(file, robot), refused)
    found: dict[str, list[Finding]] = {STUDY: []}
    if robot is not None and records is not None:
        kept(lambda: _conditioned(file, robot, records), refused)
        found = _looked_at(file, robot, records)
    return Checked(found, tuple(map(file.at_its_line, refused)), "explain")


def _conditioned(file: ExplainFile, robot: Robot, records: Records) -> None:
    """All that is done to records before anything is fitted to them; InputError as `explain` raises it."""
    known = known_of(file.study, robot)
    each = {use: [conditioned(record, file.study, known) for record in records[use]] for use in USES}
    in_a_row(each["fit"])
    in_a_row(each["validate"])


def _looked_at(file: ExplainFile, robot: Robot, records: Records) -> dict[str, list[Finding]]:
    study = file.study
    limits = np.array([[joint.lower for joint in robot.joints], [joint.upper for joint in robot.joints]])
    absolute = study.positions == "absolute" and study.drives.positions_of == "joints"
    joints = None if study.joints is None else [joint - 1 for joint in study.joints]
    every = [record for use in USES for record in records[use]]
    found = check_records(every, limits if absolute else None, joints)
    return {**found, STUDY: [*found[STUDY], *check_robot(robot)]}
