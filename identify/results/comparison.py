"""Several finished fits, or models that discoveries ended with, as one `Comparison`: reports show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from identify.core.arrays import Texts
from identify.core.errors import InputError
from identify.core.files import sha256_of
from identify.core.thresholds import SIGMAS_95
from identify.results.discovery import DiscoveryResult
from identify.results.file import kind_of, read
from identify.results.fit import FitResult
from identify.results.header import Header
from identify.results.tables import Provenance


@dataclass(frozen=True, kw_only=True)
class Comparison(Header):
    """Finished fits side by side, in the order they were named, by their labels; verdict and notes are
    sentences.
    """

    KIND: ClassVar[str] = "compare"
    runs: dict[str, FitResult]


def compared(files: Sequence[Path]) -> Comparison:
    """The comparison of the finished fits in result files, of a discovery the model that it ended with;
    InputError for a file that holds none, or for one file named twice.
    """
    labels, paths = unique_labels(files), [file.resolve() for file in files]
    twice = next((file for file in files if paths.count(file.resolve()) > 1), None)
    if twice is not None or len(files) < 2:
        raise InputError(
            str(twice or "compare"),
            "named twice" if twice else "one result alone",
            "at least two different results",
        )
    runs = {label: _fit_in(file) for label, file in zip(labels, files, strict=True)}
    seconds = sum(run.seconds for run in runs.values())
    return Comparison(
        name=" and ".join(labels),
        verdict=_verdict(runs),
        notes=tuple(_notes(runs)),
        seconds=seconds,
        runs=runs,
        provenance=_provenance(files, runs),
    )


def _fit_in(file: Path) -> FitResult:
    """The fit in a result file; of a discovery, the model that it ended with."""
    if kind_of(file) == DiscoveryResult.KIND:
        return read(file, DiscoveryResult).after
    return read(file, FitResult)


def unique_labels(files: Sequence[Path]) -> list[str]:
    """The files' names without suffix, with as many folders before them as tell them apart."""
    for depth in range(1, max(len(file.resolve().parts) for file in files) + 1):
        labels = ["/".join(file.resolve().with_suffix("").parts[-depth:]) for file in files]
        if len(set(labels)) == len(files):
            break
    return labels


def differing(a: FitResult, b: FitResult) -> list[str]:
    """Parameters that are free in both, whose difference is outside 1.96 standard deviations of both
    together.
    """
    return [name for name, apart in apart_in_std(a, b).items() if apart > SIGMAS_95]


def apart_in_std(a: FitResult, b: FitResult) -> dict[str, float]:
    """How far apart the parameters of two runs are, in standard deviations of the difference, on the search
    scale; common free ones.
    """
    found = {}
    for i, name in enumerate(a.parameters.name):
        j = b.parameters.name.index(name) if name in b.parameters.name else -1
        if j < 0 or not a.parameters.free[i] or not b.parameters.free[j]:
            continue
        x, y = (
            np.log(v) if a.parameters.log[i] else v for v in (a.parameters.value[i], b.parameters.value[j])
        )
        spread = float(np.hypot(a.parameters.std[i], b.parameters.std[j]))
        found[name] = float(abs(x - y) / spread) if spread > 0 else float("nan")
    return found


def _verdict(runs: dict[str, FitResult]) -> Texts:
    """Who explains the fitted data best, who predicts best, and which parameters differ."""
    fitted = _ranking({label: run.gap for label, run in runs.items()})
    first = (
        f"On the data that were fitted, the residual over noise is {fitted}." if fitted else _by_cost(runs)
    )
    predicted = _ranking({label: run.gap_validation for label, run in runs.items()})
    second = (
        f"On data that were not fitted, it is {predicted}."
        if predicted
        else "No two runs predict data that were not fitted."
    )
    return first, second, _differences(runs)


def _ranking(values: dict[str, float]) -> str:
    """`1.02 (B), 3.41 (A): B is lower`; empty where fewer than two are known."""
    known = sorted((value, label) for label, value in values.items() if not np.isnan(value))
    if len(known) < 2:
        return ""
    level = (
        "there is little between them" if known[-1][0] < 1.02 * known[0][0] else f"{known[0][1]} is lowest"
    )
    return ", ".join(f"{_short(value)} ({label})" for value, label in known) + f"; {level}"


def _short(value: float) -> str:
    """Two decimals, or three digits of a small number."""
    return f"{value:.2f}" if value >= 0.1 else f"{value:.3g}"


def _by_cost(runs: dict[str, FitResult]) -> str:
    if len({run.cost_kind for run in runs.values()}) > 1:
        return (
            "The runs have different costs and no known noise, so their fits can be compared by their errors"
            " only."
        )
    return f"The cost is {_ranking({label: run.cost for label, run in runs.items()})}."


def _differences(runs: dict[str, FitResult]) -> str:
    (reference, a), *others = runs.items()
    parts = []
    for label, b in others:
        both, apart = apart_in_std(a, b), differing(a, b)
        which = f": {', '.join(apart)}" if 0 < len(apart) <= 6 else ""
        parts.append(
            f"{len(apart)} of {len(both)} common parameters of {label} differ from {reference} beyond their"
            f" uncertainty{which}"
        )
        alone = sorted({*a.parameters.name} ^ {*b.parameters.name})
        if alone:
            parts.append(
                f"{len(alone)} parameter{'s are' if len(alone) > 1 else ' is'} in only one of the two"
            )
    return "; ".join(parts) + "."


def _notes(runs: dict[str, FitResult]) -> list[str]:
    notes = [f"{label} did not converge" for label, run in runs.items() if not run.converged]
    if len({run.cost_kind for run in runs.values()}) > 1:
        notes.append("the runs have different kinds of cost: costs cannot be compared, gaps can")
    hashes: dict[str, set[str]] = {}
    for run in runs.values():
        for name, m in run.measurements.items():
            hashes.setdefault(name, set()).add(m.sha256)
    other = [name for name, found in hashes.items() if len(found) > 1]
    if other:
        notes.append(f"measurements of the same name with different data: {', '.join(other)}")
    return notes


def _provenance(files: Sequence[Path], runs: dict[str, FitResult]) -> Provenance:
    """That of the latest run, with the result files as inputs: the same files give the same comparison."""
    latest = max(runs.values(), key=lambda run: run.provenance.written).provenance
    hashes = tuple(sha256_of(file, "a result file") for file in files)
    latest = replace(latest, config_path="", config_sha256="", config="", settings=None)
    return replace(latest, input_files=tuple(runs), input_sha256=hashes)
