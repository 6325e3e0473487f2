"""Synthetic targets for tests of costs and optimizers: data from the model itself, so that the truth is known exactly.

Only for contracts (zero at the truth, gradients, bounds): what a fit is worth is tested on data of another origin.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from identify.costs.target import FrfTarget, ModalTarget, Targets
from identify.effects.base import Parameter
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.modal_table import ModalTable
from identify.model.modes import complex_modes
from tests.arms import arm, initial, system

NODES = {1: ("link3", [0.0, 0.1, 0.2]), 2: ("link5", [0.1, 0.0, 0.1]), 3: ("link6", [0.0, 0.05, 0.15])}


def targets(
    folder: Path, effects: list[dict[str, Any]] | None = None, *, noise: float = 0.0, seed: int = 1, band: tuple[float, float] = (3, 80)
) -> tuple[Targets, list[Parameter]]:
    """FRFs of three points from forces at the last one, and the modes with shapes, both at the parameters' initial values.

    noise: standard deviation of the complex values over the RMS of each FRF.
    """
    model, parameters, _ = system(arm(folder, seed), effects or [{"kind": "joint-compliance"}], seed)
    channels = tuple(Channel(node, axis) for node in NODES for axis in (1, 2, 3))
    rows = np.vstack([model.jacobian(link, np.array(at))[:3] for link, at in NODES.values()])
    f = np.linspace(*band, 60)
    empty = FrfSet(f, np.zeros((60, 9, 3), complex), channels, channels[-3:], "accelerance", window_decay_per_s=0.7)
    values = initial(parameters)
    h = FrfTarget("synthetic", empty, model, rows, rows[-3:].T).predict(values)
    level = np.sqrt(np.mean(np.abs(h) ** 2, axis=0)) * (noise or 0.01) / np.sqrt(2)
    rng = np.random.default_rng(seed)
    disturbed = h + (noise > 0) * level * (rng.normal(size=h.shape) + 1j * rng.normal(size=h.shape))
    data = FrfSet(f, disturbed, channels, channels[-3:], "accelerance", window_decay_per_s=0.7)
    frf = FrfTarget("synthetic", data, model, rows, rows[-3:].T, np.broadcast_to(level, h.shape).copy())
    modes = complex_modes(*model.matrices(values))
    table = ModalTable(modes.frequency_hz[:4], modes.damping_ratio[:4], channels, modes.shapes[:4] @ rows.T)
    return Targets((frf,), (ModalTarget("synthetic", table, model, rows),)), parameters
