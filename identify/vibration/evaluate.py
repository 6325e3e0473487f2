"""A finished fit looked at from all sides: errors, modes, intervals, a verdict in three sentences; everything
a result keeps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identify.core.arrays import Array, real_product
from identify.core.coded import code_of
from identify.core.parameters import Scale
from identify.core.thresholds import MISSING, QUIET, SIGMAS_95
from identify.fitting.fit import Fit
from identify.fitting.tables import parameter_table, start_table
from identify.fitting.uncertainty import Uncertainty, at_bounds, inseparable
from identify.measured.channel import Channel
from identify.measured.frf_set import UNIT
from identify.measured.geometry import displacements
from identify.measured.modal_tables import ModalTable
from identify.measured.quality_robot import robot_notes
from identify.modal.frf_errors import frf_errors
from identify.modal.pairing import pair
from identify.model.geometry import drawn_geometry, drawn_modes, sensor_geometry, shapes_at, standing
from identify.model.modes import complex_modes
from identify.model.system import System
from identify.results import fit as results
from identify.results import tables
from identify.robot.visual import Looks, looks
from identify.vibration.costs.make_target import Targets
from identify.vibration.costs.target import FrfTarget
from identify.vibration.elsewhere import gap_elsewhere
from identify.vibration.far_places import far_notes
from identify.vibration.file_geometry import geometry_notes
from identify.vibration.intervals import intervals, with_left_open
from identify.vibration.measured_modes import MeasuredModes, measured_modes
from identify.vibration.notes import fault_notes, record_notes, soft_directions
from identify.vibration.nuisances.stated import stated_uncertainty
from identify.vibration.problem import Measurement, Problem
from identify.vibration.profile import profile
from identify.vibration.provenance import description_of, provenance_of
from identify.vibration.uncertainty import UNRELIABLE, covariance_root, gap

_NAMED = 3
"""Open directions that a sentence names; more are for a table."""


def evaluate(
    problem: Problem,
    fit: Fit,
    key: str,
    profiled: Sequence[str] = (),
    measured: Mapping[str, MeasuredModes | None] | None = None,
    elsewhere: float | None = None,
    unnamed: Mapping[str, float] | None = None,
) -> results.FitResult:
    """The result of a fit, ready to be written; key says which run it is the result of
    (`identify.vibration.run`).

    profiled: names of parameters whose profile likelihood is wanted; measured: the `measured_modes` of the
    data, elsewhere: the gap on data that were not fitted, where they are known already; unnamed: as
    `with_left_open` has it.
    """
    measured = measured_modes(problem) if measured is None else measured
    targets, parameters = problem.targets(), problem.of_effects
    trusted = with_left_open(problem, intervals(problem, fit.values), fit.values, unnamed)
    scale = Scale(parameters)
    stated = stated_uncertainty(problem, trusted, fit.values)
    names = [parameters[number].name for number in scale.free]
    groups = tuple(", ".join(group) for group in inseparable(trusted, names))
    elsewhere = gap_elsewhere(problem, trusted, fit.values) if elsewhere is None else elsewhere
    gaps = gap(targets, fit.values), elsewhere
    study, seen = problem.file.study, looks(problem.robot)
    return results.FitResult(
        key=key,
        name=study.name,
        seed=study.seed,
        verdict=(
            *_verdict(fit, trusted, gaps, groups, trusted.count),
            *filter(None, (at_bounds(trusted, scale), _what_next(problem, gaps[0]))),
            *soft_directions(problem, trusted, fit.values),
            *(() if stated is None else stated.sentences),
        ),
        notes=_notes(problem, fit, targets, trusted),
        effects=tuple(effect.sentence() for effect in study.effects),
        cost_kind=study.cost.kind,
        cost=fit.cost,
        gap=gaps[0],
        gap_validation=gaps[1],
        converged=fit.best.converged,
        seconds=fit.seconds,
        parameters=parameter_table(parameters, fit.values[: problem.size], trusted, scale),
        correlation=trusted.correlation,
        singular_values=trusted.singular_values,
        directions=trusted.directions,
        inseparable=groups,
        starts=start_table(fit, problem.size),
        history=fit.history,
        measurements={
            m.name: _measurement(problem, m, fit, trusted, measured[m.name], seen)
            for m in problem.measurements
        },
        published=_published(problem),
        profiles={name: profile(problem, fit.values, trusted, name) for name in profiled},
        provenance=provenance_of(problem.file),
        description=description_of(problem.file, problem.points),
        uncertainty=stated,
    )


def _notes(problem: Problem, fit: Fit, targets: Targets, trusted: Uncertainty) -> tuple[str, ...]:
    return (
        *_file_notes(problem),
        *robot_notes(problem.robot),
        *far_notes(problem),
        *geometry_notes(problem),
        *trusted.notes,
        *_unstated_note(problem, trusted),
        *fault_notes(targets.frf, fit.values),
        *record_notes(targets, fit.values),
        *_start_notes(fit),
    )


def _verdict(
    fit: Fit, trusted: Uncertainty, gaps: tuple[float, float], groups: Sequence[str], count: int
) -> tuple[str, ...]:
    starts = f"{fit.agreeing} of {len(fit.starts)} starts" if len(fit.starts) > 1 else "one start"
    found = f"The fit ended at a cost of {fit.cost:.4g} after {fit.seconds:.1f} s; {starts} reached it."
    parameters = len(trusted.status)
    if count <= parameters:
        quality = (
            f"There are {count} measured numbers for {parameters} free parameters, so agreement alone proves"
            " nothing."
        )
    elif np.isnan(gaps[0]):
        quality = (
            "The noise of the data is not known, so how good the fit is can only be judged by its errors."
        )
    else:
        on = "" if np.isnan(gaps[1]) else f" and {gaps[1]:.2f} times on data that were not fitted"
        word = (
            "agrees with the data to within their noise"
            if gaps[0] <= QUIET
            else "does not yet explain the data"
        )
        quality = f"The model {word}: the residual is {gaps[0]:.2f} times the noise{on}."
    status = np.array(trusted.status)
    determined = int(np.sum(status == "determined"))
    said = f"{determined} of {parameters} free parameters are determined by the data.{_open(groups)}"
    return found, quality, said


def _open(groups: Sequence[str]) -> str:
    """What the data do not determine: a few directions by their parameters, of many only how many."""
    if not groups:
        return ""
    if len(groups) <= _NAMED:
        return f" Not determined, alone or in combination: {'; '.join(groups)}."
    members = {name for group in groups for name in group.split(", ")}
    return (
        f" {len(groups)} combinations of {len(members)} parameters are not determined: the report has a table"
        " of directions, the least determined last."
    )


def _unstated_note(problem: Problem, trusted: Uncertainty) -> list[str]:
    """A word on what was stated, where the residual is far above noise and nothing was said to be
    uncertain.
    """
    if problem.nuisances.entries or UNRELIABLE not in map(code_of, trusted.notes):
        return []
    return [
        "masses, places of sensors, gains and directions of impacts were taken as exact: `uncertainty:"
        " typical` in the study fits their errors, too"
    ]


def _what_next(problem: Problem, gap: float) -> str:
    """A sentence that says what to do about a large gap; empty where there is none, or discovery is of no
    use.
    """
    if gap > MISSING and all(isinstance(m.target, FrfTarget) for m in problem.measurements):
        return (
            f"Something is missing from the model: `identify discover {problem.file.path.name}` looks for it."
        )
    return ""


def _file_notes(problem: Problem) -> list[str]:
    """What of the measured files was not read, in sentences."""
    return [
        f"{m.name}: in the file, {note}"
        for m in problem.measurements
        if isinstance(m.target, FrfTarget)
        for note in m.target.data.notes
    ]


def _start_notes(fit: Fit) -> list[str]:
    notes = []
    if len(fit.starts) > 1 and fit.agreeing == 1:
        notes.append(
            "only one start found the best minimum, so a better one may exist: use more `starts` or a larger"
            " budget to find out"
        )
    return notes + fit.end_note


def _measurement(
    problem: Problem,
    m: Measurement,
    fit: Fit,
    trusted: Uncertainty,
    measured: MeasuredModes | None,
    seen: Looks,
) -> results.MeasurementResult:
    system, own = m.at(fit.values)
    geometry, modes, table = _modes(problem, system, own, seen)
    one = Targets(frf=(m.target,)) if isinstance(m.target, FrfTarget) else Targets(modal=(m.target,))
    return results.MeasurementResult(
        name=m.name,
        use=m.settings.use,
        file=str(m.settings.source),
        sha256=m.target.data.sha256,
        posture_deg=m.given.posture_deg,
        gap=gap(one, fit.values),
        geometry=geometry,
        modes=modes,
        frf=_frf(problem, m.target, fit, trusted) if isinstance(m.target, FrfTarget) else None,
        pairs=None if measured is None else _pairs(problem, m, measured, table),
    )


def _modes(
    problem: Problem, system: System, values: Array, seen: Looks
) -> tuple[tables.Geometry, tables.Modes, ModalTable]:
    """Geometry and modes with shapes in the base's axes, and the same modes as a table over the points' own
    channels.
    """
    site = system.site
    points = standing(problem.points, site)
    modes = complex_modes(*system.matrices(values))
    geometry = drawn_geometry(site.engine, points, seen)
    kept = drawn_modes(system, points, modes, geometry.bodies)
    channels = tuple(Channel(point.node, axis) for point in points for axis in (1, 2, 3))
    local = [np.asarray(point.axes @ system.jacobian(point.link, point.position)[:3]) for point in points]
    table = ModalTable(
        modes.frequency_hz,
        modes.damping_ratio,
        channels,
        shapes_at(modes.shapes, local).reshape(len(modes.frequency_hz), len(channels)),
    )
    return geometry, kept, table


def _pairs(problem: Problem, m: Measurement, measured: MeasuredModes, model: ModalTable) -> results.ModePairs:
    """Measured modes beside the model's."""
    table, pairing = measured.table, pair(measured.table, model)
    return results.ModePairs(
        measured_frequency_hz=table.frequency_hz,
        measured_damping_ratio=table.damping_ratio,
        measured=pairing.a,
        model=pairing.b,
        mac=pairing.mac,
        mac_matrix=pairing.mac_matrix,
        measured_shapes=_measured_shapes(problem, m, table),
        origin=measured.origin,
    )


def _measured_shapes(problem: Problem, m: Measurement, table: ModalTable) -> NDArray[np.complex128] | None:
    """(modes, points, 3) in base axes from shapes at channels; directions that were not measured count as
    still.
    """
    if table.shapes is None or not len(table):
        return None
    return displacements(
        sensor_geometry(m.system.site.engine, standing(problem.points, m.system.site)), table
    )


def _frf(problem: Problem, target: FrfTarget, fit: Fit, trusted: Uncertainty) -> results.FrfComparison:
    outputs, inputs = target.pairs
    numbers, root = covariance_root(problem, trusted, fit.values)
    fitted, gradient = target.gradient_pairs(fit.values, numbers)
    measured, difference = target.measured, fitted - target.measured
    spread = np.linalg.norm(real_product(root.T, np.swapaxes(gradient, 1, 2)), axis=1)
    known = target.noise is not None
    return results.FrfComparison(
        quantity=target.data.quantity,
        unit=UNIT[target.data.quantity],
        window_decay_per_s=target.data.window_decay_per_s,
        frequency_hz=target.data.frequency_hz,
        output=tuple(str(target.data.outputs[i]) for i in outputs),
        input=tuple(str(target.data.inputs[i]) for i in inputs),
        measured=measured,
        initial=target.predict_pairs(problem.initial),
        fitted=fitted,
        band_95=SIGMAS_95 * spread,
        noise=target.sigma if known else None,
        coherence=None if target.data.coherence is None else target.data.coherence[:, outputs, inputs],
        gap=np.sqrt(np.mean(np.abs(difference / target.sigma) ** 2, axis=0) / 2) if known else None,
        **frf_errors(measured, fitted),
    )


def _published(problem: Problem) -> results.PublishedValues | None:
    reference = problem.reference
    if reference is None:
        return None
    value = np.array([reference.parameters.get(p.name, np.nan) for p in problem.of_effects])
    modes = reference.modes or ModalTable(np.zeros(0), np.zeros(0))
    return results.PublishedValues(reference.source, value, modes.frequency_hz, modes.damping_ratio)
