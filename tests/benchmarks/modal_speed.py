"""Seconds of a modal analysis beside sdypy-EMA on the same FRFs at the same order.

Run `python -m tests.benchmarks.modal_speed` from the repository's root; `--large` adds 1,002 FRFs of 4,000
lines.  sdypy-EMA is used if it is installed and left out, saying so, if not.  It works with one reference:
it gets all FRFs as one column, has no automatic choice of poles, no refinement and no intervals; its time is
that of its poles (LSCF).  Ours is the whole analysis, twice: with refinement and intervals, and without.
"""

from __future__ import annotations

import argparse
import importlib
import io
import time
from collections.abc import Callable
from contextlib import redirect_stderr

import numpy as np

from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.modal.analysis import analyse
from identify.modal.settings import ModalSettings


def measured(channels: int, references: int, lines: int, modes: int) -> FrfSet:
    """Accelerances of random modes at least a line wide, with a hundredth of noise."""
    rng = np.random.default_rng(3)
    frequency = 5.0 + 0.25 * np.arange(lines)
    s = 2j * np.pi * frequency
    hz = np.sort(rng.uniform(1.1 * frequency[0], 0.98 * frequency[-1], modes))
    zeta = np.maximum(rng.uniform(0.004, 0.02, modes), 0.25 / hz)
    omega, shapes = 2 * np.pi * hz, rng.normal(size=(channels, modes))
    each = s[:, None] ** 2 / (s[:, None] ** 2 + 2 * zeta * omega * s[:, None] + omega**2)
    frf = np.einsum("lm,om,im->loi", each, shapes, shapes[:references], optimize=True)
    noise = 0.01 * np.sqrt(np.mean(np.abs(frf) ** 2, axis=0) / 2)
    frf = frf + noise * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))
    sensors = tuple(Channel(n // 3 + 1, n % 3 + 1) for n in range(channels))
    return FrfSet(frequency, frf, sensors, sensors[:references], "accelerance", source="random modes")


def theirs(data: FrfSet, order: int) -> int:
    """Poles of every order by sdypy-EMA; how many it has at the highest."""
    ema = importlib.import_module("sdypy.EMA")
    frf = data.frf.reshape(len(data.frequency_hz), -1).T
    low, high = data.frequency_hz[[0, -1]]
    model = ema.Model(
        frf, data.frequency_hz, lower=low, upper=high, pol_order_high=order, frf_form=data.quantity
    )
    with redirect_stderr(io.StringIO()):
        model.get_poles(method="lscf", show_progress=False)
    return len(model.all_poles[-1])


def methods(order: int) -> dict[str, Callable[[FrfSet], int]]:
    """What is timed, by name; each returns how many modes (or poles) it has."""
    settings = ModalSettings(max_order=order)
    plain = settings.model_copy(update={"refine": False})
    timed: dict[str, Callable[[FrfSet], int]] = {
        "identify": lambda data: len(analyse(data, settings).table),
        "identify, no refinement": lambda data: len(analyse(data, plain).table),
    }
    try:
        importlib.import_module("sdypy.EMA")
    except ImportError:
        print("sdypy-EMA is not installed and left out (pip install sdypy-EMA in an environment of its own)")
    else:
        timed["sdypy-EMA, poles alone"] = lambda data: theirs(data, order)
    return timed


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--large", action="store_true", help="also 1,002 FRFs of 4,000 lines, order 100")
    asked = parser.parse_args()
    analyse(measured(6, 2, 200, 4))
    print("FRFs | lines | order | modes | method | seconds | processor seconds | found")
    for channels, lines, modes, order in (
        (84, 800, 20, 60),
        *(((334, 4000, 60, 100),) if asked.large else ()),
    ):
        data = measured(channels, 3, lines, modes)
        for name, method in methods(order).items():
            begun, spent = time.perf_counter(), time.process_time()
            found = method(data)
            seconds = f"{time.perf_counter() - begun:.2f} | {time.process_time() - spent:.2f}"
            print(f"{3 * channels} | {lines} | {order} | {modes} | {name} | {seconds} | {found}", flush=True)


if __name__ == "__main__":
    main()
