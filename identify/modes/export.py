"""Files of a modal analysis: its modes as tables, and the FRFs, analysed and rebuilt, as universal files."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import cast

import numpy as np

from identify.core.arrays import Complex
from identify.core.atomic import write_atomically
from identify.measured.frf_set import POWER, FrfSet, Quantity
from identify.measured.geometry import MeasuredGeometry
from identify.measured.modal_tables import ModalTable, write_modal_table
from identify.measured.uff.shapes import write_shapes
from identify.measured.uff.write import write_uff58
from identify.modal.analysis import ModalAnalysis

_SUFFIXES = ("_frfs.uff", "_rebuilt.uff")


def frf_paths(table: Path) -> list[Path]:
    """Where the FRFs of an analysis go whose modal table is at `table`: analysed, rebuilt."""
    return [table.with_name(table.stem + suffix) for suffix in _SUFFIXES]


def write_frfs(found: ModalAnalysis, table: Path) -> list[Path]:
    """Both, beside the modal table, on the lines that were analysed, without pairs that were not measured;
    none where all are of motors.
    """
    layout = found.layout
    if any(all(channel.motor for channel in side) for side in (layout.responses, layout.references)):
        return []
    rebuilt = np.where(np.isnan(layout.frf), np.nan, found.synthesised)
    paths = frf_paths(table)
    for path, frf, name in zip(paths, (layout.frf, rebuilt), ("measured", "rebuilt from modes"), strict=True):
        write_atomically(path, partial(write_uff58, frf_set=_frf_set(found, frf, name), binary=True))
    return paths


def _frf_set(found: ModalAnalysis, frf: Complex, name: str) -> FrfSet:
    """FRFs (L, responses, references) as outputs by inputs."""
    layout = found.layout
    quantity = cast(Quantity, next(name for name, power in POWER.items() if power == layout.power))
    channels = layout.responses, layout.references
    if layout.transposed:
        frf, channels = frf.transpose(0, 2, 1), channels[::-1]
    source = f"{name}: {Path(layout.source).name}"
    return FrfSet(
        layout.frequency_hz, frf, *channels, quantity, window_decay_per_s=layout.decay, source=source
    )


def write_tables(table: ModalTable, sensors: MeasuredGeometry | None, path: Path) -> list[Path]:
    """The modal table as YAML, and shapes with their geometry as a universal file, which has points alone;
    nothing where no mode was found.
    """
    if not len(table):
        return []
    shapes = path.with_suffix(".uff")
    write_atomically(path, partial(write_modal_table, table=table))
    if all(channel.motor is not None for channel in table.channels):
        return [path]
    write_atomically(shapes, partial(write_shapes, table=table, geometry=sensors))
    return [path, shapes]
