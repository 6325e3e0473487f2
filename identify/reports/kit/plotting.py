"""What figures are drawn with, imported when the first one is: that takes longer than to write a page."""

# ruff: noqa: PLC0414  these names are for other modules

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib import get_data_path as get_data_path
    from matplotlib import rc_context as rc_context
    from matplotlib.axes import Axes as Axes
    from matplotlib.axis import Axis as Axis
    from matplotlib.collections import LineCollection as LineCollection
    from matplotlib.collections import PolyCollection as PolyCollection
    from matplotlib.colorbar import Colorbar as Colorbar
    from matplotlib.colors import Colormap as Colormap
    from matplotlib.colors import LinearSegmentedColormap as LinearSegmentedColormap
    from matplotlib.colors import LogNorm as LogNorm
    from matplotlib.figure import Figure as Figure
    from matplotlib.ticker import FormatStrFormatter as FormatStrFormatter
    from matplotlib.ticker import LogFormatter as LogFormatter
    from matplotlib.ticker import LogLocator as LogLocator
    from matplotlib.ticker import MaxNLocator as MaxNLocator
    from matplotlib.ticker import NullFormatter as NullFormatter
    from matplotlib.ticker import NullLocator as NullLocator

_MODULES = {
    "matplotlib": ("get_data_path", "rc_context"),
    "matplotlib.axes": ("Axes",),
    "matplotlib.axis": ("Axis",),
    "matplotlib.collections": ("LineCollection", "PolyCollection"),
    "matplotlib.colorbar": ("Colorbar",),
    "matplotlib.colors": ("Colormap", "LinearSegmentedColormap", "LogNorm"),
    "matplotlib.figure": ("Figure",),
    "matplotlib.ticker": (
        "FormatStrFormatter",
        "LogFormatter",
        "LogLocator",
        "MaxNLocator",
        "NullFormatter",
        "NullLocator",
    ),
}


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(name)


@cache
def shades(colors: tuple[str, ...]) -> LinearSegmentedColormap:
    """The colour map that runs through these."""
    found: LinearSegmentedColormap = __getattr__("LinearSegmentedColormap").from_list("shades", list(colors))
    return found
