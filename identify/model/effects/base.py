"""What an effect is: where it sits, what its parameters are and how it enters M, C and K; and the registry
of all kinds.  What an effect of a third party gives is looked at: else a wrong matrix would be fitted.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from identify.core.arrays import Array
from identify.core.config import without_old_keys
from identify.core.errors import InputError
from identify.core.parameters import Parameter
from identify.core.plugin import PluginError, name_of, package_of
from identify.core.registry import Registry, parse_kind
from identify.model.effects.initial_values import Quantity, start_grid
from identify.model.effects.place import Beside, Form, Place, Release
from identify.model.effects.site import Added, Site
from identify.model.effects.torque_law import TorqueLaw
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

EFFECTS = Registry(
    "effect",
    "identify.effects",
    {
        "added-mass": "identify.model.effects.added_mass:AddedMass",
        "appended-resonator": "identify.model.effects.appended_resonator:AppendedResonator",
        "base-compliance": "identify.model.effects.base_compliance:BaseCompliance",
        "channel-gain": "identify.model.effects.channel_gain:ChannelGain",
        "channel-polarity": "identify.model.effects.channel_polarity:ChannelPolarity",
        "channel-swap": "identify.model.effects.channel_swap:ChannelSwap",
        "frf-gain": "identify.model.effects.frf_gain:FrfGain",
        "hardening-stiffness": "identify.model.effects.nonlinear:HardeningStiffness",
        "hysteretic-damping": "identify.model.effects.hysteretic_damping:HystereticDamping",
        "joint-compliance": "identify.model.effects.joint_compliance:JointCompliance",
        "joint-friction": "identify.model.effects.nonlinear:JointFriction",
        "joint-relaxation": "identify.model.effects.joint_relaxation:JointRelaxation",
        "link-flexibility": "identify.model.effects.link_flexibility:LinkFlexibility",
        "load-cell": "identify.model.effects.load_cell:LoadCell",
        "measured-impedance": "identify.model.effects.measured_impedance:MeasuredImpedance",
        "mount-compliance": "identify.model.effects.mount_compliance:MountCompliance",
        "rotor-inertia": "identify.model.effects.geared:RotorInertia",
        "sensor-matrix": "identify.model.effects.sensor_matrix:SensorMatrix",
        "sensor-mass": "identify.model.effects.sensor_mass:SensorMass",
        "sensor-rotation": "identify.model.effects.sensor_rotation:SensorRotation",
        "servo": "identify.model.effects.geared:Servo",
        "spring-to-ground": "identify.model.effects.spring_to_ground:SpringToGround",
        "time-delay": "identify.model.effects.time_delay:TimeDelay",
        "pre-trigger": "identify.model.effects.pre_trigger:PreTrigger",
        "window-decay": "identify.model.effects.window_decay:WindowDecay",
    },
    "identify.model.effects.base:Effect",
)
_ROUNDING = 1e-9
_MATRICES = ("stiffness", "damping", "mass", "hysteretic")


@dataclass(frozen=True)
class Torque:
    """A nonlinear torque: its law and the coordinate that it acts on."""

    law: TorqueLaw
    coordinate: str


@dataclass(frozen=True)
class Term:
    """A parameter and what one unit of it adds to the model at a site.

    stiffness, damping, mass (n, n): symmetric, over all coordinates of the site, or None; hysteretic is
    the imaginary part of the stiffness: damping that does not grow with frequency.  torque: the nonlinear
    torque that it is a parameter of; those of one torque follow each other in the order of its law.
    compliance: symmetric, positive semidefinite; the parameter c is the compliance of a spring with
    stiffness pinv(c * compliance), and the next term's parameter is its retardation time, damping over
    stiffness, s (`identify.model.compliant`).  holds: the rotor that it holds as a controller or a brake
    does, which is no part of the model where the torque of that motor is an input.
    """

    parameter: Parameter
    stiffness: Array | None = None
    damping: Array | None = None
    mass: Array | None = None
    hysteretic: Array | None = None
    torque: Torque | None = None
    compliance: Array | None = None
    holds: str | None = None

    @property
    def quantity(self) -> Quantity | None:
        """What the parameter scales: a mass, which may have a weight, a stiffness, or a viscous damping."""
        if self.parameter.initial == 0:
            return None
        damped = self.damping is not None
        if self.mass is not None:
            return None if damped else "mass"
        if self.stiffness is not None:
            return None if damped else "stiffness"
        return "damping" if damped else None


class Effect(BaseModel, ABC):
    """Settings of one effect as written in the config.  The physics is in the methods; nothing in an effect
    changes after reading.

    Positions in the config start with `effects.N`; `kind` is the name in the registry.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    needs_levels: ClassVar[bool] = False
    """Whether only impacts of different strength can tell it from a linear effect."""
    of_measurement: ClassVar[bool] = False
    """Whether it is a matter of the measurement, not of the robot."""
    of_amplitude: ClassVar[bool] = False
    """Whether its share in the motion depends on the amplitude, so that impacts have to be simulated."""
    last_resort: ClassVar[bool] = False
    """Whether discovery tries it only where what was measured at a place is no other effect's law."""
    RENAMED: ClassVar[Mapping[str, str]] = {}
    """Keys of older versions and what they are called now."""
    kind: str = Field(description="which effect")

    @model_validator(mode="before")
    @classmethod
    def _no_old_key(cls, data: Any) -> Any:
        return without_old_keys(cls.RENAMED, data)

    @abstractmethod
    def sentence(self) -> str:
        """What this instance is, as an engineer would say it."""

    @classmethod
    @abstractmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """One instance for each place where the effect can sit on a robot and its measurement points (by
        node), for discovery.
        """

    def variants(self) -> list[Self]:
        """Simpler and richer variants of it in the same place, for discovery to choose from."""
        return []

    def limits(self) -> Sequence[Effect]:
        """What it cannot be told from where it ends, of other kinds: simpler ones, for discovery."""
        return ()

    @property
    def settings_found(self) -> int:
        """How many of its settings are fitted to the data where discovery has found it: they count as its
        parameters do.
        """
        return 0

    @property
    def changes_site(self) -> bool:
        """Whether it brings coordinates or mass of its own; if not, it acts on the site of the others."""
        bringing = ("added_coordinates", "consistent_mass")
        return any(getattr(type(self), name) is not getattr(Effect, name) for name in bringing)

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """Further coordinates, such as a rotor that turns its link, or the bending of a link."""
        return []

    def consistent_mass(self, robot: Robot, site: Site) -> Array | None:
        """Mass matrix (n, n) whatever the parameters: a link's own mass that moves when the link bends."""
        return None

    def coordinates(self, robot: Robot) -> list[str]:
        """The coordinates at which it acts with a torque that depends on amplitude; none by default."""
        return []

    def free_coordinates(self, robot: Robot) -> list[str]:
        """The coordinates that this effect lets move; none by default: it acts on those that others free."""
        return []

    def held_fast(self, robot: Robot) -> list[str]:
        """Those of its free coordinates, of rotors, that stand still but where their motor is driven."""
        return []

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """Where it sits, for the screen that looks at places before it knows what is missing there.

        By default the coordinates that it frees, or those that it acts on by amplitude; empty: no place, so
        that discovery can only try it.
        """
        freed, driven = self.free_coordinates(robot), self.coordinates(robot)
        if freed:
            return [Release(tuple(freed))]
        return [Beside(tuple(driven))] if driven else []

    @abstractmethod
    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """Its parameters, and what each adds at a site, in a fixed order; `where` is its entry in the config.

        Parameters are the same at every site: `site.inertia` and `site.reference` scale their defaults.
        """

    @property
    def has_form(self) -> bool:
        """Whether its form may be off."""
        return type(self).forms is not Effect.forms

    def forms(self, robot: Robot, points: Mapping[int, Point]) -> list[Form]:
        """What its form may be off by, where that is said to be uncertain; nothing by default."""
        return []

    def initial_values(self, terms: Sequence[Term], band_hz: tuple[float, float]) -> Array:
        """Where discovery starts from, (m, terms), the given start first; `terms` are those of its own whose
        parameters are free and have no value yet, band_hz the band of the measurement.
        """
        return start_grid([term.parameter for term in terms], [term.quantity for term in terms], band_hz)


def parse_effect(data: Any) -> Effect:
    """An effect from its mapping in the config, by `kind`; raises ValueError for pydantic to report with its
    key.
    """
    effect: Effect = parse_kind(EFFECTS, data)
    return effect


@contextmanager
def errors_of(effect: Effect, number: int) -> Iterator[None]:
    """Errors of the effect with that number in the config name its entry, `effects.N`, and the key in it."""
    try:
        yield
    except InputError as error:
        entry, names = f"effects.{number}", rf"{number}|{re.escape(effect.kind)}"
        own = re.fullmatch(rf"robot|effects(?:\.(?:{names})(?P<key>\..+)?)?", error.where)
        found = error.found if own else f"{error.where}: {error.found}"
        where = entry + ((own["key"] or "") if own else "")
        raise InputError(where, found, error.expected, error.fix) from error


def check_terms(effect: Effect, terms: Sequence[Term], size: int) -> None:
    """Raise a PluginError that names the package whose effect gives anything but terms with symmetric
    matrices (size, size) of finite numbers.
    """
    if package_of(type(effect)) == __name__.partition(".")[0]:
        return
    for term in terms:
        if not isinstance(term, Term):
            raise PluginError(name_of(effect), f"a term of type {type(term).__name__}", "a Term")
        for role in _MATRICES:
            check_matrix(effect, f"the {role} of {term.parameter.name}", getattr(term, role), size)


def check_matrix(effect: Effect, what: str, matrix: Array | None, size: int) -> None:
    """The same of one matrix."""
    if matrix is None or package_of(type(effect)) == __name__.partition(".")[0]:
        return
    found, expected = np.asarray(matrix), f"a symmetric matrix ({size}, {size}) of numbers"
    if found.shape != (size, size):
        fault = f"a matrix of shape {found.shape}"
    elif not np.isfinite(found).all():
        fault = "a matrix with NaN or infinity in it"
    elif np.abs(found - found.T).max(initial=0.0) > _ROUNDING * np.abs(found).max(initial=0.0):
        fault = "a matrix that is not symmetric"
    else:
        return
    raise PluginError(name_of(effect), f"{what} is {fault}", expected, "tell its authors, or leave it out")
