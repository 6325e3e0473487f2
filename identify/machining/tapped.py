"""A tool whose tip was tapped on the machine, without a model of what carries it: FRFs, or their modes.

The receptance of a tip by the modes that were found in its FRFs, as smooth as these:

    H(s) = sum_k R_k / (s - lambda_k) + R_k* / (s - lambda_k*) + U + L / s^2

with the poles of a modal analysis, and residues R, and U and L for modes above and below, as they give its
rebuilt FRFs back by least squares.  Uncertain are frequencies and dampings, as the analysis says, and
residues, U and L, as what it left of the FRFs does, taken as their noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.errors import InputError
from identify.core.text import listed
from identify.core.thresholds import SIGMAS_95
from identify.machining.exact_limit import ExactLimit
from identify.machining.mounted import Cutting
from identify.machining.structure import Structure, conjugated
from identify.machining.tip_lines import TipLines
from identify.machining.tool import Tool
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet
from identify.measured.noise import without_bias
from identify.measured.scatter import scatter
from identify.results.modes import AnalysedMeasurement, ModeTable

_AXES, _EVEN = "XYZ", 4
"""Of four lines that follow the receptance, one more is even in the logarithm."""
Pairs = Sequence[tuple[Channel, Channel]]
"""Responses and forces, one for each column of values (lines, pairs)."""


class Tip(Protocol):
    """The receptance of a tip along the tool's axes, and what is uncertain of it."""

    @property
    def line_hz(self) -> Array:
        """(lines,), Hz, at which it was measured."""

    def receptance(self, line_hz: Array) -> Complex:
        """(l, 3, 3), m/N, at lines (l,), Hz, of 0 or more."""

    def own(self, line_hz: Array) -> Array:
        """(l, 3, 3), m/N: standard deviation of either part by what each line has of its own."""

    def shared(self, line_hz: Array) -> Complex:
        """(l, 3, 3, c), m/N, per unit of each independent number that all lines share."""


@dataclass(frozen=True, kw_only=True)
class Tapped(Cutting):
    """A tool on a measured tip, along the axes of its file; said: what was assumed, in sentences."""

    known: Tip
    node: int
    said: tuple[str, ...] = ()

    @property
    def in_time(self) -> Structure | None:
        """FRFs have no equation in time."""
        return None

    @property
    def highest_hz(self) -> float:
        """That of the file."""
        return float(self.known.line_hz[-1])

    def lines_hz(self, count: int) -> Array:
        """So many of the file, dense where the receptance turns, and a few up to three times as high."""
        own = self.known.line_hz
        tip = self.known.receptance(own).reshape(len(own), -1)
        turns = np.linalg.norm(np.diff(tip, axis=0), axis=1) / np.linalg.norm(tip[1:], axis=1)
        passed = np.concatenate([[0.0], np.cumsum(turns)])
        dense = own[np.searchsorted(passed, np.linspace(0.0, passed[-1], count))]
        even = np.geomspace(own[0], 3 * own[-1], max(2, count // _EVEN))
        return np.unique(np.concatenate([[0.0], dense, even]))

    def tip(self, line_hz: Array) -> Complex:
        """As measured, and conjugate at negative lines."""
        return conjugated(self.known.receptance(np.abs(line_hz)), line_hz)

    @cached_property
    def uncertain(self) -> UncertainTip:
        """What noise and modal analysis leave open."""
        return UncertainTip(self.known)


@dataclass(frozen=True)
class UncertainTip:
    """A measured tip, where a limit asks how far it may be off."""

    known: Tip

    def relative(self, limit: ExactLimit) -> tuple[Array, float]:
        """What a limit changes, relative to it: per unit of each number, and by noise of its own lines."""
        at = np.abs(limit.lines_hz)
        columns = conjugated(self.known.shared(at), limit.lines_hz)
        change = np.einsum("lij,lijc->c", limit.slope, columns).real
        own = np.linalg.norm(np.abs(limit.slope) * self.known.own(at))
        return change / limit.depth, float(own) / limit.depth

    def half_band(self, line_hz: Array) -> Array:
        """(l, 3, 3), m/N: half the 95 % band, of the size of the receptance's error."""
        size = np.linalg.norm(self.known.shared(line_hz), axis=-1)
        return np.asarray(SIGMAS_95 * np.hypot(size, np.sqrt(2) * self.known.own(line_hz)))


def of_frfs(data: FrfSet, tool: Tool, where: str, speeds: int, draws: int) -> Tapped:
    """The tool on a tip that FRFs were measured at; InputError where it is not there, or the tool's file
    describes a spindle beside it.
    """
    if data.window_decay_per_s:
        found = "FRFs behind an exponential window"
        raise InputError(data.source, found, "FRFs without one", "find their modes: `identify modes`")
    data, said = _with_noise(data.lines(data.frequency_hz > 0))
    rows, columns = np.nonzero(data.measured)
    pairs = [(data.outputs[i], data.inputs[j]) for i, j in zip(rows, columns, strict=True)]
    node = _node(pairs, tool, data.source)
    raised = ((2j * np.pi * data.frequency_hz) ** (2 - POWER[data.quantity]))[:, None]
    accelerance, assumed = _filled(node, pairs, raised * data.frf[:, rows, columns])
    noise = np.zeros_like(accelerance.real)
    if data.noise is not None:
        noise = np.abs(_filled(node, pairs, np.abs(raised) * data.noise[:, rows, columns])[0])
    axes = tool.axes(np.eye(3), where=where)
    turned = np.sqrt(axes**2 @ noise**2 @ (axes**2).T)
    known = TipLines(data.frequency_hz, np.asarray(axes @ accelerance @ axes.T), turned)
    return _tapped(known, node, axes, (*assumed, *said), tool, where, speeds, draws)


def of_modes(found: AnalysedMeasurement, tool: Tool, where: str, speeds: int, draws: int) -> Tapped:
    """The same by the modes that were found in such FRFs."""
    frf = found.frf
    if found.output_only is not None:
        raise InputError(found.file, "modes from responses alone", "modes of FRFs, which have modal masses")
    texts = zip(frf.output, frf.input, strict=True)
    pairs = [(Channel.parse(output), Channel.parse(force)) for output, force in texts]
    node = _node(pairs, tool, found.file)
    s = np.asarray(frf.window_decay_per_s + 2j * np.pi * frf.frequency_hz)
    rebuilt, assumed = _filled(node, pairs, frf.fitted)
    left = _filled(node, pairs, frf.measured - frf.fitted)[0]
    axes = tool.axes(np.eye(3), where=where)
    rest = np.sqrt(np.mean(np.abs(axes @ left @ axes.T) ** 2, axis=0) / 2)
    turned = np.asarray(axes @ rebuilt @ axes.T)
    known = tip_modes(found.modes, frf.frequency_hz, s, POWER[frf.quantity], turned, rest)
    said = "the tip is that of the modes in the file; the residual of its FRFs is taken as noise"
    return _tapped(known, node, axes, (*assumed, said), tool, where, speeds, draws)


def _tapped(
    known: Tip,
    node: int,
    axes: Array,
    said: tuple[str, ...],
    tool: Tool,
    where: str,
    speeds: int,
    draws: int,
) -> Tapped:
    for key in ("modes", "coupling"):
        if getattr(tool, key):
            found = "a spindle of its own beside a tip that was measured with it"
            raise InputError(f"{where}: {key}", found, "the tip alone", f"leave `{key}` out")
    return Tapped(
        tool=tool, where=where, axes=axes, speeds=speeds, draws=draws, known=known, node=node, said=said
    )


def _node(pairs: Pairs, tool: Tool, source: str) -> int:
    """The node of the tip: the tool's, or the only one that was tapped and measured in one direction."""
    driven = {one.node for one, other in pairs if one.place == other.place and 1 <= abs(one.direction) <= 3}
    if tool.node in driven or (tool.node is None and len(driven) == 1):
        return tool.node or driven.pop()
    names = listed([f"node {node}" for node in sorted(driven)])
    found = f"drive points at {names}" if driven else "no drive point"
    fix = "say which it is: `node` in the tool's file" if driven else "tap the tip beside its sensor"
    raise InputError(source, found, "FRFs of the tip, tapped where its motion was measured", fix)


def _with_noise(data: FrfSet) -> tuple[FrfSet, tuple[str, ...]]:
    """With their noise, by coherence and averages or by their scatter from line to line; or a sentence."""
    if data.coherence is not None and (data.averages or 0) >= 2:
        return without_bias(data), ()
    between = scatter(data)
    if between is None:
        return data, ("the file does not tell the noise of its FRFs: the bands are without it",)
    said = "the noise of the FRFs is their scatter from line to line: the file has no coherence and averages"
    return replace(data, noise=np.sqrt(between / 2)), (said,)


def _filled(node: int, pairs: Pairs, values: Array | Complex) -> tuple[Complex, tuple[str, ...]]:
    """(lines, 3, 3) along x, y and z of what was measured at the tip, either way round, nothing elsewhere;
    and what that assumes.
    """
    found, known = np.zeros((len(values), 3, 3), dtype=complex), np.zeros((3, 3), dtype=bool)
    for value, (output, force) in zip(values.T, pairs, strict=True):
        straight = all(1 <= abs(one.direction) <= 3 for one in (output, force))
        if straight and output.node == force.node == node:
            found[:, output.axis, force.axis] = output.sign * force.sign * value
            known[output.axis, force.axis] = True
    for row, column in np.argwhere(~known & known.T):
        found[:, row, column] = found[:, column, row]
    missing = [
        _AXES[row] if row == column else f"{_AXES[row]} by {_AXES[column]}"
        for row, column in np.argwhere(~(known | known.T))
        if row <= column
    ]
    if not missing:
        return found, ()
    return found, (f"what was not measured at the tip is taken as rigid: {listed(missing)}",)


@dataclass(frozen=True)
class TipModes:
    """line_hz (lines,), Hz: those of the FRFs; poles (m,), rad/s; parts (2 m + 2, 3, 3) along the tool's
    axes: real and imaginary parts of residues, U, L; moved (2 m,), rad/s: change of a pole per standard
    deviation of its frequency, then of its damping; root (2 m + 2, 2 m + 2): of the parts' covariance, per
    noise of an FRF, spread (3, 3).
    """

    line_hz: Array
    poles: Complex
    parts: Array
    moved: Complex
    root: Array
    spread: Array

    def receptance(self, line_hz: Array) -> Complex:
        """(l, 3, 3), m/N, at lines (l,), Hz, of 0 or more; below the lowest known one as there."""
        columns = _columns(self._s(line_hz), self.poles)
        return np.asarray(np.einsum("lk,kij->lij", columns, self.parts))

    def own(self, line_hz: Array) -> Array:
        """(l, 3, 3): nothing is of one line alone."""
        return np.zeros((len(line_hz), 3, 3))

    def shared(self, line_hz: Array) -> Complex:
        """(l, 3, 3, c), m/N: change per standard deviation of each frequency, each damping, and each
        combination of the parts of each FRF.
        """
        s, count = self._s(line_hz), len(self.poles)
        residues = self.parts[:count] + 1j * self.parts[count : 2 * count]
        slopes = [
            np.einsum("lk,kij->lijk", moved / (s[:, None] - poles) ** 2, by)
            for moved, poles, by in (
                (self.moved, np.tile(self.poles, 2), np.tile(residues, (2, 1, 1))),
                (self.moved.conj(), np.tile(self.poles.conj(), 2), np.tile(residues.conj(), (2, 1, 1))),
            )
        ]
        by_parts = _columns(s, self.poles) @ self.root
        each = np.einsum("lc,ij,ia,jb->lijabc", by_parts, self.spread, np.eye(3), np.eye(3))
        return np.concatenate([slopes[0] + slopes[1], each.reshape(len(s), 3, 3, -1)], axis=-1)

    def _s(self, line_hz: Array) -> Complex:
        return np.asarray(2j * np.pi * np.maximum(line_hz, self.line_hz[0]))


def tip_modes(
    modes: ModeTable, line_hz: Array, s: Complex, power: int, rebuilt: Complex, spread: Array
) -> TipModes:
    """From modes and rebuilt FRFs (lines, 3, 3), s^power times receptances in m/N, at s (lines,), rad/s, of
    lines (lines,), Hz; spread (3, 3): RMS of either part of what the modes leave of the measured ones.
    """
    omega, ratio = 2 * np.pi * modes.frequency_hz, modes.damping_ratio
    root = np.sqrt(1 - ratio**2)
    poles = omega * (-ratio + 1j * root)
    std_hz, std_ratio = (np.nan_to_num(one) for one in (modes.frequency_std_hz, modes.damping_std))
    moved = np.concatenate(
        [poles * std_hz / modes.frequency_hz, omega * (-1 - 1j * ratio / root) * std_ratio]
    )
    columns = (s**power)[:, None] * _columns(s, poles)
    size = np.linalg.norm(columns, axis=0)
    left, right = (np.concatenate([one.real, one.imag]) for one in (columns / size, rebuilt.reshape(-1, 9)))
    q, r = np.linalg.qr(left)
    back = np.linalg.inv(r) / size[:, None]
    return TipModes(line_hz, poles, (back @ (q.T @ right)).reshape(-1, 3, 3), moved, back, spread)


def _columns(s: Complex, poles: Complex) -> Complex:
    """(l, 2 m + 2): what real and imaginary parts of residues, U and L are multiplied with at s (l,)."""
    line = s[:, None]
    one, other = 1 / (line - poles), 1 / (line - poles.conj())
    return np.concatenate([one + other, 1j * (one - other), np.ones_like(line), 1 / line**2], axis=1)
