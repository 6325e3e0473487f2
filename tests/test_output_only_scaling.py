"""`identify modes --output-only` scaled: modal masses by FRFs, by an added mass, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.cli import app
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import read_modal_table
from identify.measured.uff.write import write_uff58
from identify.modal.analysis import ModalAnalysis
from identify.modal.analysis import analyse as analyse_frfs
from identify.modal.operational.analysis import OperationalModes, analyse
from identify.modal.operational.by_added_mass import by_added_mass
from identify.modal.operational.by_frfs import by_frfs
from identify.modal.operational.settings import OperationalSettings
from identify.modal.settings import ModalSettings
from identify.reports.modes.tables import mass_table
from identify.results import file as result_file
from identify.results.modes import ModesResult, ShapeScaling
from tests.generator.linear import Linear
from tests.generator.working import Work, recorded
from tests.test_output_only import BAND, DAMPING, HZ, LOW, SHAPES, csv, history, refusal

NAMES = ("1:+Z", "2:+Z", "3:+Z", "4:+Z")
MASS = 1 / np.max(np.abs(SHAPES), axis=0) ** 2
"""Modal masses, kg, of shapes whose largest component is 1: SHAPES have unit modal mass."""
WORK = Work(rate_hz=128.0, seconds=400.0)
ADDED = 0.015
"""kg at the first sensor."""


def structure(added_kg: float = 0.0) -> Linear:
    """Four sensors and four modes, pushed at every sensor, with a mass at the first."""
    at = SHAPES[:1].T
    mass = np.eye(4) + added_kg * at @ at.T
    omega = 2 * np.pi * HZ
    lower = -np.linalg.solve(mass, np.hstack([np.diag(omega**2), np.diag(2 * DAMPING * omega)]))
    push = np.linalg.solve(mass, SHAPES.T)
    return Linear(
        np.vstack([np.eye(4, 8, 4), lower]),
        np.vstack([np.zeros((4, 4)), push]),
        SHAPES @ lower,
        SHAPES @ push,
    )


def records(added_kg: float = 0.0, seed: int = 3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return recorded([(structure(added_kg), rng.normal(size=(WORK.samples, 4)))], WORK, rng)


def frfs(pairs: list[tuple[int, int]], gain: float = 1.0, names: tuple[str, ...] = NAMES) -> FrfSet:
    """Accelerances between sensors, with a hundredth of noise."""
    rng, hz = np.random.default_rng(8), np.arange(2.0, 60.0, 0.125)
    outputs, inputs = sorted({i for i, _ in pairs}), sorted({j for _, j in pairs})
    whole = structure().accelerance(2j * np.pi * hz)[:, outputs][:, :, inputs]
    size = 0.01 * np.sqrt(np.mean(np.abs(whole) ** 2, axis=0) / 2)
    noise = rng.normal(size=whole.shape) + 1j * rng.normal(size=whole.shape)
    channels = tuple(map(Channel.parse, names))
    return FrfSet(
        hz,
        gain * (whole + size * noise),
        tuple(channels[i] for i in outputs),
        tuple(channels[j] for j in inputs),
        "accelerance",
        source="frfs.uff",
    )


def found_in(values: np.ndarray) -> OperationalModes:
    return analyse(history(values), OperationalSettings(), LOW)


def forced(pairs: list[tuple[int, int]], gain: float = 1.0, names: tuple[str, ...] = NAMES) -> ModalAnalysis:
    return analyse_frfs(frfs(pairs, gain, names), ModalSettings(band_hz=BAND))


@pytest.fixture(scope="module")
def values() -> np.ndarray:
    return records()


@pytest.fixture(scope="module")
def heavier() -> np.ndarray:
    return records(ADDED, seed=4)


@pytest.fixture(scope="module")
def found(values: np.ndarray) -> OperationalModes:
    return found_in(values)


@pytest.mark.parametrize("pairs", [[(0, 0)], [(1, 0)], [(0, 0), (1, 0), (2, 0), (3, 0)]])
def test_modal_masses_from_frfs(found: OperationalModes, pairs: list[tuple[int, int]]) -> None:
    """At one sensor, between two, and from one to all."""
    masses = by_frfs(found, forced(pairs))
    assert np.isfinite(masses.kg).sum() >= 3
    told = np.isfinite(masses.kg)
    assert np.abs(masses.kg[told] / MASS[told] - 1).max() < 0.1
    assert np.abs((masses.kg - MASS) / masses.std_kg)[told].max() < 3.5
    assert masses.partner_hz[told] == pytest.approx(HZ[told], rel=0.01)


def test_a_larger_frf_is_a_smaller_modal_mass(found: OperationalModes) -> None:
    once, twice = (by_frfs(found, forced([(0, 0), (1, 0)], gain)) for gain in (1.0, 2.0))
    assert twice.kg == pytest.approx(once.kg / 2, rel=1e-3)


def test_frfs_of_wrong_sign_tell_no_mass(found: OperationalModes) -> None:
    masses = by_frfs(found, forced([(0, 0)], gain=-1.0))
    assert np.isnan(masses.kg).all()
    assert "is turned by" in masses.reason[0]


def test_a_reversed_channel_is_the_same_channel(found: OperationalModes) -> None:
    turned = by_frfs(found, forced([(1, 0)], gain=-1.0, names=("1:+Z", "2:-Z", "3:+Z", "4:+Z")))
    assert turned.kg == pytest.approx(by_frfs(found, forced([(1, 0)])).kg, rel=1e-6, nan_ok=True)


def test_modal_masses_from_an_added_mass(found: OperationalModes, heavier: np.ndarray) -> None:
    masses = by_added_mass(found, found_in(heavier), {1: ADDED})
    told = np.isfinite(masses.kg)
    assert told.sum() >= 3
    assert np.abs((masses.kg - MASS) / masses.std_kg)[told].max() < 3.5
    assert np.all(masses.std_kg[told] < 0.25 * masses.kg[told])
    # Told twice as heavy, and modes are so too.
    double = by_added_mass(found, found_in(heavier), {1: 2 * ADDED})
    assert double.kg == pytest.approx(2 * masses.kg, nan_ok=True)


@pytest.mark.parametrize("added_kg", [0.02, 0.5])
def test_a_mass_of_any_size_tells_exactly(found: OperationalModes, added_kg: float) -> None:
    """Without noise, also with a mass that halves frequencies and changes shapes beyond recognition."""
    light, heavy = exact(found, 0.0), exact(found, added_kg)
    masses = by_added_mass(light, heavy, {1: added_kg})
    assert masses.kg == pytest.approx(MASS, rel=2e-3)
    usual = (light.frequency_hz**2 / heavy.frequency_hz**2 - 1) / (added_kg * np.abs(light.shapes[:, 0]) ** 2)
    assert np.max(np.abs(1 / usual / MASS - 1)) > 0.02


def test_fewer_channels_than_modes_tell_them(found: OperationalModes) -> None:
    light, heavy = (without_last(exact(found, kg)) for kg in (0.0, 0.02))
    assert by_added_mass(light, heavy, {1: 0.02}).kg == pytest.approx(MASS, rel=2e-3)
    none = by_added_mass(light, modes_kept(heavy, np.arange(4) < 1), {1: 0.02})
    assert np.isnan(none.kg).all()
    assert "1 mode with the mass at 3 channels does not determine 4 modal masses" in none.reason[0]


def test_a_mode_beyond_the_band_widens_the_others(found: OperationalModes) -> None:
    """The highest one of four is not in the band: what it adds is uncertain, not wrong."""
    kept = np.arange(4) < 3
    light, heavy = (modes_kept(exact(found, kg), kept) for kg in (0.0, 0.05))
    light = replace(light, records=replace(light.records, band_hz=(4.0, 30.0)))
    masses, whole = (
        by_added_mass(light, heavy, {1: 0.05}),
        by_added_mass(*(exact(found, kg) for kg in (0.0, 0.05)), {1: 0.05}),
    )
    told = np.isfinite(masses.kg)
    assert told.sum() >= 2
    assert np.abs((masses.kg - MASS[:3]) / masses.std_kg)[told].max() < 2.5
    assert np.min(masses.std_kg[told] / whole.std_kg[:3][told]) > 10


def modes_kept(found: OperationalModes, kept: np.ndarray) -> OperationalModes:
    return replace(
        found,
        frequency_hz=found.frequency_hz[kept],
        damping_ratio=found.damping_ratio[kept],
        shapes=found.shapes[kept],
        scatter=found.scatter[kept],
    )


def exact(found: OperationalModes, added_kg: float) -> OperationalModes:
    """Modes as they are, with hardly any interval."""
    poles, vectors = np.linalg.eig(structure(added_kg).a)
    kept = np.flatnonzero(poles.imag > 0)
    kept = kept[np.argsort(np.abs(poles[kept]))]
    shapes = (SHAPES @ vectors[:4, kept]).T
    shapes = shapes / shapes[np.arange(4), np.argmax(np.abs(shapes), axis=1)][:, None]
    tiny = 1e-6 * np.ones((4, 4))
    return replace(
        found,
        frequency_hz=np.abs(poles[kept]) / (2 * np.pi),
        shapes=shapes,
        scatter=replace(found.scatter, frequency_hz=tiny[:, 0], damping=tiny[:, 0], shapes=tiny),
    )


def without_last(found: OperationalModes) -> OperationalModes:
    """Fewer channels than modes, so that shapes tell nothing about each other."""
    scatter = replace(found.scatter, shapes=found.scatter.shapes[:, :3])
    records = replace(found.records, channels=found.records.channels[:3])
    return replace(found, shapes=found.shapes[:, :3], scatter=scatter, records=records)


def test_a_mass_that_is_not_there_is_not_believed(found: OperationalModes) -> None:
    """The same structure again: no shift, so no modal mass."""
    masses = by_added_mass(found, found_in(records(seed=9)), {1: ADDED})
    assert np.isnan(masses.kg).all()
    assert all(masses.reason)


def test_the_command_writes_modal_masses(tmp_path: Path, values: np.ndarray, heavier: np.ndarray) -> None:
    data, more, frf = (tmp_path / name for name in ("light.csv", "heavy.csv", "frf.uff"))
    csv(data, values), csv(more, heavier)
    write_uff58(frf, frfs([(0, 0), (1, 0)]))
    given = [str(data), "--output-only", "--no-report", "--band", "4", "50", "--max-order", "20"]
    given += ["--out", str(tmp_path / "a.h5")]
    done = CliRunner().invoke(app, ["modes", *given, "--scale-frf", str(frf)])
    assert done.exit_code == 0, done.output
    assert "come from the FRFs of frf.uff" in " ".join(done.output.split())
    scaling = scaling_in(tmp_path / "a.h5")
    assert scaling.modal_mass_kg == pytest.approx(MASS, rel=0.15, nan_ok=True)
    written = read_modal_table(tmp_path / "a.yaml").modal_mass_kg
    assert written is not None
    assert np.array_equal(written, scaling.modal_mass_kg, equal_nan=True)
    given[-1] = str(tmp_path / "b.h5")
    done = CliRunner().invoke(
        app, ["modes", *given, "--scale-record", str(more), "--added-mass", f"1={ADDED}"]
    )
    assert done.exit_code == 0, done.output
    said = " ".join(done.output.split())
    assert f"recorded with {ADDED} kg at point 1" in said
    assert "point 1 was not recorded along X and Y" in said
    scaling = scaling_in(tmp_path / "b.h5")
    assert scaling.method == "added mass"
    assert scaling.added_kg.tolist() == [ADDED]


def scaling_in(path: Path) -> ShapeScaling:
    (kept,) = result_file.read(path, ModesResult).measurements.values()
    assert kept.output_only is not None and kept.output_only.scaling is not None
    table = mass_table(kept)
    assert table is not None
    assert len(table.rows) == len(kept.modes.frequency_hz)
    return kept.output_only.scaling


def test_refusals(tmp_path: Path, values: np.ndarray) -> None:
    data, frf = csv(tmp_path / "light.csv", values[: len(values) // 5]), tmp_path / "frf.uff"
    write_uff58(frf, frfs([(1, 2)], names=("7:+Z", "8:+Z", "9:+Z", "4:+Z")))

    def said(*options: object) -> str:
        return refusal(data, "--output-only", "--band", 4, 50, "--out", tmp_path / "c.h5", *options)

    assert "no FRF whose force and response are both" in said("--scale-frf", frf)
    assert "one of them" in said("--scale-frf", frf, "--scale-record", data, "--added-mass", "1=1")
    assert "add `--added-mass`" in said("--scale-record", data)
    assert "add `--scale-record`" in said("--added-mass", "1=1")
    assert "point 9, which is not in both" in said("--scale-record", data, "--added-mass", "9=1")
    assert "such as 12=0.5" in said("--scale-record", data, "--added-mass", "1=-1")
    assert "such as 12=0.5" in said("--scale-record", data, "--added-mass", "one=1")
    assert "twice" in said("--scale-record", data, "--added-mass", "1=1", "--added-mass", "1=2")
    assert "add `--output-only`" in refusal(data, "--scale-frf", frf)
    assert not list(tmp_path.glob("*.h5"))
