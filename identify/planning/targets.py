"""What a test is planned for: parameters, a mode at a posture, or the depth limit of a cut there."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.machining.mounted import mounted
from identify.machining.one_limit import limit_at
from identify.machining.tool import Tool
from identify.model.modes import complex_modes, frequency_and_damping_gradient
from identify.planning.known import Known

_MODE = re.compile(r"^mode(\d+)\.(frequency|damping)$")
_OTHERS = "mode1.frequency, mode1.damping (of any mode), depth"


@dataclass(frozen=True)
class Target:
    """A quantity that is to be known: its value, and its derivatives row (p,) by the free parameters on their
    search scale.
    """

    name: str
    unit: str
    value: float
    row: Array

    @property
    def relative(self) -> Array:
        """(p,), per value."""
        return np.asarray(self.row / self.value)


def targets_of(known: Known, names: tuple[str, ...], tool: Tool | None, posture: Array) -> list[Target]:
    """The targets of these names; modes and depths at a posture (joints,), rad, depths of a tool at its
    highest spindle speed.  InputError for an unknown one.
    """
    found = []
    for name in names:
        mode = _MODE.match(name)
        if name in known.names:
            row = known.names.index(name)
            value = float(known.model.values[known.free[row]])
            step = known.step[row] * np.eye(len(known.names))[row]
            found.append(Target(name, known.units[row], value, step))
        elif mode is not None:
            found.append(_of_mode(known, name, int(mode[1]), mode[2], posture))
        elif name == "depth":
            found.append(_of_depth(known, tool, posture))
        else:
            expected = "one of " + ", ".join(known.names) + ", or " + _OTHERS
            raise InputError("--target", f"no free parameter {name!r}", expected)
    return found


def _of_mode(known: Known, name: str, number: int, what: str, posture: Array) -> Target:
    system = known.model.system(posture)
    modes = complex_modes(*system.matrices(known.model.values))
    if not 1 <= number <= len(modes.eigenvalues):
        raise InputError("--target", f"no mode {number}", f"a number from 1 to {len(modes.eigenvalues)}")
    slopes = frequency_and_damping_gradient(modes, system.factors, len(known.model.values))
    values, of = (modes.frequency_hz, "Hz") if what == "frequency" else (modes.damping_ratio, "1")
    row = slopes[what == "damping"][number - 1, known.free] * known.step
    return Target(name, of, float(values[number - 1]), row)


def _of_depth(known: Known, tool: Tool | None, posture: Array) -> Target:
    if tool is None:
        raise InputError("--target depth", "no milling tool", "`--cutter tool.yaml`")
    on = mounted(known.model, tool, posture, "--cutter")
    rpm = tool.spindle_rpm[1]
    depth, _, exact = limit_at(on, rpm)
    if exact is None:
        found = "no limit there" if np.isinf(depth) else "a limit without slopes"
        raise InputError("--target depth", f"{found}, at {rpm:,.0f} rpm", "a cut that chatters")
    by = on.uncertain.slopes(exact.lines_hz, known.free)
    row = np.einsum("lij,lijp->p", exact.slope, by).real * known.step
    return Target(f"depth limit at {rpm:,.0f} rpm", "m", depth, row)
