"""`identify modes --output-only` on several setups: reference sensors stay, the others are moved with their
mass."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.measured.uff.shapes import read_shapes
from identify.modal.mac import mac
from identify.modes.output_only import Asked, run_output_only
from identify.modes.scaling import ScaledBy
from identify.results import file as result_file
from identify.results.modes import ModesResult
from tests.generator.linear import Linear
from tests.generator.working import Work, cutting, recorded

HZ, DAMPING = np.array([9.0, 17.0, 26.0]), np.array([0.03, 0.02, 0.025])
SHAPES = np.array(
    [
        [1.0, 2.0, 3.0, 4.0, 2.2, 0.7],
        [1.0, 1.5, 0.2, -1.6, 1.1, -0.9],
        [2.0, -0.5, -0.8, 0.9, 1.4, 1.9],
    ]
)
WORK = Work(rate_hz=96.0, seconds=160.0, rpm=2900.0, teeth=2, wander=3e-4, pulses=0.0)
SETUPS = ((1, 2, 3, 4), (1, 2, 5, 6))
SETTINGS = {"band_hz": (4.0, 36.0), "max_order": 30}


def structure(drop: float) -> Linear:
    """Six sensors, frequencies lower by this part."""
    omega = 2 * np.pi * HZ * (1 - drop)
    lower = np.hstack([-np.diag(omega**2), -np.diag(2 * DAMPING * omega)])
    a = np.vstack([np.eye(3, 6, 3), lower])
    push = SHAPES[:, :3]
    return Linear(a, np.vstack([np.zeros((3, 3)), push]), SHAPES.T @ lower, SHAPES.T @ push)


def write(path: Path, sensors: tuple[int, ...], seed: int, drop: float = 0.0) -> Path:
    rng = np.random.default_rng(seed)
    values = recorded([(structure(drop), cutting(WORK, rng))], WORK, rng)[:, [n - 1 for n in sensors]]
    time = np.arange(len(values)) / WORK.rate_hz
    heads = ["time_s", *(f"{n}:+Z [m/s^2]" for n in sensors)]
    np.savetxt(path, np.column_stack([time, values]), delimiter=",", header=",".join(heads), comments="")
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("setups")
    return [
        write(folder / f"setup{k + 1}.csv", sensors, 5 + k, drop)
        for k, (sensors, drop) in enumerate(zip(SETUPS, (0.0, 0.02), strict=True))
    ]


def test_shapes_of_two_setups_become_one(files: list[Path], tmp_path: Path) -> None:
    _, written = run_output_only(files, tmp_path / "m.h5", Asked(modal=SETTINGS))
    found = result_file.read(tmp_path / "m.h5", ModesResult)
    (m,) = found.measurements.values()
    assert m.modes.channels == tuple(f"{n}:+Z" for n in range(1, 7))
    assert len(m.modes.frequency_hz) == 3
    assert np.diag(mac(m.modes.shapes, SHAPES)) == pytest.approx(1, abs=0.01)
    wrong = np.array(m.modes.shapes)
    wrong[:, 4:] *= 3
    assert np.diag(mac(wrong, SHAPES)).min() < 0.97, "negative control: the size of the second setup counts"
    assert m.setups is not None and m.output_only is not None
    low, high = m.setups.own_hz.min(axis=1), m.setups.own_hz.max(axis=1)
    assert high / low - 1 == pytest.approx(0.02, abs=0.005)
    assert m.output_only.shape_std.shape == (3, 6)
    assert any("2 setups whose poles differ" in note for note in found.notes)
    assert read_shapes(next(p for p in written if p.suffix == ".uff")).shapes is not None


def test_setups_need_two_sensors_in_common_and_no_masses(files: list[Path], tmp_path: Path) -> None:
    lone = write(tmp_path / "lone.csv", (1, 5, 6), 9)
    with pytest.raises(InputError, match="1 sensors in common"):
        run_output_only([files[0], lone], tmp_path / "m.h5", Asked(modal=SETTINGS))
    wanted = replace(Asked(modal=SETTINGS), scaled_by=ScaledBy(frf=tmp_path / "hammer.uff"))
    with pytest.raises(InputError, match="one file of responses"):
        run_output_only(files, tmp_path / "n.h5", wanted)
