"""The study that a search for missing effects ends with: the config as it was written, comments and all, with
the new numbers and springs, and all values as found.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from identify.core.arrays import Array
from identify.core.config_paths import relocate
from identify.core.yaml_input import flat, in_one_line, renamed, round_trip, yaml_text
from identify.motion.friction import FrictionSettings
from identify.motion.links import damping_of, parts
from identify.motion.problem import MotionProblem, sections_of
from identify.motion.study import MotionStudy

_WHAT = "discovered"
_OTHERS = ("candidates", "optimizer", "starts")
"""Keys that are for a model that is far from its best values."""


def study_text(problem: MotionProblem, values: Array, folder: Path) -> str:
    """The study of a problem at parameter values (parameters,), as the text of a file in `folder`."""
    file = problem.file
    data = round_trip().load(file.text)
    if file.path.parent.resolve() != folder.resolve():
        relocate(MotionStudy, data, file.path.parent, folder)
    renamed(data, file.study.name, _WHAT)
    for key in _OTHERS:
        data.pop(key, None)
    noise = {q: flat(v) if isinstance(v, list) else v for q, v in file.study.noise.items()}
    data["noise"] = in_one_line(noise)
    told = dict(zip([p.name for p in problem.parameters], values.tolist(), strict=True))
    _springs(data, problem, told)
    _numbers(data, problem, values)
    _law(data, problem)
    _told(data, problem)
    return yaml_text(data)


def _springs(data: Any, problem: MotionProblem, told: Mapping[str, float]) -> None:
    """All effects with what was found of them."""
    effects = problem.file.study.effects
    if not effects:
        return
    entries = data.setdefault("effects", CommentedSeq())
    for number, effect in enumerate(effects):
        if number == len(entries):
            entry = effect.model_dump(mode="json", exclude_defaults=True)
            own = {key: flat(v) if isinstance(v, list) else v for key, v in entry.items()}
            entries.append(in_one_line({"kind": effect.kind, **own}))
        for stiff, names in parts(effect, problem.robot).items():
            for key, what in ((stiff, "stiffness"), (damping_of(stiff), "damping")):
                if getattr(effect, key).fixed:
                    continue
                part = CommentedMap(entries[number].get(key) or {})
                part.pop("damping_ratio", None)
                part["initial"] = flat([_short(told[f"{name}.{what}"]) for name in names])
                if "bounds" in part:
                    part["bounds"] = flat(part["bounds"])
                entries[number][key] = in_one_line(part)


def _numbers(data: Any, problem: MotionProblem, values: Array) -> None:
    """All numbers that are searched with what was found of them."""
    arrays, joints = problem.table.arrays(values[None]), len(problem.robot.joints)
    parameters, sections = {p.name: p for p in problem.parameters}, sections_of(problem.file)
    for where, (free, _) in problem.table.columns.items():
        *outer, key = where.split(".")
        part = data
        for name in outer:
            part = part[int(name)] if name.isdigit() else part.setdefault(name, CommentedMap())
        row = [_short(value) for value in arrays[where][0].tolist()]
        one = parameters[f"joint{free[0] + 1}.{where}"]
        within = getattr(sections[where.rpartition(".")[0]], key).within
        known = {"within": within} if within else {"bounds": flat([one.lower, one.upper])}
        entry = {"initial": flat(row), **known}
        if len(free) < joints:
            entry["joints"] = flat([int(joint) + 1 for joint in free])
        part[key] = in_one_line(entry)


def _law(data: Any, problem: MotionProblem) -> None:
    """How dry friction passes through zero, where that was changed."""
    found = problem.file.study.friction.smoothing
    if data.get("friction", {}).get("smoothing", FrictionSettings().smoothing) != found:
        data.setdefault("friction", CommentedMap())["smoothing"] = found


def _told(data: Any, problem: MotionProblem) -> None:
    """What the controller goes on computing with, of motors that are not as stated."""
    for where in problem.freed:
        section, _, key = where.partition(".")
        if section == "motor" and where in problem.told:
            told = data["servo"].setdefault("told", CommentedMap())
            told[key] = flat([_short(value) for value in problem.told[where].tolist()])


def _short(value: float) -> float:
    return float(f"{value:.6g}")
