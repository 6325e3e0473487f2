"""A study: config.yaml read into settings, every error with its key, its line and a fix, all at once.

What the settings mean is turned into data and models in `identify.vibration.problem`.
"""

from __future__ import annotations

import difflib
import hashlib
from inspect import isabstract
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, Self, TypeVar, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from identify.core.errors import InputError, InputErrors
from identify.fitting.optimizers.base import Optimizer, parse_optimizer
from identify.measured.frf_records import FrfFileOptions
from identify.measured.source import Estimation
from identify.modal.settings import ModalSettings
from identify.model.effects.base import Effect, parse_effect
from identify.vibration.costs.base import Cost, parse_cost

SCHEMA = "identify/1"
S = TypeVar("S", bound=BaseModel)
_ROBUST_THEN_LIKELY: tuple[dict[str, Any], ...] = (
    {"kind": "gauss-newton", "cost": {"kind": "frf-least-squares", "residual": "log"}},
    {"kind": "gauss-newton"},
)
"""Default stages of FRF least squares: log residuals find the valley from poor guesses, the likelihood its bottom."""


class Settings(BaseModel):
    """A part of the config; keys that do not exist are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Payload(Settings):
    """A rigid body fixed to a link."""

    link: str = Field(description="link or frame that carries it")
    mass_kg: float = Field(gt=0)
    centre_m: tuple[float, float, float] = Field((0.0, 0.0, 0.0), description="centre of mass in the link's frame")
    inertia_kg_m2: tuple[float, float, float, float, float, float] = Field(
        (0.0,) * 6, description="ixx, iyy, izz, ixy, ixz, iyz about that centre; default: a point mass"
    )


class RobotSettings(Settings):
    """Where the robot is described: a URDF or a Denavit-Hartenberg table."""

    urdf: Path | None = Field(None, description="URDF with inertias")
    dh: Path | None = Field(None, description="YAML with a Denavit-Hartenberg table, masses, centres and inertias")
    payload: list[Payload] = Field([], description="bodies added to links")
    gravity_m_s2: tuple[float, float, float] | None = Field(None, description="in the base link's axes; default: down z")

    @model_validator(mode="after")
    def _one(self) -> RobotSettings:
        if (self.urdf is None) == (self.dh is None):
            raise ValueError("give either `urdf` or `dh`")
        return self


class RelativeNoise(Settings):
    """Noise as a share of each FRF's own RMS over the band."""

    relative: float = Field(gt=0, description="standard deviation of the complex value over the RMS of the FRF")


class ImpactSettings(Settings):
    """The blows of a hammer test, half-sines: what amplitude-dependent effects depend on."""

    peak_n: float = Field(gt=0, description="mean peak force of the blows, N")
    width_ms: float = Field(
        6.5, gt=0, description="how long a blow lasts, ms; friction torques found are in proportion to peak times width"
    )


class MeasurementSettings(FrfFileOptions):
    """One measurement: a file of FRFs, or a table of modes, at one posture."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)
    name: str | None = Field(None, description="default: the file's name")
    file: Path | None = Field(None, description="FRFs: .uff, .unv, .csv, .h5, .mat; with `estimate`, time histories")
    estimate: Estimation | None = Field(None, description="estimate FRFs from the time histories in the file")
    repeats: list[Path] = Field([], description="further files of the same measurement: the mean is used, its noise is their scatter")
    modes: Path | None = Field(None, description="modal table: .yaml or .csv")
    shapes: Path | None = Field(None, description="mode shapes of a modal table in .csv")
    posture_deg: list[float] = Field(description="joint angles, one per joint")
    speed_deg_per_s: list[float] | None = Field(None, description="joint speeds of a robot that moved, one per joint: Coriolis terms")
    detached: str | None = Field(None, description="this link and all beyond it were taken off")
    outputs: list[str] | None = Field(None, description="response channels to use, such as 12:+Z; default: all")
    inputs: list[str] | None = Field(None, description="force channels to use; default: all")
    impact: ImpactSettings | None = Field(None, description="the blows of a hammer test; needed by amplitude-dependent effects only")
    noise: Literal["coherence"] | RelativeNoise = Field("coherence", description="`coherence` (with `averages`), or {relative: 0.02}")
    use: Literal["fit", "validate"] = Field("fit", description="`validate`: never fitted, only predicted")

    @model_validator(mode="after")
    def _one(self) -> MeasurementSettings:
        if (self.file is None) == (self.modes is None):
            raise ValueError("give either `file` (FRFs) or `modes` (a modal table)")
        return self

    @model_validator(mode="after")
    def _frfs_only(self) -> MeasurementSettings:
        if self.modes is not None and (self.repeats or self.estimate):
            raise ValueError("`repeats` and `estimate` go with `file`, not with `modes`")
        return self

    @property
    def source(self) -> Path:
        """The file, whichever kind."""
        return self.file or self.modes or Path()


def _as_list(data: Any) -> Any:
    return data if isinstance(data, (list, tuple)) else [data]


class Study(Settings):
    """What one config.yaml describes; everything has a default but the robot and the data."""

    schema_: Literal["identify/1"] = Field(alias="schema", description="version of this format")
    name: str = Field("study", min_length=1, pattern=r"^[^/\\]+$", description="names the result file")
    robot: RobotSettings
    points: Path | None = Field(None, description="CSV of measurement points; needed for FRFs and mode shapes")
    measurements: list[MeasurementSettings] = Field(min_length=1)
    band_hz: tuple[float, float] | None = Field(None, description="lowest and highest frequency used; default: all lines")
    effects: list[Annotated[Effect, BeforeValidator(parse_effect)]] = Field(
        [parse_effect({"kind": "joint-compliance"})],
        min_length=1,
        description="the physics of the model; default: drive compliance of all joints",
    )
    initial: dict[str, float] = Field({}, description="start values by name of parameter, over those of the effects")
    cost: Annotated[Cost, BeforeValidator(parse_cost)] = Field(
        parse_cost("frf-least-squares"), description="how far a model is from the data"
    )
    optimizer: Annotated[list[Annotated[Optimizer, BeforeValidator(parse_optimizer)]], BeforeValidator(_as_list)] = Field(
        [], description="stages, one after the other; default: gauss-newton on log residuals, then the likelihood; else hybrid"
    )
    modal: ModalSettings = Field(ModalSettings(), description="how modes are found in measured FRFs, for `identify modes` and beside a fit")
    starts: int = Field(10, ge=1, description="at most this many starts; fewer when three agree on a minimum that explains the data")
    start_factor: float = Field(3.0, gt=1, description="further starts are drawn within this factor of the initial values")
    target_cost: float = Field(0.0, ge=0, description="a cost at or below this ends the fit")
    seed: int = Field(1, ge=0, description="all chance comes from this number")
    reference: Path | None = Field(None, description="published values (.yaml) that reports set beside the fitted ones")

    @model_validator(mode="after")
    def _consistent(self) -> Study:
        if self.band_hz is not None and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz: found [{self.band_hz[0]:g}, {self.band_hz[1]:g}]; expected the lower frequency first")
        if all(measurement.use == "validate" for measurement in self.measurements):
            raise ValueError("measurements: all are for validation; expected at least one with `use: fit`")
        return self

    @property
    def stages(self) -> list[Optimizer]:
        """The optimizers to run, with the default filled in."""
        if self.optimizer:
            return self.optimizer
        robust = self.cost == parse_cost("frf-least-squares")
        return [parse_optimizer(dict(stage)) for stage in _ROBUST_THEN_LIKELY] if robust else [parse_optimizer("hybrid")]

    @property
    def last_resort(self) -> list[Optimizer]:
        """The stages of one more start where the default ones did not agree; none where the study chose its optimizer."""
        if self.optimizer or self.stages == [parse_optimizer("hybrid")]:
            return []
        globally = {**_ROBUST_THEN_LIKELY[0], "kind": "hybrid", "evaluations": 4000, "rounds": 1}
        return [parse_optimizer(globally), parse_optimizer(dict(_ROBUST_THEN_LIKELY[1]))]


class ConfigFile(Settings, Generic[S]):
    """A study with the file it came from: text and sha256 go into the result, paths in it are relative to its folder."""

    path: Path
    text: str
    sha256: str
    study: S
    overrides: dict[str, Any] = {}
    """What the command line said in place of keys of the study, by key."""

    @classmethod
    def of(cls, path: Path, study: S, text: str) -> Self:
        """A study, the text that says it, and where that is."""
        return cls(path=path, text=text, sha256=hashlib.sha256(text.encode()).hexdigest(), study=study)

    def resolve(self, path: Path) -> Path:
        """A path of the config, relative to the config's folder."""
        return self.path.parent / path


class StudyFile(ConfigFile[Study]):
    """A study of FRFs or modes with its file."""


def read_study(path: Path) -> StudyFile:
    """The study in a YAML file.

    Raises InputError for a file that cannot be read or is no YAML, and InputErrors with every key that is wrong.
    """
    return StudyFile.of(path, *read_settings(path, Study, SCHEMA))


def family_of(path: Path) -> str:
    """The family of schemas that a config says it is of, such as `identify-motion`; empty where it says none."""
    data, _ = read_yaml(path)
    return str(data.get("schema", "")).partition("/")[0] if isinstance(data, dict) else ""


def read_settings(path: Path, kind: type[S], schema: str) -> tuple[S, str]:
    """The settings of that kind in a YAML file, whose `schema:` is to be `schema`, and its text; raises as `read_study` does."""
    data, text = read_yaml(path)
    if not isinstance(data, dict):
        raise InputError(str(path), "not a mapping of keys", f"`schema: {schema}` and the other keys", "see `identify config`")
    return validated(path, data, kind), text


def validated(path: Path, data: Any, kind: type[S]) -> S:
    """Settings of that kind from the data of a config; raises InputErrors with every key that is wrong, and its line."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise InputErrors([_input_error(path, data, fault, kind) for fault in error.errors()]) from error


def read_yaml(path: Path) -> tuple[Any, str]:
    """What a YAML file holds, and its text; raises InputError for one that cannot be read or is no YAML."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(path), f"cannot be read ({error})", "a config file", "write one with `identify init`") from error
    return parse_yaml(path, text), text


def parse_yaml(path: Path, text: str) -> Any:
    """The text of a config as data that know their lines; InputError where it is no YAML."""
    try:
        return YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        line = f" line {error.problem_mark.line + 1}" if error.problem_mark else ""
        found = f"not YAML ({error.problem or error.context})"
        raise InputError(f"{path}{line}", found, "`key: value` lines", "check indents and quotes") from error
    except YAMLError as error:
        raise InputError(str(path), f"not YAML ({error})", "`key: value` lines") from error


def _input_error(path: Path, data: Any, fault: Any, kind: type[BaseModel]) -> InputError:
    """A pydantic error as a sentence with the key and its line."""
    keys = [key for key in fault["loc"] if not (isinstance(key, str) and key[:1].isupper())]  # class names of unions are no keys
    where = f"{path}{line_of(data, keys)}: {'.'.join(map(str, keys)) or 'config'}"
    if fault["type"] == "extra_forbidden":
        known = [field.alias or name for name, field in _fields_at(kind, keys[:-1]).items()]
        near = difflib.get_close_matches(str(keys[-1]), known, n=1)
        fix = f"did you mean `{near[0]}`?" if near else "remove it"
        return InputError(where, "unknown key", "one of " + ", ".join(known) if known else "a known key", fix)
    if fault["type"] == "missing":
        return InputError(where, "missing", "a value", "see `identify config` for what it means")
    if fault["type"] == "value_error":
        return InputError(where, str(fault["ctx"]["error"]).rstrip("."))
    found = fault["input"] if isinstance(fault["input"], (str, int, float, bool)) else type(fault["input"]).__name__
    return InputError(where, f"found {found!r}", fault["msg"][:1].lower() + fault["msg"][1:])


def line_of(data: Any, keys: list[Any]) -> str:
    """` line N` of a key in the YAML, or of the nearest parent that has one."""
    line = ""
    for key in keys:
        try:
            marks = data.lc.data[key]
            line, data = f" line {marks[0] + 1}", data[key]
        except (AttributeError, KeyError, IndexError, TypeError):
            break
    return line


def _fields_at(kind: type[BaseModel], keys: list[Any]) -> dict[str, Any]:
    """The fields that are known where an unknown key was found; empty inside plug points, whose errors name them."""
    models: list[type[BaseModel]] = [kind]
    for key in (key for key in keys if isinstance(key, str)):
        models = [inner for model in models if key in model.model_fields for inner in _models_in(model.model_fields[key].annotation)]
    return {name: field for model in models if not isabstract(model) for name, field in model.model_fields.items()}


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    """The settings models that a field's type mentions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]
