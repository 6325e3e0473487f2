"""A study: config.yaml read into settings, every error with its key, its line and a fix, all at once.

What the settings mean is turned into data and models in `identify.vibration.problem`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from identify.core.config import ConfigFile, Settings, read_settings, read_yaml
from identify.core.errors import InputError, InputErrors
from identify.core.text import count
from identify.fitting.plan import StageSettings, as_list
from identify.measured.correction import AS_STATED, Correction
from identify.measured.frf_records import TEXT, FrfFileOptions
from identify.measured.registration.settings import RegistrationSettings
from identify.measured.several import name_of
from identify.measured.source import Estimation
from identify.modal.settings import ModalSettings, with_choices
from identify.model.effects.base import Effect, parse_effect
from identify.robot.joint_angles import AS_THE_ROBOT, JointAngles
from identify.robot.read import read_robot
from identify.robot.settings import RobotSettings
from identify.vibration.costs.base import Cost, parse_cost
from identify.vibration.nuisances.settings import UncertaintySettings, parse_uncertainty

SCHEMA = "identify/1"
_ROBUST_THEN_LIKELY: tuple[dict[str, Any], ...] = (
    {"kind": "gauss-newton", "cost": {"kind": "frf-least-squares", "residual": "log"}},
    {"kind": "gauss-newton"},
)
"""Default stages of FRF least squares: log residuals find the valley from poor guesses, the likelihood its
bottom.
"""


def _one_or_several(value: Any, read: ValidatorFunctionWrapHandler) -> Any:
    """A path or a list of some; ValueError for anything else."""
    try:
        found = read(value)
    except ValidationError:
        found = []
    if found == []:
        raise ValueError(f"found {value!r}; expected a path, or a list of paths")
    return found


class RelativeNoise(Settings):
    """Noise as a share of each FRF's own RMS over the band."""

    relative: float = Field(
        gt=0, lt=1, description="standard deviation of the complex value over the RMS of the FRF"
    )


class ImpactSettings(Settings):
    """The impacts of a hammer test, half-sines: what amplitude-dependent effects depend on."""

    peak_n: float = Field(gt=0, description="mean peak force of the impacts, N")
    width_ms: float = Field(
        6.5,
        gt=0,
        description="how long an impact lasts, ms; friction torques found are in proportion to peak x width",
    )


class MeasurementSettings(FrfFileOptions):
    """One measurement: a file of FRFs, or a table of modes, at one posture."""

    name: str | None = Field(None, description="default: the name of the file or folder")
    file: Annotated[Path | list[Path] | None, WrapValidator(_one_or_several)] = Field(
        None,
        description="FRFs: .uff, .unv, .csv, .txt, .h5, .mat; a list, a folder or a pattern such as p1/*.csv"
        " where they are in several; with `estimate`, time histories",
    )
    estimate: Estimation | None = Field(None, description="estimate FRFs from the time histories in the file")
    repeats: list[Path] = Field(
        [], description="further files of the same measurement: the mean is used, its noise is their scatter"
    )
    modes: Path | None = Field(None, description="modal table: .yaml or .csv")
    shapes: Path | None = Field(None, description="mode shapes of a modal table in .csv")
    correct: Correction = Field(
        AS_STATED, description="what the file says wrongly: a factor, the quantity, rad/s, points, axes"
    )
    posture_deg: list[float] = Field(description="joint angles, one per joint")
    speed_deg_per_s: list[float] | None = Field(
        None, description="joint speeds of a robot that moved, one per joint: Coriolis terms"
    )
    detached: str | None = Field(None, description="this link and all beyond it were taken off")
    outputs: list[str] | None = Field(
        None, description="response channels to use, such as 12:+Z; default: all"
    )
    inputs: list[str] | None = Field(None, description="force channels to use; default: all")
    impact: ImpactSettings | None = Field(
        None, description="the impacts of a hammer test; needed by amplitude-dependent effects only"
    )
    noise: Literal["coherence"] | RelativeNoise = Field(
        "coherence", description="`coherence` (with `averages`), or {relative: 0.02}"
    )
    motor_side: list[Literal["torque", "motion"]] = Field(
        [],
        description="what of `joint2:motor` is given at the motor's shaft: [torque, motion] or one of them,"
        " with the `gear_ratio` of its effect; default: all at the gear output",
    )
    motor_torque: Literal["total", "added"] = Field(
        "total",
        description="`total`: all that each motor exerts, as its controller logs it, so that nothing else"
        " holds its rotor; `added`: a torque beside that of a controller that goes on holding",
    )
    use: Literal["fit", "validate"] = Field("fit", description="`validate`: never fitted, only predicted")

    @model_validator(mode="after")
    def _one(self) -> MeasurementSettings:
        if (self.file is None) == (self.modes is None):
            raise ValueError("give either `file` (FRFs) or `modes` (a modal table)")
        return self

    @model_validator(mode="after")
    def _of_its_kind(self) -> MeasurementSettings:
        """Keys that would do nothing beside what is measured are refused."""
        if self.modes is not None:
            beside, keys = "modes", {"repeats", "estimate", "noise", "impact", "correct"}
            keys |= {"motor_side", "motor_torque"}
            keys |= {*FrfFileOptions.model_fields}
        elif self.estimate is not None:
            beside, keys = (
                "estimate",
                {"quantity", "unit", "averages", "variables", "channels", "shapes", *TEXT},
            )
            if self.estimate.excitation != "impacts":
                keys.add("window_decay_per_s")
        else:
            beside, keys = "file", {"shapes"}
        idle = sorted(keys & self.model_fields_set)
        if idle:
            raise ValueError(f"`{idle[0]}` has no meaning beside `{beside}`: leave it out")
        if self.shapes is not None and self.modes is not None and self.modes.suffix.lower() != ".csv":
            raise ValueError("`shapes` goes with `modes` in .csv; those in .yaml bring their own")
        return self

    @property
    def sources(self) -> list[Path]:
        """The files, folders or patterns, of whichever kind."""
        return self.file if isinstance(self.file, list) else [self.file or self.modes or Path()]

    @property
    def source(self) -> Path:
        """The file, folder or pattern; of several the first."""
        return self.sources[0]

    @property
    def label(self) -> str:
        """The name: as given, or that of the file, or of the folder of several."""
        return self.name or name_of(self.sources)


class VibrationStage(StageSettings):
    """A stage, which may have a cost of its own."""

    cost: Annotated[Cost, BeforeValidator(parse_cost)] | None = Field(
        None, description="another cost for this stage, such as a robust first one; default: the study's"
    )


class LikeSettings(Settings):
    """Another robot of the type that was fitted."""

    result: Path = Field(description="its result: of a fit, or of a discovery, whose final model is taken")
    spread: float = Field(
        gt=0,
        le=3,
        description="how far parameters of robots of the type differ, relative: one standard deviation",
    )


class Study(Settings):
    """What one config.yaml describes; everything has a default but the robot and the data."""

    schema_: Literal["identify/1"] = Field(alias="schema", description="version of this format")
    name: str = Field("study", min_length=1, pattern=r"^[^/\\]+$", description="names the result file")
    robot: RobotSettings = Field(description="the robot that was measured")
    joint_angles: JointAngles = Field(
        AS_THE_ROBOT,
        description="how `posture_deg` counts, where not as the robot file does: order, sign, offset",
    )
    points: Path | None = Field(
        None,
        description="CSV of measurement points; default: the nodes of the geometry in a file of FRFs, laid on"
        " the robot",
    )
    registration: RegistrationSettings | None = Field(
        None, description="without `points`: how the geometry of the test lies on the robot"
    )
    points_frame: Literal["link", "base"] = Field(
        "link",
        description="frame of their positions and axes: of the `link` of each, or of the `base` at a posture",
    )
    points_posture_deg: list[float] | None = Field(
        None,
        description="with `points_frame: base`: joint angles at which they were measured, counted as"
        " `posture_deg`",
    )
    measurements: list[MeasurementSettings] = Field(
        min_length=1, description="what was measured, one entry per posture"
    )
    band_hz: tuple[float, float] | None = Field(
        None, description="lowest and highest frequency used; default: all lines"
    )
    effects: list[Annotated[Effect, BeforeValidator(parse_effect)]] = Field(
        [parse_effect({"kind": "joint-compliance"})],
        min_length=1,
        description="the physics of the model; default: drive compliance of all joints",
    )
    initial: dict[str, float] = Field(
        {}, description="start values by name of parameter, over those of the effects"
    )
    like: LikeSettings | None = Field(
        None,
        description="a fitted robot of the same type: parameters start at its values, within the bounds that"
        " hold 95 % of such robots",
    )
    cost: Annotated[Cost, BeforeValidator(parse_cost)] = Field(
        parse_cost("frf-least-squares"), description="how far a model is from the data"
    )
    optimizer: Annotated[
        list[Annotated[VibrationStage, BeforeValidator(VibrationStage.parse)]], BeforeValidator(as_list)
    ] = Field(
        [],
        description=(
            "stages, one after the other; default: gauss-newton on log residuals, then the likelihood; else"
            " hybrid"
        ),
    )
    uncertainty: Annotated[UncertaintySettings, BeforeValidator(parse_uncertainty)] | None = Field(
        None,
        description=(
            "how far masses, places, directions, gains and angles may be from what was stated: `typical`,"
            " `careful`, or what is uncertain by how much; intervals carry it, and the likelihood fits it"
            " along; default: exactly as stated"
        ),
    )
    modal: ModalSettings = Field(
        ModalSettings(),
        description="how modes are found in measured FRFs, for `identify modes` and beside a fit",
    )
    modal_choices: Path | None = Field(
        None, description="YAML file of further keys of `modal`, which has precedence: modes kept by hand"
    )
    starts: int = Field(
        10,
        ge=1,
        description="at most this many starts; fewer when three agree on a minimum that explains the data",
    )
    start_factor: float = Field(
        3.0, gt=1, description="further starts are drawn within this factor of the initial values"
    )
    target_cost: float = Field(0.0, ge=0, description="a cost at or below this ends the fit")
    seed: int = Field(1, ge=0, lt=2**63, description="seed of all random numbers")
    reference: Path | None = Field(
        None, description="published values (.yaml) that reports set beside the fitted ones"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Study:
        if self.band_hz is not None and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(
                f"band_hz: found [{self.band_hz[0]:g}, {self.band_hz[1]:g}]; expected the lower frequency"
                " first"
            )
        if all(measurement.use == "validate" for measurement in self.measurements):
            raise ValueError("measurements: all are for validation; expected at least one with `use: fit`")
        if (self.points_posture_deg is not None) != (self.points_frame == "base"):
            raise ValueError("give both `points_frame: base` and `points_posture_deg`, or neither")
        if self.points is None and self.points_frame == "base":
            raise ValueError("points_frame: found `base` and no `points`; expected both")
        if self.points is not None and self.registration is not None:
            raise ValueError("found `points` and `registration`; expected one of both")
        return self

    @property
    def stages(self) -> list[VibrationStage]:
        """The stages to run, with the default filled in."""
        if self.optimizer:
            return self.optimizer
        robust = self.cost.likelihood
        return (
            [VibrationStage.parse(dict(stage)) for stage in _ROBUST_THEN_LIKELY]
            if robust
            else [VibrationStage.parse("hybrid")]
        )

    @property
    def last_resort(self) -> list[VibrationStage]:
        """The stages of one more start where the default ones did not agree; none where the study chose its
        optimizer.
        """
        if self.optimizer or self.stages == [VibrationStage.parse("hybrid")]:
            return []
        globally = {**_ROBUST_THEN_LIKELY[0], "kind": "hybrid", "evaluations": 4000, "rounds": 1}
        return [VibrationStage.parse(globally), VibrationStage.parse(dict(_ROBUST_THEN_LIKELY[1]))]


class StudyFile(ConfigFile[Study]):
    """A study of FRFs or modes with its file."""


def read_study(path: Path) -> StudyFile:
    """The study in a YAML file, with the choices of a modal analysis that it names.

    Raises InputError for a file that cannot be read or is no YAML, and InputErrors with every key that is
    wrong.
    """
    try:
        study, text = read_settings(path, Study, SCHEMA)
    except InputErrors as several:
        raise InputErrors([_with_joints(path, error) for error in several.errors]) from several
    file = StudyFile.of(path, study, text)
    if study.modal_choices is None:
        return file
    with file.located():
        modal = with_choices(study.modal, file.resolve(study.modal_choices))
    return file.model_copy(update={"study": study.model_copy(update={"modal": modal})})


def _with_joints(path: Path, error: InputError) -> InputError:
    """An angle that was not filled in, with the number of joints, where the robot can be read."""
    if error.found != "not filled in" or not error.where.endswith(".posture_deg"):
        return error
    try:
        data, _ = read_yaml(path)
        robot = read_robot(RobotSettings.model_validate(data["robot"]), path.parent)
    except (InputError, InputErrors, ValueError, KeyError, TypeError):
        return error
    names = [joint.name for joint in robot.joints]
    example = ", ".join(["0.0"] * len(names))
    return InputError(
        error.where,
        "not filled in",
        f"{count(len(names), 'angle')}, one per joint ({', '.join(names)}), in degrees",
        f"fill in the posture that was measured, such as [{example}]",
    )
