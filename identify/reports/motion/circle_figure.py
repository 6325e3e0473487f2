"""The circular test drawn as Kobe's Fig. 16: radial errors enlarged about the mean circle, recorded and
simulated.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from identify.reports.kit import plotting as mpl
from identify.reports.kit.figures import BLUE, GRID, MUTED, ORANGE, WIDTH_IN
from identify.results.circular import CircularTest

_LOOKS: dict[str, dict[str, Any]] = {
    "feedback": {"color": BLUE, "lw": 1.1, "label": "feedback position"},
    "end": {"color": ORANGE, "lw": 1.1, "ls": "--", "dashes": (4, 1.2), "label": "mechanical end"},
}
_SHARE = 0.4
"""Of the radius, that the largest error is drawn as, before the factor is made round."""


def circles(tests: dict[str, CircularTest], axes: tuple[str, str] = ("X", "Y")) -> mpl.Figure:
    """A panel of what was recorded, where it was, and one of what was simulated, on the same enlarged
    scale.
    """
    panels = (
        [("recorded", "recorded "), ("simulated", "")]
        if any(name.startswith("recorded") for name in tests)
        else [("simulated", "")]
    )
    worst = max(float(np.abs(test.error).max()) for name, test in tests.items() if name != "command")
    radius = tests["command"].radius
    factor = _round(_SHARE * radius / max(worst, 1e-9))
    figure = mpl.Figure((WIDTH_IN if len(panels) == 2 else 0.55 * WIDTH_IN, 4.0), layout="constrained")
    for place, (title, prefix) in zip(np.atleast_1d(figure.subplots(1, len(panels))), panels, strict=True):
        _panel(
            place, {name: tests[prefix + name] for name in _LOOKS if prefix + name in tests}, radius, factor
        )
        place.set(title=title, xlabel=f"{axes[0]} (mm)", ylabel=f"{axes[1]} (mm)")
    figure.legend(*place.get_legend_handles_labels(), loc="outside upper left", ncols=3)
    return figure


def _round(value: float) -> float:
    """The next smaller of 1, 2, 5, 10, 20, ..."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value))


def _panel(axes: mpl.Axes, tests: dict[str, CircularTest], radius: float, factor: float) -> None:
    angle = np.linspace(0, 2 * np.pi, 361)
    division = radius * 0.2
    for ring in (-1, 0, 1):
        color, width = (MUTED, 0.9) if ring == 0 else (GRID, 0.7)
        label = f"mean circle; rings {1e6 * division / factor:.0f} µm apart" if ring == 0 else None
        axes.plot(
            *(1e3 * (radius + ring * division) * np.array([np.cos(angle), np.sin(angle)])),
            label=label,
            color=color,
            lw=width,
        )
    for name, test in tests.items():
        x, y = (
            1e3
            * (
                test.enlarged(factor)
                + (radius - test.radius) * np.column_stack([np.cos(test.angle), np.sin(test.angle)])
            ).T
        )
        axes.plot(x, y, **_LOOKS[name])
    reach = 1e3 * radius * (1.05 + _SHARE)
    axes.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach))
    axes.text(0, 0, f"radial error\nenlarged {factor:g} times", ha="center", va="center", color=MUTED)
