"""Modal analysis beside sdypy-EMA on the same FRFs, band and order: time, and how many true modes are found.

Run `python -m tests.benchmarks.modal` from the repository's root; `--order 60` is the order of both,
`--methods` picks some. sdypy-EMA is imported if it is installed and left out, saying so, if not; it has no
automatic selection, so it is given the reference frequencies to pick the poles closest to them, once with its
default frequency window and once with a narrow one.
"""

from __future__ import annotations

import argparse
import csv
import importlib
import io
import json
import time
from collections.abc import Callable
from contextlib import redirect_stderr
from dataclasses import dataclass

import numpy as np

from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import analyse
from identify.modal.pairing import PairSettings, pair
from identify.modal.settings import ModalSettings
from tests.modal.test_hidden_arms import true_modes
from tests.modal.test_measured_structures import AIRCRAFT_HZ, AIRCRAFT_PERCENT
from tests.shared import shared

NARROW_HZ = 2


@dataclass(frozen=True)
class Case:
    """FRFs, the true (or reference) modes, and what counts as found: relative error of frequency and of
    damping.
    """

    name: str
    data: FrfSet
    truth: ModalTable
    band_hz: tuple[float, float]
    frequency_tolerance: float
    damping_tolerance: float


def cases() -> list[Case]:
    """The aircraft and the hidden arms with nothing hidden."""
    percent = np.array(AIRCRAFT_PERCENT) / 100
    aircraft = load_frf_set(
        shared("data", "uliege_aircraft", "aircraft_converted.uff"), FrfFileOptions(unit="m/s^2/N")
    )
    found = [
        Case("aircraft", aircraft, ModalTable(np.array(AIRCRAFT_HZ), percent), (10.0, 170.0), 0.003, 0.3)
    ]
    for name in ("none_101", "none_102"):
        test = json.loads((shared("hidden", name) / "test.json").read_text())
        for posture, file in enumerate(test["files"], start=1):
            options = FrfFileOptions(window_decay_per_s=test["exponential_window_decay_per_s"])
            data = load_frf_set(shared("hidden", name, file["file"]), options)
            low, high = float(data.frequency_hz[0]), float(data.frequency_hz[-1])
            truth = true_modes(name, posture)
            inside = truth.frequency_hz <= high
            table = ModalTable(truth.frequency_hz[inside], truth.damping_ratio[inside])
            found.append(Case(f"{name} posture {posture}", data, table, (low, high), 0.002, 0.03))
    return found


def ours(case: Case, estimator: str, order: int) -> ModalTable:
    """Automatic analysis with default criteria."""
    limit = min(order, len(case.data.band(*case.band_hz).frequency_hz) // 4)
    return analyse(case.data, ModalSettings(band_hz=case.band_hz, estimator=estimator, max_order=limit)).table


def theirs(case: Case, method: str, order: int, window_hz: int | None) -> ModalTable:
    """sdypy-EMA with poles picked closest to the true frequencies; None: its default window."""
    ema = importlib.import_module("sdypy.EMA")
    frf = case.data.frf.reshape(len(case.data.frequency_hz), -1).T
    low, high = case.band_hz
    if method == "lsce":
        # Its sample time does not follow a lower limit, which shifts every pole.
        low = 0.0
    limit = min(order, len(case.data.frequency_hz) // 4)
    model = ema.Model(
        frf, case.data.frequency_hz, lower=low, upper=high, pol_order_high=limit, frf_form=case.data.quantity
    )
    sigma = case.data.window_decay_per_s
    omega = 2 * np.pi * case.truth.frequency_hz
    seen = np.hypot(
        omega * np.sqrt(1 - case.truth.damping_ratio**2), omega * case.truth.damping_ratio + sigma
    ) / (2 * np.pi)
    with redirect_stderr(io.StringIO()):
        model.get_poles(method=method, show_progress=False)
        model.select_closest_poles(list(seen), **({} if window_hz is None else {"f_window": window_hz}))
    size = 2 * np.pi * np.asarray(model.nat_freq)
    damping = np.asarray(model.nat_xi)
    poles = size * (-damping + 1j * np.sqrt(np.maximum(1 - damping**2, 0))) + sigma
    order_by = np.argsort(np.abs(poles))
    frequency, ratio = np.abs(poles) / (2 * np.pi), -poles.real / np.maximum(np.abs(poles), 1e-12)
    return ModalTable(frequency[order_by], ratio[order_by])


def score(case: Case, table: ModalTable) -> tuple[int, int, int]:
    """True modes found in frequency, found in frequency and damping, and further modes."""
    found = pair(case.truth, table, PairSettings(max_frequency_error=case.frequency_tolerance))
    good = np.abs(found.damping_error) < case.damping_tolerance
    return len(found), int(good.sum()), len(found.unpaired_b)


def methods() -> dict[str, Callable[[Case, int], ModalTable]]:
    """What is compared, by name."""
    compared: dict[str, Callable[[Case, int], ModalTable]] = {
        "identify plscf": lambda case, order: ours(case, "plscf", order),
        "identify lsce": lambda case, order: ours(case, "lsce", order),
    }
    try:
        importlib.import_module("sdypy.EMA")
    except ImportError:
        print("sdypy-EMA is not installed and left out (pip install sdypy-EMA in an environment of its own)")
        return compared
    for method in ("lscf", "lsce"):
        compared[f"sdypy-EMA {method}, default window"] = lambda case, order, m=method: theirs(
            case, m, order, None
        )
        compared[f"sdypy-EMA {method}, {NARROW_HZ} Hz window"] = lambda case, order, m=method: theirs(
            case, m, order, NARROW_HZ
        )
    return compared


def run(order: int, wanted: list[str]) -> list[list[str]]:
    """One row for every case and method."""
    rows = []
    for case in cases():
        for name, method in methods().items():
            if wanted and not any(word in name for word in wanted):
                continue
            start = time.perf_counter()
            try:
                found = score(case, method(case, order))
                result = [f"{found[0]}/{len(case.truth)}", f"{found[1]}/{len(case.truth)}", str(found[2])]
            except (
                ValueError,
                IndexError,
                ArithmeticError,
                AssertionError,
                np.linalg.LinAlgError,
                MemoryError,
            ) as error:
                result = [f"failed: {type(error).__name__}", "", ""]
            rows.append([case.name, name, f"{time.perf_counter() - start:.2f}", *result])
            print(
                "  ".join(f"{cell:34s}" if k == 1 else f"{cell:20s}" for k, cell in enumerate(rows[-1])),
                flush=True,
            )
    return rows


def main() -> None:
    """Print the table, and write it as CSV where `--csv` says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--order", type=int, default=60)
    parser.add_argument("--methods", nargs="*", default=[], help="only methods with one of these words")
    parser.add_argument("--csv", help="file for the table")
    arguments = parser.parse_args()
    print("case, method, seconds, modes found in frequency, in frequency and damping, further modes")
    rows = run(arguments.order, arguments.methods)
    if arguments.csv:
        with open(arguments.csv, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(
                [["case", "method", "seconds", "frequency", "damping", "further"], *rows]
            )


if __name__ == "__main__":
    main()
