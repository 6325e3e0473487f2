"""A discovery compensated for the reports' tests: one effect added, one followed but not kept, and a last
step that finds nothing.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from identify.results.discovery import (
    AddedEffects,
    DiscoveryResult,
    GapByBand,
    MarkTable,
    OptionTable,
    PartTable,
    StepResult,
)
from identify.results.file import LAYOUT
from identify.results.fit import FitResult, FrfComparison
from identify.results.tables import ParameterTable
from tests.reports.sample import frf_result

TILT, BASE, ODD = (
    "tilt compliance of joint 2 (rx, ry)",
    "compliance of the base (rx, ry)",
    "gain of channel 3:<+Z> & more",
)
CONFIG_AFTER = (
    "schema: identify/1\nname: made_up_arm\neffects:\n  - {kind: joint-compliance, joints: [2], axes: [rx,"
    " ry]}\n"
)
_TRIED = 15


def discovery_result() -> DiscoveryResult:
    """Two steps that find something, the second in vain, and one that does not; the last parameter of the
    final model is new.
    """
    after = frf_result(60, 4)
    return DiscoveryResult(
        layout=LAYOUT,
        kind="discovery",
        key="key",
        name="made_up_arm",
        verdict=(
            f"Missing from the model: {TILT}. With it, the gap goes from 12.35 to 1.03.",
            "The remaining residual is noise.",
        ),
        notes=("only one start found the best minimum, 1 < 2 & more `starts` would tell",),
        seconds=93.25,
        elsewhere="measurements for validation",
        added=AddedEffects(
            sentence=(TILT,),
            kind=("joint-compliance",),
            config=('{"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]}',),
            named=(f"{TILT}: offset.z = 0.0123 m",),
            parameters=("offset.z",),
            log_odds=np.array([43781.25]),
            gap=np.array([1.0331]),
            gap_validation=np.array([1.0626]),
        ),
        steps={
            "0": _step(12.3456, 11.875, TILT, True),
            "1": _step(1.0331, 1.0626, ODD, False),
            "2": _step(1.0331, 1.0626, "", False),
        },
        map_before=_map(after, 9.0),
        map_after=_map(after, 1.0),
        before=_before(after),
        after=dataclasses.replace(
            after, provenance=dataclasses.replace(after.provenance, config=CONFIG_AFTER)
        ),
        provenance=after.provenance,
        marks=MarkTable(
            (TILT, TILT), np.tile([0.0, 0.0, 0.4], (2, 1)), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        ),
    )


def null_result() -> DiscoveryResult:
    """A discovery that adds nothing, although something is missing, judged by data left out of a fit."""
    found = discovery_result()
    none = AddedEffects((), (), (), (), (), np.zeros(0), np.zeros(0), np.zeros(0))
    same: dict[str, Any] = {
        "marks": MarkTable((), np.zeros((0, 3)), np.zeros((0, 3))),
        "after": found.before,
        "map_after": found.map_before,
        "steps": {"0": _step(12.3456, 11.875, "", False)},
    }
    return dataclasses.replace(
        found,
        added=none,
        verdict=("Nothing in the catalogue explains it.",),
        elsewhere="channels left out",
        **same,
    )


def _before(after: FitResult) -> FitResult:
    """The fit without the last parameter: its FRFs are those of the start model."""
    measurements = {}
    for name, m in after.measurements.items():
        assert m.frf is not None
        measurements[name] = dataclasses.replace(
            m, gap=12.3456 if m.use == "fit" else 11.875, frf=_worse(m.frf)
        )
    less = dataclasses.replace(after, parameters=_shorter(after.parameters), measurements=measurements)
    return dataclasses.replace(less, effects=after.effects[:1], gap=12.3456, gap_validation=11.875)


def _worse(frf: FrfComparison) -> FrfComparison:
    assert frf.initial is not None and frf.gap is not None
    return dataclasses.replace(
        frf, fitted=frf.initial, gap=12 * frf.gap, relative_error=3 * frf.relative_error
    )


def _shorter(p: ParameterTable) -> ParameterTable:
    cut = {field.name: getattr(p, field.name)[:-1] for field in dataclasses.fields(p)}
    return ParameterTable(**{**cut, **{side: 0.8 * cut[side] for side in ("value", "low_95", "high_95")}})


def _step(gap: float, other: float, best: str, kept: bool) -> StepResult:
    decided = (
        "It was added."
        if kept
        else "It was not kept."
        if best
        else f"None of {_TRIED} candidates is supported by the data."
    )
    return StepResult(
        model=() if kept else (TILT,),
        gap=gap,
        gap_validation=other,
        where=f"The residual is {gap:.2f} times the noise, 56% of it at 25 to 79.4 Hz.",
        parts=_parts(gap),
        options=_options(gap, best),
        best=best,
        kept=kept,
        alike=(BASE,) if best == ODD else (),
        advice="To tell them apart, measure p<4>:+X for an impact at p<1>:+X & look." if best == ODD else "",
        decision=decided,
    )


def _parts(gap: float) -> PartTable:
    names = {
        "mode": ("27.4 Hz", "12.1 Hz"),
        "band": ("25 to 79.4 Hz", "3.13 to 8 Hz", "8 to 25 Hz"),
        "measurement": ("posture1",),
        "direction": ("Y", "X"),
        "point": tuple(f"p<{node}>" for node in range(1, 15)),
    }
    rows = [(kind, name) for kind, own in names.items() for name in own]
    share = np.linspace(0.9, -0.02, len(rows))
    return PartTable(
        tuple(kind for kind, _ in rows),
        tuple(name for _, name in rows),
        gap * (0.6 + share),
        share,
        np.array([27.4, 12.1, 25.0, 3.13, 8.0] + [np.nan] * (len(rows) - 5)),
    )


def _options(gap: float, best: str) -> OptionTable:
    """The best one and another like it, one that explains less, and others that were not refitted."""
    log_odds = np.full(_TRIED, np.nan)
    log_odds[:3] = (43781.25, 43779.5, 250.125) if best else (-12.743774, -20.5, -31.0)
    left = np.linspace(1.0 + 0.05 * (gap - 1), gap, _TRIED)
    second = "the data cannot tell it from the best" if best == ODD else "explains less"
    return OptionTable(
        sentence=(
            best or "added mass on link1",
            BASE,
            *(f"appended resonator on link{number} along x" for number in range(_TRIED - 2)),
        ),
        kind=("joint-compliance", "base-compliance", *("appended-resonator",) * (_TRIED - 2)),
        gap=left,
        gap_validation=np.where(np.isnan(log_odds), np.nan, left + 0.0123),
        parameters=np.array([4, 4, *([3] * (_TRIED - 2))]),
        log_odds=log_odds,
        verdict=(
            "best" if best else "does not pay for its parameters",
            second,
            "explains less",
            *("ruled out on few lines",) * (_TRIED - 3),
        ),
    )


def _map(result: FitResult, size: float) -> GapByBand:
    """Gaps up to about `size`; one cell without data."""
    rng = np.random.default_rng(11)
    bands, channels = (
        np.geomspace(3.125, 80.0, 13),
        tuple(f"p<{node}>:+{axis}" for node in range(1, 5) for axis in "XYZ"),
    )
    shape = len(result.measurements), len(bands) - 1, len(channels)
    gap = size ** rng.uniform(0.4, 1.1, shape) * rng.uniform(0.8, 1.25, shape)
    gap[0, 0, 3] = np.nan
    return GapByBand(tuple(result.measurements), bands, channels, gap)
