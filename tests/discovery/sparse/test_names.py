"""A sensor's matrix is said as the simplest thing that it is."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from identify.core.arrays import Array
from identify.core.parameters import Values
from identify.discovery.sparse.names import of_rotor, of_sensor, of_springs
from identify.model.effects.geared import RotorInertia
from identify.model.effects.joint_compliance import JointCompliance
from identify.model.effects.link_flexibility import LinkFlexibility

INFORMATION, PRICE = 1e6 * np.eye(9), 5.0
NOISE = 1e-4 * np.random.default_rng(0).normal(size=(3, 3))


def turned(axis: int, angle: float) -> Array:
    """What a sensor reads that was turned by an angle: the old motion in its new axes."""
    return scipy.spatial.transform.Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix().T


@pytest.mark.parametrize(
    ("matrix", "sentence", "values"),
    [
        (2 * np.eye(3), "gain of channel 7", [2.0]),
        (np.diag([1.0, 1.3, 1.0]), "gain of channel 7:+Y", [1.3]),
        (np.diag([1.0, 1.0, -1.0]), "reversed polarity of channel 7:+Z", []),
        (-np.eye(3), "reversed polarity of channel 7", []),
        (np.eye(3)[[1, 0, 2]], "exchanged axes x and y of the sensor at point 7", []),
        (turned(2, np.pi / 2), "sensor at point 7 turned about its z axis", [np.pi / 2]),
        (turned(0, 0.2), "sensor at point 7 turned about its x axis", [0.2]),
        (turned(1, -0.4), "sensor at point 7 turned about its y axis", [-0.4]),
        (
            np.array([[2, 0.4, 0], [0, 1, 0.7], [0.1, 0, 1]]),
            "sensitivity matrix of the sensor at point 7",
            None,
        ),
    ],
)
def test_the_simplest_form_is_named(matrix: Array, sentence: str, values: list[float] | None) -> None:
    effect, found, _ = of_sensor(7, matrix - np.eye(3) + NOISE, INFORMATION, PRICE)
    said = effect.sentence()
    if "exchanged" in sentence:
        assert effect.kind == "channel-swap", said
    else:
        assert said == sentence
    if values is not None:
        assert list(found.values()) == pytest.approx(values, abs=1e-3)


def test_the_angle_of_a_turned_sensor_is_what_well_measured_entries_say() -> None:
    """One reading that hardly any data determine is far off: it was named as a matrix of nine numbers."""
    error = turned(2, 0.3) - np.eye(3)
    error[0, 1] += 0.5
    information = 1e6 * np.eye(9)
    information[1, 1] = 1.0
    effect, found, _ = of_sensor(7, error, information, PRICE)
    assert effect.sentence() == "sensor at point 7 turned about its z axis"
    assert list(found.values()) == pytest.approx([0.3], abs=1e-3)


def test_a_rigid_axis_of_a_bearing_is_left_out() -> None:
    values = {"joint3.rx.compliance": 2e-7, "joint3.rx.retardation_time": 1e-3}
    values |= {"joint3.ry.compliance": 0.0, "joint3.ry.retardation_time": 1e-3}
    dense = JointCompliance(joints=[3], axes=["rx", "ry", "tx", "ty", "tz"], shrink=True)
    effect, found = of_springs(dense, "joint3.tilt", values)
    assert effect.sentence() == "tilt compliance of joint 3 (rx)"
    assert found == pytest.approx({"joint3.rx.stiffness": 5e6, "joint3.rx.damping": 5e3})


def test_a_link_bends_in_all_its_planes_however_stiff_one_is() -> None:
    values = {f"link2.{what}.compliance": 1e-6 for what in ("bending_1", "torsion")}
    values |= {"link2.bending_2.compliance": 0.0}
    values |= {f"link2.{what}.retardation_time": 1e-3 for what in ("bending_1", "bending_2", "torsion")}
    effect, found = of_springs(LinkFlexibility(link="link2", shrink=True), "link2", values)
    assert isinstance(effect, LinkFlexibility)
    assert not effect.shrink
    assert found["link2.bending_1.stiffness"] == pytest.approx(1e6)
    assert found["link2.bending_2.stiffness"] > 1e8


def test_a_held_rotor_is_named_with_what_holds_it() -> None:
    free = RotorInertia(
        joints=[2], gear_ratio=[100.0], inertia=Values(initial=1e-2), holding_stiffness=Values(), shrink=True
    )
    own = {"inertia": 2e-2, "compliance": 2e-6, "retardation_time": 1e-2}
    effect, values = of_rotor(free, {f"joint2.rotor.{name}": value for name, value in own.items()})
    assert effect.sentence() == "rotor inertia of joint 2 behind the gear, held by a spring"
    assert values == pytest.approx(
        {"joint2.rotor.inertia": 2e-2, "joint2.rotor.stiffness": 5e5, "joint2.rotor.damping": 5e3}
    )
    assert isinstance(effect, RotorInertia)
    assert not effect.shrink
    assert effect.holding_stiffness is not None
    assert effect.holding_stiffness.initial == pytest.approx([5e5])
