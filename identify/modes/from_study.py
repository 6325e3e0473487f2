"""The FRF measurements of a study for `identify modes`, with the robot's points at every posture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from identify.core.errors import InputError
from identify.core.text import listed
from identify.measured.frf_set import FrfSet
from identify.model.geometry import drawn_geometry, sensor_geometry, standing
from identify.modes.evaluate import Measured
from identify.modes.job import NO_WINDOW, Job, window_untold
from identify.modes.said import modal_settings
from identify.robot.visual import looks
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import Problem, load_problem
from identify.vibration.provenance import provenance_of
from identify.vibration.study import MeasurementSettings, read_study


def job_of_study(config: Path, modal: dict[str, Any], *, refused: bool) -> Job:
    """The FRF measurements of a study; modal: settings of the analysis from the command line; refused:
    options of a data file were given, which a study says itself.  InputError for these, or without any FRF.
    """
    if refused:
        fix = "write them into the study, or give a file of FRFs in its place"
        raise InputError(
            str(config), "options for a data file beside a study", "only options of the analysis", fix
        )
    problem = load_problem(read_study(config))
    if not any(isinstance(m.target, FrfTarget) for m in problem.measurements):
        raise InputError(str(config), "no measurement with FRFs", "at least one with `file`")
    overrides = {f"modal.{key}": value for key, value in modal.items()}
    stated = replace(problem, file=problem.file.model_copy(update={"overrides": overrides}))
    study = problem.file.study
    settings = modal_settings(study.modal, modal)
    beside = [problem.file.resolve(path) for path in (study.modal_choices,) if path is not None]
    measured = _measured(problem)
    notes = [f"{one.name}: in the file, {note}" for one in measured for note in one.data.notes]
    untold = [
        m.name
        for m in problem.measurements
        if isinstance(m.target, FrfTarget) and _window_untold(m.settings, m.target.data)
    ]
    notes += [f"{listed(untold)}: {NO_WINDOW}"] if untold else []
    return Job(study.name, measured, settings, provenance_of(stated.file), notes, beside)


def _window_untold(settings: MeasurementSettings, data: FrfSet) -> bool:
    """Whether nobody says that impacts were windowed or not."""
    impacts = settings.estimate is None or settings.estimate.excitation == "impacts"
    return impacts and window_untold(settings, data)


def _measured(problem: Problem) -> list[Measured]:
    """Every FRF measurement, with the robot's points at its posture."""
    found, seen = [], looks(problem.robot)
    for m in problem.measurements:
        if isinstance(m.target, FrfTarget):
            engine, points = m.system.site.engine, standing(problem.points, m.system.site)
            places = sensor_geometry(engine, points), drawn_geometry(engine, points, seen)
            found.append(
                Measured(
                    m.name,
                    str(m.settings.source),
                    m.target.data,
                    m.given.posture_deg.tolist(),
                    *places,
                )
            )
    return found
