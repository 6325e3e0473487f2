"""`identify check` of a study of excitation: robot, limits and what is to be known are looked at."""

from __future__ import annotations

from pathlib import Path

from identify.core.errors import InputError
from identify.excite.information import Experiment, experiment_of
from identify.excite.limits import Limits, limits_of
from identify.excite.study import ExciteFile, read_excite_study
from identify.measured.finding import STUDY, Checked, Finding, kept
from identify.measured.quality_robot import check_robot
from identify.robot.read import read_robot


def run_checks(config: Path) -> Checked:
    """Load all that `identify excite` would load of a study.

    Raises InputError or InputErrors where the config itself cannot be read; other refusals are kept.
    """
    file, refused = read_excite_study(config), list[InputError]()
    loaded = kept(lambda: _loaded(file), refused)
    found = [] if loaded is None else [*check_robot(loaded[0].arm.robot), _of_limits(*loaded)]
    return Checked({STUDY: found}, tuple(map(file.at_its_line, refused)), "excite")


def _loaded(file: ExciteFile) -> tuple[Limits, Experiment]:
    limits = limits_of(file.study, read_robot(file.study.robot, file.path.parent))
    return limits, experiment_of(file.study, limits.arm.robot, limits)


def _of_limits(limits: Limits, experiment: Experiment) -> Finding:
    sentence = (
        f"{len(limits.moving)} of {len(limits.low)} joints move within their limits, to determine"
        f" {int(experiment.wanted.sum())} values."
    )
    return Finding("info", "limits", (), sentence, len(limits.moving))
