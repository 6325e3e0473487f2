"""What can be chosen in an operational modal analysis beside the criteria of any modal analysis."""

from __future__ import annotations

from pydantic import Field, model_validator

from identify.core.config import Settings


class OperationalSettings(Settings):
    """Settings of `identify.modal.operational.analysis.analyse`; unknown keys are refused."""

    speeds_rpm: tuple[float, ...] = Field(
        (), description="speeds of what turns, 1/min: their multiples are no modes"
    )
    teeth: int | None = Field(
        None,
        ge=1,
        description="teeth of the cutter: multiples of the tooth-passing frequency are marked, too",
    )
    least_damping: float = Field(
        0.01, gt=0, lt=1, description="the smallest damping ratio that the records must be long enough for"
    )

    @model_validator(mode="after")
    def _turning(self) -> OperationalSettings:
        if self.teeth is not None and len(self.speeds_rpm) != 1:
            raise ValueError(f"teeth with {len(self.speeds_rpm)} speeds; expected one, of the cutter")
        if any(not speed > 0 for speed in self.speeds_rpm):
            raise ValueError("a speed that is not positive")
        return self

    @property
    def speeds_hz(self) -> tuple[float, ...]:
        """Frequencies of which all multiples may be tones."""
        return tuple(speed / 60 for speed in self.speeds_rpm)
