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
from identify.core.yaml_input import round_trip
from identify.fitting.resume import held
from identify.planning.candidates import Candidates, candidates, tabled
from identify.planning.design import Criterion, Design, best_design, random_choice, total
from identify.planning.information import Measurable, measurable
from identify.planning.known import Known, known_of
from identify.results import file as result_file
from identify.results.plan import PlanResult, PromisedTable
from identify.results.provenance import provenance, sha256
from identify.vibration.fit_notes import of_gap

_RANDOM = 200
_Z_95 = 1.96


@dataclass(frozen=True)
class PlanOptions:
    """Size of the test, how many postures it is chosen from (or a table of them), what it is for: parameters
    by name (default: all), and whether the data of the fit count (anew: they do not); noise: floor of an
    accelerance, m/s^2/N, and resolution, Hz, by default those of the fit's FRFs.
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
    targets = _targets(known, options.target)
    with held(path), threadpool_limits(1):
        among = _among(known, options)
        sizes = (options.postures, options.impacts, options.sensors)
        _check_sizes(sizes, among)
        found = measurable(known.model, among, known.free, known.step, known.noise, known.band)
        before = known.bounds if options.anew or not known.information.any() else known.information
        criterion = Criterion(before, targets)
        rng = np.random.default_rng(options.seed)
        design = best_design(found.information, sizes, criterion, rng)
        judged = _promised(known, found, design, sizes, criterion, rng)
        result = _result(model, known, options, among, found, design, judged, path.parent)
        result = replace(result, seconds=time.perf_counter() - begun)
        result_file.write(result, path)
        atomic.write_text(study, result.study)
    return result, [path, study]


def _targets(known: Known, names: tuple[str, ...]) -> Array | None:
    """Rows of the identity for the named parameters; None where none is; InputError for an unknown one."""
    for name in names:
        if name not in known.names:
            raise InputError("--target", f"no free parameter {name!r}", "one of " + ", ".join(known.names))
    return np.eye(len(known.names))[[known.names.index(name) for name in names]] if names else None


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
    rng: np.random.Generator,
) -> tuple[PromisedTable, float]:
    """Intervals of the planned test and of random ones, and the median of the ratio."""

    def half(information: Array) -> Array:
        std = np.sqrt(np.diagonal(np.linalg.inv(information + criterion.before), axis1=-2, axis2=-1))
        return np.asarray(_Z_95 * std * known.step / np.abs(known.model.values[known.free]))

    chosen = half(total(found.information, design.chosen))
    others = np.array(
        [half(total(found.information, random_choice(found.information, sizes, rng))) for _ in range(_RANDOM)]
    )
    judged = np.ones(len(chosen), bool) if criterion.targets is None else criterion.targets.any(axis=0)
    ratio = float(np.median(others[:, judged] / chosen[judged]))
    now = half(np.zeros_like(criterion.before))
    values = known.model.values[known.free]
    return PromisedTable(known.names, known.units, values, now, chosen, np.median(others, axis=0)), ratio


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
