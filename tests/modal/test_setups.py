"""Modes of several setups whose sensors weigh something: paired, explained by their mass, put together."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.modal.mac import mac
from identify.modal.settings import ModalSettings
from identify.modal.setups import run
from identify.modal.setups.align import align, nearest
from identify.modal.setups.loading import explained, loaded, without
from identify.modal.setups.residues import factors, is_joined
from identify.modal.setups.result import pooled
from identify.modal.setups.run import analyse_setups
from tests.modal.systems import System, channels

N = 6
PLACES = np.linspace(0.1, 1.0, N)
HZ, DAMPING = np.array([20.0, 31.0, 47.0, 62.0]), np.array([0.012, 0.01, 0.008, 0.01])
SHAPES = np.array([np.sin((r + 0.7) * np.pi * PLACES + 0.2 * r) for r in range(4)]) * 0.7
LINES = np.linspace(8.0, 75.0, 600)
KG = 0.04


def structure(at: list[int], kg: float, part: float = 0.0) -> System:
    """Four modes seen at six points, with masses at some, as modal coordinates; part: by which all
    frequencies are higher.
    """
    omega = 2 * np.pi * HZ * (1 + part)
    moved = SHAPES[:, at]
    return System(np.eye(4) + kg * moved @ moved.T, np.diag(2 * DAMPING * omega), np.diag(omega**2))


def measure(
    at: list[int], kg: float, forces: list[int], noise: float, seed: int, name: str, part: float = 0.0
) -> FrfSet:
    """Accelerances of the points where sensors are."""
    frf = structure(at, kg, part).frf(2j * np.pi * LINES)
    frf = np.einsum("mo,lmn,ni->loi", SHAPES[:, at], frf, SHAPES[:, forces])
    rng = np.random.default_rng(seed)
    white = (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape)) / np.sqrt(2)
    every = channels(N)
    frf = frf + noise * np.sqrt(np.mean(np.abs(frf) ** 2)) * white
    outputs, inputs = tuple(every[i] for i in at), tuple(every[i] for i in forces)
    return FrfSet(LINES, frf, outputs, inputs, "accelerance", source=name)


@cache
def setups(kg: float) -> list[FrfSet]:
    return [measure([k], kg, [1], 0.003, 3 + k, f"point {k + 1}") for k in range(N)]


def test_what_a_mass_does_is_taken_out_and_the_mass_told() -> None:
    sets = setups(KG)
    found, said = analyse_setups(pooled(sets), sets, [s.source for s in sets], ModalSettings())
    assert said is not None and not said.together
    table = found.table
    assert len(table) == 4
    assert table.frequency_std_hz is not None and table.shapes is not None
    off = np.abs(table.frequency_hz - HZ)
    assert (off < 0.02 * DAMPING * HZ).all(), (
        "of half-bandwidths, where the mass moves modes by up to one and a half"
    )
    assert (off < 4 * table.frequency_std_hz).all()
    assert np.diag(mac(table.shapes, SHAPES)) == pytest.approx(1, abs=2e-3)
    assert table.damping_ratio == pytest.approx(DAMPING, rel=0.02)
    assert said.merged.kg == pytest.approx(KG, rel=0.03)
    assert said.merged.kg_std < 0.1 * KG
    assert found.table.modal_mass_kg is not None, "a sensor came to where the force was"
    assert table.shapes == pytest.approx(
        SHAPES * np.sign(SHAPES[:, [1]] * table.shapes[:, [1]].real), abs=0.02
    )


def test_one_set_of_them_all_shows_modes_that_are_not_there() -> None:
    """Negative control: analysed as if they shared their poles, the FRFs of a moved sensor split modes."""
    from identify.modal.analysis import analyse

    assert len(analyse(pooled(setups(KG))).table) > 4


def test_setups_whose_poles_agree_are_analysed_together() -> None:
    sets = setups(0.0)
    found, said = analyse_setups(pooled(sets), sets, [s.source for s in sets], ModalSettings())
    assert said is not None and said.together
    assert found.table.frequency_hz == pytest.approx(HZ, rel=1e-3)


def test_moved_forces_and_sensors_are_joined_by_what_they_share() -> None:
    """Setups with other forces too, joined by one that two of them have."""
    one = measure([0, 2, 4], KG, [1, 3], 0.003, 1, "one")
    two = measure([1, 3, 5], KG, [3, 5], 0.003, 2, "two")
    found, _ = analyse_setups(pooled([one, two]), [one, two], ["one", "two"], ModalSettings())
    assert np.diag(mac(found.table.shapes, SHAPES)) == pytest.approx(1, abs=5e-3)  # type: ignore[arg-type]
    three = measure([1, 3, 5], KG, [5], 0.003, 2, "three")
    lone = replace(one, frf=one.frf[:, :, :1], inputs=one.inputs[:1])
    with pytest.raises(InputError, match="setups without a channel in common"):
        analyse_setups(pooled([lone, three]), [lone, three], ["lone", "three"], ModalSettings())
    other = replace(two, frequency_hz=LINES + 1)
    with pytest.raises(InputError, match="a frequency axis that differs"):
        analyse_setups(pooled([one, two]), [one, other], ["one", "two"], ModalSettings())
    with pytest.raises(InputError, match="different quantities"):
        analyse_setups(
            pooled([one, two]), [one, replace(two, quantity="mobility")], ["a", "b"], ModalSettings()
        )


def test_loaded_modes_are_the_eigenvalues_with_the_mass_on() -> None:
    omega = 2 * np.pi * HZ
    for at in ([0], [2, 4]):
        there, made = loaded(omega, [np.sqrt(KG) * SHAPES[:, at]])
        system = structure(at, KG)
        squares = np.linalg.eigvals(np.linalg.solve(system.mass, system.stiffness))
        assert np.sort(there[:, 0]) == pytest.approx(np.sqrt(np.sort(squares.real)))
        mass = made[0].T @ system.mass @ made[0]
        assert mass == pytest.approx(np.eye(4), abs=1e-9)
    swapped, _ = loaded(omega[::-1], [np.sqrt(KG) * SHAPES[::-1][:, [1]]])
    assert swapped[::-1] == pytest.approx(loaded(omega, [np.sqrt(KG) * SHAPES[:, [1]]])[0])


def test_loads_come_out_of_poles_and_shapes_alone() -> None:
    omega = 2 * np.pi * HZ
    parts = [SHAPES[:, [k]] for k in range(N)]
    there, made = loaded(omega, [np.sqrt(KG) * part for part in parts])
    found = explained(there, np.full(there.shape, 1e-4), parts)
    assert found.omega == pytest.approx(omega, rel=2e-4)
    assert found.load == pytest.approx(np.full(4, KG), rel=0.02)
    product = np.einsum("ro,ri->roi", made[0].T @ SHAPES, made[0].T @ SHAPES[:, [1]])
    size = np.sqrt(KG) * SHAPES
    right = without(product, size / np.sqrt(KG), SHAPES[:, [1]], np.full(4, KG), made[0])
    assert right == pytest.approx(np.einsum("ro,ri->roi", SHAPES, SHAPES[:, [1]]), abs=1e-9)


def test_poles_of_no_mass_have_no_load() -> None:
    omega = 2 * np.pi * HZ
    rng = np.random.default_rng(0)
    there = omega[:, None] + rng.normal(scale=0.01, size=(4, N))
    found = explained(there, np.full(there.shape, 0.01), [SHAPES[:, [k]] for k in range(N)])
    assert (np.abs(found.load) < 4 * found.load_std + 1e-6).all()
    assert (np.abs(found.omega - omega) < 4 * found.omega_std).all()


def test_pairs_keep_order_and_leave_gaps() -> None:
    tables = [
        ModalTable(np.array(hz), np.full(len(hz), 0.01))
        for hz in ([10.0, 20.0, 21.0, 40.0], [9.9, 20.6, 39.5], [9.8, 19.7, 20.5, 39.0, 60.0])
    ]
    member = align(tables)
    rows = {tuple(row) for row in member.tolist()}
    assert (0, 0, 0) in rows and (3, 2, 3) in rows and (-1, -1, 4) in rows
    expected = np.array([[10.0, 9.9, 9.8], [20.0, 19.9, 19.7], [21.0, 20.6, 20.5], [40.0, 39.5, 39.0]])
    again = nearest(tables, expected, np.full(4, 0.01), member)
    assert again.tolist()[:4] == [[0, 0, 0], [1, -1, 1], [2, 1, 2], [3, 2, 3]]
    assert again.tolist()[4:] == [[-1, -1, 4]], "what is left over stays"


def test_factors_of_a_matrix_with_gaps() -> None:
    left, right = np.array([1.0, -2.0, 0.5, 3.0]), np.array([0.2, 1.0, -0.4])
    matrix = np.outer(left, right).astype(complex)
    matrix[0, 1:] = matrix[2, 0] = matrix[3, 2] = np.nan
    shape, participation = factors(matrix, np.ones((4, 3)))
    assert shape == pytest.approx(left, abs=1e-6)
    assert participation == pytest.approx(right, abs=1e-6)
    mask = np.isfinite(matrix)
    assert is_joined(mask)
    mask[0] = [True, False, False]
    mask[1:, 0] = False
    assert not is_joined(mask)


def test_choices_by_hand_and_of_channels_are_of_all_setups() -> None:
    sets, names = setups(KG), [s.source for s in setups(KG)]
    data = pooled(sets)
    dropped, _ = analyse_setups(data, sets, names, ModalSettings(drop_hz=(31.0,)))
    assert dropped.table.frequency_hz == pytest.approx(np.delete(HZ, 1), rel=1e-3)
    named, _ = analyse_setups(data, sets, names, ModalSettings(modes_hz=(20.0, 62.0)))
    assert named.table.frequency_hz == pytest.approx(HZ[[0, 3]], rel=1e-3)
    with pytest.raises(InputError, match="no mode of all setups near 40 Hz"):
        analyse_setups(data, sets, names, ModalSettings(keep_hz=(40.0,)))
    two = [measure([k], KG, [1, 3], 0.003, 3 + k, str(k)) for k in range(N)]
    one, _ = analyse_setups(pooled(two), two, names, ModalSettings(references=("4:+Z",), direction="Z"))
    assert [str(c) for c in one.references] == ["4:+Z"]
    assert len(one.table) == 4


def test_a_setup_of_noise_alone_and_lines_that_one_lacks_do_no_harm() -> None:
    sets = list(setups(KG))
    rng = np.random.default_rng(8)
    shape = sets[2].frf.shape
    sets[2] = replace(sets[2], frf=rng.normal(size=shape) + 1j * rng.normal(size=shape))
    sets[4] = replace(sets[4], frf=np.where(np.arange(len(LINES))[:, None, None] < 3, np.nan, sets[4].frf))
    found, said = analyse_setups(pooled(sets), sets, [s.source for s in sets], ModalSettings())
    assert said is not None
    assert found.table.frequency_hz == pytest.approx(HZ, rel=1e-3)
    assert len(found.layout.frequency_hz) == len(LINES) - 3


def test_what_no_mass_explains_is_a_common_model_unless_it_splits_modes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Frequencies that wander from setup to setup, whatever the sensor's place."""
    names = [str(k) for k in range(N)]
    wander = 0.015 * np.array([1.0, -0.5, 0.8, -1.0, 0.3, -0.5])
    sets = [measure([k], 0.0, [1], 0.003, k, names[k], wander[k]) for k in range(N)]
    found, said = analyse_setups(pooled(sets), sets, names, ModalSettings())
    assert said is not None and not said.agree and not said.together
    assert said.unexplained > 0.5
    assert found.table.frequency_hz == pytest.approx(HZ, rel=0.015)
    monkeypatch.setattr(run, "poles_agree", lambda modes, found: False)
    still = setups(0.0)
    found, said = analyse_setups(pooled(still), still, names, ModalSettings())
    assert said is not None and said.together and said.unexplained > 0.5
    assert len(found.table) == 4
