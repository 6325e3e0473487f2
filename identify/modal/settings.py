"""What can be chosen in an experimental modal analysis, in a study, a command or a file of its own; every
default works on ordinary hammer tests.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from identify.core.config import Settings, read_yaml, validated

ESTIMATORS = {"plscf": "pLSCF", "lsce": "LSCE"}
"""How the estimators are written in reports."""


class ModalSettings(Settings):
    """Settings of `identify.modal.analysis.analyse`; unknown keys are refused.

    An order is the degree of the denominator polynomial: a model of order p has p x references poles in the
    band.
    """

    estimator: Literal["plscf", "lsce"] = Field(
        "plscf", description="poly-reference LSCF, or least-squares complex exponential"
    )
    band_hz: tuple[float, float] | None = Field(
        None, description="band to analyse; all measured lines above 0 Hz where not given"
    )
    references: tuple[str, ...] | None = Field(
        None, description="reference channels (12:+Z); the smaller side of the FRFs if not given"
    )
    direction: Literal["X", "Y", "Z"] | None = Field(
        None, description="use only the responses of this direction (UMONS took each apart)"
    )
    min_order: int = Field(2, ge=1, description="least order of the stabilisation diagram")
    max_order: int | None = Field(
        None,
        ge=2,
        description="largest order; chosen from the number of lines and references where not given",
    )
    max_damping_ratio: float = Field(
        0.25, gt=0, lt=1, description="poles with more damping are taken as computational"
    )
    cluster_radius: float = Field(
        0.5, gt=0, description="reach of a cluster over orders: |dlambda|/(zeta omega) + 1 - MAC"
    )
    min_presence: float = Field(
        0.4, gt=0, le=1, description="least fraction of the orders in which a physical pole appears"
    )
    max_frequency_spread: float = Field(
        0.02, gt=0, description="largest standard deviation over orders of a frequency, relative to it"
    )
    max_damping_spread: float = Field(
        0.35, gt=0, description="largest standard deviation over orders of a damping ratio, relative to it"
    )
    min_mpc: float = Field(0.5, ge=0, le=1, description="least modal phase collinearity (median over orders)")
    max_mpd_deg: float = Field(
        30.0, gt=0, le=90, description="largest mean phase deviation (median over orders)"
    )
    duplicate_mac: float = Field(
        0.7, ge=0, le=1, description="MAC that makes a close cluster a duplicate of a firmer one"
    )
    min_contribution: float | None = Field(
        None,
        ge=0,
        lt=1,
        description=(
            "least part of the energy around a mode that only it explains; where not given, more than noise"
            " could, or 0.01 where the modes leave more than noise"
        ),
    )
    modes_hz: tuple[float, ...] | None = Field(
        None, description="manual choice: the clusters nearest to these frequencies"
    )
    keep_hz: tuple[float, ...] = Field(
        (),
        description="by hand: the cluster nearest to each of these frequencies is a mode, whatever it fails",
    )
    drop_hz: tuple[float, ...] = Field(
        (), description="by hand: the clusters within a half-bandwidth of these frequencies are no modes"
    )
    refine: bool = Field(
        True, description="refine poles and participations by nonlinear least squares on the FRFs"
    )
    residuals: tuple[Literal["lower", "upper"], ...] = Field(
        ("lower", "upper"), description="terms for the modes below and above the band"
    )

    @model_validator(mode="after")
    def _ordered(self) -> ModalSettings:
        if self.band_hz is not None and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz is {list(self.band_hz)}; expected [low, high] with 0 <= low < high")
        if self.max_order is not None and self.max_order < self.min_order:
            raise ValueError(f"max_order {self.max_order} is below min_order {self.min_order}")
        if self.modes_hz is not None and (self.keep_hz or self.drop_hz):
            raise ValueError("modes_hz names all modes; keep_hz and drop_hz only correct an automatic choice")
        return self


def chosen_settings(path: Path | None) -> dict[str, Any]:
    """The settings of the analysis that a YAML file gives; InputErrors for what is none, with its line."""
    if path is None:
        return {}
    data, _ = read_yaml(path)
    return validated(path, data, ModalSettings).model_dump(exclude_unset=True)


def with_choices(given: ModalSettings, path: Path) -> ModalSettings:
    """Settings over those of a file of choices; InputErrors where the two do not go together."""
    both = {**chosen_settings(path), **given.model_dump(exclude_unset=True)}
    return validated(path, both, ModalSettings)
