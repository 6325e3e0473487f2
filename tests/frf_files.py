"""Files of FRFs for tests, in the layouts of docs/data_files.md."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import h5py

from identify.measured.frf_set import UNIT, FrfSet

_LONG = ("frequency_hz", "output", "input", "real", "imag")


def write_csv(path: Path, frf_set: FrfSet) -> None:
    """Write the measured pairs of an FRF set in the long layout, in SI units, with every digit."""
    notes = {
        "unit": UNIT[frf_set.quantity],
        "averages": frf_set.averages,
        "window_decay_per_s": frf_set.window_decay_per_s,
        "record_s": frf_set.record_s,
    }
    lines = [f"# {key}: {value}" for key, value in notes.items() if value is not None]
    lines.append(",".join(_LONG) + (",coherence" if frf_set.coherence is not None else ""))
    for i, j in product(range(len(frf_set.outputs)), range(len(frf_set.inputs))):
        if frf_set.measured[i, j]:
            for line, (frequency, value) in enumerate(
                zip(frf_set.frequency_hz.tolist(), frf_set.frf[:, i, j].tolist(), strict=True)
            ):
                coherence = (
                    ""
                    if frf_set.coherence is None
                    else f",{float(frf_set.coherence[line, i, j])!r}".replace("nan", "")
                )
                lines.append(
                    f"{frequency!r},{frf_set.outputs[i]},{frf_set.inputs[j]},{value.real!r},{value.imag!r}{coherence}"
                )
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_hdf5(path: Path, frf_set: FrfSet) -> None:
    """Write an FRF set in SI units, every bit of it."""
    with h5py.File(path, "w") as file:
        file["frequency_hz"] = frf_set.frequency_hz
        file["frf"] = frf_set.frf
        file["outputs"] = [str(channel) for channel in frf_set.outputs]
        file["inputs"] = [str(channel) for channel in frf_set.inputs]
        if frf_set.coherence is not None:
            file["coherence"] = frf_set.coherence
        file.attrs["quantity"] = frf_set.quantity
        file.attrs["unit"] = UNIT[frf_set.quantity]
        file.attrs["window_decay_per_s"] = frf_set.window_decay_per_s
        for name in ("averages", "record_s"):
            if (value := getattr(frf_set, name)) is not None:
                file.attrs[name] = value
