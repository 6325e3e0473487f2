"""Hidden effects are named, with the truth inside the intervals; nothing is named where nothing is hidden."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from identify.explain.run import run_explain
from identify.explain.sentences import notes
from identify.results.explain import ExplainResult, PairTable, TargetResult
from tests.motion.hidden_drive import RATE, RATIO, Array, Hidden, Motion, only, study


def _run(
    folder: Path, count: int, hidden: Hidden, judged: Hidden | None = None, **more: object
) -> ExplainResult:
    return run_explain(study(folder, count, hidden, judged, **more), folder / "out.h5")[0]


def _value(found: TargetResult, effect: str, name: str) -> tuple[float, float, float]:
    row = next(
        n
        for n, pair in enumerate(zip(found.values.effect, found.values.name, strict=True))
        if pair == (effect, name)
    )
    return found.values.value[row], found.values.low_95[row], found.values.high_95[row]


def _holds(found: TargetResult, effect: str, name: str, truth: float, within: float) -> None:
    value, low, high = _value(found, effect, name)
    assert value == pytest.approx(truth, rel=within), (effect, name)
    # A little wider than 95 %, because dozens of values are looked at, and half a per cent for what is
    # linearised.
    slack = 0.005 * abs(truth)
    assert value - 1.6 * (value - low) - slack <= truth <= value + 1.6 * (high - value) + slack, (
        effect,
        name,
        low,
        truth,
        high,
    )


def _friction(m: Motion) -> Array:
    """Coulomb and viscous friction of joint 1, with Stribeck's fall at joint 3."""
    first = 1.2 * np.sign(m.v[:, 0]) + 2.0 * m.v[:, 0]
    third = (0.8 + 0.6 * np.exp(-((m.v[:, 2] / 0.08) ** 2))) * np.sign(m.v[:, 2])
    return only(3, 1, first) + only(3, 3, third)


def _balancer(m: Motion) -> Array:
    """A spring without slack length between two anchors: its torque by the cross product of lever and
    pull.
    """
    angle = m.q[:, 1]
    arm = 0.2 * np.stack([np.cos(angle + 0.3), np.sin(angle + 0.3)], axis=1)
    pull = 9000.0 * (np.array([-0.5, 0.25]) - arm)
    return only(3, 2, -(arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0]) / RATIO[1])


def test_friction_balancer_payload_and_ripple(tmp_path: Path) -> None:
    def ripple(m: Motion) -> Array:
        return only(3, 1, 0.3 * np.cos(6 * RATIO[0] * m.q[:, 0] + 0.4))

    hidden = Hidden((_friction, _balancer, ripple), payload_kg=12.0, memory=0.8, extra={"links": False})
    # Twelve kilograms are 14 % of what the last link carries: with bodies 5 % uncertain, nothing to name.
    well_known = "{mass_percent: 1, centre_percent: 1, inertia_percent: 1}"
    found = _run(tmp_path, 3, hidden, effects=_kinds("torque"), uncertainty=well_known).targets["torque"]
    expected = {
        "joint1.coulomb-friction",
        "joint1.viscous-friction",
        "joint3.coulomb-friction",
        "joint3.stribeck-friction",
    }
    expected |= {"joint2.gravity-balancer", "payload-mass", "joint1.torque-ripple.6"}
    assert set(found.effects.name) == expected
    _holds(found, "joint1.coulomb-friction", "torque", 1.2, 0.05)
    _holds(found, "joint1.viscous-friction", "damping", 2.0, 0.05)
    _holds(found, "joint3.coulomb-friction", "torque", 0.8, 0.1)
    _holds(found, "joint3.stribeck-friction", "excess", 0.6, 0.25)
    _holds(found, "joint3.stribeck-friction", "speed", 0.08, 0.25)
    _holds(found, "payload-mass", "mass", 12.0, 0.1)
    peak = 9000.0 * 0.2 * np.hypot(0.5, 0.25)
    sine, cosine = (
        _value(found, "joint2.gravity-balancer", name)[0]
        for name in ("sine at the joint", "cosine at the joint")
    )
    assert np.hypot(sine, cosine) == pytest.approx(peak, rel=0.05)
    # Noise that keeps 0.8 of its last value is 2.74 times what third differences of it say.
    assert found.gap == pytest.approx(np.full(3, 2.74), rel=0.2)
    assert found.explained.min() > 0.9


def test_deflection(tmp_path: Path) -> None:
    """Backlash at joint 1, hardening at joint 2, a transmission error at joint 3, and all encoders late."""

    def bend(m: Motion) -> Array:
        hard = np.array(
            [
                np.real(r[np.abs(r.imag) < 1e-9][0])
                for r in (np.roots([4e10, 0, 4e5, -torque]) for torque in m.rigid[:, 1])
            ]
        )
        wave = m.rigid[:, 2] / 6e5 + 6e-5 * np.sin(2 * RATIO[2] * m.q[:, 2] + 0.5)
        return np.stack([m.rigid[:, 0] / 5e5 + 1.5e-4 * np.sign(m.rigid[:, 0]), hard, wave], axis=1)

    hidden = Hidden(deflection=bend, latency_s=(0.003, 0.003, 0.002, 0, 0))
    found = _run(tmp_path, 3, hidden, effects=_kinds("deflection")).targets["deflection"]
    for effect in (
        "joint1.backlash",
        "joint2.hardening-stiffness",
        "joint3.angular-transmission-error.1",
        "joint1.joint-compliance",
    ):
        assert effect in found.effects.name
    assert {"joint2.backlash", "joint3.backlash", "joint2.joint-compliance"}.isdisjoint(found.effects.name)
    _holds(found, "joint1.sensor-latency", "latency", 0.003, 0.05)
    _holds(found, "joint3.sensor-latency", "latency", 0.002, 0.05)
    _holds(found, "joint1.backlash", "half width", 1.5e-4, 0.1)
    _holds(found, "joint3.angular-transmission-error.1", "order", 2 * RATIO[2], 0.01)
    _holds(found, "joint3.joint-compliance", "compliance", 1 / 6e5, 0.05)
    soft, _, _ = _value(found, "joint2.hardening-stiffness", "compliance at no load")
    torque, _, _ = _value(found, "joint2.hardening-stiffness", "torque")
    assert 1 / soft == pytest.approx(4e5, rel=0.1)
    assert 1 / (soft**3 * torque**2) == pytest.approx(4e10, rel=0.3)


def _kinds(target: str) -> str:
    from identify.explain.effects.base import MOTION_EFFECTS

    chosen = [kind for kind in MOTION_EFFECTS.names() if MOTION_EFFECTS.get(kind).target == target]
    return "[" + ", ".join(chosen) + "]"


def test_of_noise_alone_nothing_is_named(tmp_path: Path) -> None:
    def noise(m: Motion) -> Array:
        return np.random.default_rng(3).normal(scale=1e-5, size=m.q.shape)

    result = _run(tmp_path, 3, Hidden(torque_noise=0.2, memory=0.95, error=noise))
    assert [found.effects.name for found in result.targets.values()] == [(), (), ()]
    assert all("nothing was found" in sentence for sentence in result.verdict)


def test_a_wrong_torque_constant_is_no_balancer(tmp_path: Path) -> None:
    """A tenth of the load at joint 2 first looks like a balancer, whose torque must not stay in the load."""

    def wrong(m: Motion) -> Array:
        return only(3, 2, 0.1 * m.rigid[:, 1] / RATIO[1])

    hidden = Hidden((wrong,), memory=0.8, extra={"links": False})
    found = _run(
        tmp_path, 3, hidden, effects="[torque-constant, gravity-balancer, coulomb-friction]"
    ).targets["torque"]
    assert found.effects.name == ("joint2.torque-constant",)
    _holds(found, "joint2.torque-constant", "share", 0.1, 0.12)


def test_what_the_held_out_record_does_not_have_is_not_named(tmp_path: Path) -> None:
    """A negative control: friction in the fitted record alone."""
    hidden, clean = (Hidden(motor, extra={"links": False}) for motor in ((_friction,), ()))
    assert not _run(tmp_path, 3, hidden, clean, effects=_kinds("torque")).targets["torque"].effects.name


def test_gear_coupling_of_a_wrist(tmp_path: Path) -> None:
    def coupled(m: Motion) -> Array:
        return only(5, 4, 0.3 * m.rigid[:, 4] / RATIO[3] + 0.2 * np.sign(m.v[:, 3]))

    hidden = Hidden((coupled,), torque_noise=0.003, extra={"links": False})
    found = _run(tmp_path, 5, hidden, joints=[4, 5], effects=_kinds("torque")).targets["torque"]
    assert set(found.effects.name) == {"joint4.gear-coupling.joint5", "joint4.coulomb-friction"}
    _holds(found, "joint4.gear-coupling.joint5", "share", 0.3, 0.05)


WRIST = np.array([[1.0, 0.0], [0.8, 1.0]])
"""Motor 5 turns 0.8 times with joint 4."""


def _coupled_wrist(m: Motion) -> Array:
    """What is more at the motors of joints 4 and 5 than rigid links over the ratio: motor 4 carries what
    motor 5 holds against it, friction and rotor of motor 5 see both joints (power is the same on both sides).
    """
    ratio, pair = RATIO[3:5], slice(3, 5)
    through = np.linalg.solve(WRIST.T, m.rigid[:, pair].T).T
    speed, acceleration = m.v[:, pair] @ WRIST.T, m.a[:, pair] @ WRIST.T
    friction = np.stack(
        [0.05 * np.sign(speed[:, 0]), 0.08 * np.sign(speed[:, 1]) + 0.1 * speed[:, 1]], axis=1
    )
    rotor = np.stack([np.zeros(len(speed)), 4e-4 * ratio[1] * acceleration[:, 1]], axis=1)
    found = np.zeros_like(m.q)
    found[:, pair] = (through - m.rigid[:, pair]) / ratio + friction + rotor
    return found


def test_a_coupled_wrist_is_found_and_once_stated_known(tmp_path: Path) -> None:
    hidden = Hidden((_coupled_wrist,), torque_noise=0.003, extra={"links": False})
    kinds = "[coulomb-friction, viscous-friction, rotor-inertia, gear-coupling, motor-coupling, first-moment]"
    kinds = kinds.replace("first-moment", "link-first-moment")
    found = _run(tmp_path, 5, hidden, joints=[4, 5], effects=kinds).targets["torque"]
    assert {"joint5.motor-coupling.joint4", "joint4.gear-coupling.joint5"} <= set(found.effects.name)
    _holds(found, "joint5.motor-coupling.joint4", "coupling", 0.8, 0.05)
    _holds(found, "joint5.motor-coupling.joint4", "Coulomb friction", 0.08, 0.1)
    whole = np.eye(5)
    whole[3:, 3:] = WRIST
    config = study(tmp_path, 5, hidden, joints=[4, 5], effects=kinds)
    text = config.read_text()
    assert "drives: {" in text
    config.write_text(text.replace("drives: {", f"drives: {{coupling: {whole.tolist()}, "))
    stated = run_explain(config, tmp_path / "stated.h5")[0].targets["torque"]
    assert set(stated.effects.name) == {
        "joint4.coulomb-friction",
        "joint5.coulomb-friction",
        "joint5.viscous-friction",
        "joint5.rotor-inertia",
    }
    _holds(stated, "joint5.coulomb-friction", "torque", 0.08, 0.05)
    _holds(stated, "joint5.rotor-inertia", "inertia", 4e-4, 0.1)


def test_integral_action(tmp_path: Path) -> None:
    """The error of a position P, velocity PI loop by small Euler steps; without its integrator nothing of the
    kind is named.
    """

    def servo(integral_time: float) -> Hidden:
        def error(m: Motion) -> Array:
            torque, state, found = m.rigid / RATIO[:3], np.zeros(3), np.empty_like(m.q)
            for row in range(len(m.time)):
                found[row] = (torque[row] / 40.0 + m.v[row] - state / integral_time) / 20.0
                state = state + (20.0 * found[row] - m.v[row]) / RATE
            return found + np.random.default_rng(0).normal(scale=1e-5, size=found.shape)

        return Hidden(error=error, torque_noise=0.002, extra={"links": False})

    tracking = _run(tmp_path, 3, servo(0.5), effects=_kinds("tracking")).targets["tracking"]
    for joint in (1, 2, 3):
        assert f"joint{joint}.integral-action" in tracking.effects.name
        assert _value(tracking, f"joint{joint}.integral-action", "rate")[0] == pytest.approx(2.0, rel=0.05)
    without = _run(tmp_path, 3, servo(1e9), effects=_kinds("tracking")).targets["tracking"]
    assert not [name for name in without.effects.name if "integral" in name]
    assert _value(without, "joint1.position-lag", "lag")[0] == pytest.approx(1 / 20, rel=0.02)


@pytest.mark.parametrize(
    ("kind", "name", "warned"),
    [
        ("gravity-balancer", "cosine", True),
        ("angular-transmission-error", "cosine", False),
        ("angular-transmission-error", "lag", True),
    ],
)
def test_records_that_disagree_are_warned_of_but_for_the_phase_of_a_harmonic(
    kind: str, name: str, warned: bool
) -> None:
    one = np.ones(1)
    found = SimpleNamespace(
        target="torque",
        effects=SimpleNamespace(name=(f"joint2.{kind}",), kind=(kind,)),
        values=SimpleNamespace(
            effect=(f"joint2.{kind}",),
            name=(name,),
            low_95=5 * one,
            high_95=6 * one,
            other_low_95=one,
            other_high_95=2 * one,
            at_edge=np.zeros(1, dtype=bool),
        ),
        body_errors=np.zeros(0),
        warnings=(),
        pairs=PairTable(),
        words=lambda name: name,
    )
    assert any("disagree" in note for note in notes(cast(TargetResult, found))) is warned
