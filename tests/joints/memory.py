"""A bench whose runs come from memory, so that many noise seeds cost no files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from identify.joints.data import JointTestData
from identify.measured.conditioning import ConditionedMotion, condition
from identify.measured.records import MotionRecord, SignalSettings, TimeAxis
from tests.generator import joint_runs

SIGNALS: Any = {
    "motor_position": SignalSettings(at="joint{joint}.motor_rad", unit="rad"),
    "link_position": SignalSettings(at="joint{joint}.link_rad", unit="rad"),
    "motor_torque": SignalSettings(at="joint{joint}.torque_N_m", unit="N m"),
}
_OF = {"motor_rad": "motor_position", "link_rad": "link_position", "torque_N_m": "motor_torque"}


@dataclass(frozen=True)
class MemoryBench(JointTestData):
    """runs: signals of one joint (samples,), or of all (samples, joints), by the name of the file they would
    be in.
    """

    runs: dict[str, tuple[int, dict[str, Any]]] = field(default_factory=dict)

    def motion(
        self, path: Path, quantities: Sequence[Any], joints: Sequence[int], where: str
    ) -> ConditionedMotion:
        """The conditioned run of that name."""
        joint, signals = self.runs[str(path)]
        record = {_OF[key]: _spread(values, joint) for key, values in signals.items()}
        samples = len(record["motor_position"])
        record.setdefault("motor_torque", np.full((samples, 3), np.nan))
        found = MotionRecord(str(path), 100.0, np.arange(samples) / 100.0, record, str(path), "")
        motion = condition(found, self.lowpass_hz)
        return replace(motion, torque=motion.torque * self.torque_ratio)


def _spread(values: Any, joint: int) -> Any:
    if values.ndim == 2:
        return values
    found = np.full((len(values), 3), np.nan)
    found[:, joint] = values
    return found


def bench(runs: Any = None, robot: Any = None, folder: Path = Path()) -> MemoryBench:
    """The bench of the generator's arm."""
    return MemoryBench(
        folder=folder,
        robot=robot,
        gear_ratio=joint_runs.RATIO,
        torque_ratio=joint_runs.RATIO,
        torque_constant=None,
        signals=SIGNALS,
        time=TimeAxis(at="time_s"),
        zero=np.zeros(3),
        slow=float(np.radians(0.4)),
        lowpass_hz=10.0,
        runs=runs or {},
    )


def noisy(clean: Any, seed: int) -> Any:
    """Runs as sensors give them."""
    rng = np.random.default_rng([11, seed])
    return {
        name: (joint, joint_runs.sensed(signals, joint_runs.RATIO[joint], rng))
        for name, (joint, signals) in clean.items()
    }


def covered(results: Sequence[Any], truth: dict[str, float], shrink: float = 1.0) -> float:
    """Share of the intervals, shrunk about their middle, that hold the truth."""
    inside = []
    for found in results:
        v = found.values
        for name, true in truth.items():
            row = v.name.index(name)
            middle, half = (v.high_95[row] + v.low_95[row]) / 2, (v.high_95[row] - v.low_95[row]) / 2
            inside.append(abs(true - middle) <= shrink * half)
    return float(np.mean(inside))


def value(found: Any, name: str) -> tuple[float, float, float, str]:
    """Value, interval and status of that name."""
    v = found.values
    row = v.name.index(name)
    return v.value[row], v.low_95[row], v.high_95[row], v.status[row]
