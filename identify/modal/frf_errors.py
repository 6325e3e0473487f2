"""Errors of modelled FRFs beside measured ones, per pair: one place for fits and for modal analyses."""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from identify.core.arrays import Array, Complex
from identify.modal.mac import frac


class FrfErrors(TypedDict):
    """Errors of FRFs, each (pairs,)."""

    relative_error: Array
    frac: Array
    area_error: Array


def frf_errors(measured: Complex, modelled: Complex) -> FrfErrors:
    """relative_error, frac and area_error of FRFs (lines, pairs), each (pairs,); NaN where the measured FRF
    is zero.

    Relative: RMS difference over RMS measured; area: between the magnitudes, over the area below the measured
    one (Kobe Eq. 10).
    """
    return {
        "relative_error": _over(
            np.linalg.norm(modelled - measured, axis=0), np.linalg.norm(measured, axis=0)
        ),
        "frac": np.asarray(frac(measured, modelled)),
        "area_error": _over(
            np.abs(np.abs(modelled) - np.abs(measured)).sum(axis=0), np.abs(measured).sum(axis=0)
        ),
    }


def _over(top: Array, below: Array) -> Array:
    return np.asarray(np.divide(top, below, out=np.full(top.shape, np.nan), where=below > 0))
