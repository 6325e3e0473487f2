"""FRF sets as MATLAB keeps them: arrays under the documented names, and files of version 7.3."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from identify.measured.frf_set import FrfSet


def content(frf_set: FrfSet) -> dict[str, Any]:
    """The set under the documented names."""
    return {
        "frequency_hz": frf_set.frequency_hz,
        "frf": frf_set.frf,
        "coherence": frf_set.coherence,
        "outputs": np.array([str(c) for c in frf_set.outputs], dtype=object),
        "inputs": np.array([str(c) for c in frf_set.inputs], dtype=object),
        "unit": "m/s^2/N",
        "averages": 4.0,
    }


def write_v73(path: Path, names: dict[str, Any]) -> None:
    """A MATLAB v7.3 file as MATLAB lays it out: HDF5 behind 512 bytes, axes reversed, complex as (real,
    imag), text as UTF-16 codes.
    """
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in names.items():
            array = np.atleast_2d(np.asarray(value))
            if array.dtype.kind in "US":
                codes = np.frombuffer(str(value).encode("utf-16-le"), np.uint16)
                data, kind = file.create_dataset(name, data=codes[:, None]), "char"
                data.attrs["MATLAB_int_decode"] = np.int32(2)
            elif array.dtype.kind == "O":
                cells = [
                    file.create_dataset(
                        f"#refs#/{name}{i}", data=np.frombuffer(t.encode("utf-16-le"), np.uint16)[:, None]
                    )
                    for i, t in enumerate(value)
                ]
                for cell in cells:
                    cell.attrs["MATLAB_class"], cell.attrs["MATLAB_int_decode"] = (
                        np.bytes_("char"),
                        np.int32(2),
                    )
                data = file.create_dataset(
                    name, data=np.array([cell.ref for cell in cells], dtype=h5py.ref_dtype)[:, None]
                )
                kind = "cell"
            elif array.dtype.kind == "c":
                pairs = np.empty(array.T.shape, [("real", "f8"), ("imag", "f8")])
                pairs["real"], pairs["imag"] = array.T.real, array.T.imag
                data, kind = file.create_dataset(name, data=pairs), "double"
            else:
                data, kind = file.create_dataset(name, data=array.T.astype(float)), "double"
            data.attrs["MATLAB_class"] = np.bytes_(kind)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
