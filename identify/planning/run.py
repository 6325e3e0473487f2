"""What `identify plan` does, without the terminal: a fit in, the next test with what it promises out."""

from __future__ import annotations

import io
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from ruamel.yaml.comments import CommentedMap
from threadpoolctl import threadpool_limits

from identify.batch.posture_table import read_postures
from identify.core import atomic
from identify.core.arrays import Array
from identify.core.config_paths import relocated
from identify.core.errors import InputError
from identify.core.thresholds import SIGMAS_95
from identify.core.yaml_input import round_trip
from identify.fitting.resume import held
from identify.machining.tool import read_tool
from identify.planning.candidates import Candidates, candidates, tabled
from identify.planning.design import Criterion, Design, best_design, random_choice, total
from identify.planning.information import Measurable, measurable
from identify.planning.known import Known, known_of
from identify.planning.targets import Target, targets_of
from identify.results import file as result_file
from identify.results.plan import PlanResult, PromisedTable
from identify.results.provenance import provenance, sha256
from identify.vibration.fit_notes import of_gap

_RANDOM = 200


@dataclass(frozen=True)
class PlanOptions:
    """Size of the test, how many postures it is chosen from (or a table of them), what it is for: parameters
    by name (default: all), modes (`mode2.frequency`) or `depth`, the limit of a cutter (file of a tool), both
    at a posture at_deg (default: the first), and whether the data of the fit count (anew: they do not);
    noise: floor of an accelerance, m/s^2/N, and resolution, Hz, by default those of the fit's FRFs.
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


def angles_of(text: str | None) -> tuple[float, ...]:
    """Angles in degrees of a text such as `0,30,-60,0,45,0`; none of None; InputError for another text."""
    if text is None:
        return ()
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise InputError("--at", repr(text), "angles in degrees such as 0,30,-60,0,45,0") from error


def run_plan(model: Path, options: PlanOptions, out: Path | None = None) -> tuple[PlanResult, list[Path]]:
    """Choose the next test of a study that was not measured yet, or of a fit; writes `<model>_plan.h5` (of a
    study, in reports/) and the study of that test, `.yaml`, beside it.

    Raises InputError for a file that is neither, a test larger than what there is to choose from, an unknown
    target, noise that is not known, and a result that cannot be written.
    """
    begun = time.perf_counter()
    known = known_of(model, options.noise, options.resolution)
    of_study = model.suffix in (".yaml", ".yml")
    path = out or (Path("reports") if of_study else model.parent) / f"{model.stem}_plan.h5"
    study = path.with_suffix(".yaml")
    result_file.check_new(path, "a plan", [model, *filter(None, [options.table])], [study])
    targets = _targets(known, options)
    with held(path), threadpool_limits(1):
        among = _among(known, options)
        sizes = (options.postures, options.impacts, options.sensors)
        _check_sizes(sizes, among)
        found = measurable(known.model, among, known.free, known.step, known.noise, known.band)
        before = known.bounds if options.anew or not known.information.any() else known.information
        criterion = Criterion(before, _rows(known, targets))
        rng = np.random.default_rng(options.seed)
        design = best_design(found.information, sizes, criterion, rng)
        judged = _promised(known, found, design, sizes, criterion, targets, rng)
        result = _result(model, known, options, among, found, design, judged, path.parent)
        result = replace(result, seconds=time.perf_counter() - begun)
        result_file.write(result, path)
        atomic.write_text(study, result.study)
    return result, [path, study]


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


def _promised(
    known: Known,
    found: Measurable,
    design: Design,
    sizes: tuple[int, int, int],
    criterion: Criterion,
    targets: list[Target],
    rng: np.random.Generator,
) -> tuple[PromisedTable, float]:
    """Intervals of the planned test and of random ones, of targets that are no parameters first, and the
    median of the ratio.
    """
    others = [target for target in targets if target.name not in known.names]
    own = known.model.values[known.free]
    rows = np.array([*(one.relative for one in others), *np.diag(known.step / np.abs(own))])

    def half(information: Array) -> Array:
        covariance = np.linalg.inv(information + criterion.before)
        return np.asarray(SIGMAS_95 * np.sqrt(np.einsum("tp,pq,tq->t", rows, covariance, rows)))

    chosen = half(total(found.information, design.chosen))
    drawn = np.array(
        [half(total(found.information, random_choice(found.information, sizes, rng))) for _ in range(_RANDOM)]
    )
    names = (*(one.name for one in others), *known.names)
    judged = np.array([not targets or name in {one.name for one in targets} for name in names])
    ratio = float(np.median(drawn[:, judged] / chosen[judged]))
    units = (*(one.unit for one in others), *known.units)
    values = np.array([*(one.value for one in others), *own])
    now = half(np.zeros_like(criterion.before))
    return PromisedTable(names, units, values, now, chosen, np.median(drawn, axis=0)), ratio


def _result(
    path: Path,
    known: Known,
    options: PlanOptions,
    among: Candidates,
    found: Measurable,
    design: Design,
    judged: tuple[PromisedTable, float],
    folder: Path,
) -> PlanResult:
    postures, impacts, sensors = design.chosen
    promised, ratio = judged
    points = [known.model.points[among.sensors[k]] for k in sensors]
    posture_deg = np.asarray(np.round(np.rad2deg(among.postures[postures]), 1), dtype=float)
    what = f"{', '.join(options.target)} (I-optimal)" if options.target else "all parameters (D-optimal)"
    return PlanResult(
        name=known.name,
        verdict=_verdict(
            promised,
            ratio,
            what,
            (len(postures), len(impacts), len(sensors)),
            options.anew or not known.information.any(),
        ),
        notes=_notes(known),
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
        level=found.level[np.ix_(*design.chosen)],
        noise_floor=known.noise.floor,
        band_hz=known.band[:2],
        resolution_hz=float(known.band[2]),
        candidates=np.array([len(among.postures), len(among.impacts), len(among.sensors)]),
        random_ratio=ratio,
        promised=promised,
        study=_study(path, known, posture_deg, folder),
    )


def _verdict(
    promised: PromisedTable, ratio: float, what: str, sizes: tuple[int, ...], anew: bool
) -> tuple[str, ...]:
    said = [
        f"{sizes[0]} postures, {sizes[1]} impacts and {sizes[2]} sensors determine {what}: at the median,"
        f" their intervals are {ratio:.3g} times narrower than those of tests of the same size at random."
    ]
    worst = int(np.argmax(promised.promised))
    said.append(
        f"The 95 % intervals that it promises are ± {100 * promised.promised.min():.2g} to"
        f" {100 * promised.promised[worst]:.2g} %, the widest that of {promised.name[worst]}."
    )
    if not anew:
        gain = promised.now / promised.promised
        best = int(np.argmax(gain))
        said.append(
            f"Together with the data of the fit, this narrows the intervals by a factor of"
            f" {np.median(gain):.3g} at the median, most that of {promised.name[best]}: {gain[best]:.3g}."
        )
    return tuple(said)


def _notes(known: Known) -> tuple[str, ...]:
    said = [
        f"the promise holds for a noise of {known.noise.floor:.3g} m/s²/N in the real and in the imaginary"
        " part of each accelerance, and for parameters near those given"
    ]
    if known.config_folder is None:
        said.append(
            "the paths in the study of the test are those of the fit's study: put it into the same folder"
        )
    return *said, *of_gap(known.gap, "for which this test is not planned")


def _study(path: Path, known: Known, posture_deg: Array, folder: Path) -> str:
    """The study with the measurements of the plan in place of its own, as the text of a file in a folder."""
    yaml = round_trip()
    yaml.width = 140
    data = yaml.load(known.config)
    data["name"] = f"{known.name}_plan"
    if known.config_folder is not None:
        for owner, key in ((data["robot"], "urdf"), (data["robot"], "dh"), (data, "points")):
            if key in owner:
                owner[key] = relocated(owner[key], known.config_folder, folder)
    data["measurements"] = [_planned(number, posture) for number, posture in enumerate(posture_deg, 1)]
    text = io.StringIO()
    yaml.dump(data, text)
    return text.getvalue()


def _planned(number: int, posture_deg: Array) -> CommentedMap:
    """A measurement that is to be done, in one line."""
    entry = CommentedMap({"file": f"planned{number}.uff", "posture_deg": posture_deg.tolist()})
    entry.fa.set_flow_style()
    return entry
