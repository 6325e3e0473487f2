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
    from matplotlib.ticker import FuncFormatter as FuncFormatter
    from matplotlib.ticker import LogFormatter as LogFormatter
    from matplotlib.ticker import LogLocator as LogLocator
    from matplotlib.ticker import MaxNLocator as MaxNLocator
    from matplotlib.ticker import NullFormatter as NullFormatter
    from matplotlib.ticker import NullLocator as NullLocator

_MODULES = ("", ".axes", ".axis", ".collections", ".colors", ".figure", ".ticker")


def __getattr__(name: str) -> Any:
    for module in _MODULES if not name.startswith("_") else ():
        found = getattr(import_module(f"matplotlib{module}"), name, None)
        if found is not None:
            return found
    raise AttributeError(name)


@cache
def shades(colors: tuple[str, ...]) -> LinearSegmentedColormap:
    """The colour map that runs through these."""
    found: LinearSegmentedColormap = __getattr__("LinearSegmentedColormap").from_list("shades", list(colors))
    return found
