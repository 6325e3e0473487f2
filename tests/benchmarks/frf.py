"""FRF evaluations per second, and Gauss-Newton with exact gradients against finite differences.

    python -m tests.benchmarks.frf

36 coordinates, 400 lines, 12 outputs, 1 input, one BLAS thread; ratios are taken in the same run.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from identify.core.parameters import Parameter, Scale
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import Search, parse_optimizer
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.model.frf import frf
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget
from tests.arms import arm, initial, system

ALL_AXES = ["tx", "ty", "tz", "rx", "ry", "rz"]
S = 2j * np.pi * np.linspace(0.5, 200, 400)


def seconds(call: Callable[[], object], least: float = 1.0) -> float:
    """Best time of one call, over at least `least` seconds."""
    call()
    best, end = np.inf, time.perf_counter() + least
    while time.perf_counter() < end:
        began = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - began)
    return best


def evaluations(folder: Path) -> None:
    """The time of one set of FRFs by several routes."""
    model, parameters, _ = system(arm(folder), [{"kind": "joint-compliance", "axes": ALL_AXES}])
    values = initial(parameters)
    mass, damping, stiffness = model.matrices(values)
    points = [(f"link{n}", np.array([0.05 * k, 0.0, 0.1])) for n in range(1, 7) for k in (1, 2)]
    out = np.vstack([model.jacobian(link, at)[1] for link, at in points])
    force = out[-1:].T
    objective, _, data = problem(folder, ALL_AXES)
    ended = parse_cost("frf-least-squares").objective(Targets(frf=(replace(data, record=2.0),)))
    population = values * np.exp(np.random.default_rng(0).normal(size=(20, len(values))) * 0.2)

    def by_solve() -> np.ndarray:
        return np.array(
            [s**2 * out @ np.linalg.solve(stiffness + s * damping + s**2 * mass, force) for s in S]
        )

    def by_inverse() -> np.ndarray:
        return np.array(
            [s**2 * out @ np.linalg.inv(stiffness + s * damping + s**2 * mass) @ force for s in S]
        )

    def ours() -> np.ndarray:
        return frf(*model.matrices(values), S, out, force, 2)

    reference = by_solve()
    error = np.abs(ours() - reference).max() / np.abs(reference).max()
    times = {
        "numpy.linalg.solve per line": seconds(by_solve),
        "numpy.linalg.inv per line": seconds(by_inverse),
        "identify, one candidate": seconds(ours),
        "identify, cost of each of a population": (
            seconds(lambda: objective.costs(population)) / len(population)
        ),
        "identify, the same with ended records": seconds(lambda: ended.costs(population)) / len(population),
    }
    print(
        f"{mass.shape[0]} coordinates, {len(S)} lines, {len(out)} outputs, 1 input; relative error"
        f" {error:.1e}"
    )
    for name, took in times.items():
        print(
            f"  {name:40s} {1 / took:8.0f} per s   {times['numpy.linalg.solve per line'] / took:5.1f} x solve"
        )


def fits(folder: Path) -> None:
    """Gauss-Newton from 10 % off, exact gradients against finite differences, for 12 and 72 parameters."""
    for axes in (["rz"], ALL_AXES):
        objective, parameters, data = problem(folder, axes)
        scale = Scale(tuple(parameters))
        start = scale.to_x(
            initial(parameters) * np.exp(0.1 * np.random.default_rng(1).normal(size=len(parameters)))
        )

        def exact(objective: Objective = objective, scale: Scale = scale, start: np.ndarray = start) -> float:
            search = Search(objective, scale, 10_000)
            parse_optimizer("gauss-newton").minimize(search, start, np.random.default_rng(0))
            return search.best_cost

        def differences(data: FrfTarget = data, scale: Scale = scale, start: np.ndarray = start) -> float:
            def residual(x: np.ndarray) -> np.ndarray:
                e = ((data.predict_pairs(scale.to_values(x)) - data.measured) / data.sigma).ravel()
                return np.concatenate([e.real, e.imag])

            found = least_squares(
                residual, start, bounds=scale.bounds(), x_scale="jac", ftol=1e-10, xtol=1e-10, max_nfev=100
            )
            return float(np.sqrt(np.mean(found.fun**2)))

        times = [seconds(exact, 0.1), seconds(differences, 0.1)]
        print(
            f"{len(start)} parameters: exact gradients {times[0]:.2f} s (gap {exact():.3f}), finite"
            f" differences {times[1]:.2f} s ",
            end="",
        )
        print(f"(gap {differences():.3f}): {times[1] / times[0]:.1f} times faster")


def problem(folder: Path, axes: list[str]) -> tuple[Objective, list[Parameter], FrfTarget]:
    """Speed only: the data come from the model itself, with 1 % noise."""
    model, parameters, _ = system(arm(folder), [{"kind": "joint-compliance", "axes": axes}])
    out = np.vstack(
        [model.jacobian(f"link{n}", np.array([0.05 * k, 0.0, 0.1]))[1] for n in range(1, 7) for k in (1, 2)]
    )
    channels = tuple(Channel(node, 2) for node in range(1, 13))
    empty = FrfSet(
        S.imag / (2 * np.pi), np.zeros((400, 12, 1), complex), channels, channels[-1:], "accelerance"
    )
    h = FrfTarget("speed", empty, model, out, out[-1:].T).predict(initial(parameters))
    sigma = 0.01 * np.sqrt(np.mean(np.abs(h) ** 2, axis=0)) / np.sqrt(2) * np.ones(h.shape)
    rng = np.random.default_rng(0)
    noisy = h + sigma * (rng.normal(size=h.shape) + 1j * rng.normal(size=h.shape))
    data = FrfTarget(
        "speed",
        FrfSet(empty.frequency_hz, noisy, channels, channels[-1:], "accelerance"),
        model,
        out,
        out[-1:].T,
        sigma,
    )
    return parse_cost("frf-least-squares").objective(Targets(frf=(data,))), parameters, data


if __name__ == "__main__":
    with threadpool_limits(1), tempfile.TemporaryDirectory() as name:
        evaluations(Path(name))
        fits(Path(name))
