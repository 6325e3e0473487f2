"""A study with its data in memory, at few lines, which can be built again with some keys changed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pydantic import ValidationError

from identify.core.errors import InputError, InputErrors
from identify.core.yaml_input import parse_yaml, plain
from identify.measured.frf_set import FrfSet
from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.points import Point, check_links
from identify.robot.read import carrying, read_robot
from identify.robot.settings import RobotSettings
from identify.setup.edits import Change, OnLink, edited
from identify.vibration.given import Given, as_modelled, given_of, in_band, posture_of, read_as_they_are
from identify.vibration.nuisances.settings import UncertaintySettings
from identify.vibration.postures import Built, Stand
from identify.vibration.problem import Problem, already_built, assembled
from identify.vibration.study import MeasurementSettings, Study, StudyFile

LINES = 20
"""Lines of each measurement that are looked at: some for each mode of a band."""
_GLANCED, _GLANCED_SETS = 12, 2
"""Lines and measurements at a first look."""
_SETS = 3
"""Measurements that are looked at."""


@dataclass(frozen=True)
class Stated:
    """A study as stated.

    data: of its file, plain; sets: its FRFs by number of measurement, as their files have them, with their
    noise and few lines; records: length of the records behind them, s; uncertainty: how far off what it says
    may be, with which no variant is fitted at first; lines: of each measurement that are looked at; robots,
    engines: those made so far, by what the study says of them.
    """

    file: StudyFile
    data: Any
    points: Mapping[int, Point]
    sets: Mapping[int, FrfSet]
    records: Mapping[int, float | None]
    uncertainty: UncertaintySettings | None = None
    lines: int = LINES
    robots: dict[str, Robot] = field(default_factory=dict, repr=False)
    engines: dict[str, dict[Stand, Engine]] = field(default_factory=dict, repr=False)

    @property
    def study(self) -> Study:
        """Its settings."""
        return self.file.study

    @property
    def robot(self) -> Robot:
        """The robot as the study describes it."""
        settings = self.study.robot
        return self._once(settings, lambda: carrying(self._bare, settings))

    @property
    def _bare(self) -> Robot:
        """The same without payloads: its file is read once for all of them."""
        settings = self.study.robot.model_copy(update={"payload": []})
        return self._once(settings, lambda: read_robot(settings, self.file.path.parent))

    def _once(self, settings: RobotSettings, make: Callable[[], Robot]) -> Robot:
        key = settings.model_dump_json()
        if key not in self.robots:
            self.robots[key] = make()
        return self.robots[key]

    @property
    def measured(self) -> list[MeasurementSettings]:
        """The settings of the measurements that are looked at."""
        return [self.study.measurements[number] for number in self.sets]

    def changed(self, edits: Sequence[Change]) -> Stated:
        """The study with some keys changed; InputErrors where it is then none."""
        data = edited(self.data, edits)
        try:
            study = Study.model_validate(data).model_copy(update={"uncertainty": None, "modal_choices": None})
        except ValidationError as error:
            raise InputErrors([InputError("study", str(error))]) from error
        points = dict(self.points)
        for edit in edits:
            if isinstance(edit, OnLink):
                points[edit.node] = edit.point or replace(points[edit.node], link=edit.link)
        return replace(self, file=self.file.model_copy(update={"study": study}), data=data, points=points)

    def without(self, number: int) -> Stated:
        """The same without a measurement."""
        return replace(self, sets={n: data for n, data in self.sets.items() if n != number})

    def glanced(self) -> Stated:
        """The same at fewer lines of fewer measurements, for a first look at many variants."""
        return replace(self, sets=dict(list(self.sets.items())[:_GLANCED_SETS]), lines=_GLANCED)

    def problem(self) -> Problem:
        """The study with its few lines, ready to be fitted; InputError as `load_problem`."""
        check_links(self.points, self.robot)
        engines = self.engines.setdefault(self.study.robot.model_dump_json(), {})
        built, given = Built(engines), list(self._given())
        problem = assembled(self.file, self.robot, dict(self.points), given, built=built)
        engines.update(already_built(problem, with_sites=False).engines)
        return problem

    def _given(self) -> Iterator[Given]:
        for number, data in self.sets.items():
            settings = self.study.measurements[number]
            decay = settings.window_decay_per_s  # which an edit may say
            known = data if decay is None else replace(data, window_decay_per_s=decay)
            right = settings.correct.applied(known, f"measurement {number}")
            right = in_band(right.chosen(settings.outputs, settings.inputs, ""), self.study.band_hz, "")
            right = right.evenly(self.lines)
            posture = posture_of(self.study, settings, self.robot, number)
            told = settings.model_copy(update={"use": "fit"})  # all are looked at, if not all are fitted
            given = Given(f"{number}", told, posture, right)
            yield as_modelled(given, self.study.effects, self.robot, self.points)


def stated(problem: Problem) -> Stated:
    """What a study states; InputError where it has no FRFs with known noise."""
    file = problem.file
    sets: dict[int, FrfSet] = {}
    records: dict[int, float | None] = {}
    for number, m in enumerate(problem.measurements):
        if m.settings.file is None or m.given.noise is None or not isinstance(m.given.data, FrfSet):
            continue
        if len(sets) == _SETS:
            break
        sets[number], records[number] = _few(file, m.given), m.given.record
    if not sets:
        raise InputError("measurements", "no FRFs with known noise", "FRFs, and their noise")
    data = plain(parse_yaml(file.text, str(file.path)))
    for key, value in file.overrides.items():
        data[key] = value
    study = file.study.model_copy(update={"uncertainty": None})
    told = file.model_copy(update={"study": study})
    return Stated(told, data, problem.points, sets, records, file.study.uncertainty)


def _few(file: StudyFile, given: Given) -> FrfSet:
    """A measurement as its file has it, with its noise, at a few lines of the band, and beyond it of the band
    in rad/s.
    """
    settings = given.settings
    raw = read_as_they_are(file, settings)
    frequency = raw.frequency_hz
    low, high = file.study.band_hz or (float(frequency[0]), float(frequency[-1]))
    inside = (frequency >= low) & (frequency <= high) & (frequency > 0)
    beyond = (frequency > high) & (frequency <= 2 * np.pi * high)
    keep = np.zeros(len(frequency), dtype=bool)
    for some in map(np.flatnonzero, (inside, beyond)):
        if len(some):
            keep[some[np.linspace(0, len(some) - 1, LINES).astype(int)]] = True
    whole = given_of(settings, given.name, given.posture, raw.lines(frequency > 0)).data
    assert isinstance(whole, FrfSet)
    return whole.lines(keep[frequency > 0])
