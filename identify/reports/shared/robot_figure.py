"""Pictures of the robot for the PDF, in parallel projection: at every posture with its points, and in its
first modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit import plotting as mpl
from identify.reports.kit.figures import BLUE, GRID, INK, MUTED, ORANGE, PALETTE, WIDTH_IN, decades_beside
from identify.reports.shared.pick import ways
from identify.reports.shared.shapes import ModeView
from identify.results.tables import Bodies, Geometry

POSTURES, MODES = 6, 6
ARROWS = "arrows: directions of responses (blue) and of forces (orange, longer)"
_COLUMNS = 3
_AZIMUTH, _ELEVATION = -0.9, 0.35
_STEP_M = 0.5
_TITLE_IN = 0.22
_EYE = np.array(
    [np.cos(_ELEVATION) * np.cos(_AZIMUTH), np.cos(_ELEVATION) * np.sin(_AZIMUTH), np.sin(_ELEVATION)]
)
"""Where the eye is, far away."""
_SHADES = ("#848e99", "#e9ecee")
_REACH = 0.16
"""Largest displacement drawn, as a part of the robot's size."""


@dataclass(frozen=True)
class PostureView:
    """The robot at a posture, under a title, with the channels of responses and of forces."""

    title: str
    geometry: Geometry
    outputs: Sequence[str] = ()
    inputs: Sequence[str] = ()


def postures(views: Sequence[PostureView]) -> mpl.Figure:
    """The robot at its first six postures; points in the colour of their link, with their nodes."""
    shown = [view.geometry for view in views[:POSTURES]]
    below = len(shown) > 1
    figure, panels = _grid(shown, foot=0.22 if below else 0.0, right=0.0 if below else 1.0)
    links = list(dict.fromkeys(link for view in views for link in view.geometry.point_links))
    for axes, view in zip(panels, views, strict=False):
        g = view.geometry
        _floor(axes, g)
        _robot(axes, g, INK)
        _arrows(axes, view)
        x, y = projected(g.points)
        for link in dict.fromkeys(g.point_links):
            chosen = np.array([name == link for name in g.point_links])
            axes.plot(
                x[chosen],
                y[chosen],
                "o",
                ms=3.6,
                color=PALETTE[links.index(link) % len(PALETTE)],
                mec="white",
                mew=0.4,
                label=link,
                zorder=4,
            )
        for node, at_x, at_y in zip(g.nodes, x, y, strict=True):
            axes.annotate(
                str(node), (at_x, at_y), (3, 2.5), textcoords="offset points", fontsize=5.5, color=MUTED
            )
        axes.set_title(view.title)
    where: Any = {"loc": "lower left", "ncols": 8} if below else {"loc": "center right"}
    figure.legend(*panels[0].get_legend_handles_labels(), handletextpad=0.2, columnspacing=1.2, **where)
    return figure


def _arrows(axes: mpl.Axes, view: PostureView) -> None:
    """From every point in the directions of its channels; at inputs a longer one."""
    g = view.geometry
    size = float(np.ptp(_places(g), axis=0).max())
    for channels, length, color, width in ((view.outputs, 0.06, BLUE, 0.6), (view.inputs, 0.15, ORANGE, 1.1)):
        found = list(ways(g, channels).values())
        if found:
            ends = projected(np.array([[g.points[row], length * size * way] for row, way in found]))
            look: Any = {"angles": "xy", "scale_units": "xy", "scale": 1, "units": "inches"}
            axes.quiver(
                *ends[:, :, 0],
                *ends[:, :, 1],
                color=color,
                width=width / 72,
                headwidth=4,
                headlength=5,
                **look,
            )


def shapes(g: Geometry, views: Sequence[ModeView]) -> mpl.Figure:
    """At most six modes: at rest (grey), the model at both ends; at one end its points, ringed where
    measured.

    Where only points were measured, lines join them at one end.
    """
    views = views[:MODES]
    figure, panels = _grid([g] * len(views))
    size = _REACH * float(np.ptp(_places(g), axis=0).max())
    for axes, view in zip(panels, views, strict=True):
        _floor(axes, g)
        if g.bodies is not None and view.bodies is not None:
            _solids(axes, g.bodies, size * view.bodies.real)
        axes.plot(*projected(g.skeleton), color=MUTED, lw=1.2)
        if view.points is None or view.skeleton is None:
            _measured_alone(axes, g, view, size)
            continue
        for sign, color in ((1, BLUE), (-1, ORANGE)):
            axes.plot(*projected(g.skeleton + sign * size * view.skeleton.real), "-", color=color, lw=1.5)
        axes.plot(*projected(g.points + size * view.points.real), ".", color=BLUE, ms=3)
        if view.measured_points is not None:
            axes.plot(
                *projected(g.points + size * view.measured_points.real),
                "o",
                mfc="none",
                mec=INK,
                mew=0.5,
                ms=3.6,
            )
        axes.set_title(view.label.replace("damping ", ""))
    return figure


@dataclass(frozen=True)
class Marks:
    """Places (n, 3) that are ringed, and directions (n, 3) that are arrows from there, NaN for none."""

    places: Array
    along: Array

    def arrows(self, geometry: Geometry) -> list[Array]:
        """The ends (2, 3) of each arrow, a fifth of the robot long, in both directions."""
        reach = 0.2 * float(np.ptp(_places(geometry), axis=0).max())
        both = zip(self.places, self.along, strict=True)
        return [
            np.stack([at, at + sign * reach * way])
            for at, way in both
            if np.isfinite(way).all()
            for sign in (1, -1)
        ]


def coloured(
    geometry: Geometry, panels: Sequence[tuple[str, Array]], marks: Marks, colors: Colors, label: str
) -> mpl.Figure:
    """The robot once a panel (title, values (points,), NaN for none), its points in the colour of their
    value on a logarithmic scale.
    """
    figure, every = _grid([geometry] * len(panels), right=0.75)
    x, y = projected(geometry.points)
    for axes, (title, values) in zip(every, panels, strict=True):
        _floor(axes, geometry)
        _robot(axes, geometry, MUTED)
        known = np.isfinite(values)
        shown = axes.scatter(
            x[known],
            y[known],
            c=values[known],
            norm=mpl.LogNorm(*colors.limits),
            cmap=colors.map,
            s=26,
            edgecolors=INK,
            linewidths=0.5,
            zorder=4,
        )
        axes.plot(*projected(marks.places), "o", ms=13, mfc="none", mec=PALETTE[1], mew=1.3, zorder=5)
        for ends in projected(np.array(marks.arrows(geometry)).reshape(-1, 2, 3)).transpose(1, 2, 0):
            look: Any = {"arrowstyle": "-|>", "color": PALETTE[1], "lw": 1.2, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", ends[1], ends[0], arrowprops=look)
        axes.set_title(title)
    width = figure.get_figwidth()
    bar = figure.colorbar(shown, cax=figure.add_axes((1 - 0.65 / width, 0.1, 0.1 / width, 0.8)))
    decades_beside(bar, label, colors.limits)
    return figure


@dataclass(frozen=True)
class Colors:
    """A logarithmic scale of colours between limits."""

    map: mpl.Colormap
    limits: tuple[float, float]


def _measured_alone(axes: mpl.Axes, g: Geometry, view: ModeView, size: float) -> None:
    if view.measured_points is None:
        return
    moved = g.points + size * view.measured_points.real
    for ends in g.segments if g.segments is not None else ():
        axes.plot(*projected(g.points[ends]), color=GRID, lw=0.7, zorder=0)
        axes.plot(*projected(moved[ends]), color=INK, lw=0.7)
    if g.segments is None:
        for rest, end in zip(g.points, moved, strict=True):
            axes.plot(*projected(np.stack([rest, end])), color=BLUE, lw=0.7)
    axes.plot(*projected(moved), ".", color=BLUE, ms=3)
    axes.set_title(view.label.replace("damping ", ""))


def _grid(
    geometries: Sequence[Geometry], foot: float = 0.0, right: float = 0.0
) -> tuple[mpl.Figure, list[mpl.Axes]]:
    """Equal panels, three a row, high enough for the highest picture, with room below and at the right side,
    inches.
    """
    boxes = [
        np.ptp(np.concatenate([projected(_corners(g)), projected(_places(g))], axis=1), axis=1)
        for g in geometries
    ]
    width, height = np.max(boxes, axis=0)
    columns = min(len(geometries), _COLUMNS)
    rows = -(-len(geometries) // columns)
    across = WIDTH_IN / max(columns, 1.6)
    up = min(across * height / width, 2.6)
    figure = mpl.Figure((across * columns, rows * (up + _TITLE_IN) + foot + 0.05))
    whole, tall = figure.get_size_inches()
    across = (whole - right) / columns
    panels = []
    for place in range(len(geometries)):
        row, column = divmod(place, columns)
        bottom = tall - row * (up + _TITLE_IN) - _TITLE_IN - up
        axes = figure.add_axes((column * across / whole, bottom / tall, 0.97 * across / whole, up / tall))
        axes.set_axis_off()
        axes.set_aspect("equal")
        panels.append(axes)
    return figure, panels


def _places(geometry: Geometry) -> Array:
    seen = [] if geometry.bodies is None else [geometry.bodies.placed]
    return np.concatenate([geometry.points, geometry.skeleton, *seen])


def _robot(axes: mpl.Axes, g: Geometry, color: str) -> None:
    """The bodies of the links and the skeleton, which is thick where it alone stands for a link."""
    if g.bodies is not None:
        _solids(axes, g.bodies)
        for row in np.flatnonzero(g.bodies.bare):
            axes.plot(*projected(g.skeleton[row : row + 2]), color=color, lw=2.4)
    axes.plot(
        *projected(g.skeleton),
        "-o",
        color=color,
        lw=2.4 if g.bodies is None else 0.8,
        ms=4,
        mfc="white",
        mew=1.1,
    )


def _solids(axes: mpl.Axes, bodies: Bodies, moved: Array | None = None) -> None:
    """The bodies of the links at rest, or with their middles shifted and themselves turned (b, 6), the
    farthest triangle first, each as light as it faces the eye.
    """
    places = bodies.placed
    if moved is not None:
        own = moved[bodies.of_link]
        places = places + own[:, :3] + np.cross(own[:, 3:], places - bodies.middle[bodies.of_link])
    corners = places[bodies.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    facing = normal @ _EYE
    light = np.clip(np.where(facing < 0, -1, 1) * (0.75 * facing + 0.45 * normal[:, 2]) + 0.1, 0, 1)
    order = np.argsort(corners.mean(axis=1) @ _EYE)
    colors = mpl.shades(_SHADES)(light[order])
    faces = list(projected(corners[order]).transpose(1, 2, 0))
    drawn = mpl.PolyCollection(faces, facecolors=colors, edgecolors=colors, linewidths=0.2, zorder=0.5)
    drawn.set_rasterized(True)
    axes.add_collection(drawn)


def projected(places: Array) -> Array:
    """Across and up on the page, (2, ...), of places (..., 3), m, in parallel projection."""
    depth = places @ [np.cos(_AZIMUTH), np.sin(_AZIMUTH), 0.0]
    across = places @ [-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0]
    return np.array([across, np.cos(_ELEVATION) * places[..., 2] - np.sin(_ELEVATION) * depth])


def _corners(geometry: Geometry) -> Array:
    """Two opposite corners and the others, (4, 3), of the floor below the robot, in steps of 0.5 m."""
    places = _places(geometry)[:, :2]
    low, high = (
        np.floor(places.min(axis=0) / _STEP_M) * _STEP_M,
        np.ceil(places.max(axis=0) / _STEP_M) * _STEP_M,
    )
    low, high = np.minimum(low, -_STEP_M), np.maximum(high, _STEP_M)
    return np.array([[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0]])


def _floor(axes: mpl.Axes, geometry: Geometry) -> None:
    """A floor grid of 0.5 m below the robot and the base's axes."""
    (x0, y0, _), _, (x1, y1, _), _ = _corners(geometry)
    lines = [[[x, y0, 0], [x, y1, 0]] for x in np.arange(x0, x1 + 1e-9, _STEP_M)]
    lines += [[[x0, y, 0], [x1, y, 0]] for y in np.arange(y0, y1 + 1e-9, _STEP_M)]
    ends = projected(np.array(lines)).transpose(1, 2, 0)
    axes.add_collection(mpl.LineCollection(list(ends), colors=GRID, linewidths=0.5, zorder=0))
    for axis, name in enumerate("XYZ"):
        end = np.zeros((2, 3))
        end[1, axis] = 0.35
        axes.plot(*projected(end), color=MUTED, lw=0.7, zorder=1)
        x, y = projected(1.2 * end[1])
        axes.text(float(x), float(y), name, fontsize=6, color=MUTED, ha="center", va="center")
