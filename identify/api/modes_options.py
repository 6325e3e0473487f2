"""Options of `identify modes`: of FRFs, of time records that they are estimated from, of responses alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identify.api.options import Columns, Names, Quiet, Report, columns_of, option
from identify.core.errors import InputError


def _variable(text: str) -> tuple[str, str]:
    """Name and place of an array, from `name=place`."""
    name, equals, place = text.partition("=")
    if not (name and equals and place):
        raise InputError("--variable", repr(text), "a name and a place, such as frf=test.H")
    return name.strip(), place.strip()


def _added_mass(text: str) -> tuple[int, float]:
    """Node and mass, kg, from `node=mass`."""
    node, _, mass = text.partition("=")
    try:
        found = int(node), float(mass)
    except ValueError:
        found = 0, 0.0
    if found[0] < 1 or not 0 < found[1] < float("inf"):
        raise InputError("--added-mass", repr(text), "a point and a mass in kg, such as 12=0.5")
    return found


@dataclass(frozen=True)
class ModesOptions:
    """Of `identify modes`."""

    out: Path | None = option("result file; default: reports/<name of the data>_modes.h5")
    format: str | None = option("uff, csv, hdf5 or mat, where the suffix does not say")
    unit: str | None = option("unit of the FRFs, such as m/s^2/N or g/N, where the file does not say")
    quantity: str | None = option("receptance, mobility or accelerance, where the file does not say")
    averages: int | None = option("averages behind each FRF")
    window_decay: float | None = option("decay, 1/s, of an exponential window on force and response")
    band: tuple[float, float] | None = option("lowest and highest frequency, Hz", metavar="LOW HIGH")
    estimator: str | None = option("plscf or lsce")
    direction: str | None = option("only the responses along X, Y or Z")
    mode: list[float] | None = option("choose by hand: the mode nearest to this frequency, Hz; repeatable")
    keep: list[float] | None = option(
        "the cluster of poles nearest to this frequency, Hz, is a mode; repeatable"
    )
    drop: list[float] | None = option("what was found at this frequency, Hz, is no mode; repeatable")
    threshold: float | None = option(
        "least part of the energy around a mode that only it explains, such as 0.01"
    )
    max_order: int | None = option("largest model order of the stabilisation diagram")
    variable: list[str] | None = option(
        "where a file of arrays keeps something: frequency_hz=f, frf=test.H; repeatable"
    )
    outputs: str | None = option("response channels to use, or all of an array file without names: 1:+Z,2:+Z")
    inputs: str | None = option("force channels to use, or all of an array file without names: 1:+Z")
    columns: Columns = None
    names: Names = None
    geometry: Path | None = option("universal file with the measurement points; default: the data file")
    length_unit: str | None = option("m, mm, cm, in or ft, where the geometry does not say")
    choices: Path | None = option(
        "YAML file of settings as under `modal:` of a study; options here override it"
    )
    roved: bool = option("each node of a response was measured by itself, by a sensor that was moved", False)
    estimate: str | None = option(
        "the files have forces and responses over time: impacts (a block per hit) or random"
    )
    method: str | None = option("with --estimate: h1, h2 or hv, noise on responses, forces or both")
    force_window: float | None = option("with --estimate impacts: seconds behind which the force is zero")
    segment: float | None = option("with --estimate random: length of the segments, s; default: 2")
    frfs: bool = option("also the analysed and the rebuilt FRFs, as universal files (58b)", False)
    output_only: bool = option("modes of responses over time, without a force", False)
    speed: list[float] | None = option(
        "with --output-only: 1/min, of a spindle or motor whose multiples are no modes; repeatable"
    )
    teeth: int | None = option("teeth of the cutter that turns at --speed")
    damping: float | None = option(
        "with --output-only: the smallest damping ratio that must be estimated; default: 0.01"
    )
    scale_frf: Path | None = option(
        "with --output-only: FRFs between some of its channels, which tell modal masses"
    )
    scale_record: Path | None = option(
        "with --output-only: records with --added-mass on, which tell modal masses"
    )
    added_mass: list[str] | None = option(
        "mass, kg, at a point (node) of the records of --scale-record: 12=0.5; repeatable"
    )
    report: Report = True
    quiet: Quiet = False

    def check(self) -> None:
        """InputError for options of an analysis of responses beside one of FRFs, and the reverse."""
        for name in ("method", "force_window", "segment"):
            if getattr(self, name) is not None and self.estimate is None:
                option, fix = f"--{name.replace('_', '-')}", "add `--estimate`, or leave it out"
                raise InputError(option, "given without --estimate", "time records", fix)
        if self.output_only:
            for name in ("frfs", "roved", "estimate"):
                if getattr(self, name):
                    raise InputError(
                        f"--{name}", "given beside --output-only", "measured FRFs", "leave it out"
                    )
            self._check_scaling()
            return
        for name in ("speed", "teeth", "damping", "scale_frf", "scale_record", "added_mass"):
            if getattr(self, name):
                found, fix = "given without --output-only", "add `--output-only`, or leave it out"
                option = f"--{name.replace('_', '-')}"
                raise InputError(option, found, "an analysis of responses alone", fix)

    def _check_scaling(self) -> None:
        if self.scale_frf is not None and self.scale_record is not None:
            raise InputError("--scale-frf", "given beside --scale-record", "one of them", "leave one out")
        if (self.scale_record is None) != (not self.added_mass):
            given, other = "--added-mass", "--scale-record"
            if self.scale_record is not None:
                given, other = other, given
            raise InputError(given, f"given without {other}", "both", f"add `{other}`, or leave it out")
        nodes = [node for node, _ in map(_added_mass, self.added_mass or ())]
        for node in nodes:
            if nodes.count(node) > 1:
                raise InputError("--added-mass", f"point {node} twice", "each point once", "add them up")

    def operational(self) -> dict[str, Any]:
        """What they say of an analysis of responses alone, by the keys of its settings."""
        given = {
            "speeds_rpm": tuple(self.speed) if self.speed else None,
            "teeth": self.teeth,
            "least_damping": self.damping,
        }
        return {key: value for key, value in given.items() if value is not None}

    def scaled_by(self) -> dict[str, Any]:
        """What they say of what scales shapes from responses alone, by its keys."""
        masses = dict(map(_added_mass, self.added_mass or ()))
        return {"frf": self.scale_frf, "record": self.scale_record, "added_kg": masses}

    def file(self) -> dict[str, Any]:
        """What they say of the file of FRFs."""
        return {
            "format": self.format,
            "unit": self.unit,
            "quantity": self.quantity,
            "averages": self.averages,
            "window_decay_per_s": self.window_decay,
            "variables": dict(_variable(text) for text in self.variable or ()),
            "outputs": self.outputs.replace(" ", "").split(",") if self.outputs else None,
            "inputs": self.inputs.replace(" ", "").split(",") if self.inputs else None,
            "columns": columns_of(self.columns),
            "names": self.names,
        }

    def estimation(self) -> dict[str, Any]:
        """What they say of FRFs that are estimated from time records."""
        given = {
            "excitation": self.estimate,
            "method": self.method,
            "force_window_s": self.force_window,
            "segment_s": self.segment,
        }
        return {key: value for key, value in given.items() if value is not None}

    def modal(self) -> dict[str, Any]:
        """What they say of the modal analysis, by the keys of its settings."""
        given = {
            "band_hz": self.band,
            "estimator": self.estimator,
            "direction": self.direction,
            "modes_hz": self.mode or None,
            "keep_hz": self.keep or None,
            "drop_hz": self.drop or None,
            "min_contribution": self.threshold,
            "max_order": self.max_order,
        }
        return {key: value for key, value in given.items() if value is not None}
