"""Options of `identify modes`: of FRFs, of time records that they are estimated from, of responses alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from identify.api.options import Columns, Names, Quiet, Report, columns_of
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

    out: Annotated[
        Path | None, typer.Option(help="result file; default: reports/<name of the data>_modes.h5")
    ] = None
    format: Annotated[
        str | None, typer.Option(help="uff, csv, hdf5 or mat, where the suffix does not say")
    ] = None
    unit: Annotated[
        str | None, typer.Option(help="unit of the FRFs, such as m/s^2/N or g/N, where the file does not say")
    ] = None
    quantity: Annotated[
        str | None, typer.Option(help="receptance, mobility or accelerance, where the file does not say")
    ] = None
    averages: Annotated[int | None, typer.Option(help="averages behind each FRF")] = None
    window_decay: Annotated[
        float | None, typer.Option(help="decay, 1/s, of an exponential window on force and response")
    ] = None
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(help="lowest and highest frequency, Hz", metavar="LOW HIGH"),
    ] = None
    estimator: Annotated[str | None, typer.Option(help="plscf or lsce")] = None
    direction: Annotated[str | None, typer.Option(help="only the responses along X, Y or Z")] = None
    mode: Annotated[
        list[float] | None,
        typer.Option(help="choose by hand: the mode nearest to this frequency, Hz; repeatable"),
    ] = None
    keep: Annotated[
        list[float] | None,
        typer.Option(help="the cluster of poles nearest to this frequency, Hz, is a mode; repeatable"),
    ] = None
    drop: Annotated[
        list[float] | None, typer.Option(help="what was found at this frequency, Hz, is no mode; repeatable")
    ] = None
    threshold: Annotated[
        float | None,
        typer.Option(help="least part of the energy around a mode that only it explains, such as 0.01"),
    ] = None
    max_order: Annotated[
        int | None, typer.Option(help="largest model order of the stabilisation diagram")
    ] = None
    variable: Annotated[
        list[str] | None,
        typer.Option(help="where a file of arrays keeps something: frequency_hz=f, frf=test.H; repeatable"),
    ] = None
    outputs: Annotated[
        str | None,
        typer.Option(help="response channels to use, or all of an array file without names: 1:+Z,2:+Z"),
    ] = None
    inputs: Annotated[
        str | None, typer.Option(help="force channels to use, or all of an array file without names: 1:+Z")
    ] = None
    columns: Columns = None
    names: Names = None
    geometry: Annotated[
        Path | None, typer.Option(help="universal file with the measurement points; default: the data file")
    ] = None
    length_unit: Annotated[
        str | None, typer.Option(help="m, mm, cm, in or ft, where the geometry does not say")
    ] = None
    choices: Annotated[
        Path | None,
        typer.Option(help="YAML file of settings as under `modal:` of a study; options here override it"),
    ] = None
    roved: Annotated[
        bool,
        typer.Option(
            "--roved",
            help="each node of a response was measured by itself, by a sensor that was moved",
        ),
    ] = False
    estimate: Annotated[
        str | None,
        typer.Option(
            help="the files have forces and responses over time: impacts (a block per hit) or random"
        ),
    ] = None
    method: Annotated[
        str | None, typer.Option(help="with --estimate: h1, h2 or hv, noise on responses, forces or both")
    ] = None
    force_window: Annotated[
        float | None, typer.Option(help="with --estimate impacts: seconds behind which the force is zero")
    ] = None
    segment: Annotated[
        float | None, typer.Option(help="with --estimate random: length of the segments, s; default: 2")
    ] = None
    frfs: Annotated[
        bool, typer.Option("--frfs", help="also the analysed and the rebuilt FRFs, as universal files (58b)")
    ] = False
    output_only: Annotated[
        bool,
        typer.Option("--output-only", help="modes of responses over time, without a force"),
    ] = False
    speed: Annotated[
        list[float] | None,
        typer.Option(
            help="with --output-only: 1/min, of a spindle or motor whose multiples are no modes; repeatable"
        ),
    ] = None
    teeth: Annotated[int | None, typer.Option(help="teeth of the cutter that turns at --speed")] = None
    damping: Annotated[
        float | None,
        typer.Option(
            help="with --output-only: the smallest damping ratio that must be estimated; default: 0.01"
        ),
    ] = None
    scale_frf: Annotated[
        Path | None,
        typer.Option(help="with --output-only: FRFs between some of its channels, which tell modal masses"),
    ] = None
    scale_record: Annotated[
        Path | None,
        typer.Option(help="with --output-only: records with --added-mass on, which tell modal masses"),
    ] = None
    added_mass: Annotated[
        list[str] | None,
        typer.Option(help="mass, kg, at a point (node) of the records of --scale-record: 12=0.5; repeatable"),
    ] = None
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
