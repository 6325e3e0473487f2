"""`uncertainty:` of a study: how far masses, places, directions, gains and angles may be from what was
stated.

Every number is one standard deviation of a Gaussian error.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from identify.core.config import Settings
from identify.vibration.nuisances.meshes import INERTIA, MASS

Level = Literal["careful", "typical", "meshes"]
_EACH = ("links", "points", "channels")
"""Groups with values of single links, points and channels."""

Share = Annotated[float | None, Field(ge=0, lt=1)]
Degrees = Annotated[float | None, Field(ge=0, lt=45)]


class LinkUncertainty(Settings):
    """Inertia of a link."""

    mass: Share = Field(None, description="relative, such as 0.02")
    centre_m: Share = Field(None, description="centre of mass, m, along each axis")
    inertia: Share = Field(
        None,
        description=(
            "principal moments of inertia, relative; half of it for products of inertia over the mean of"
            " two moments"
        ),
    )


class LinksUncertainty(LinkUncertainty):
    """Inertia of all links, and of single ones."""

    each: dict[str, LinkUncertainty] = Field(
        {}, description="other values by name of link, such as {link6: {mass: 0.2}}"
    )


class PointUncertainty(Settings):
    """A point and its sensor."""

    position_m: Share = Field(None, description="position of a point, m, along each axis")
    direction_deg: Degrees = Field(None, description="rotation of a sensor about each of its axes, degrees")


class PointsUncertainty(PointUncertainty):
    """Where sensors and impacts are, and how sensors are turned."""

    each: dict[int, PointUncertainty] = Field(
        {}, description="other values by node, such as {12: {position_m: 0.001}}"
    )


class ChannelUncertainty(Settings):
    """A response channel."""

    gain: Share = Field(None, description="relative, of each response channel over the force")


class ChannelsUncertainty(ChannelUncertainty):
    """Sensitivities of the transducers."""

    force_gain: Share = Field(
        None,
        description=(
            "relative, of the force transducer; 0 where channels were calibrated with it, by a known mass"
        ),
    )
    each: dict[str, ChannelUncertainty] = Field(
        {}, description="other values by channel, such as {'12:+Z': {gain: 0.002}}"
    )


class ImpactsUncertainty(Settings):
    """How the hammer was held and swung."""

    direction_deg: Degrees = Field(
        None, description="of each impact in each measurement, about two axes, degrees"
    )
    strength: Share = Field(
        None,
        description="relative, of each mean peak force in each measurement; for effects that depend on it",
    )
    duration: Share = Field(
        None, description="relative, of all impacts; for effects that depend on amplitude"
    )


class JointsUncertainty(Settings):
    """Angles of the joints."""

    angle_deg: Degrees = Field(None, description="of each joint at each posture, degrees")


class KinematicsUncertainty(Settings):
    """Places of the joints."""

    position_m: Share = Field(None, description="of each joint in its parent link, m, along each axis")


class SetsUncertainty(Settings):
    """Timing of a measurement."""

    delay_s: Share = Field(None, description="of all responses of a measurement against the force, s")


class FlexibleLinksUncertainty(Settings):
    """Form of the links that bend (effect `link-flexibility`), which are no beams."""

    shape: Share = Field(
        None,
        description=(
            "slope at a sensor on the link, relative to that of the link's end; a third of it for deflections"
        ),
    )
    mass: Share = Field(None, description="mass that sits elsewhere along the link, relative to the link's")
    spread: Share = Field(
        None,
        description="share of the link's mass and inertia that moves evenly with all of its sections, and"
        " not with those where it is; not of nonuniform links, of which it is a parameter",
    )
    ends: Share = Field(
        None,
        description=(
            "compliance of each end of the link, where nothing distinguishes it from that of the joint there,"
            " relative to the whole link's"
        ),
    )


class UncertaintySettings(Settings):
    """What is uncertain of what was stated; zero: exactly as stated."""

    like: Level | None = Field(
        None,
        description="`careful`, `typical`, or `meshes` where the bodies of links were made of their meshes:"
        " values for all that is not said here; default: exactly as stated",
    )
    links: LinksUncertainty = Field(LinksUncertainty(), description="masses, centres and inertias of links")
    points: PointsUncertainty = Field(PointsUncertainty(), description="places and directions of sensors")
    channels: ChannelsUncertainty = Field(ChannelsUncertainty(), description="sensitivities")
    impacts: ImpactsUncertainty = Field(
        ImpactsUncertainty(), description="directions, strengths and duration of impacts"
    )
    joints: JointsUncertainty = Field(JointsUncertainty(), description="joint angles")
    kinematics: KinematicsUncertainty = Field(KinematicsUncertainty(), description="places of joints")
    sets: SetsUncertainty = Field(SetsUncertainty(), description="delays")
    flexible_links: FlexibleLinksUncertainty = Field(
        FlexibleLinksUncertainty(), description="form of links that bend"
    )

    @model_validator(mode="after")
    def _something(self) -> UncertaintySettings:
        single = [one for group in _EACH for one in getattr(self, group).each.values()]
        if not any(
            self.std(group, key) > 0 for group, keys in _LEVELS["careful"].items() for key in keys
        ) and not any(value for one in single for value in one.model_dump().values()):
            raise ValueError(
                "uncertainty: nothing is uncertain; expected `typical`, `careful` or a value above 0"
            )
        return self

    def std(self, group: str, key: str) -> float:
        """The standard deviation that a key of a group says, in the unit of the key."""
        stated = getattr(getattr(self, group), key)
        return float(self._otherwise(group, key) if stated is None else stated)

    def of(self, group: str, place: str | int, key: str) -> float:
        """The same of one link, point or channel."""
        own = getattr(self, group).each.get(place)
        stated = None if own is None else getattr(own, key)
        return self.std(group, key) if stated is None else float(stated)

    def of_link(self, name: str, key: str, made: Mapping[str, float]) -> float:
        """The same of a link, of which `made` says what it is where its body was made of its mesh."""
        own = self.links.each.get(name)
        said = (None if own is None else getattr(own, key), getattr(self.links, key))
        stated = next((one for one in said if one is not None), None)
        if stated is None and self.like == "meshes":
            return made[key]
        return self.std("links", key) if stated is None else float(stated)

    def _otherwise(self, group: str, key: str) -> float:
        return 0.0 if self.like is None else _LEVELS[self.like][group][key]


_LEVELS: dict[str, dict[str, dict[str, float]]] = {
    "careful": {
        "links": {"mass": 0.02, "centre_m": 0.005, "inertia": 0.05},
        "points": {"position_m": 0.003, "direction_deg": 1.0},
        "channels": {"gain": 0.01, "force_gain": 0.0},
        "impacts": {"direction_deg": 1.0, "strength": 0.1, "duration": 0.2},
        "joints": {"angle_deg": 0.05},
        "kinematics": {"position_m": 0.0},
        "sets": {"delay_s": 0.0},
        "flexible_links": {"shape": 0.2, "mass": 0.1, "spread": 0.5, "ends": 0.05},
    },
    "typical": {
        "links": {"mass": 0.05, "centre_m": 0.015, "inertia": 0.15},
        "points": {"position_m": 0.01, "direction_deg": 3.0},
        "channels": {"gain": 0.03, "force_gain": 0.0},
        "impacts": {"direction_deg": 3.0, "strength": 0.2, "duration": 0.3},
        "joints": {"angle_deg": 0.1},
        "kinematics": {"position_m": 0.0},
        "sets": {"delay_s": 0.0},
        "flexible_links": {"shape": 0.2, "mass": 0.1, "spread": 0.5, "ends": 0.05},
    },
}
"""What data sheets and mounting are usually off by: in a careful laboratory, where links were weighed and
sensors placed with a jig, and in an ordinary one."""
_LEVELS["meshes"] = {
    **_LEVELS["typical"],
    "links": {"mass": MASS[0], "centre_m": 0.021, "inertia": INERTIA[0]},
}
"""As typical, but for links, of which `identify.vibration.nuisances.meshes` says more."""


FORMS_ALONE = UncertaintySettings(
    flexible_links=FlexibleLinksUncertainty(**_LEVELS["careful"]["flexible_links"])
)
"""All is exactly as stated, but links that bend are not quite what a beam is."""
IMPACTS_ALONE = UncertaintySettings(
    impacts=ImpactsUncertainty(
        **{what: _LEVELS["careful"]["impacts"][what] for what in ("strength", "duration")}
    )
)
"""All is exactly as stated, but no two impacts are equally strong: what a joint that slips or hardens does
depends on each.
"""


def parse_uncertainty(data: Any) -> Any:
    """The mapping of a level named alone; anything else as it is, for pydantic to check."""
    if isinstance(data, str):
        if data not in _LEVELS:
            raise ValueError(
                f"found {data!r}; expected {', '.join(_LEVELS)} or a mapping of what is uncertain"
            )
        return {"like": data}
    return data
