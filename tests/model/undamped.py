"""Modes of a system without damping, from the textbook's eigenvalue problem."""

from __future__ import annotations

import numpy as np
import scipy


def undamped_modes(mass: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (n,), Hz, and mass-normalised shapes (n, n), one a row; an unstable mode has a negative
    frequency.
    """
    squares, shapes = scipy.linalg.eigh(stiffness, mass)
    return np.sign(squares) * np.sqrt(np.abs(squares)) / (2 * np.pi), shapes.T
