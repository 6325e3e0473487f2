"""What the stages of an explanation share: which side of the gears loads are made of, and which effects
may be tried on a target.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array
from identify.core.plugin import left_out_where_broken
from identify.explain.effects.base import MOTION_EFFECTS, MotionEffect, Target
from identify.explain.loop import grow
from identify.explain.problem import Known, deflection_problem, scene_of, slow_part_of
from identify.explain.recorded_motion import RecordedMotion
from identify.explain.regression import Fit, RegressionProblem
from identify.explain.study import ExplainStudy
from identify.explain.workbench import RecordWorkbench, rms
from identify.fitting.memory import Memory
from identify.fitting.processes import Processes
from identify.fitting.selection.workbench import Story
from identify.measured.conditioning import ConditionedMotion

_FIRST = ("sensor-latency", "joint-compliance", "damped-compliance")
_AGAIN = 4
"""How often a latency is looked for anew, of positions that are read earlier by the last one."""


@dataclass(frozen=True)
class Problems:
    """One target on the records that are fitted, on those that judge, and on those that are only reported."""

    fitted: RegressionProblem
    judge: RegressionProblem
    tests: tuple[RegressionProblem, ...] = ()

    @classmethod
    def of(cls, problems: Sequence[RegressionProblem]) -> Problems:
        """Out of all of them in this order."""
        return cls(problems[0], problems[1], tuple(problems[2:]))

    def each(self, change: Callable[[RegressionProblem], RegressionProblem]) -> Problems:
        """All of them changed."""
        return Problems(change(self.fitted), change(self.judge), tuple(map(change, self.tests)))

    @property
    def scenes(self) -> list[RecordedMotion]:
        """The motions, in the same order."""
        return [problem.scene for problem in (self.fitted, self.judge, *self.tests)]


@dataclass(frozen=True)
class Tools:
    """What all stages share: what was computed, and who computes ahead."""

    memory: Memory
    workers: Processes | None

    def bench(
        self,
        pair: Problems,
        effects: Sequence[MotionEffect],
        label: str,
        begun: Fit | None = None,
        examined: frozenset[str] = frozenset(),
    ) -> RecordWorkbench:
        """The workbench of a stage."""
        return RecordWorkbench(
            pair.fitted, pair.judge, effects, label, self.memory, begun, examined, self.workers
        )


@dataclass(frozen=True)
class Recorded:
    """Conditioned motions: all to fit in a row, all to judge by in a row, and each that is only reported."""

    fitted: ConditionedMotion
    judge: ConditionedMotion
    tests: tuple[ConditionedMotion, ...]

    def problems(
        self, prepare: Callable[..., RegressionProblem], scenes: Sequence[RecordedMotion], known: Known
    ) -> Problems:
        """A target of all of them."""
        made = [prepare(motion, scene, known) for motion, scene in zip(self.all, scenes, strict=True)]
        return Problems.of(made)

    @property
    def all(self) -> tuple[ConditionedMotion, ...]:
        """In the order of the problems."""
        return self.fitted, self.judge, *self.tests


def torque_effects(tried: Sequence[MotionEffect], scene: RecordedMotion) -> list[MotionEffect]:
    """Without errors of bodies beyond what is stated, where loads are made of the links' accelerations: what
    a filter of a link-side sensor, or a latency, does to these looks like other bodies.
    """
    return [effect for effect in tried if scene.links is None or not effect.of_bodies]


def scenes_of(
    motions: Recorded, known: Known, study: ExplainStudy, story: Story, tools: Tools
) -> list[RecordedMotion]:
    """All motions, with what the links behind the gears need for the motion of the links or of the motors:
    whichever springs and latencies leave less of the deflection for.

    Near a resonance and above it only the links' will do.  Far below it both are the same motion, and what
    is wrong with a link-side position (backlash, errors of its scale) would be taken for acceleration.
    """
    of_motors = [scene_of(motion, replace(known, by_links=False)) for motion in motions.all]
    if not all(was_recorded(motion, "deflection") for motion in motions.all):
        return of_motors
    of_links = [scene_of(motion, known) for motion in motions.all]
    _, left = _springs_alone(motions, of_motors, of_links, known, study, story, tools)
    latency, other = _springs_alone(motions, of_links, of_links, known, study, story, tools)
    if other >= left:
        return of_motors
    scenes = of_links
    for _ in range(_AGAIN if latency.any() else 0):
        scenes = [scene_of(motion, known, latency) for motion in motions.all]
        latency, _ = _springs_alone(motions, scenes, of_links, known, study, story, tools)
    return scenes


def _springs_alone(
    motions: Recorded,
    scenes: Sequence[RecordedMotion],
    counted: Sequence[RecordedMotion],
    known: Known,
    study: ExplainStudy,
    story: Story,
    tools: Tools,
) -> tuple[Array, float]:
    """Latencies of link-side positions (joints,), s, that are found beside springs alone, and the mean ln of
    the RMS that both leave of what counts of the deflections that judge; infinite without any spring.
    """
    links = scenes[0].links
    side = "motors" if links is None else "links"
    label = f"load by the {side}, late by {0 if links is None else links.latency.tolist()}"
    tried = [one for one in candidates("deflection", scenes[0], study.effects) if one.kind in _FIRST]
    pair = motions.problems(deflection_problem, scenes, known)
    pair = Problems(
        replace(pair.fitted, slow_part=slow_part_of(motions.fitted, counted[0])),
        replace(pair.judge, slow_part=slow_part_of(motions.judge, counted[1])),
    )
    fit, _ = grow(tools.bench(pair, tried, label), story_of(story, f"load by the {side}"))
    latency = np.zeros(len(known.gear_ratio))
    for effect in fit.effects:
        if effect.kind == "sensor-latency":
            latency[effect.axis - 1] = fit.of(effect)[0]
    if all(effect.kind == "sensor-latency" for effect in fit.effects):
        return latency, float("inf")
    return latency, float(np.log(np.maximum(rms(pair.judge, fit), 1e-300)).mean())


def was_recorded(motion: ConditionedMotion, target: str) -> bool:
    return (motion.link_position if target == "deflection" else motion.command_position) is not None


def story_of(story: Story, target: str) -> Story:
    """A story of one target."""
    return Story(lambda sentence: story.say(f"{target}: {sentence}"), story.done)


def candidates(
    target: Target, scene: RecordedMotion, kinds: Sequence[str] | None = None
) -> list[MotionEffect]:
    """One effect for each kind and place that fits the target; kinds: only those (default: all that are
    registered).
    """
    found: list[MotionEffect] = []
    chosen = (
        MOTION_EFFECTS.usable()
        if kinds is None
        else {kind: MOTION_EFFECTS.get(kind, "effects") for kind in kinds}
    )
    for cls in chosen.values():
        with left_out_where_broken():
            found += cls.instances(scene) if cls.target == target else []
    return found
