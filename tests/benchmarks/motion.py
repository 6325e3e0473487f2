"""How fast a driven arm is simulated: seconds of motion per second of computing, beside scipy's solve_ivp
with Pinocchio's ABA.

The arm is that of the Kawasaki RS010L study: three axes, direct-current motors, PID at 1 kHz, Coulomb
friction.  The alternative integrates the same equations between ticks (RK45, relative tolerance 1e-6), as one
would without this package. `python -m tests.benchmarks.motion`
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pinocchio
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.generator import kawasaki
from tests.motion.test_published_arms import at_truth

Array = NDArray[np.float64]


def between_ticks(model: pinocchio.Model) -> Callable[[Array, Array], Array]:
    """The state (angles, velocities, currents) a tick later, by solve_ivp."""
    data, ratio = model.createData(), np.array(kawasaki.TRUTH["gear_ratio"])
    dry, viscous = (
        np.array(kawasaki.TRUTH["coulomb_n_m"]),
        ratio**2 * np.array(kawasaki.TRUTH["viscous_motor_n_m_s_rad"]),
    )

    def tick(state: Array, voltage: Array) -> Array:
        def slope(_: float, y: Array) -> Array:
            q, v, i = y.reshape(3, 3)
            torque = ratio * kawasaki.TORQUE_CONSTANT * i - dry * np.tanh(v / 1e-3) - viscous * v
            current = (
                voltage - kawasaki.RESISTANCE * i - kawasaki.BACK_EMF * ratio * v
            ) / kawasaki.INDUCTANCE
            return np.concatenate([v, pinocchio.aba(model, data, q, v, torque), current])

        solved = solve_ivp(slope, (0, kawasaki.PERIOD_S), state.ravel(), rtol=1e-6, atol=1e-9)
        return np.asarray(solved.y[:, -1].reshape(3, 3))

    return tick


def by_scipy(ticks: int) -> tuple[Array, float]:
    """Angles (ticks, 3) of the first record, and seconds."""
    test, model, numbers = (
        kawasaki.TESTS[0],
        kawasaki.arm(),
        {key: np.array(value) for key, value in kawasaki.TRUTH.items()},
    )
    wanted, tick, zero = kawasaki.command(test), between_ticks(model), np.zeros(3)
    weight = pinocchio.rnea(model, model.createData(), wanted[0], zero, zero)
    state = np.array([wanted[0], zero, weight / numbers["gear_ratio"] / kawasaki.TORQUE_CONSTANT])
    integral, error, angles, began = kawasaki.RESISTANCE * state[2], np.zeros(3), [], time.perf_counter()
    for target in wanted[:ticks]:
        angles.append(state[0])
        new = target - state[0]
        change = numbers["derivative_gain_v_s_rad"] * (new - error) / kawasaki.PERIOD_S
        voltage = numbers["position_gain_v_rad"] * new + change + integral
        integral, error = integral + numbers["integral_gain_v_rad_s"] * kawasaki.PERIOD_S * new, new
        state = tick(state, voltage)
    return np.array(angles), time.perf_counter() - began


def main() -> None:
    """Print the factors and how far the two are apart."""
    problem, values = at_truth("kawasaki_rs010l")
    record = problem.records[0]
    length = record.command.position.shape[0] * 1e-3
    theirs, seconds = by_scipy(1000)
    alone = 1.0 / seconds
    print(f"solve_ivp (RK45) and Pinocchio's ABA: {alone:.2f} s of motion per second")
    for lanes in (1, 10, 40):
        began = time.perf_counter()
        motion = problem.run(np.tile(values, (lanes, 1)), [record])
        factor = lanes * length / (time.perf_counter() - began)
        print(
            f"identify, {lanes} side by side: {factor:.1f} s of motion per second, {factor / alone:.0f} times"
        )
    apart, turned = np.abs(motion.coordinates[0, :1000] - theirs).max(), np.ptp(theirs, axis=0).max()
    print(
        f"largest difference of angles over the first second: {np.degrees(apart):.2g} deg of"
        f" {np.degrees(turned):.1f}"
    )


if __name__ == "__main__":
    main()
