"""Several files of one test: which of them were measured at once, and what is said of those that were not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identify.core.text import count, listed
from identify.core.thresholds import SIGMAS_95
from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set
from identify.measured.silent import connected
from identify.measured.source import Estimation, read_source
from identify.modal.setups.result import pooled
from identify.modal.setups.run import EXPLAINED, Setups
from identify.results import modes as results

_SHOWN = 4
"""Modes that a note names."""


def read_setups(
    files: Sequence[Path], file: FrfFileOptions, estimation: Estimation | None, roved: bool
) -> list[tuple[str, FrfSet]]:
    """The FRFs of each setup with its name: files whose responses are at the same nodes are one setup.
    roved: each node of a response is a setup, as where one sensor was moved while all FRFs went into one
    file.
    """
    sets = {path: read_source([path], file, estimation) for path in files}
    groups: dict[frozenset[int], list[Path]] = {}
    for path, one in sets.items():
        groups.setdefault(frozenset(c.node for c in one.outputs), []).append(path)
    found = []
    for paths in groups.values():
        if len(paths) == 1:
            one = sets[paths[0]]
        elif estimation is None:
            one = load_frf_set(paths, file)
        else:
            one = pooled([sets[path] for path in paths], str(paths[0]))
        found.append((paths[0].stem, one))
    found = [(name, connected(one)) for name, one in _chosen(found, file, str(files[0]))]
    return [part for name, one in found for part in _by_node(name, one)] if roved else found


def _chosen(setups: list[tuple[str, FrfSet]], file: FrfFileOptions, where: str) -> list[tuple[str, FrfSet]]:
    """The named channels of every setup, and setups that have some; InputError for one that none has."""
    if len(setups) == 1:
        (name, one), *_ = setups
        return [(name, one.chosen(file.outputs, file.inputs, where))]
    pooled([one for _, one in setups]).chosen(file.outputs, file.inputs, where)

    def own(wanted: list[str] | None, present: tuple[Channel, ...]) -> list[str] | None:
        return None if wanted is None else [text for text in wanted if Channel.parse(text) in present]

    named = [
        (name, one, own(file.outputs, one.outputs), own(file.inputs, one.inputs)) for name, one in setups
    ]
    return [
        (name, one.chosen(outputs, inputs, name))
        for name, one, outputs, inputs in named
        if outputs != [] and inputs != []
    ]


def _by_node(name: str, data: FrfSet) -> list[tuple[str, FrfSet]]:
    """A set by the nodes of its responses, without forces that none of them was measured with."""
    parts = []
    for node in dict.fromkeys(c.node for c in data.outputs):
        rows = [i for i, c in enumerate(data.outputs) if c.node == node]
        columns = [j for j in range(len(data.inputs)) if data.measured[rows, j].any()]
        parts.append((f"{name}, node {node}", data.pairs(rows, columns)))
    return parts


def kept_setups(found: Setups) -> results.SetupPoles:
    """What a result keeps of setups."""
    own, modes = found.merged.own, found.merged
    expected = np.full(own.shape, np.nan) if modes.loading is None else modes.loading.predicted / (2 * np.pi)
    return results.SetupPoles(
        setup=found.names,
        frequency_hz=np.abs(modes.poles) / (2 * np.pi),
        own_hz=np.abs(own) / (2 * np.pi),
        own_damping_ratio=np.asarray(-own.real / np.abs(own)),
        expected_hz=expected,
        agree=found.agree,
        together=found.together,
        unexplained=found.unexplained,
        sensor_kg=modes.kg,
        sensor_std_kg=modes.kg_std,
    )


def setups_note(name: str, kept: results.SetupPoles) -> str:
    """Whether poles of setups differ, by how much, and what explains it."""
    said = f"{name}: {count(len(kept.setup), 'setup')}"
    if kept.agree:
        how = ": all FRFs were analysed together" if kept.together else ""
        return f"{said} whose poles agree within their intervals{how}"
    spread = np.nanmax(kept.own_hz, axis=1) / np.nanmin(kept.own_hz, axis=1) - 1
    most = np.argsort(-spread)[:_SHOWN]
    shifts = listed([f"{kept.frequency_hz[r]:.4g} Hz by {100 * spread[r]:.2g} %" for r in sorted(most)])
    said += f" whose poles differ, most those at {shifts}"
    if not kept.unexplained < EXPLAINED:
        how = "means over setups are shown, with their scatter"
        if kept.together:
            how = "all FRFs were analysed together, as a common model splits no mode"
        return f"{said}, which no mass of moved sensors explains: look at what else changed; {how}"
    mass = (
        f" of {1e3 * kept.sensor_kg:.3g} ± {1e3 * SIGMAS_95 * kept.sensor_std_kg:.1g} g"
        if kept.sensor_kg > 0
        else ""
    )
    left = f"{100 * kept.unexplained:.2g} % (median)"
    return (
        f"{said}: the mass{mass} of a moved sensor explains it but for {left}; frequencies, damping and"
        " shapes are those without it"
    )
