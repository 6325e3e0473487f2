"""A drive of two inertias with a spring and a damper between them, friction at its motor, and sensors that
count, are late, sit behind a filter: records and the study that explains them.  Shares no code with what
explains them.

The motor's side is given at the joint: n^2 J of the rotor.  State: motor, link, and their speeds; exact steps
of the linear part (matrix exponential), friction held over an eighth of a sample.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
_PARTS = 8
_TONES = 40


@dataclass(frozen=True)
class Drive:
    """Inertias of rotor (at the joint) and link, kg m^2; stiffness N m/rad (infinite: rigid), damper
    N m s/rad; Coulomb N m and viscous N m s/rad friction of the motor, at the joint; gear ratio.
    """

    rotor: float
    link: float
    stiffness: float
    damper: float
    coulomb: float
    viscous: float
    ratio: float

    @property
    def locked_hz(self) -> float:
        """Frequency of the link with the motor held."""
        return float(np.sqrt(self.stiffness / self.link) / (2 * np.pi))


@dataclass(frozen=True)
class Sensing:
    """Samples a second and seconds; counts of the encoders per turn of the joint; how late the link's is
    read, s; corner, Hz, of the first-order filter of the torque (0: none), and its noise, as a share.
    """

    rate_hz: float
    seconds: float
    counts: float
    latency_s: float = 0.0
    torque_filter_hz: float = 0.0
    torque_noise: float = 0.005


def excited(drive: Drive, sensing: Sensing, band_hz: tuple[float, float], swing: float, seed: int) -> Array:
    """(samples, 4): time, motor position, torque at the motor, link position of a drive under a multisine of
    random phases in a band, whose slowest tone would move it by `swing`, rad.
    """
    rng = np.random.default_rng(seed)
    step = 1 / (sensing.rate_hz * _PARTS)
    time = np.arange(int(sensing.seconds / step)) * step
    tones, phases = np.linspace(*band_hz, _TONES), rng.uniform(0, 2 * np.pi, _TONES)
    size = swing * (drive.rotor + drive.link) * (2 * np.pi * band_hz[0]) ** 2
    push = size * np.sin(2 * np.pi * np.outer(time, tones) + phases).sum(axis=1) / np.sqrt(_TONES / 2)
    motor, link, torque = _moved(drive, push, step)
    late = round(sensing.latency_s / step)
    link = np.concatenate([np.full(late, link[0]), link[: len(link) - late]])
    seen = torque / drive.ratio
    if sensing.torque_filter_hz:
        keep = np.exp(-2 * np.pi * sensing.torque_filter_hz * step)
        seen = scipy.signal.lfilter([1 - keep], [1, -keep], seen)
    seen = seen + rng.normal(scale=sensing.torque_noise * float(seen.std()), size=len(seen))
    grain = 2 * np.pi / sensing.counts
    counted = [np.round((angle + offset) / grain) * grain for angle, offset in ((motor, 0.3), (link, -1.7))]
    return np.column_stack([time, counted[0], seen, counted[1]])[::_PARTS]


def _moved(drive: Drive, push: Array, step: float) -> tuple[Array, Array, Array]:
    """Motor, link (samples,), rad, and torque of the motor, N m at the joint."""
    rigid = not np.isfinite(drive.stiffness)
    masses = np.array([drive.rotor + (drive.link if rigid else 0.0), drive.link])
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    matrix = np.zeros((5, 5))
    matrix[:2, 2:4] = np.eye(2)
    if not rigid:
        matrix[2:4, :2] = -drive.stiffness * pair / masses[:, None]
        matrix[2:4, 2:4] = -drive.damper * pair / masses[:, None]
    matrix[2, 4] = 1 / masses[0]
    whole = scipy.linalg.expm(matrix * step)
    forward, drawn = whole[:4, :4].copy(), whole[:4, 4].copy()
    state, found = np.zeros(4), np.empty((len(push), 2))
    soft = 1e-3 * float(np.abs(push).max()) / masses.sum() * step * 1e3
    for row, torque in enumerate(push):
        found[row] = state[:2]
        against = drive.coulomb * np.tanh(state[2] / max(soft, 1e-9)) + drive.viscous * state[2]
        state = forward @ state + drawn * (torque - against)
    return found[:, 0], found[:, 0] if rigid else found[:, 1], push


def study(
    folder: Path,
    drive: Drive,
    sensing: Sensing,
    lowpass_hz: float,
    seed: int,
    more: Mapping[str, object] = {},
) -> Path:
    """A study of two records of the drive, one to fit and one to judge, whose link's inertia is known."""
    band, swing = band_of(drive), 0.05
    for name, number in (("a", 2 * seed), ("b", 2 * seed + 1)):
        table = excited(drive, sensing, band, swing, number)
        header = "time_s,motor,torque,link"
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.12g")
    (folder / "drive.yaml").write_text(
        "name: drive\nconvention: standard\n"
        "joints:\n  - {name: j1, d_m: 0, a_m: 0, alpha_deg: 0}\n"
        "links:\n  - {name: link1, mass_kg: 1, centre_m: [0, 0, 0],"
        f" inertia_kg_m2: [{drive.link}, {drive.link}, {drive.link}, 0, 0, 0]}}\n"
    )
    lines = [
        "schema: identify-explain/1\nname: drive\nrobot: {dh: drive.yaml}",
        f"drives: {{gear_ratio: [{drive.ratio}]}}",
        "records: [{name: A, file: a.csv}, {name: B, file: b.csv, use: validate}]",
        "time: {at: time_s}\nsignals:",
        "  motor_position: {at: motor, unit: rad}",
        "  motor_torque: {at: torque, unit: N m}",
        "  link_position: {at: link, unit: rad}",
        f"lowpass_hz: {lowpass_hz:g}",
        *(f"{key}: {value}" for key, value in more.items()),
    ]
    path = folder / "study.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


def band_of(drive: Drive) -> tuple[float, float]:
    """Hz, from well below the link's own frequency to well above the resonance."""
    locked = drive.locked_hz if np.isfinite(drive.stiffness) else 8.0
    resonance = locked * np.sqrt(1 + drive.link / drive.rotor)
    return 0.15 * locked, 1.6 * resonance


def drawn(rng: np.random.Generator, soft: bool = True) -> tuple[Drive, Sensing, float]:
    """A drive, its sensors and a low-pass at random, from a small servo to the base of a large robot."""
    link = float(np.exp(rng.uniform(np.log(2e-3), np.log(200.0))))
    rotor = link * float(rng.uniform(0.3, 3.0))
    locked = float(rng.uniform(3.0, 25.0))
    stiffness = link * (2 * np.pi * locked) ** 2 if soft else np.inf
    damper = 2 * float(rng.uniform(0.005, 0.05)) * link * 2 * np.pi * locked
    resonance = locked * float(np.sqrt(1 + link / rotor))
    weight = 0.05 * (rotor + link) * (2 * np.pi * 0.15 * locked) ** 2
    drive = Drive(
        rotor,
        link,
        stiffness,
        damper,
        weight * float(rng.uniform(0.02, 0.15)),
        weight * float(rng.uniform(0.05, 0.5)),
        float(rng.choice([1, 50, 100, 160])),
    )
    rate = float(rng.choice([250, 500, 1000]))
    late = float(rng.uniform(0.5, 2.0)) / rate if rng.uniform() < 0.4 else 0.0
    filtered = float(rng.uniform(4, 10)) * resonance if rng.uniform() < 0.4 else 0.0
    counts = float(2 ** int(rng.integers(17, 22)))
    sensing = Sensing(rate, 60.0 / locked + 5.0, counts, late, filtered)
    return drive, sensing, float(min(rng.uniform(0.8, 3.0) * resonance, 0.4 * rate))


def as_numbers(drive: Drive, sensing: Sensing) -> dict[str, float]:
    """All of it, for a table."""
    return {**asdict(drive), **asdict(sensing)}
