"""A tool whose tip was tapped on the machine, without a model of what carries it: FRFs, or their modes."""

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
from identify.machining.tip_modes import tip_modes
from identify.machining.tool import Tool
from identify.measured.channel import Channel
from identify.measured.frf_set import POWER, FrfSet
from identify.measured.noise import without_bias
from identify.measured.scatter import scatter
from identify.results.modes import AnalysedMeasurement

_AXES, _EVEN = "XYZ", 4
"""Of four lines that follow the receptance, one more is even in the logarithm."""


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


Pairs = Sequence[tuple[Channel, Channel]]
"""Responses and forces, one for each column of values (lines, pairs)."""


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
        raise InputError(found.file, "modes from responses alone", "modes of FRFs, which tell what forces do")
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
    said = "the tip is that of the modes in the file; what they leave of its FRFs is taken as noise"
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
