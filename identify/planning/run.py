"""What `identify plan` does, without the terminal: a fit in, the next test with what it promises and the
study of it, to be filled in, out.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.special
from ruamel.yaml.comments import CommentedMap

from identify.batch.posture_table import read_postures
from identify.core import atomic
from identify.core.arrays import Array
from identify.core.config_paths import relocate
from identify.core.errors import InputError
from identify.core.threads import one_thread
from identify.core.thresholds import SIGMAS_95
from identify.core.yaml_input import YAML_SUFFIXES, in_one_line, round_trip, yaml_text
from identify.fitting.resume import held
from identify.machining.tool import read_tool
from identify.model.geometry import drawn_geometry, drawn_modes, standing
from identify.model.modes import complex_modes
from identify.planning.after_test import AfterTest
from identify.planning.candidates import Candidates, candidates, tabled
from identify.planning.design import Chosen, Criterion, best_design, random_choice
from identify.planning.information import Measurable, measurable
from identify.planning.known import Known, known_of
from identify.planning.promise import Target, best_single, gain_of, looked_at, promised, targets_of, worth_of
from identify.planning.refine import Refinement
from identify.planning.rival import Rival, rival_of
from identify.results import file as result_file
from identify.results.plan import PlannedPlace, PlanResult, PromisedTable
from identify.results.provenance import provenance, sha256
from identify.robot.visual import looks
from identify.vibration.notes import of_gap
from identify.vibration.study import Study


def verdict(
    promised: PromisedTable, ratio: float, what: str, sizes: tuple[int, ...], first: bool
) -> tuple[str, ...]:
    """What is determined, and how well; first: whether nothing was measured before."""
    said = [
        f"{sizes[0]} postures, {sizes[1]} impacts and {sizes[2]} sensors determine {what}: at the median,"
        f" their intervals are {ratio:.3g} times narrower than those of tests of the same size at random."
    ]
    worst = int(np.argmax(promised.promised))
    said.append(
        f"The 95 % intervals that it promises are ± {100 * promised.promised.min():.2g} to"
        f" {100 * promised.promised[worst]:.2g} %, the widest that of {promised.name[worst]}."
    )
    if not first:
        gain = promised.now / promised.promised
        best = int(np.argmax(gain))
        said.append(
            f"Together with the data of the fit, this narrows the intervals by a factor of"
            f" {np.median(gain):.3g} at the median, most that of {promised.name[best]}: {gain[best]:.3g}."
        )
    return tuple(said)


def verdict_apart(
    promised: PromisedTable, ratio: float, rival: str, sizes: tuple[int, ...]
) -> tuple[str, ...]:
    """How well the test tells the model from a rival; the difference is the last row of the table."""
    apart, random = (SIGMAS_95 / half[-1] for half in (promised.promised, promised.random))
    chance = 100 * scipy.special.ndtr(apart / 2)
    enough = "enough to decide" if apart > 2 * SIGMAS_95 else "too little to decide"
    return (
        f"{sizes[0]} postures, {sizes[1]} impacts and {sizes[2]} sensors tell the model from {rival}:"
        f" with all parameters of both fitted anew, they differ by {apart:.3g} standard deviations, {enough};"
        f" tests of the same size at random differ by {random:.3g} (the median), {ratio:.3g} times less.",
        f"Whichever is right, the expected log odds for it are {apart**2 / 2:.3g}, and the test prefers it in"
        f" {_percent(chance)} % of all cases.",
    )


def _percent(chance: float) -> str:
    return "more than 99.9" if chance > 99.9 else f"{chance:.3g}"


def next_best(impact: str, angles_deg: str, gain: float | None) -> str:
    """The one impact that says most."""
    where = f"an impact at {impact} with joint angles ({angles_deg})°"
    if gain is None:
        return f"If it is to be one impact alone: {where}, with these sensors."
    return (
        f"If it is to be one impact alone: {where}, with these sensors, narrows the intervals by a factor of"
        f" {gain:.3g} at the median."
    )


def notes(known: Known) -> tuple[str, ...]:
    """What a reader must be warned of."""
    noise, (low, high, _) = known.noise, known.band
    grown = noise.larger(np.array([low, high]))
    more = f", at {high:.3g} Hz {grown[1] / grown[0]:.2g} times that at {low:.3g} Hz" if noise.growth else ""
    said = [
        f"the promise holds for a noise of {noise.floor:.3g} m/s²/N in the real and in the imaginary part of"
        f" each accelerance and of {100 * noise.relative:.2g} % in the force{more}, and for parameters near"
        " those given"
    ]
    if known.settings is not None:
        said.append(
            "promised intervals include the stated uncertainty; postures, impacts and sensors were chosen"
            " without it"
        )
    if known.config_folder is None:
        said.append(
            "the paths in the study of the test are those of the fit's study: put it into the same folder"
        )
    return *said, *of_gap(known.gap, "for which this test is not planned")


_RANDOM, _RANDOM_TOLD = 40, 10
"""Tests at random that a plan is compared with; fewer where nuisance parameters take their time."""


@dataclass(frozen=True)
class PlanOptions:
    """Size of the test, how many postures it is chosen from (or a table of them), what it is for: parameters
    by name (default: all), modes (`mode2.frequency`) or `depth`, the limit of a cutter (file of a tool), both
    at a posture at_deg (default: the first), and whether the data of the fit count (anew: they do not);
    noise: floor of an accelerance, m/s^2/N, resolution, Hz, and force_noise, relative, by default those of
    the fit's FRFs.  rival: a fit with other effects, from which the test is to tell the model, in place of
    targets.
    """

    postures: int = 3
    impacts: int = 3
    sensors: int = 6
    among: int = 40
    table: Path | None = None
    target: tuple[str, ...] = ()
    anew: bool = False
    noise: float | None = None
    resolution: float | None = None
    seed: int = 1
    cutter: Path | None = None
    at_deg: tuple[float, ...] = ()
    rival: Path | None = None
    force_noise: float | None = None


def run_plan(model: Path, options: PlanOptions, out: Path | None = None) -> tuple[PlanResult, list[Path]]:
    """Choose the next test of a study that was not measured yet, or of a fit or discovery; writes
    `<model>_plan.h5` (of a study, in reports/) and the study of that test, `.yaml`, beside it.

    Raises InputError for a file that is neither, a test larger than what there is to choose from, an unknown
    target, noise that is not known, and a result that cannot be written.
    """
    begun = time.perf_counter()
    known = known_of(model, options.noise, options.resolution, options.force_noise)
    of_study = model.suffix in YAML_SUFFIXES
    path = out or (Path("reports") if of_study else model.parent) / f"{model.stem}_plan.h5"
    study = path.with_suffix(".yaml")
    inputs = [one for one in (options.table, options.cutter, options.rival) if one is not None]
    result_file.check_new(path, "a plan", [model, *inputs], [study])
    with held(path), one_thread():
        result = _planned(model, known, options, path.parent)
        result = replace(result, seconds=time.perf_counter() - begun)
        result_file.write(result, path)
        atomic.write_text(study, result.study)
    return result, [path, study]


def _planned(path: Path, known: Known, options: PlanOptions, folder: Path) -> PlanResult:
    """The plan for a model of a file; folder: where its study is to be."""
    targets, rival = _targets(known, options), _rival(known, options)
    among = _among(known, options)
    sizes = (options.postures, options.impacts, options.sensors)
    _check_sizes(sizes, among)
    models = [known.free_model, *([rival.model] if rival else [])]
    found = measurable(models, among, known.noise, known.band)
    before, weak = (known.before(anew) for anew in (options.anew, True))
    wanted = _rows(known, targets)
    if rival is not None:
        apart = found.information[..., -1, -1].max()
        before, weak = (rival.before(known, anew, apart) for anew in (options.anew, True))
        wanted = np.eye(len(before))[-1:]
    rng = np.random.default_rng(options.seed)
    criterion = Criterion(before, wanted)
    design = best_design(found.information, sizes, criterion, rng)
    refinement = Refinement(models, among, known.noise, known.band, criterion, weak)
    chosen = refinement.refined(design.chosen)
    looked = looked_at(known, targets, rival.name if rival else "", len(before))
    count = _RANDOM if known.settings is None else _RANDOM_TOLD
    random = [random_choice(found.information, sizes, rng) for _ in range(count)]
    precision = AfterTest(known, models, among, before, weak, options.anew).precision
    table, ratio = promised(looked, before, precision, chosen, random)
    what = f"{', '.join(options.target)} (I-optimal)" if options.target else "all parameters (D-optimal)"
    first = options.anew or not known.information.any()
    said = verdict(table, ratio, what, sizes, first)
    if rival is not None:
        what = f"difference to {rival.name} (T-optimal)"
        said = verdict_apart(table, ratio, rival.name, sizes)
    if not first:
        posture, impact = best_single(refinement.after_each(chosen[2]), looked)
        alone = precision((np.array([posture]), np.array([impact]), chosen[2]))
        gain = gain_of(looked, before, alone) if rival is None else None
        angles = ", ".join(f"{angle:.1f}" for angle in np.rad2deg(among.postures[posture]) + 0.0)
        said = *said, next_best(among.impact_name(impact), angles, gain)
    result = _result(path, known, what, among, found, chosen, (table, ratio), folder)
    return replace(result, verdict=said, worth=worth_of(looked, precision, chosen))


def _rival(known: Known, options: PlanOptions) -> Rival | None:
    if options.rival is not None and options.target:
        raise InputError("--rival", "with a target", "one of the two")
    return None if options.rival is None else rival_of(known, options.rival)


def _targets(known: Known, options: PlanOptions) -> list[Target]:
    """What the test is for; empty: all parameters; InputError for an unknown one."""
    joints = len(known.model.robot.joints)
    if options.at_deg and len(options.at_deg) != joints:
        raise InputError("--at", f"{len(options.at_deg)} angles", f"{joints}, in degrees")
    posture = np.radians(options.at_deg) if options.at_deg else known.model.posture
    tool = None if options.cutter is None else read_tool(options.cutter).study
    return targets_of(known, options.target, tool, posture)


def _rows(known: Known, targets: list[Target]) -> Array | None:
    """(t, p): derivatives by the search scale, relative to the value where it is no parameter."""
    own = np.eye(len(known.names))
    rows = [own[known.names.index(t.name)] if t.name in known.names else t.relative for t in targets]
    return np.array(rows) if rows else None


def _among(known: Known, options: PlanOptions) -> Candidates:
    if options.table is None:
        return candidates(known.model, max(options.among, options.postures), options.seed)
    return tabled(known.model, read_postures(options.table, len(known.model.robot.joints))[1])


def _check_sizes(sizes: tuple[int, int, int], among: Candidates) -> None:
    there = (len(among.postures), len(among.impacts), len(among.sensors))
    for what, size, count in zip(("postures", "impacts", "sensors"), sizes, there, strict=True):
        if not 1 <= size <= count:
            raise InputError(f"--{what}", str(size), f"from 1 to {count}, of which to choose")


def _result(
    path: Path,
    known: Known,
    what: str,
    among: Candidates,
    found: Measurable,
    chosen: Chosen,
    judged: tuple[PromisedTable, float],
    folder: Path,
) -> PlanResult:
    postures, impacts, sensors = chosen
    promised, ratio = judged
    points = [known.model.points[among.sensors[k]] for k in sensors]
    posture_deg = np.asarray(np.round(np.rad2deg(among.postures[postures]), 1), dtype=float)
    places = [_place(known, number, angles) for number, angles in enumerate(posture_deg, 1)]
    return PlanResult(
        name=known.name,
        verdict=(),
        notes=notes(known),
        seconds=0.0,
        provenance=provenance("", what, [(path.name, sha256(path))]),
        criterion=what,
        joints=tuple(joint.name for joint in known.model.robot.joints),
        posture_deg=posture_deg,
        impacts=tuple(among.impact_name(k) for k in impacts),
        sensors=np.array([point.node for point in points]),
        sensor_names=tuple(point.name for point in points),
        sensor_links=tuple(point.link for point in points),
        sensor_m=np.array([point.position for point in points]),
        sensor_axes=np.array([point.axes for point in points]),
        level=found.level[np.ix_(*chosen)],
        noise_floor=known.noise.floor,
        band_hz=known.band[:2],
        resolution_hz=float(known.band[2]),
        candidates=np.array([len(among.postures), len(among.impacts), len(among.sensors)]),
        random_ratio=ratio,
        promised=promised,
        study=study_text(known, posture_deg, folder),
        places={one.name: one for one in places},
    )


def _place(known: Known, number: int, posture_deg: Array) -> PlannedPlace:
    """The robot at a posture of the test."""
    system = known.model.system(np.deg2rad(posture_deg))
    points = standing(known.model.points, system.site)
    modes = complex_modes(*system.matrices(known.model.values))
    geometry = drawn_geometry(system.site.engine, points, looks(known.model.robot))
    return PlannedPlace(planned_name(number), geometry, drawn_modes(system, points, modes, geometry.bodies))


def planned_name(number: int) -> str:
    """Of the measurement with a number, from 1."""
    return f"planned{number}"


def study_text(known: Known, posture_deg: Array, folder: Path) -> str:
    """The study with the measurements of the plan in place of its own, as the text of a file in a folder."""
    data = round_trip().load(known.config)
    data["name"] = f"{known.name}_plan"
    if known.config_folder is not None:
        relocate(Study, data, known.config_folder, folder)
    data["measurements"] = [_study_planned(number, posture) for number, posture in enumerate(posture_deg, 1)]
    return yaml_text(data)


def _study_planned(number: int, posture_deg: Array) -> CommentedMap:
    """A measurement that is to be done, in one line."""
    return in_one_line({"file": f"{planned_name(number)}.uff", "posture_deg": posture_deg.tolist()})
