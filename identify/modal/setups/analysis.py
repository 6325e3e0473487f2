"""Modes of FRFs in several setups, each with poles of its own: what differs is noticed, explained and taken
out.

Every setup is analysed by itself (post-separate estimation); modes are paired over setups (`align`), their
residues between all channels form one matrix of rank one (`residues`), whose scale forces measured in all
setups give, and what roved sensors did to poles and residues is found and removed (`loading`).  With sensors
that weigh nothing this is PoSER merging (Reynders, Magalhaes, De Roeck and Cunha, IMAC 27 (2009)).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.core.arrays import Array, Complex, Index, Mask
from identify.measured.frf_set import FrfSet
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import ModalAnalysis
from identify.modal.mac import as_real
from identify.modal.setups import loading
from identify.modal.setups.align import align, nearest
from identify.modal.setups.residues import Grid, factors, residues

_SHOWN, _EXPLAINED = 3, 0.3
"""So many setups are enough for a mode whose poles are, on average, so near in half-bandwidths to where the
mass of a sensor puts them (through two poles there is always a line); others are shown by the part of all
setups that a pole needs of all orders."""
_TURNS = 10
"""Of shapes and loads, each of which needs the other."""


@dataclass(frozen=True)
class Merged:
    """Modes (m,) of all setups: poles without roved sensors, their standard deviations of frequency (Hz) and
    damping; shapes (m, outputs), participation (m, inputs), the largest 1: receptance residues as of
    `ModalModel`; member (m, setups): row of each setup's table, -1 where it does not show the mode; own (m,
    setups): its poles there, NaN; loading: None where no sensor was roved; kg, kg_std: of a roved sensor, NaN
    where no drive point tells modal masses; turned_down: frequency, Hz, and number of setups of what too few
    show.
    """

    grid: Grid
    poles: Complex
    frequency_std_hz: Array
    damping_std: Array
    shapes: Complex
    participation: Complex
    member: Index
    own: Complex
    loading: loading.Loading | None
    kg: float = np.nan
    kg_std: float = np.nan
    turned_down: tuple[tuple[float, int], ...] = ()

    def rows(self, kept: Mask) -> Merged:
        """Some of the modes."""
        names = ("poles", "frequency_std_hz", "damping_std", "shapes", "participation", "member", "own")
        some = {name: getattr(self, name)[kept] for name in names}
        loads = None if self.loading is None else _ordered(self.loading, np.flatnonzero(kept))
        return replace(self, **some, loading=loads)


def merged(
    sets: Sequence[FrfSet], found: Sequence[ModalAnalysis], least: float = 0.4, *, weighs: bool = True
) -> Merged:
    """One set of modes from those of several setups; least: part of them that must show a mode; weighs:
    whether moved sensors may.
    """
    grid, tables = Grid.of(sets), [_compared(a) for a in found]
    always = set.intersection(*({c.node for c in one.outputs} for one in sets))
    roved = roved_rows(grid, always) if weighs else []

    def of(member: Index) -> Merged:
        poles, std = poles_of([(a.model.poles, a.table) for a in found], member)
        middle = np.nanmedian(poles.real, axis=1) + 1j * np.nanmedian(poles.imag, axis=1)
        there = np.where(member >= 0, poles, middle[:, None])
        product = [_products(a, grid, k, member[:, k], there[:, k]) for k, a in enumerate(found)]
        return together(grid, member, (poles, std), np.array(product), roved)

    return real(of, tables, least)


def real(of: Callable[[Index], Merged], tables: Sequence[ModalTable], least: float) -> Merged:
    """The modes that are real of those that setups show; of: what comes of rows of tables (modes, setups)."""
    state = of(align(tables))
    if state.loading is None:
        shown = np.mean(state.member >= 0, axis=1) >= least
        return state if shown.all() else replace(of(state.member[shown]), turned_down=_gone(state, ~shown))
    again = nearest(tables, _expected(state), -state.poles.real / np.abs(state.poles), state.member)
    best = max(state, of(again), key=_explains)
    one = _joined(best)
    best = best if len(one) == len(best.member) else of(one)
    kept = _is_real(best, least)
    if kept.all():
        return best
    return replace(of(best.member[kept]), turned_down=_gone(best, ~kept))


def _gone(state: Merged, rows: Mask) -> tuple[tuple[float, int], ...]:
    """Frequency, Hz, and number of setups of some modes."""
    own = state.own[rows]
    return tuple((float(abs(np.nanmean(p))) / (2 * np.pi), int(np.sum(np.isfinite(p)))) for p in own)


def _joined(state: Merged) -> Index:
    """Rows of tables with modes as one that no setup shows both of and that are, without sensors, within
    their half-power bandwidth: parts of one.
    """
    rows: list[Index] = []
    last = complex(0.0, 0.0)
    for member, pole in zip(state.member, state.poles, strict=True):
        near = np.abs(pole - last) < -(pole.real + last.real)
        if rows and near and not np.any((member >= 0) & (rows[-1] >= 0)):
            rows[-1] = np.maximum(rows[-1], member)
        else:
            rows.append(member)
            last = pole
    return np.array(rows)


def _is_real(state: Merged, least: float) -> Mask:
    """Modes that enough setups show, or several where the mass of a sensor puts them."""
    count = np.sum(state.member >= 0, axis=1)
    far = np.nanmean(np.minimum(_far(state), 1.0), axis=1)
    enough = count >= least * state.member.shape[1]
    return np.asarray(enough | ((count >= _SHOWN) & (far < _EXPLAINED)) if least < 1 else enough)


def _far(state: Merged) -> Array:
    """How far poles of setups are from where they are expected, half-bandwidths, (m, setups)."""
    return np.asarray(np.abs(np.abs(state.own) - 2 * np.pi * _expected(state)) / -state.own.real)


def _explains(state: Merged) -> float:
    """How many poles of setups are where they are expected, those that are near counting in part."""
    return float(np.nansum(1 - np.minimum(_far(state), 1.0)))


def _compared(found: ModalAnalysis) -> ModalTable:
    """The modes of a setup with what compares them: participations of forces, shapes where forces rove."""
    model, layout = found.model, found.layout
    values, channels = (
        (model.shapes, layout.responses) if layout.transposed else (model.participation, layout.references)
    )
    return ModalTable(found.table.frequency_hz, found.table.damping_ratio, channels, values)


def _expected(state: Merged) -> Array:
    """Frequency of every mode in every setup, Hz, (m, setups)."""
    if state.loading is None:
        return np.repeat(np.abs(state.poles)[:, None], state.member.shape[1], axis=1) / (2 * np.pi)
    return state.loading.predicted / (2 * np.pi)


def together(
    grid: Grid,
    member: Index,
    own: tuple[Complex, Array],
    product: Complex,
    roved: Sequence[Index],
    *,
    forced: bool = True,
) -> Merged:
    """Modes from the poles (m, setups) of setups with their standard deviations (m, setups, 2), and their
    products of shape and participation, (setups, m, outputs, inputs).  forced: whether inputs are forces;
    where they are not, shapes are of any size in each setup and keep what sensors did to them.
    """
    poles, std = own
    if any(map(len, roved)):
        best = (_explained if forced else _turn)(product, poles, std[..., 0], grid, roved)
        shapes, participation, loads, kg = best.shapes, best.participation, best.loads, best.kg
    else:
        (shapes, participation), loads, kg = factors_of(product), None, (np.nan, np.nan)
    omega, zeta, omega_std, zeta_std = unloaded(poles, std, loads)
    order = np.argsort(omega)
    scale = participation[np.arange(len(omega)), np.argmax(np.abs(participation), axis=1)][:, None]
    damped = omega * np.sqrt(1 - zeta**2)
    return Merged(
        grid=grid,
        poles=(-zeta * omega + 1j * damped)[order],
        frequency_std_hz=omega_std[order] / (2 * np.pi),
        damping_std=zeta_std[order],
        shapes=(shapes * scale / (2j * damped[:, None]))[order],
        participation=(participation / scale)[order],
        member=member[order],
        own=poles[order],
        loading=None if loads is None else _ordered(loads, order),
        kg=kg[0],
        kg_std=kg[1],
    )


@dataclass(frozen=True)
class _Turn:
    """Shapes and participation without sensors, and what these do to poles; misfit: how far poles are from
    there, in half-bandwidths, on average.
    """

    shapes: Complex
    participation: Complex
    loads: loading.Loading
    kg: tuple[float, float]
    misfit: float


def _explained(product: Complex, own: Complex, std: Array, grid: Grid, roved: Sequence[Index]) -> _Turn:
    """What explains the poles best, by turns: loads take shapes without sensors, and these take loads.  Where
    modes are so near to each other that a mass mixes them, turns need not settle, so the best one is kept.
    """
    turns = [_turn(product, own, std, grid, roved, mixed=False)]
    corrected = product
    for _ in range(_TURNS):
        turns.append(_turn(corrected, own, std, grid, roved))
        corrected = (corrected + _without(product, turns[-1], roved)) / 2
    return min(turns, key=lambda turn: turn.misfit)


def _turn(
    corrected: Complex, own: Complex, std: Array, grid: Grid, roved: Sequence[Index], *, mixed: bool = True
) -> _Turn:
    """Shapes of products from which masses are taken out, and the loads that they give."""
    shapes, participation = factors_of(corrected)
    moved = [shapes[:, rows].real for rows in roved]
    loads, kg = _loads(np.abs(own), std, moved, _square(grid, shapes, participation), mixed)
    far = np.abs(np.abs(own) - loads.predicted) / -own.real
    return _Turn(shapes, participation, loads, kg, float(np.nanmean(np.minimum(far, 1.0))))


def _without(product: Complex, turn: _Turn, roved: Sequence[Index]) -> Complex:
    """Products (setups, m, outputs, inputs) less what masses did to them."""
    loads, shapes = turn.loads, turn.shapes
    made = loading.loaded(
        loads.omega, [np.sqrt(loads.load)[:, None] * shapes[:, rows].real for rows in roved]
    )[1]
    return np.array(
        [
            loading.without(p, shapes, turn.participation, loads.load, m)
            for p, m in zip(product, made, strict=True)
        ]
    )


def _ordered(loads: loading.Loading, order: Index) -> loading.Loading:
    names = ("omega", "omega_std", "load", "load_std", "predicted")
    return replace(loads, **{name: getattr(loads, name)[order] for name in names})


def poles_of(found: Sequence[tuple[Complex, ModalTable]], member: Index) -> tuple[Complex, Array]:
    """Poles of every mode in every setup, (m, setups), and standard deviations of their size, rad/s, and
    damping ratio, (m, setups, 2); NaN where a setup does not show it.
    """
    own = np.full(member.shape, complex(np.nan, np.nan))
    std = np.full((*member.shape, 2), np.nan)
    for k, (poles, table) in enumerate(found):
        shown = member[:, k] >= 0
        assert table.frequency_std_hz is not None and table.damping_std is not None
        both = np.stack([2 * np.pi * table.frequency_std_hz, table.damping_std], axis=1)
        least = np.stack([np.abs(poles), np.ones(len(poles))], axis=1) * 1e-9
        own[shown, k] = poles[member[shown, k]]
        std[shown, k] = np.maximum(both, least)[member[shown, k]]
    return own, std


def _products(found: ModalAnalysis, grid: Grid, k: int, rows: Index, poles: Complex) -> Complex:
    """Products of shape and participation of unit modal mass, about, of every mode in setup k, (m, outputs,
    inputs) of all, NaN where it has no FRF.
    """
    shown = rows >= 0
    own, more = residues(found, poles[~shown])
    both = np.zeros((len(rows), *own.shape[1:]), dtype=complex)
    both[shown], both[~shown] = own[rows[shown]], more
    return grid.spread(k, both * (2j * poles.imag)[:, None, None])


def roved_rows(grid: Grid, always: set[int]) -> list[Index]:
    """Of every setup the rows of sensors that are not at nodes of all setups."""
    return [
        np.array([r for r in rows if grid.outputs[r].node not in always], dtype=int) for rows in grid.rows
    ]


def factors_of(products: Complex) -> tuple[Complex, Complex]:
    """Shapes (m, outputs), as real as they can be, and participation (m, inputs) of products (setups, m,
    outputs, inputs); products of several setups are averaged.
    """
    count = np.sum(np.isfinite(products), axis=0)
    mean = np.nansum(products, axis=0) / np.maximum(count, 1)
    pairs = [factors(one, weight) for one, weight in zip(mean, count, strict=True)]
    shapes = np.array([left for left, _ in pairs])
    turned = as_real(shapes)
    turn = np.sum(turned * shapes.conj(), axis=1) / np.maximum(np.sum(np.abs(shapes) ** 2, axis=1), 1e-300)
    return turned, np.array([right for _, right in pairs]) / turn[:, None]


def _square(grid: Grid, shapes: Complex, participation: Complex) -> tuple[Array, Array]:
    """What a squared shape is worth in one of unit modal mass, 1/kg (m,), NaN without a drive point, and how
    much of its largest motion a mode has at drive points, (m,).
    """
    at = {c.place: (n, c.sign) for n, c in enumerate(grid.inputs)}
    drive = [(r, *at[c.place], c.sign) for r, c in enumerate(grid.outputs) if c.place in at]
    if not drive:
        return np.full(len(shapes), np.nan), np.zeros(len(shapes))
    rows, columns, one, other = (list(values) for values in zip(*drive, strict=True))
    shape, force = shapes[:, rows], participation[:, columns] * np.multiply(one, other)
    size = np.sum(np.abs(shape) ** 2, axis=1)
    largest = np.max(np.abs(shapes), axis=1)
    square = np.sum(shape.conj() * force, axis=1).real / np.maximum(size, 1e-300)
    return square, np.sqrt(size) / np.maximum(largest, 1e-300)


def _loads(
    omega: Array, std: Array, moved: Sequence[Array], square: tuple[Array, Array], mixed: bool
) -> tuple[loading.Loading, tuple[float, float]]:
    """What explains the poles, and the sensor's mass, kg, with its standard deviation: where drive points
    tell modal masses, one mass for all modes is estimated by those that determine it well, and then helps the
    others.
    """
    alone = loading.explained(omega, std, moved, None, mixed)
    value, seen = square
    known = (value > 0) & (alone.load_std > 0) & (alone.load > 0)
    if not known.any():
        return alone, (np.nan, np.nan)
    each, sure = alone.load[known] / value[known], seen[known] * alone.load[known] / alone.load_std[known]
    weight = 1 / (1 / np.minimum(seen[known], 1.0) ** 2 + 1 / np.maximum(sure, 1e-9) ** 2)
    kg = _median(each, weight)
    scatter = loading.MEDIAN * _median(np.abs(each / kg - 1) * seen[known], weight)
    kg_std = kg * scatter / np.sqrt(max(np.sum(weight) ** 2 / np.sum(weight**2), 1.0))
    width = kg * value * np.hypot(scatter / np.maximum(seen, 1e-9), kg_std / kg)
    prior = np.where(value > 0, kg * value, np.nan), np.maximum(width, 1e-3 * kg * np.abs(value))
    return loading.explained(omega, std, moved, prior, mixed), (kg, kg_std)


def _median(values: Array, weight: Array) -> float:
    """Weighted median."""
    order = np.argsort(values)
    summed = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(summed, summed[-1] / 2)])


def unloaded(own: Complex, std: Array, loads: loading.Loading | None) -> tuple[Array, Array, Array, Array]:
    """Size, rad/s, and damping ratio of every mode's pole without sensors, (m,) each, and their standard
    deviations: means over setups where no mass explains what differs.
    """
    size, ratio = np.abs(own), -own.real / np.abs(own)
    if loads is None:
        omega, omega_std = _mean(size, std[..., 0])
    else:
        omega, omega_std = loads.omega, loads.omega_std
    # A mass lowers c / m and omega^2 by the same part.
    zeta, zeta_std = _mean(ratio * omega[:, None] / size, std[..., 1])
    return omega, zeta, omega_std, zeta_std


def _mean(values: Array, std: Array) -> tuple[Array, Array]:
    """Weighted means over the last axis, and their standard deviations.  What values differ by beyond their
    own (DerSimonian and Laird, Controlled Clinical Trials 7 (1986)) counts in full: setups may be off alike.
    """
    weight = np.where(np.isfinite(values), 1 / std**2, 0.0)
    total = np.sum(weight, axis=-1)
    mean = np.nansum(weight * values, axis=-1) / total
    left = np.nansum(weight * (values - mean[..., None]) ** 2, axis=-1)
    freedom = np.sum(weight > 0, axis=-1) - 1
    spare = total - np.sum(weight**2, axis=-1) / total
    beyond = np.maximum(left - freedom, 0.0) / np.where(freedom > 0, spare, np.inf)
    return mean, np.sqrt(1 / total + beyond)
