"""Normalised responses from a fast chirp: an offset mass on the spindle sweeps through the band in some
seconds while the robot moves.

The mass m at radius r pushes with F_x = A sin theta, F_y = A sin(theta - pi/2), A = m r omega^2 (fast chirp,
Eq. 1).  At a positive frequency F_y = -j F_x, so what a response X divided by F_x shows is

    X/A = H_xx + H_xy e^(-j pi/2),   Y/A = H_yx + H_yy e^(-j pi/2),   Z/A = H_zx + H_zy e^(-j pi/2)

(Eq. 2, all with the phase of F_x; the printed one has H_yy for H_xy in its first row and refers its second to
F_y).  Of a measured force only the part that turns with the mass counts: A = (F_x + j F_y) / 2.

The force comes from Eq. 1 with the measured angle of the spindle, from a load cell between robot and spindle,
corrected by the inertia of the spindle beyond it (Eq. 9), or from Eq. 1 below a frequency and from the load
cell above.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array, Complex
from identify.core.config import Settings
from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.time_history import TimeHistory

_LAG = (1.0 + 0.0j, 0.0 - 1.0j)
"""Phasors of F_x and F_y."""
_ASTRAY_DEG = 45.0
"""Half a right angle: cells are mounted along or across."""


class Chirp(Settings):
    """How a record of a rotating offset mass is read."""

    angle: str = Field(description="channel of the spindle's angle in rad, such as 14:+RZ")
    acts_at: tuple[str, str] = Field(
        description="channels along which F_x and F_y act, such as ['14:+X', '14:+Y']"
    )
    offset_kg: float = Field(gt=0, description="offset mass")
    radius_m: float = Field(gt=0, description="its distance from the spindle's axis")
    force: Literal["formula", "load-cell", "blend"] = Field(
        "formula", description="`blend`: formula below `blend_hz`, load cell from there"
    )
    blend_hz: float = Field(24.0, gt=0, description="where the load cell takes over")
    load_cell: tuple[str, str] | None = Field(
        None, description="its channels along F_x and F_y: the force that the robot feels"
    )
    load_cell_turn_deg: float = Field(
        0.0,
        description="how far the cell's axes are turned about the spindle's from those of F_x to those of"
        " F_y; 180 where it tells the opposite force; a channel such as 13:-Y is the negative of 13:+Y",
    )
    spindle_kg: float = Field(0.0, ge=0, description="what hangs beyond the load cell: spindle, holder, tool")
    accelerometer: tuple[str, str] | None = Field(
        None, description="its channels along F_x and F_y, for the spindle's inertia"
    )

    @model_validator(mode="after")
    def _complete(self) -> Chirp:
        if self.force != "formula" and (self.load_cell is None or self.accelerometer is None):
            raise ValueError(f"force: {self.force} needs `load_cell` and `accelerometer`")
        return self


def frf_from_chirp(history: TimeHistory, chirp: Chirp) -> FrfSet:
    """Receptances X/A (lines, responses, 1 of 2 inputs) of each block, averaged over blocks with the power of
    the force as weight (H1).

    The set's `simultaneous_inputs` says that the forces act at once.  InputError for channels that the
    record lacks, or a chirp that does not turn one way.
    """
    angle = history.data[:, :, _signal(history, chirp.angle, "rad")]
    frequency_hz = np.fft.rfftfreq(history.data.shape[1], 1 / history.sample_rate_hz)[1:]
    force, notes = _formula(angle, chirp, history), list[str]()
    if chirp.force != "formula":
        felt, inertia = _felt(history, chirp), _inertia(history, chirp)
        notes.append(_beside_formula(felt, force - _turning(*inertia), history))
        measured = _turning(*(f + a for f, a in zip(felt, inertia, strict=True)))
        force = (
            measured
            if chirp.force == "load-cell"
            else np.where(frequency_hz < chirp.blend_hz, force, measured)
        )
    responses = [n for n, unit in enumerate(history.units) if unit == "m/s^2"]
    if not responses:
        raise InputError(
            history.source or "time history", "no acceleration", "responses in m/s^2, g or the like"
        )
    spectra = np.fft.rfft(history.data[:, :, responses], axis=1)[:, 1:]
    with np.errstate(
        divide="ignore", invalid="ignore"
    ):  # lines without force come out as NaN, which the study refuses in its band
        ratio = (
            np.sum(spectra * force.conj()[:, :, None], axis=0) / np.sum(np.abs(force) ** 2, axis=0)[:, None]
        )
    frf = np.full((len(frequency_hz), len(responses), 2), np.nan, dtype=complex)
    frf[:, :, 0] = ratio / (2j * np.pi * frequency_hz[:, None]) ** 2
    return FrfSet(
        frequency_hz=frequency_hz.astype(np.float64),
        frf=frf,
        outputs=tuple(history.channels[n] for n in responses),
        inputs=tuple(Channel.parse(text, "chirp.acts_at") for text in chirp.acts_at),
        quantity="receptance",
        simultaneous_inputs=_LAG,
        source=history.source,
        sha256=history.sha256,
        notes=tuple(notes),
    )


def _beside_formula(felt: tuple[Array, Array], expected: Complex, history: TimeHistory) -> str:
    """Gain and turn of the load cell's force along x and y (blocks, samples) beside what the formula leaves
    for it to feel (blocks, lines), as a sentence; InputError where it is turned by more than half a right
    angle, or mirrored: then frame or sign are not as stated.
    """
    along, against = (
        complex(np.sum(part * expected.conj()) / np.sum(np.abs(expected) ** 2))
        for part in (_turning(*felt), _turning(felt[0], -felt[1]))
    )
    where = f"{history.source or 'time history'}, estimate.chirp.load_cell"
    if abs(against) > abs(along):
        fix = "turn the sign of one of its channels, such as 13:-Y, or exchange them"
        raise InputError(where, "a force that turns against the offset mass", "one that turns with it", fix)
    turned = -float(np.degrees(np.angle(along)))
    if abs(turned) > _ASTRAY_DEG:
        found = f"axes turned by {turned:.0f}° against those of the formula"
        fix = f"add {turned:.0f} to `load_cell_turn_deg`"
        raise InputError(where, found, f"one within {_ASTRAY_DEG:g}°", fix)
    gain = f"{abs(along):.3f} times what the formula tells"
    return f"the load cell feels {gain}, with axes turned by {turned:.1f}°"


def _formula(angle: Array, chirp: Chirp, history: TimeHistory) -> Complex:
    """A (blocks, lines) by Eq. 1 from the angle (blocks, samples), rad."""
    speed = np.gradient(angle, axis=1) * history.sample_rate_hz
    if np.abs(speed).max() < 1.0 or np.median(speed) < 0:
        raise InputError(
            history.source or "time history",
            "a spindle that stands still or turns backwards",
            "a positive rising angle",
        )
    size = chirp.offset_kg * chirp.radius_m * speed**2
    return _turning(size * np.sin(angle), size * np.sin(angle - np.pi / 2))


def _felt(history: TimeHistory, chirp: Chirp) -> tuple[Array, Array]:
    """What the load cell feels along F_x and F_y, (blocks, samples), N."""
    assert chirp.load_cell is not None  # the settings have checked it
    turn = np.radians(chirp.load_cell_turn_deg)
    first, second = (_signed(history, channel, "N") for channel in chirp.load_cell)
    return np.cos(turn) * first - np.sin(turn) * second, np.sin(turn) * first + np.cos(turn) * second


def _inertia(history: TimeHistory, chirp: Chirp) -> tuple[Array, Array]:
    """What accelerates the spindle with the robot along F_x and F_y, (blocks, samples), N (Eq. 9)."""
    assert chirp.accelerometer is not None  # the settings have checked it
    along_x, along_y = (_signed(history, channel, "m/s^2") for channel in chirp.accelerometer)
    return chirp.spindle_kg * along_x, chirp.spindle_kg * along_y


def _signed(history: TimeHistory, text: str, unit: str) -> Array:
    """A signal (blocks, samples), or the negative of the one of the opposite direction."""
    channel = Channel.parse(text, "estimate.chirp")
    told = zip(history.channels, history.units, strict=True)
    if (channel, unit) in told:
        return np.asarray(history.data[:, :, _signal(history, text, unit)])
    opposite = str(Channel(channel.node, -channel.direction))
    return np.asarray(-history.data[:, :, _signal(history, opposite, unit)])


def _turning(along_x: Array, along_y: Array) -> Complex:
    """The part of a force (blocks, samples) that turns from x to y, as spectrum (blocks, lines) with the
    phase of its x component.
    """
    x, y = (np.fft.rfft(force, axis=1)[:, 1:] for force in (along_x, along_y))
    return np.asarray((x + 1j * y) / 2)


def _signal(history: TimeHistory, text: str, unit: str) -> int:
    """Number of the signal of that channel and unit; InputError where the record has none."""
    channel = Channel.parse(text, "estimate.chirp")
    for number, found in enumerate(zip(history.channels, history.units, strict=True)):
        if found == (channel, unit):
            return number
    known = ", ".join(f"{c} ({u})" for c, u in zip(history.channels, history.units, strict=True))
    raise InputError("estimate.chirp", f"no signal {channel} in {unit}", f"one of {known}")
