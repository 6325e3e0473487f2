"""Spindle and tool, measured apart, coupled to the arm where its model ends: receptance coupling.

With receptances H of what was measured hanging free, at the tip t and the flange f, and R of the arm there,

    G_tt = H_tt - H_tf (H_ff + R)^-1 H_ft     (Schmitz and Donaldson 2000, Ann. CIRP 49),

over displacements and, where the file has them, rotations of the flange; without these, spindle and arm are
held together as by a ball joint.  A small change dR of the arm changes G_tt by L dR L'', L = H_tf (H_ff +
R)^-1 and L'' = (H_ff + R)^-1 H_ft.  Between its lines and above them: `tip_lines`; below the lowest line G_tt
is what it is there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.machining.structure import conjugated
from identify.machining.tip_lines import between
from identify.machining.tool import Coupling
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet
from identify.measured.loaders import load_frf_set

ArmAt = Callable[[Array], Complex]
"""Lines (l,), Hz, above 0, to the arm's receptance at the flange (l, k, k), m/N."""


@dataclass(frozen=True)
class Substructure:
    """Accelerances (lines, 3 + k, 3 + k) at line_hz of the tip, then of the flange: k is 3 without rotations,
    else 6; along the axes of the link that carries it.
    """

    line_hz: Array
    accelerance: Complex

    @property
    def degrees(self) -> int:
        """k."""
        return int(self.accelerance.shape[1]) - 3

    def coupled(self, line_hz: Array, arm: Complex, turn: Array) -> tuple[Complex, Complex, Complex]:
        """G_tt (l, 3, 3), L (l, 3, k) and L'' (l, k, 3) at lines (l,), Hz, not below the lowest; arm (l, k,
        k): R, m/N, along the rows of turn (3, 3), the axes in which all is wanted.
        """
        both = np.kron(np.eye(1 + self.degrees // 3), turn)
        free = both @ between(line_hz, self.line_hz, self.accelerance) @ both.T
        inner = free[:, 3:, 3:] + arm
        right = np.linalg.solve(inner, free[:, 3:, :3])
        left = np.swapaxes(
            np.linalg.solve(np.swapaxes(inner, 1, 2), np.swapaxes(free[:, :3, 3:], 1, 2)), 1, 2
        )
        tip = np.asarray(free[:, :3, :3] - free[:, :3, 3:] @ right, dtype=complex)
        return tip, np.asarray(left, dtype=complex), np.asarray(right, dtype=complex)


@dataclass(frozen=True)
class CoupledTip:
    """A substructure on an arm; turn (3, 3): the axes in which all is wanted, in those of the link."""

    on: Substructure
    arm: ArmAt
    turn: Array

    @property
    def degrees(self) -> int:
        """k, of the substructure."""
        return self.on.degrees

    def lines(self, line_hz: Array) -> Array:
        """(l,), Hz, of any sign: where it is looked at for lines (l,)."""
        return np.asarray(np.where(line_hz < 0, -1.0, 1.0) * np.maximum(np.abs(line_hz), self.on.line_hz[0]))

    def sides(self, line_hz: Array) -> tuple[Complex, Complex]:
        """L (l, 3, k) and L'' (l, k, 3) at such lines."""
        _, left, right = self._at(line_hz)
        return left, right

    def receptance(self, line_hz: Array) -> Complex:
        """(l, 3, 3), m/N, of the tip, at lines of any sign."""
        return self._at(self.lines(line_hz))[0]

    def _at(self, line_hz: Array) -> tuple[Complex, Complex, Complex]:
        there = np.abs(line_hz)
        parts = self.on.coupled(there, self.arm(there), self.turn)
        tip, left, right = (conjugated(one, line_hz) for one in parts)
        return tip, left, right


def substructure(coupling: Coupling) -> Substructure:
    """Of a file of FRFs; InputError for FRFs that are missing, by the channel's name."""
    path = Path(coupling.file)
    return _substructure(coupling, path.stat().st_mtime_ns if path.exists() else 0)


@lru_cache(maxsize=4)
def _substructure(coupling: Coupling, changed: int) -> Substructure:
    found = load_frf_set(Path(coupling.file))
    if found.window_decay_per_s:
        raise InputError(coupling.file, "an exponential window", "FRFs without one, to be coupled")
    if found.frequency_hz[0] <= 0:
        found = found.lines(found.frequency_hz > 0)
    names = [Channel(coupling.tip, axis) for axis in (1, 2, 3)]
    rotations = any(one.node == coupling.flange and one.direction in (4, 5, 6) for one in found.outputs)
    names += [Channel(coupling.flange, axis) for axis in range(1, 7 if rotations else 4)]
    raised = (2j * np.pi * found.frequency_hz) ** (2 - POWER[found.quantity])
    pairs = [[raised * _pair(found, one, other, coupling.file) for other in names] for one in names]
    return Substructure(found.frequency_hz, np.moveaxis(np.array(pairs), -1, 0))


def _pair(found: FrfSet, output: Channel, force: Channel, where: str) -> Complex:
    """(lines,) of one pair, or of the reciprocal one, whatever the signs of the channels."""
    for first, second in ((output, force), (force, output)):
        for i, one in enumerate(found.outputs):
            for j, other in enumerate(found.inputs):
                same = (one.node, abs(one.direction)) == (first.node, first.direction)
                if same and (other.node, abs(other.direction)) == (second.node, second.direction):
                    value = found.frf[:, i, j]
                    if np.isfinite(value).all():
                        return np.asarray(one.sign * other.sign * value)
    expected = f"the response of {output} by a force at {force}, or the other way round"
    raise InputError(where, "without an FRF that the coupling needs", expected)
