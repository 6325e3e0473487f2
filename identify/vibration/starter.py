"""`identify init`: a commented starter config beside a robot and its data, with everything read from the
files that they say.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from identify.core.atomic import ELSEWHERE, write_text
from identify.core.config_paths import robot_key
from identify.core.errors import InputError
from identify.core.text import count, listed, typed
from identify.core.yaml_input import YAML_SUFFIXES
from identify.measured.band import suggested_band
from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import frf_files, load_of_any_unit
from identify.measured.registration.geometry_file import has_nodes, nodes_alone
from identify.measured.several import is_pattern
from identify.robot.description import Robot
from identify.robot.joint_angles import from_ground
from identify.vibration.starter_robot import NewRobot, RobotOptions, new_robot, relative

_TEMPLATE = """\
# A study of identify.  Keys that are missing have defaults; `identify config` prints them all.
# SI units unless a key says otherwise.
schema: identify/1
name: {{ name }}                     # names the result file in reports/
robot: { {{- robot_key }}: {{ robot }}{{ robot_keys }}}
    # add `payload: [{link: {{ last_link }}, mass_kg: 5}]`
{{ from_ground -}}
{{ points -}}
measurements:
{%- for m in measurements %}
  - {{ m.key }}: {{ m.file }}{{ m.comment }}
{%- for line in m.lines %}
    {{ line }}
{%- endfor %}
{%- if loop.first and posture %}
    posture_deg: {{ posture }}
{%- else %}
    posture_deg: null                # FILL IN: angles of {{ joints }}, such as {{ zeros }}
{%- endif %}
{%- if m.key == "file" %}
{%- if m.unknown %}
    quantity: null                   # FILL IN: receptance, mobility or accelerance; the file does not say
    unit: null                       # FILL IN: such as m/s^2/N or g/N
{%- endif %}
{%- if m.coherence %}
    averages: null                   # FILL IN: averages behind each FRF; the noise follows from them
{%- else %}
    noise: {relative: 0.02}          # CHECK: noise over each FRF; there is no coherence that would tell it
{%- endif %}
    window_decay_per_s: 0.0          # CHECK: sigma of an exponential window exp(-sigma t); 0: none
{%- endif %}
    use: fit                         # or `validate`: never fitted, only predicted
{%- endfor %}
{{ "" if has_frf else "# " }}band_hz: {{ band }}                  # what is compared{{ why }}
effects:                             # the physics of the model; one line per effect
  - kind: joint-compliance
    joints: all
    axes: [rz]                       # rz: about the joint's own axis; rx, ry: tilt; tx, ty: radial; tz: axial
    # stiffness: {initial: [1.0e+6, ...], bounds: [1.0e+4, 1.0e+8]}   # N m/rad; default: from inertia
    # damping: {damping_ratio: 0.03}
{%- if motors %}
  - kind: rotor-inertia              # the motors in the data: they turn by themselves, and the gears wind up
    joints: {{ motors }}
    gear_ratio: null                 # FILL IN: motor turns per joint turn, one per joint
    inertia: {initial: null}         # FILL IN: of each rotor on the motor side, kg m^2, from its data sheet
    friction: {}
{%- endif %}
  # - {kind: base-compliance, axes: [rx, ry]}
  # - {kind: pre-trigger}            # records begin before the impact; slow modes ring on beyond their end
{{ uncertainty }}              # masses, sensors, gains and angles are not quite as stated; or `careful`
cost: {{ cost }}   # FRFs: frf-least-squares, frf-area, normalized-response; modal tables: eigenfrequency
# optimizer: hybrid                  # default: Gauss-Newton with exact gradients from several starts
starts: 10                           # at most; fewer when three agree
seed: 1
"""


@dataclass(frozen=True)
class Starter:
    """The config that was written, and what is left to do, in sentences."""

    config: Path
    to_do: list[str]


def check_new(out: Path) -> None:
    """Raise InputError for a config that exists."""
    if out.exists():
        raise InputError(str(out), "the file exists", "a new file", ELSEWHERE)


def write_starter(
    robot: Path,
    data: list[Path],
    out: Path,
    points: Path | None,
    options: FrfFileOptions | None = None,
    robot_options: RobotOptions | None = None,
    posture: tuple[float, ...] = (),
) -> Starter:
    """Write the config; options: what the user says of all files, robot_options: of the robot; posture:
    joint angles of the first measurement, degrees, if they are known.

    InputError for a file that exists, which is kept, and for one that cannot be read.
    """
    check_new(out)
    folder = out.resolve().parent
    of_robot = robot_options or RobotOptions()
    new = new_robot(robot, folder, of_robot)
    described = new.robot
    if posture and len(posture) != len(described.joints):
        expected = f"{len(described.joints)}, one per joint ({_joints(described)})"
        raise InputError("--posture", count(len(posture), "angle"), expected)
    settings = options or FrfFileOptions()
    read = dict[Path, _Read]()
    alone = [path for path in data if nodes_alone(path)]
    groups = _grouped([path for path in data if path not in alone], settings, read)
    entries = [_measurement(files, folder, settings, read, len(described.joints)) for files in groups]
    entries = entries or [_Entry("file", "null", "   # FILL IN: the FRFs that were measured")]
    there = points or robot.parent / "points.csv"
    given = points is not None or there.exists() or not described.visuals
    source = None if given else next(filter(has_nodes, (*alone, *data)), None)
    lines = _points_lines(there, source, source in alone, entries, folder)
    text = _text(new, entries, posture, (out, robot), lines)
    write_text(out, text)
    to_do = _points_to_do(robot, of_robot, data, there, source, entries)
    return Starter(out, [*_unfilled(text), *to_do, *new.said])


def _points_lines(
    points: Path, source: Path | None, alone: bool, entries: Sequence[_Entry], folder: Path
) -> str:
    """Where the config says that the points are: in a file of them, or in the geometry of the source, which
    may have nothing but it.
    """
    nodes = {node for entry in entries for node in entry.nodes}
    if source is None:
        off = "# " if nodes and max(nodes) < 0 else ""
        said = "   # node, name, link, x_m, y_m, z_m: where the channels of the data are"
        return f"{off}points: {relative(points, folder)}              {said}\n"
    said = f"# no `points`: the geometry of {relative(source, folder)} is laid on the robot\n"
    if alone:
        return f"{said}registration: {{geometry: {relative(source, folder)}}}   # add `pairs: pairs.csv`\n"
    return (
        f"{said}# registration: {{pairs: pairs.csv}}   # nodes whose place is known, where it asks for some\n"
    )


def _text(
    new: NewRobot,
    entries: Sequence[_Entry],
    posture: Sequence[float],
    files: tuple[Path, Path],
    points: str,
) -> str:
    """The config; files: itself and the robot's; points: the lines that say where they are."""
    (out, robot), folder, described = files, files[0].resolve().parent, new.robot
    nodes = {node for entry in entries for node in entry.nodes}
    template = jinja2.Template(_TEMPLATE, keep_trailing_newline=True, undefined=jinja2.StrictUndefined)
    text: str = template.render(
        name=out.stem if out.stem != "config" else _name(robot),
        robot_key=robot_key(robot),
        robot=relative(new.file, folder),
        robot_keys=new.keys,
        from_ground=_from_ground(described),
        uncertainty=f"uncertainty: {new.uncertainty}" if new.uncertainty else "# uncertainty: typical",
        last_link=described.links[-1].name,
        points=points,
        motors=sorted({-node for node in nodes if node < 0}),
        measurements=entries,
        posture=list(posture),
        zeros=[0.0] * len(described.joints),
        joints=_joints(described),
        **_of_band([entry.band for entry in entries if entry.band]),
    )
    return text


def _of_band(bands: Sequence[tuple[float, float]]) -> dict[str, Any]:
    """What the config says of the band and the cost, by the bands of FRFs, if there are any."""
    if not bands:
        return {"band": [3, 80], "has_frf": False, "why": "", "cost": "eigenfrequency"}
    return {
        "band": [_round(min(band[0] for band in bands)), _round(max(band[1] for band in bands))],
        "has_frf": True,
        "why": ", proposed from coherence and the first resonances: CHECK",
        "cost": "frf-least-squares",
    }


def _unfilled(text: str) -> list[str]:
    """Where the config asks for something, by its lines."""
    asked: dict[str, list[str]] = {}
    for number, line in enumerate(text.splitlines(), 1):
        if "FILL IN" in line:
            asked.setdefault(line.strip(" -").partition(":")[0], []).append(str(number))
    lines = [f"`{key}` ({'line' if len(at) == 1 else 'lines'} {listed(at)})" for key, at in asked.items()]
    said = [f"fill in {listed(lines)}"] if lines else []
    window = "`window_decay_per_s: 0.0` says that no exponential window was used: correct it if there was one"
    return [*said, window] if "window_decay_per_s" in text else said


def _points_to_do(
    robot: Path,
    settings: RobotOptions,
    data: list[Path],
    points: Path,
    source: Path | None,
    entries: list[_Entry],
) -> list[str]:
    """What shows the points that a geometry makes; or that the file of points is missing, which nodes it has
    to have, and what makes it.
    """
    nodes = sorted({node for entry in entries for node in entry.nodes if node > 0})
    if points.exists() or not nodes:
        return []
    words = ["identify", "points", robot, source or data[0], "--posture", "...", *settings.words()]
    show = f"`{typed([*words, '--out', points])}`"
    if source is not None:
        return [
            f"the geometry of {source} is laid on the robot: `identify check` says what is doubtful, {show}"
            " shows it"
        ]
    some = ", ".join(map(str, nodes[:20])) + (", ..." if len(nodes) > 20 else "")
    return [
        f"write {points}, which does not exist: a line node,name,link,x_m,y_m,z_m and one for each node of"
        f" the data ({some}), or let {show} show the robot, to click on for the test"
    ]


@dataclass(frozen=True)
class _Entry:
    """What the template needs of one data file; band (Hz) of FRFs; unknown: the file does not say its
    quantity or unit; nodes: of its channels.
    """

    key: str
    file: str
    comment: str = ""
    band: tuple[float, float] | None = None
    unknown: bool = False
    nodes: tuple[int, ...] = ()
    lines: tuple[str, ...] = ()
    coherence: bool = True


_Read = tuple[FrfSet, bool]
"""The FRFs of files, and whether these do not say their quantity or unit."""


def _grouped(data: list[Path], options: FrfFileOptions, read: dict[Path, _Read]) -> list[list[Path]]:
    """The files of each measurement: those of one folder that have no FRF in common are parts of one; read:
    gets what was read on the way.
    """
    groups: list[list[Path]] = []
    pairs: list[set[tuple[Channel, Channel]]] = []
    for path in data:
        own = set[tuple[Channel, Channel]]()
        if len(data) > 1 and path.is_file() and path.suffix not in YAML_SUFFIXES:
            read[path] = load_of_any_unit([path], options)
            own = _pairs(read[path][0])
        alike = bool(groups and own and pairs[-1]) and groups[-1][0].parent == path.parent
        if alike and not own & pairs[-1]:
            groups[-1].append(path)
            pairs[-1] |= own
        else:
            groups.append([path])
            pairs.append(own)
    return groups


def _pairs(data: FrfSet) -> set[tuple[Channel, Channel]]:
    """Output and input of every FRF that was measured."""
    rows, columns = np.nonzero(data.measured)
    return {(data.outputs[i], data.inputs[j]) for i, j in zip(rows, columns, strict=True)}


def _measurement(
    files: list[Path], folder: Path, options: FrfFileOptions, read: dict[Path, _Read], joints: int
) -> _Entry:
    if files[0].suffix in YAML_SUFFIXES:
        return _Entry("modes", relative(files[0], folder))
    known = read.get(files[0]) if len(files) == 1 else None
    frf_set, unknown = known or load_of_any_unit(files, options)
    parts = [one for path in files for one in frf_files(path)]
    size = (
        f"   # {len(frf_set.outputs)} responses, {len(frf_set.inputs)} forces, {len(frf_set.frequency_hz)}"
        f" lines{f', in {len(parts)} files of one posture' if len(parts) > 1 else ''}"
    )
    said = options.model_dump(exclude_defaults=True, include={"columns", "names"})
    return _Entry(
        "file",
        _named(files, folder),
        size,
        suggested_band(frf_set, joints),
        unknown,
        tuple(sorted({channel.node for channel in (*frf_set.outputs, *frf_set.inputs)})),
        tuple(f"{key}: {json.dumps(value)}" for key, value in said.items()),
        frf_set.coherence is not None,
    )


def _named(files: list[Path], folder: Path) -> str:
    """Files as the key `file` has them: one, all of their kind in a folder by a pattern, or a list."""
    if len(files) == 1:
        return json.dumps(relative(files[0], folder)) if is_pattern(files[0]) else relative(files[0], folder)
    pattern = files[0].parent / f"*{files[0].suffix}"
    if sorted(files[0].parent.glob(pattern.name)) == sorted(files):
        return json.dumps(relative(pattern, folder))
    return json.dumps([relative(path, folder) for path in files])


def _round(frequency: float) -> float:
    """To three digits."""
    return float(f"{frequency:.3g}")


def _name(robot: Path) -> str:
    """Of the folder that a robot's file is in, or of the file in the `urdf` folder of a package."""
    folder = robot.resolve().parent.name
    return robot.name.partition(".")[0] if folder in ("urdf", "xacro", "robots") else folder


def _from_ground(robot: Robot) -> str:
    """How a joint 3 that is counted from the ground would be reported."""
    times = from_ground(robot)
    if times is None:
        return ""
    key = f"joint_angles: {{coupling: {{3: {{2: {times:g}}}}}}}"
    return f"# {key}   # if joint 3 is counted from the ground: Fanuc; arms with a parallelogram\n"


def _joints(robot: Robot) -> str:
    return ", ".join(joint.name for joint in robot.joints)
