"""What to do after a command, as commands that can be copied."""

from __future__ import annotations

from pathlib import Path

from identify.core.config_paths import robot_key
from identify.core.thresholds import MISSING
from identify.reports.outcome import Result
from identify.results.motion import MotionResult


def next_steps(found: Result, config: Path | None = None) -> list[str]:
    """Sentences with the next commands, best first; none where there is nothing obvious.

    config: of the study that was run.
    """
    data = found.data
    if data.KIND == "fit":
        return _after_fit(found, config)
    if data.KIND == "discovery":
        return _after_discovery(found, config)
    if (
        data.KIND == "motion"
        and config is not None
        and data.starts is None
        and data.free
        and _has_records(data)
    ):
        return [f"identify fit {config}   (identifies its free numbers from the records)"]
    if data.KIND == "motion":
        return _after_motion(found, config)
    return _with_files(found)


def _after_motion(found: Result, config: Path | None) -> list[str]:
    """After a fit of a study of motion that leaves a gap, or a search for what it lacks."""
    data = found.data
    if data.searched:
        return [
            f"identify fit {path}   (the better study)" for path in found.written if path.suffix == ".yaml"
        ]
    gaps = [gap for gap in (data.gap, data.gap_validation) if gap > MISSING]
    if config is None or data.starts is None or not gaps:
        return []
    return [
        f"identify discover {config}   (the gap of {max(gaps):.3g} is well above 1: finds what is missing)"
    ]


def _has_records(motion: MotionResult) -> bool:
    """Whether anything was recorded that a fit would use."""
    return any(record.use == "fit" and record.comparisons for record in motion.records.values())


def _with_files(found: Result) -> list[str]:
    """What is done with files that were written beside the result."""
    data, beside = found.data, found.written[1:]
    if data.KIND == "modes" and data.found:
        tables = [path for path in beside if path.suffix == ".yaml"][:1]
        return [
            f"a study takes these modes with `modes: {path}` in one of its measurements" for path in tables
        ]
    if data.KIND == "joints":
        return [f"a study takes these bodies with `robot: {{{robot_key(path)}: {path}}}`" for path in beside]
    if data.KIND == "excitation" and beside:
        curve = data.target if data.target == "transmission-error" else "base-parameters or rigid-bodies"
        return [f"run {beside[0]}, record it, and fit a study of joints with the curve {curve}"]
    return []


def _after_fit(found: Result, config: Path | None) -> list[str]:
    data = found.data
    if (
        config is not None
        and data.gap > MISSING
        and all(m.frf is not None for m in data.measurements.values())
    ):
        why = f"the gap of {data.gap:.3g} is well above 1"
        return [f"identify discover {config}   ({why}: finds what is missing)"]
    if data.converged and data.gap <= MISSING:
        return [
            _mapped(found.path, "the model"),
            f"identify stability {found.path} --tool tool.yaml   (how deep it may cut: docs/machining.md)",
        ]
    return []


def _after_discovery(found: Result, config: Path | None) -> list[str]:
    studies = [path for path in found.written if path.suffix == ".yaml"]
    if not studies:
        return []
    steps = [f"identify fit {studies[0]}   (the better study)"]
    fitted = found.path.with_name(f"{found.name}.h5")
    if fitted.exists():
        steps.append(f"identify compare {fitted} {found.path}   (before and after)")
    return [*steps, _mapped(found.path, "the better model")]


def _mapped(path: Path, what: str) -> str:
    return f"identify map {path} --grid 2:-60:60:9   ({what} over the workspace)"
