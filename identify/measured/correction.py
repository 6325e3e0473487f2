"""What a file of FRFs says wrongly, put right in the study: a factor, the quantity, rad/s for Hz, the axes.

The file stays as it is.  Noise and coherence go along; of FRFs whose axes are turned the noise alone does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from identify.core.arrays import Array, Complex
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet, Quantity


def _texts(data: Any) -> Any:
    """Keys of a mapping as text: points are numbers in YAML."""
    return {str(key): value for key, value in data.items()} if isinstance(data, dict) else data


ByChannel = Annotated[dict[str, float | str], BeforeValidator(_texts)]


class Correction(Settings):
    """Corrections of one measurement, whatever its file says."""

    factor: float = Field(1.0, description="times which all FRFs are taken; 9.80665 where g stands for m/s^2")
    quantity: Quantity | None = Field(
        None, description="what the FRFs really are: receptance, mobility or accelerance"
    )
    inverse: bool = Field(
        False,
        description="whether each is force over response, 1/H, such as an apparent mass for an accelerance",
    )
    frequency: Literal["Hz", "rad/s"] = Field("Hz", description="unit of the frequencies: Hz or rad/s")
    nodes: dict[int, int] = Field({}, description="what points of the file really are: {5: 6, 6: 5}")
    outputs: ByChannel = Field(
        {},
        description="of responses, what a channel really is, or the factor of a point or channel:"
        " {'5:+X': '5:-Y', 12: 10}; after `nodes`",
    )
    inputs: ByChannel = Field({}, description="the same of forces")
    axes: Literal["link", "base"] = Field(
        "link", description="axes of the channels: those of the points' links, or of the robot's base"
    )

    def applied(self, data: FrfSet, where: str) -> FrfSet:
        """The set with all put right but its axes, for which `turned` needs the robot; InputError for a
        channel or point that it does not have.
        """
        if self == AS_STATED:
            return data
        sides = (data.outputs, data.inputs)
        named = [tuple(self._at(channel, data, where) for channel in side) for side in sides]
        outputs, rows = _corrected(self.outputs, named[0], f"{where} correct.outputs")
        inputs, columns = _corrected(self.inputs, named[1], f"{where} correct.inputs")
        factor = self.factor * rows[:, None] * columns
        frf, noise = self._upright(data)
        return replace(
            data,
            frequency_hz=data.frequency_hz / (2 * np.pi if self.frequency == "rad/s" else 1.0),
            frf=frf * factor,
            noise=None if noise is None else noise * np.abs(factor),
            outputs=outputs,
            inputs=inputs,
            quantity=self.quantity or data.quantity,
        )

    def _upright(self, data: FrfSet) -> tuple[Complex, Array | None]:
        """FRFs as response over force, and their noise; none where such a one is infinite."""
        if not self.inverse:
            return data.frf, data.noise
        with np.errstate(divide="ignore", invalid="ignore"):
            frf = np.where(data.frf == 0, np.nan, 1 / data.frf)
        return frf, None if data.noise is None else data.noise * np.abs(frf) ** 2

    def _at(self, channel: Channel, data: FrfSet, where: str) -> Channel:
        """A channel at its real point; InputError where the data have not the points that are named."""
        known = {one.node for one in (*data.outputs, *data.inputs)}
        lost = next((node for node in self.nodes if node not in known), None)
        if lost is not None:
            raise InputError(f"{where} correct.nodes", f"no point {lost}", f"one of {sorted(known)}")
        return replace(channel, node=self.nodes.get(channel.node, channel.node))


AS_STATED = Correction()


def _corrected(
    stated: Mapping[str, float | str], channels: tuple[Channel, ...], where: str
) -> tuple[tuple[Channel, ...], Array]:
    """What channels really are, and the factor (channels,) of each; InputError for a name of none, or where
    two become one.
    """
    factors, real = np.ones(len(channels)), list(channels)
    for name, value in stated.items():
        own = [n for n, one in enumerate(channels) if name in (str(one.node), str(one))]
        if not own:
            known = ", ".join(map(str, channels))
            raise InputError(where, f"no point or channel {name}", f"one of {known}, or a point of them")
        if isinstance(value, str):
            for n in own:
                real[n] = Channel.parse(value, where)
        else:
            factors[own] *= value
    doubled = next((one for one in real if real.count(one) > 1), None)
    if doubled is not None:
        raise InputError(where, f"two channels become {doubled}", "each once", "exchange both of them")
    return tuple(real), factors


def turned(data: FrfSet, axes: Mapping[int, Array], where: str) -> FrfSet:
    """The set with the translations of each point along other axes: axes (3, 3) by node, whose rows are the
    new directions in the old ones.

    InputError where a point does not have all three directions.
    """
    frf, variance, outputs = _turned(data.frf, data.noise, data.outputs, axes, where)
    back = None if variance is None else np.sqrt(np.swapaxes(variance, 1, 2))
    frf, variance, inputs = _turned(np.swapaxes(frf, 1, 2), back, data.inputs, axes, where)
    noise = None if variance is None else np.sqrt(np.swapaxes(variance, 1, 2))
    frf = np.swapaxes(frf, 1, 2)
    return replace(data, frf=frf, noise=noise, coherence=None, outputs=outputs, inputs=inputs)


def _turned(
    frf: Complex, noise: Array | None, channels: tuple[Channel, ...], axes: Mapping[int, Array], where: str
) -> tuple[Complex, Array | None, tuple[Channel, ...]]:
    """FRFs (lines, channels, others) and the squares of their noise, turned."""
    found, names = frf.copy(), list(channels)
    variance = None if noise is None else noise**2
    for node in dict.fromkeys(one.node for one in channels if one.motor is None):
        own = [n for n, one in enumerate(channels) if one.node == node and abs(one.direction) <= 3]
        if sorted(channels[n].axis for n in own) != [0, 1, 2]:
            missing = f"point {node} without all three directions"
            raise InputError(
                where, missing, "+X, +Y and +Z of every point, where `axes` are those of the base"
            )
        signs = np.array([channels[n].sign for n in own])
        turn = axes[node][:, [channels[n].axis for n in own]] * signs
        found[:, own] = np.einsum("ij,ljk->lik", turn, frf[:, own])
        if variance is not None:
            variance[:, own] = np.einsum("ij,ljk->lik", turn**2, variance[:, own])
        for axis, n in enumerate(own):
            names[n] = Channel(node, axis + 1)
    return found, variance, tuple(names)
