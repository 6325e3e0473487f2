"""One chain of revolute joints out of whatever joints a description has: the others are held where they are.

Held are joints that slide or float, that mimic another, that `lock` names, and those of branches beside the
chain.  What that takes away is said in sentences.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.text import listed
from identify.robot.pose import turned
from identify.robot.urdf_elements import MOVING, UrdfJoint, UrdfLink

_CHOOSE = "`tip`: the link at the end of the arm"


@dataclass(frozen=True)
class Choice:
    """What of a description is the arm: tip, the link at its end (default: the end of the longest chain, or
    where it splits into a hand); lock: joints that are held, at which value, rad or m.
    """

    tip: str | None = None
    lock: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Chain:
    """Links and joints of one tree in which every joint is fixed or belongs to the arm; and sentences."""

    links: dict[str, UrdfLink]
    joints: list[UrdfJoint]
    notes: tuple[str, ...]


def one_chain(
    where: str, links: Mapping[str, UrdfLink], joints: Sequence[UrdfJoint], choice: Choice
) -> Chain:
    """The arm of a description; InputError where there is none, or several to choose from."""
    _check_names(where, links, joints, choice)
    kept, cut = _tree(joints)
    links, kept, apart = _one_root(where, links, kept, choice)
    tree = _Tree(links, kept)
    arm = tree.to(choice) if choice.tip else tree.longest(where, choice)
    held = [j for j in kept if j.kind != "fixed" and j.name not in arm]
    values = {joint.name: _value(joint, {j.name: j for j in kept}, choice) for joint in held}
    fixed = [
        replace(j, kind="fixed", origin=j.origin @ moved(j, values[j.name])) if j.name in values else j
        for j in kept
    ]
    followers = [j.name for j in kept if j.name in arm and j.mimic]
    return Chain(dict(links), fixed, (*cut, *apart, *_held_notes(held, values), *_follow_notes(followers)))


def moved(joint: UrdfJoint, value: float) -> Array:
    """Pose (4, 4) that a joint makes at a value, rad or m; one of several coordinates is at zero."""
    if joint.kind in MOVING:
        return turned(value * joint.axis)
    pose = np.eye(4)
    if joint.kind == "prismatic":
        pose[:3, 3] = value * joint.axis
    return pose


def _check_names(
    where: str, links: Mapping[str, UrdfLink], joints: Sequence[UrdfJoint], choice: Choice
) -> None:
    for joint in joints:
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                raise InputError(joint.where, f"unknown {role} link {link!r}", "one of " + ", ".join(links))
    if choice.tip is not None and choice.tip not in links:
        raise InputError("tip", f"unknown link {choice.tip!r}", f"one of {', '.join(links)} of {where}")
    names = [joint.name for joint in joints if joint.kind != "fixed"]
    for name in choice.lock:
        if name not in names:
            raise InputError("lock", f"unknown joint {name!r}", f"one of {', '.join(names)} of {where}")


def _tree(joints: Iterable[UrdfJoint]) -> tuple[list[UrdfJoint], list[str]]:
    """The joints of a tree, and which others were cut because their link is held already: such as of a
    parallelogram that is closed.
    """
    kept: list[UrdfJoint] = []
    parent_of: dict[str, UrdfJoint] = {}
    notes = []
    for joint in joints:
        first = parent_of.setdefault(joint.child, joint)
        if first is joint:
            kept.append(joint)
        else:
            notes.append(
                f"joint {joint.name!r} closes a loop: it was cut, and link {joint.child!r} is carried by"
                f" joint {first.name!r} alone"
            )
    return kept, notes


def _one_root(
    where: str, links: Mapping[str, UrdfLink], joints: list[UrdfJoint], choice: Choice
) -> tuple[Mapping[str, UrdfLink], list[UrdfJoint], list[str]]:
    """The tree with the arm, where a description has several that nothing joins, and what was left out."""
    tree = _Tree(links, joints)
    roots = [name for name in links if name not in tree.parent]
    if not links:
        raise InputError(
            where,
            "no link",
            "a robot with links and joints",
            "if it only defines macros, give the file that calls them",
        )
    looped = set(links) - {name for root in roots for name in tree.below(root)}
    if looped:
        name = min(looped, key=list(links).index)
        raise InputError(
            links[name].where,
            f"link {name!r} is part of a loop of joints that nothing carries",
            "a tree from one root link",
        )
    if len(roots) == 1:
        return links, joints, []
    arms = [
        root
        for root in roots
        if (choice.tip in tree.below(root) if choice.tip else any(tree.count(root, choice)))
    ]
    if len(arms) != 1:
        found = f"{len(roots)} links have no parent ({', '.join(roots)})"
        raise InputError(where, found, f"one root link, or {_CHOOSE}", "join them by joints or say `tip`")
    own = tree.below(arms[0])
    rest = listed([name for name in links if name not in own][:6])
    said = f"nothing joins {rest} to the arm: left out"
    return {n: links[n] for n in own}, [j for j in joints if j.child in own], [said]


class _Tree:
    """Who carries whom."""

    def __init__(self, links: Mapping[str, UrdfLink], joints: Iterable[UrdfJoint]) -> None:
        self.links = links
        self.parent = {joint.child: joint for joint in joints}
        self.leaving: dict[str, list[UrdfJoint]] = {name: [] for name in links}
        for joint in self.parent.values():
            self.leaving[joint.parent].append(joint)

    def below(self, root: str) -> list[str]:
        """A link and all that it carries."""
        found, ahead = dict[str, None](), [root]
        while ahead:
            name = ahead.pop()
            if name not in found:
                found[name] = None
                ahead.extend(joint.child for joint in reversed(self.leaving[name]))
        return list(found)

    def count(self, root: str, choice: Choice) -> list[UrdfJoint]:
        """The free joints of the longest chain that begins at a link."""
        best: dict[str, list[UrdfJoint]] = {}
        for name in reversed(self.below(root)):
            ways = ([j] * _free(j, choice) + best[j.child] for j in self.leaving[name])
            best[name] = max(ways, key=len, default=[])
        return best[root]

    def to(self, choice: Choice) -> set[str]:
        """The joints of the chain that ends at the chosen tip."""
        found, link = set[str](), choice.tip or ""
        while link in self.parent:
            joint = self.parent[link]
            if joint.kind in MOVING and joint.name not in choice.lock:
                found.add(joint.name)
            link = joint.parent
        if not found:
            raise InputError("tip", f"no joint moves link {choice.tip!r}", "a link of the arm")
        return found

    def longest(self, where: str, choice: Choice) -> set[str]:
        """The joints of the longest chain; it ends where it splits into a hand: into several branches of
        which none is the longest, or that mimic each other, none longer than what leads there.
        """
        link = next(name for name in self.links if name not in self.parent)
        found: list[UrdfJoint] = []
        while True:
            solid, leaving = self._rigid(link, choice)
            ways = [([j] * _free(j, choice)) + self.count(j.child, choice) for j in leaving]
            length = max(map(len, ways), default=0)
            if not length:
                break
            best = [j for j, way in zip(leaving, ways, strict=True) if len(way) == length]
            mimicked = {j.mimic.master for name in solid for j in self.leaving[name] if j.mimic}
            hand = len(best) > 1 or bool(mimicked & {j.name for j in best})
            if hand and len(found) >= length:
                break
            if len(best) > 1:
                ends = [way[-1].child for way in ways if len(way) == length]
                said = f"{len(best)} chains of {length} moving joints leave link {best[0].parent!r}"
                raise InputError(
                    where, said, f"one arm, or {_CHOOSE}, such as {' or '.join(map(repr, ends))}"
                )
            found += best
            link = best[0].child
        if not found:
            expected = f"a chain of {' or '.join(MOVING)} joints"
            raise InputError(where, "no moving joint", expected)
        return {joint.name for joint in found}

    def _rigid(self, link: str, choice: Choice) -> tuple[list[str], list[UrdfJoint]]:
        """What is held to a link, and the free joints that leave all of it."""
        solid, free, ahead = [], [], [link]
        while ahead:
            solid.append(ahead.pop())
            for joint in self.leaving[solid[-1]]:
                if _free(joint, choice):
                    free.append(joint)
                else:
                    ahead.append(joint.child)
        return solid, free


def _free(joint: UrdfJoint, choice: Choice) -> bool:
    return joint.kind in MOVING and joint.mimic is None and joint.name not in choice.lock


def _value(joint: UrdfJoint, joints: Mapping[str, UrdfJoint], choice: Choice, depth: int = 0) -> float:
    """Where a joint is held: as stated, as what it mimics, or at zero or the limit next to it."""
    if joint.name in choice.lock:
        return float(choice.lock[joint.name])
    mimic = joint.mimic
    if mimic is not None and mimic.master in joints and depth < len(joints):
        return mimic.times * _value(joints[mimic.master], joints, choice, depth + 1) + mimic.offset
    return float(np.clip(0.0, joint.lower, joint.upper))


def _held_notes(held: Sequence[UrdfJoint], values: Mapping[str, float]) -> list[str]:
    """Which joints are held where, those of one kind together."""
    notes = []
    for what, kinds in (("slides", ("prismatic",)), ("turns", MOVING), ("floats", ("floating", "planar"))):
        own = [joint for joint in held if joint.kind in kinds]
        if own:
            unit = "" if what == "floats" else " m" if what == "slides" else " rad"
            some = listed([f"{j.name} at {values[j.name]:.4g}{unit}" for j in own[:8]])
            more = f" and {len(own) - 8} more" if len(own) > 8 else ""
            notes.append(f"not part of the arm, held: {some}{more}; `lock` says where else, `tip` which arm")
    return notes


def _follow_notes(names: Sequence[str]) -> list[str]:
    if not names:
        return []
    return [f"{listed(names)} mimics another joint, but counts as a joint of its own: give its angle, too"]
