"""Single sensors, points and forces: exchanged, turned, reversed, too large, on another link.

All is asked of the model that was fitted as stated: most sensors are right, so it is nearly right.  What
would explain a sensor far better is proposed, the best first, and then judged as every other hypothesis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, replace
from itertools import combinations, permutations, product
from typing import Any

import numpy as np

from identify.core.arrays import Array, Complex
from identify.core.text import listed
from identify.measured.channel import Channel
from identify.robot.points import Point
from identify.robot.points_frame import on_link
from identify.setup.constants import near, nearest
from identify.setup.edits import Edit, Entries, OnLink
from identify.setup.hypothesis import Hypothesis
from identify.setup.score import Score
from identify.setup.stated import Stated
from identify.setup.view import Beside, beside
from identify.vibration.given import posture_of

_LEFT = 0.5
"""Share of a sensor's squares that is left where something is proposed."""
_MOST = 8
"""Proposals of a kind at most."""


def _turns() -> list[Array]:
    """All signed orders of three axes but the plain one: 23 rotations of a cube, and their mirror images."""
    found = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3))
    ]
    return [turn for turn in found if np.any(turn != np.eye(3))]


_TURNS = _turns()


def of_each(stated: Stated, key: str, new: Mapping[Any, Any]) -> tuple[Entries, ...]:
    """Entries of a correction of every measurement, beside those that are there."""
    numbers = range(len(stated.study.measurements))
    return tuple(Entries(("measurements", number, "correct", key), dict(new)) for number in numbers)


def _best(found: list[Hypothesis]) -> list[Hypothesis]:
    """Those that explain most, best first."""
    return sorted(found, key=lambda one: -one.promise)[:_MOST]


def turned(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """A sensor turned by right angles, with exchanged cables, or one of its axes reversed."""
    views = beside(plain)
    found: list[Hypothesis] = []
    for node in _nodes(views):
        own = _with(views, node)
        now = sum(view.apart(node, _of(view, node)) for view in own)
        for turn in _TURNS:
            left = sum(view.apart(node, _seen(turn, _of(view, node))) for view in own)
            names = _names(own[0], node, turn)
            if left <= _LEFT * now and names:
                edits = of_each(stated, "outputs", names)
                code, sentence = _turn_words(node, turn, names)
                found.append(Hypothesis(code, sentence, edits, f"sensor{node}", promise=now - left))
    yield from _best(found)


def _turn_words(node: int, turn: Array, names: Mapping[str, str]) -> tuple[str, str]:
    """What a signed order of axes is called."""
    said = listed([f"{old} is {new}" for old, new in names.items()])
    if len(names) == 1:
        return "sensor-sign", f"channel {next(iter(names))} has the other sign"
    if np.linalg.det(turn) < 0 and len(names) == 2 and (turn >= 0).all():
        return "channel-exchange", f"channels {listed(list(names))} are exchanged"
    if np.array_equal(turn, -np.eye(3)):
        return "sensor-sign", f"all channels of point {node} have the other sign"
    return "sensor-turned", f"the sensor at point {node} is turned: {said}"


def _names(view: Beside, node: int, turn: Array) -> dict[str, str]:
    """What the channels of a point really are; none where one would be that was not measured."""
    channels, names = view.channels[view.nodes.index(node)], dict[str, str]()
    for axis, channel in enumerate(channels):
        other = int(np.argmax(np.abs(turn[axis])))
        sign = int(turn[axis, other])
        if channel is None:
            if other != axis:
                return {}
            continue
        real = Channel(node, channel.sign * sign * (other + 1))
        if real != channel:
            names[str(channel)] = str(real)
    return names


def exchanged(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """Two points for each other: their sensors alone, or all that is said of them."""
    views = beside(plain)
    found: list[Hypothesis] = []
    forces = {one.node for view in views for one in view.target.data.inputs}
    for one, other in combinations(_nodes(views), 2):
        both = _with(views, one, other)
        now = sum(view.apart(node, _of(view, node)) for view in both for node in (one, other))
        left = sum(
            view.apart(node, _of(view, there))
            for view in both
            for node, there in ((one, other), (other, one))
        )
        if both and left <= _LEFT * now:
            sentence = f"points {one} and {other} are exchanged"
            edits = of_each(stated, "nodes", {one: other, other: one})
            if {one, other} & forces:
                sentence = f"the sensors at points {one} and {other} are exchanged"
                edits = of_each(stated, "outputs", _exchange(both[0], one, other))
            about = f"sensor{one}"
            found.append(Hypothesis("points-exchanged", sentence, edits, about, promise=now - left))
    yield from _best(found)


def _exchange(view: Beside, one: int, other: int) -> dict[str, str]:
    names = {}
    for node, there in ((one, other), (other, one)):
        for channel in view.channels[view.nodes.index(node)]:
            if channel is not None:
                names[str(channel)] = str(replace(channel, node=there))
    return names


def shifted(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """All points one number on, or back: their sensors, or all that is said of them."""
    views = beside(plain)
    nodes = _nodes(views)
    for step, word in ((1, "higher"), (-1, "lower")) if views else ():
        moved = {node: nodes[(n + step) % len(nodes)] for n, node in enumerate(nodes)}
        sentence = f"all points are really the next {word} ones"
        yield Hypothesis("points-shifted", sentence, of_each(stated, "nodes", moved), "shift")
        names = {
            str(one): str(replace(one, node=moved[one.node]))
            for one in views[0].target.data.outputs
            if one.node in moved
        }
        edits = of_each(stated, "outputs", names)
        yield Hypothesis(
            "points-shifted", f"all sensors are really at the next {word} points", edits, "shift"
        )


def links(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """One point on another link, or all on the next one."""
    names = [link.name for link in stated.robot.links]
    at = {node: names.index(point.link) for node, point in stated.points.items() if point.link in names}
    for step, word in ((1, "next"), (-1, "previous")):
        inside = {node: n + step for node, n in at.items() if 0 <= n + step < len(names)}
        edits = tuple(OnLink(node, names[n]) for node, n in inside.items())
        if edits:
            sentence = f"the points are on the {word} link of the points file's"
            yield Hypothesis("links-shifted", sentence, edits, "links")
    views = beside(plain)
    found: list[Hypothesis] = []
    for node in _nodes(views):
        own = _with(views, node)
        now = sum(view.apart(node, _of(view, node)) for view in own)
        for edit, point, words in _elsewhere(stated, node, names):
            left = sum(view.apart(node, view.of(point)) for view in own)
            if left <= _LEFT * now:
                sentence = f"point {node} is on {edit.link}, not on {stated.points[node].link}{words}"
                about = f"sensor{node}"
                found.append(Hypothesis("wrong-link", sentence, (edit,), about, promise=now - left))
    yield from _best(found)


def _elsewhere(stated: Stated, node: int, names: list[str]) -> Iterator[tuple[OnLink, Point, str]]:
    """A point on every other link: with the coordinates as they are typed there, or at the place where it is
    at the first posture, as where a surface was taken for another's; those in the base's frame only so.
    """
    told = stated.points[node]
    number = next(iter(stated.sets))
    posture = posture_of(stated.study, stated.study.measurements[number], stated.robot, number)
    for name in names:
        if name == told.link:
            continue
        if stated.study.points_frame == "link":
            yield OnLink(node, name), replace(told, link=name), ""
        there = on_link(told, name, stated.robot, posture)
        yield OnLink(node, name, there), there, ", at its stated position in space"


def sizes(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """One sensor, one channel or one force by a factor."""
    views = beside(plain)
    sensors, forces = list[_Sized](), list[_Sized]()
    whole = _sums([(view.measured, view.predicted, view.weight) for view in views])
    for node in _nodes(views):
        own = _with(views, node)
        parts = [(slice(0, 3), str(node), f"the sensor at point {node}")]
        parts += [
            (slice(axis, axis + 1), str(one), f"channel {one}")
            for axis, one in enumerate(own[0].channels[own[0].nodes.index(node)])
            if one is not None
        ]
        for part, name, words in parts:
            cuts = [_cut(view, node, part) for view in own]
            sensors += _sized(stated, "outputs", name, words, cuts, whole)
    for force in dict.fromkeys(one for view in views for one in view.target.data.inputs):
        own = [view for view in views if force in view.target.data.inputs]
        cuts = [_column(view, view.target.data.inputs.index(force)) for view in own]
        forces += _sized(stated, "inputs", str(force), f"the force at {force}", cuts, whole)
    for found in (sensors, forces):
        for _, hypotheses in sorted(found, key=lambda one: one[0])[:_SIZES]:
            yield from hypotheses


def one_measurement(stated: Stated, plain: Score) -> Iterator[Hypothesis]:
    """One measurement of several by a factor beyond that of the others: the fit is between them."""
    views = beside(plain)
    if len(views) < 2:
        return
    parts = [(view.measured, view.predicted, view.weight) for view in views]
    for place, number in enumerate(stated.sets):
        here, others = _sums([parts[place]]), _sums([*parts[:place], *parts[place + 1 :]])
        factor, left = here.factor / others.factor, here.left(here.factor) / here.now
        if left <= _LEFT and abs(np.log(abs(factor))) > np.log(_SLIGHT):
            file = stated.study.measurements[number]
            for known in near(factor, _ROUGHLY):
                value = float(f"{file.correct.factor / known.value:.8g}")
                edit = Edit(("measurements", number, "correct", "factor"), value)
                sentence = f"the FRFs of {file.source.name} are {known.words} what they should be"
                yield Hypothesis("one-measurement", sentence, (edit,), f"set{number}")


_SLIGHT = 1.3
"""A factor nearer to 1 is a calibration, not a mistake."""
_ROUGHLY = 1.0
"""Logarithm within which a factor is looked for that a model says which is not yet right: fits of each
tell."""
_SIZES = 4
"""Sensors, and forces, of which sizes are proposed."""
_Part = tuple[Complex, Complex, Array]
_Sized = tuple[float, list[Hypothesis]]


def _sized(
    stated: Stated, side: str, name: str, words: str, parts: list[_Part], whole: _Sums
) -> list[_Sized]:
    """Factors of one sensor, channel or force that may be that by which it is off from the others, because a
    common factor of all is between both; and what is left then.
    """
    sums = _sums(parts)
    factor, left = sums.factor / whole.less(sums).factor, sums.left(sums.factor) / sums.now
    about, found = f"{side}{name}", list[Hypothesis]()
    if left > _LEFT or (factor > 0 and abs(np.log(factor)) < np.log(_SLIGHT)):
        return []
    if factor < 0:
        edits, promise = of_each(stated, side, {name: -1.0}), whole.gain(sums, -1.0)
        found.append(Hypothesis("sign", f"{words} has the other sign", edits, about, promise=promise))
    sizes = [] if abs(np.log(abs(factor))) < np.log(_SLIGHT) else near(factor, _ROUGHLY)
    sizes += [nearest(factor)] if sizes and not nearest(factor).known else []
    for known in sizes:
        edits = of_each(stated, side, {name: float(f"{1 / known.value:.8g}")})
        sentence, promise = f"{words} reads {known.words} what it should", whole.gain(sums, known.value)
        mistakes = 1 if known.value > 0 else 2  # another size, and the other sign
        found.append(Hypothesis("size", sentence, edits, about, count=mistakes, promise=promise))
    return [(left, found)]


@dataclass(frozen=True)
class _Sums:
    """Weighted sums over FRFs: measured times predicted, predicted squared, measured squared, and squares of
    what is left of them as they are read.
    """

    both: float
    own: float
    size: float
    now: float

    @property
    def factor(self) -> float:
        """The real factor that measured FRFs have beyond predicted ones."""
        return (self.both / self.own if self.own > 0 else 1.0) or 1.0

    def left(self, factor: float) -> float:
        """Squares that are left where the measured ones have this factor."""
        return self.size - 2 * factor * self.both + factor**2 * self.own if self.own > 0 else self.now

    def less(self, part: _Sums) -> _Sums:
        """Of the others."""
        pairs = zip(astuple(self), astuple(part), strict=True)
        return _Sums(*(one - other for one, other in pairs))

    def gain(self, part: _Sums, factor: float) -> float:
        """Squares that are explained where a part of these was too large by a factor, with the best common
        factor of all before and after.
        """
        others = self.less(part)
        both, own = others.both + factor * part.both, others.own + factor**2 * part.own
        return max(both, 0.0) ** 2 / own - max(self.both, 0.0) ** 2 / self.own if own > 0 < self.own else 0.0


def _sums(parts: list[_Part]) -> _Sums:
    both = own = now = size = 0.0
    for measured, predicted, weight in parts:
        known = ~np.isnan(measured)
        m, p, w = np.where(known, measured, 0.0), np.where(known, predicted, 0.0), weight
        both += float(np.sum(w * (m.conj() * p).real))
        own += float(np.sum(w * np.abs(p) ** 2))
        size += float(np.sum(w * np.abs(m) ** 2))
        now += float(np.sum(w * np.abs(m - p) ** 2))
    return _Sums(both, own, size, now or 1.0)


def _cut(view: Beside, node: int, part: slice) -> _Part:
    at = view.nodes.index(node)
    return view.measured[:, at, part], view.predicted[:, at, part], view.weight[:, at]


def _column(view: Beside, number: int) -> _Part:
    return view.measured[..., number], view.predicted[..., number], view.weight[..., 0]


def _of(view: Beside, node: int) -> Complex:
    return view.predicted[:, view.nodes.index(node)]


def _seen(turn: Array, motion: Complex) -> Complex:
    """Motions (lines, 3, inputs) along other axes."""
    return np.asarray(np.einsum("ij,ljk->lik", turn, motion), dtype=complex)


def _with(views: list[Beside], *nodes: int) -> list[Beside]:
    """Those that have all of some points."""
    return [view for view in views if {*nodes} <= {*view.nodes}]


def _nodes(views: list[Beside]) -> list[int]:
    return sorted({node for view in views for node in view.nodes})
