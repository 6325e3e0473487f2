"""The kinds of analysis, in one table: command line, schemas, results and reports read it.

Everything is named as `module:attribute` and imported when it is asked for, so that the table itself costs
nothing and stands below all that it names.  A new kind of analysis is one more entry of `ANALYSES`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from identify.core.errors import InputError
from identify.core.registry import load


@dataclass(frozen=True)
class Run:
    """How an analysis answers a command: `function(config, out, ...)` gives the result and what was written.

    overrides: options that replace keys of the study, told the function as the mapping `overrides`; options:
    those it takes by their names; any other is refused.  progress: what shows how far it is, the function's
    `progress`.
    """

    function: str
    overrides: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    progress: str = ""


@dataclass(frozen=True)
class Analysis:
    """One kind of analysis.

    takes: what it is done on, as in "a study of joints"; kind: of its results, as result files say it; holds:
    what such a file holds; result: its class, and report: the module with `report(result)`; success: the
    attribute of a result that is false where it is to end with exit code 4.

    Of those that read a config, schema: what the config says it is of; study: its settings; plugs: registries
    of the keys that name a registered kind; runs: the commands that it answers, the first of them its own;
    check: the function behind `identify check`.
    """

    name: str
    takes: str
    kind: str
    holds: str
    result: str
    report: str
    success: str = ""
    schema: str = ""
    study: str = ""
    plugs: Mapping[str, str] = field(default_factory=dict)
    runs: Mapping[str, Run] = field(default_factory=dict)
    check: str = ""

    @property
    def family(self) -> str:
        """The family of schemas, without its version."""
        return self.schema.partition("/")[0]


_OPTIMIZERS = "identify.fitting.optimizers.base:OPTIMIZERS"
_EFFECTS = "identify.model.effects.base:EFFECTS"
_BAR = "identify.reports.progress:progress_bar"
_STORY = "identify.reports.progress:story"
_MOTIONS = "identify.reports.progress:motions"
_JOBS = "identify.reports.progress:batch_bar"

ANALYSES = (
    Analysis(
        name="vibration",
        takes="a study of vibration",
        kind="fit",
        holds="a finished fit",
        result="identify.results.fit:FitResult",
        report="identify.reports.fit.sections",
        success="converged",
        schema="identify/1",
        study="identify.vibration.study:Study",
        check="identify.setup.check:run_checks",
        plugs={"effects": _EFFECTS, "cost": "identify.vibration.costs.base:COSTS", "optimizer": _OPTIMIZERS},
        runs={
            "fit": Run(
                "identify.setup.fit:run_fit",
                ("seed", "starts"),
                ("workers", "resume", "profile", "write_back"),
                _BAR,
            )
        },
    ),
    Analysis(
        name="discovery",
        takes="a study of vibration",
        kind="discovery",
        holds="a search for missing effects",
        result="identify.results.discovery:DiscoveryResult",
        report="identify.reports.discovery.sections",
        schema="identify/1",
        runs={
            "discover": Run(
                "identify.discovery.run:run_discover",
                ("starts",),
                ("workers", "resume", "as_stated", "time_s"),
                _STORY,
            )
        },
    ),
    Analysis(
        name="motion",
        takes="a study of motion",
        kind="motion",
        holds="a simulated or fitted motion",
        result="identify.results.motion:MotionResult",
        report="identify.reports.motion.sections",
        success="converged",
        schema="identify-motion/1",
        study="identify.motion.study:MotionStudy",
        check="identify.motion.check:run_checks",
        plugs={
            "effects": _EFFECTS,
            "servo": "identify.motion.controller:CONTROLLERS",
            "optimizer": _OPTIMIZERS,
        },
        runs={
            "fit": Run("identify.motion.run:run_motion_fit", ("seed", "starts"), ("resume",), _BAR),
            "simulate": Run("identify.motion.run:run_simulation", options=("tables", "values")),
            "discover": Run(
                "identify.motion.missing.run:run_motion_discover",
                ("starts",),
                ("resume", "time_s"),
                _STORY,
            ),
        },
    ),
    Analysis(
        name="explain",
        takes="a study of recorded motion",
        kind="explained",
        holds="an explained motion",
        result="identify.results.explain:ExplainResult",
        report="identify.reports.explain.sections",
        schema="identify-explain/1",
        study="identify.explain.study:ExplainStudy",
        check="identify.explain.check:run_checks",
        plugs={"effects": "identify.explain.effects.base:MOTION_EFFECTS"},
        runs={
            "explain": Run("identify.explain.run:run_explain", (), ("workers", "resume"), _STORY),
            "discover": Run("identify.explain.run:run_explain", (), ("workers", "resume"), _STORY),
        },
    ),
    Analysis(
        name="joints",
        takes="a study of joints",
        kind="joints",
        holds="identified joints",
        result="identify.results.joints:JointsResult",
        report="identify.reports.joints.sections",
        schema="identify-joints/1",
        study="identify.joints.study:JointStudy",
        check="identify.joints.check:run_checks",
        plugs={"curves": "identify.joints.base:CURVES"},
        runs={"fit": Run("identify.joints.run:run_joints")},
    ),
    Analysis(
        name="excite",
        takes="a study of excitation",
        kind="excitation",
        holds="a motion that excites",
        result="identify.results.excite:ExciteResult",
        report="identify.reports.excite.sections",
        schema="identify-excite/1",
        study="identify.excite.study:ExciteStudy",
        check="identify.excite.check:run_checks",
        runs={"excite": Run("identify.excite.run:run_excite", options=("draws",), progress=_MOTIONS)},
    ),
    Analysis(
        name="batch",
        takes="a batch",
        kind="batch",
        holds="a batch",
        result="identify.results.batch:BatchResult",
        report="identify.reports.batch.sections",
        success="complete",
        schema="identify-batch/1",
        study="identify.batch.settings:BatchSettings",
        check="identify.batch.check:run_checks",
        runs={
            "batch": Run(
                "identify.batch.run:run_batch", options=("workers", "cluster", "resume"), progress=_JOBS
            )
        },
    ),
    Analysis(
        name="modes",
        takes="FRFs",
        kind="modes",
        holds="a modal analysis",
        result="identify.results.modes:ModesResult",
        report="identify.reports.modes.sections",
        success="rebuilt",
    ),
    Analysis(
        name="map",
        takes="a finished fit",
        kind="map",
        holds="a map",
        result="identify.results.map:MapResult",
        report="identify.reports.map.sections",
    ),
    Analysis(
        name="stability",
        takes="a tool",
        kind="stability",
        holds="depth limits of a cut",
        result="identify.results.stability:StabilityResult",
        report="identify.reports.stability.sections",
        schema="identify-tool/1",
        study="identify.machining.tool:Tool",
        check="identify.machining.check:run_checks",
    ),
    Analysis(
        name="deflection",
        takes="a finished fit",
        kind="deflection",
        holds="deflections of a tool",
        result="identify.results.deflection:DeflectionResult",
        report="identify.reports.deflection.sections",
    ),
    Analysis(
        name="plan",
        takes="a study of vibration or a finished fit",
        kind="plan",
        holds="a planned test",
        result="identify.results.plan:PlanResult",
        report="identify.reports.plan.sections",
    ),
    Analysis(
        name="compare",
        takes="finished fits",
        kind="compare",
        holds="a comparison",
        result="identify.results.comparison:Comparison",
        report="identify.reports.compare.sections",
    ),
)
BY_NAME = {one.name: one for one in ANALYSES}
OF_KIND = {one.kind: one for one in ANALYSES}
WITH_CONFIG = tuple(one.name for one in ANALYSES if one.study)
"""Those that have a config of their own."""


def checker_of(family: str) -> Any:
    """What checks a config of a family of schemas; of no known one, the first, whose reader says what is
    wrong.
    """
    able = [one for one in ANALYSES if one.check]
    return load(next((one for one in able if one.family == family), able[0]).check)


def analysis_for(command: str, family: str, where: str) -> Analysis:
    """The analysis that answers a command on a config of a family of schemas.

    A config of another kind of analysis is an InputError that names its command; one of no known family goes
    to the first that answers, whose reader says what is wrong.
    """
    able = [one for one in ANALYSES if command in one.runs]
    for one in able:
        if one.family == family:
            return one
    other = next((one for one in ANALYSES if one.runs and one.family == family), None)
    if other is None:
        return able[0]
    expected = " or ".join(dict.fromkeys(one.takes for one in able))
    fix = f"use `identify {next(iter(other.runs))}`"
    raise InputError(where, f"{other.takes}, schema {other.schema}", expected, fix)


def check_options(analysis: Analysis, command: str, given: Mapping[str, Any], where: str) -> None:
    """Raise an InputError for options that do not apply to this analysis, whatever their values."""
    run = analysis.runs[command]
    refused = [name for name in given if name not in (*run.overrides, *run.options)]
    if not refused:
        return
    able = [
        one.takes
        for one in ANALYSES
        if command in one.runs
        and all(name in (*one.runs[command].overrides, *one.runs[command].options) for name in refused)
    ]
    found = " and ".join(f"`--{name.replace('_', '-')}`" for name in refused)
    raise InputError(
        where, f"{found} with {analysis.takes}", " or ".join(able) or "no such option", "leave the option out"
    )
