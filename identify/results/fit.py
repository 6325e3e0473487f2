"""The result of a run and its HDF5 layout, in one place: the classes below are the groups of the file.

Arrays and texts are datasets, numbers attributes, `None` is left out, nested classes are groups.  The file is written
aside, flushed to disk and renamed, so that it is whole at every moment.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeVar, Union

import h5py
import numpy as np
from numpy.typing import NDArray

from identify.core import atomic as whole
from identify.core.errors import InputError

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Texts = tuple[str, ...]
LAYOUT = 1
UNFINISHED = "unfinished"
_ELSEWHERE = "choose another with `--out`"
_KINDS = {
    "fit": "a finished fit",
    "modes": "a modal analysis",
    "discovery": "a search for missing effects",
    "batch": "a batch",
    "map": "a map",
    "map-part": "part of a map",
    "motion": "a simulated or fitted motion",
    "explained": "an explained motion",
    "joints": "identified joints",
    UNFINISHED: "an interrupted run",
}
T = TypeVar("T")


@dataclass(frozen=True)
class ParameterTable:
    """All parameters (p of them), fixed ones too; std on the search scale (ln value where log), NaN where fixed."""

    name: Texts
    unit: Texts
    initial: Array
    value: Array
    lower: Array
    upper: Array
    log: NDArray[np.bool_]
    free: NDArray[np.bool_]
    std: Array
    low_95: Array
    high_95: Array
    status: Texts


@dataclass(frozen=True)
class StartTable:
    """One row per start: initial and final values (starts, p), cost, evaluations, seconds, and how it ended."""

    initial: Array
    final: Array
    cost: Array
    evaluations: Array
    seconds: Array
    converged: NDArray[np.bool_]
    sentence: Texts


@dataclass(frozen=True)
class Geometry:
    """Where things are at a posture, in the base's axes, m: points (n, 3) with their nodes, and the skeleton of joint origins (k, 3).

    segments (j, 2): rows of points that a measurement's trace lines join; axes (n, 3, 3): rows are the directions of the channels X, Y
    and Z of each point, None in files written before they were kept.
    """

    nodes: NDArray[np.int_]
    point_names: Texts
    point_links: Texts
    points: Array
    skeleton: Array
    segments: NDArray[np.int_] | None = None
    axes: Array | None = None


@dataclass(frozen=True)
class Modes:
    """Modes of the model (m): frequency, damping ratio, shapes at the points (m, n, 3) and at the skeleton (m, k, 3), base axes."""

    frequency_hz: Array
    damping_ratio: Array
    point_shapes: Complex
    skeleton_shapes: Complex


@dataclass(frozen=True)
class ModePairs:
    """Measured modes beside the model's: rows of each, MAC of the pair (NaN without shapes), and the whole MAC matrix (measured, model).

    measured_shapes (measured modes, points, 3), base axes, NaN where a point was not measured; origin: where they come from.
    """

    measured_frequency_hz: Array
    measured_damping_ratio: Array
    measured: NDArray[np.int_]
    model: NDArray[np.int_]
    mac: Array
    mac_matrix: Array | None
    measured_shapes: Complex | None
    origin: str


@dataclass(frozen=True)
class FrfComparison:
    """FRFs (lines, pairs): measured, predicted at the start (None: no such model) and as fitted, noise (std of real or imaginary
    part); per pair the errors.

    gap: RMS residual over noise; relative: |difference| / |measured| over the band; frac: see identify.modal.mac; area as in
    Kobe Eq. 10 over the area below the measurement.
    """

    quantity: str
    unit: str
    window_decay_per_s: float
    frequency_hz: Array
    output: Texts
    input: Texts
    measured: Complex
    initial: Complex | None
    fitted: Complex
    band_95: Array | None
    noise: Array | None
    coherence: Array | None
    gap: Array | None
    relative_error: Array
    frac: Array
    area_error: Array


@dataclass(frozen=True)
class MeasurementResult:
    """One measurement: what it was, and how the model does on it."""

    name: str
    use: str
    file: str
    sha256: str
    posture_deg: Array
    gap: float
    geometry: Geometry
    modes: Modes
    frf: FrfComparison | None
    pairs: ModePairs | None


@dataclass(frozen=True)
class PublishedValues:
    """What a publication found: values in the order of the parameters (p), NaN where it says nothing, and its modes."""

    source: str
    value: Array
    frequency_hz: Array
    damping_ratio: Array


@dataclass(frozen=True)
class ProfileCurve:
    """Profile likelihood of a parameter: its values (n,), the rise of chi-square (n,), and where it crosses 3.84 (95 %), NaN if nowhere."""

    values: Array
    rise: Array
    low: float
    high: float


@dataclass(frozen=True)
class SettingTable:
    """Every setting of a run: its key, its value as text, and where the value came from (`identify.results.setting_table`)."""

    key: Texts
    value: Texts
    source: Texts


@dataclass(frozen=True)
class Provenance:
    """Where a result comes from; settings: None in files written before they were kept."""

    identify: str
    python: str
    platform: str
    packages: Texts
    written: str
    config_path: str
    config_sha256: str
    config: str
    input_files: Texts
    input_sha256: Texts
    settings: SettingTable | None = None


@dataclass(frozen=True)
class Description:
    """The texts of the files that describe the robot (its name says what it is) and the points, so that a result can be used alone."""

    robot_name: str
    robot: str
    points: str


@dataclass(frozen=True)
class Result:
    """A whole run.  verdict and notes are sentences; history as in `identify.fitting.fit.Fit`; effects are the sentences of the model's effects."""

    KIND: ClassVar[str] = "fit"
    layout: int
    kind: str
    key: str
    name: str
    seed: int
    verdict: Texts
    notes: Texts
    effects: Texts
    cost_kind: str
    cost: float
    gap: float
    gap_validation: float
    converged: bool
    seconds: float
    parameters: ParameterTable
    correlation: Array
    singular_values: Array
    directions: Array
    inseparable: Texts
    starts: StartTable
    history: Array
    measurements: dict[str, MeasurementResult]
    published: PublishedValues | None
    profiles: dict[str, ProfileCurve]
    provenance: Provenance
    description: Description | None = None


@dataclass(frozen=True)
class Unfinished:
    """A run that is under way or was interrupted: what it would be a run of, and all costs in order (`identify.fitting.journal`)."""

    KIND: ClassVar[str] = UNFINISHED
    layout: int
    kind: str
    key: str
    costs: Array


def unfinished(key: str, costs: Array) -> Unfinished:
    """What is on disk while a run goes on."""
    return Unfinished(LAYOUT, UNFINISHED, key, costs)


def check_writable(path: Path) -> None:
    """Raise an InputError where a result cannot be written; what is at `path` stays."""
    whole.check_writable(path, _ELSEWHERE)


def write(result: Any, path: Path) -> None:
    """Write a result whole.  Raises InputError where the folder cannot be written."""

    def fill(aside: Path) -> None:
        with h5py.File(aside, "w") as file:
            _write_group(file, result)

    whole.write_whole(path, fill, _ELSEWHERE)


def read(path: Path, kind: type[T] = Result) -> T:  # type: ignore[assignment]
    """Read a result; raises InputError for a file that is none, or one of another layout."""
    try:
        with h5py.File(path, "r") as file:
            layout = file.attrs.get("layout")
            if layout != LAYOUT:
                found = "not a result of identify" if layout is None else f"layout {layout}"
                raise InputError(str(path), found, f"a result file of layout {LAYOUT}", "run the fit again with this version")
            stored, wanted = file["kind"][()].decode(), kind.KIND  # type: ignore[attr-defined]
            if stored != wanted:
                fix = "see `identify fit --resume`" if UNFINISHED in (stored, wanted) else ""
                raise InputError(str(path), f"holds {_KINDS.get(stored, stored)}", _KINDS[wanted], fix)
            return _read_group(file, kind)
    except OSError as error:
        raise InputError(str(path), f"cannot be read as HDF5 ({error})", "a result file written by `identify fit`") from error


def kind_of(path: Path) -> str:
    """What a result file holds: `fit`, `modes`, `unfinished`; empty for a file that is no result."""
    try:
        with h5py.File(path, "r") as file:
            return file["kind"][()].decode() if "kind" in file else ""
    except OSError:
        return ""


def _write_group(group: h5py.Group, item: Any) -> None:
    entries = item.items() if isinstance(item, dict) else ((f.name, getattr(item, f.name)) for f in dataclasses.fields(item))
    for name, value in entries:
        if value is None:
            continue
        if dataclasses.is_dataclass(value) or isinstance(value, dict):
            _write_group(group.create_group(name, track_order=True), value)
        elif isinstance(value, tuple):
            group.create_dataset(name, data=np.array(value, dtype=object), dtype=h5py.string_dtype(), shape=(len(value),))
        elif isinstance(value, (np.ndarray, str)):
            group.create_dataset(name, data=value)
        else:
            group.attrs[name] = value


def _read_group(group: h5py.Group, kind: type[T]) -> T:
    hints = typing.get_type_hints(kind)
    values = {field.name: _read_value(group, field.name, hints[field.name]) for field in dataclasses.fields(kind)}  # type: ignore[arg-type]
    return kind(**values)


def _read_value(group: h5py.Group, name: str, hint: Any) -> Any:
    if typing.get_origin(hint) in (Union, types.UnionType):
        if name not in group and name not in group.attrs:
            return None
        hint = next(option for option in typing.get_args(hint) if option is not type(None))
    if typing.get_origin(hint) is dict:
        inner = typing.get_args(hint)[1]
        return {key: _read_group(member, inner) for key, member in group[name].items()}
    if typing.get_origin(hint) is tuple:
        return tuple(text.decode() for text in group[name][()])
    if dataclasses.is_dataclass(hint):
        return _read_group(group[name], typing.cast(type, hint))
    if hint in (int, float, bool):
        return hint(group.attrs[name])
    value = group[name][()]
    return value.decode() if hint is str else value
