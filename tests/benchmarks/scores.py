"""Tables of the newest stored exams for docs/: python -m tests.benchmarks.scores, then
`python -m tests.benchmarks.pages write`.

A draw that is scored anew takes the place of the older one here.
"""

from __future__ import annotations

import json
from pathlib import Path
from statistics import median
from typing import Any

from tests.benchmarks.pages import keep

RESULTS = Path(__file__).parent / "results"
NAME = "scores"
Rows = list[list[str]]
_FEW = {
    "shared tests, robots as stated": "discovery_hidden",
    "shared tests, `careful` and `typical`": "discovery_hidden_dirty",
    "drawn, robots as stated": "discovery_1129409",
    "drawn, `careful`": "discovery_1129408",
    "drawn, `typical`": "discovery_1129405",
}
_MANY, _SEEN = "hall_drawn_3021", 10.0
"""The draw of arms with many effects; standard deviations of the noise by which an effect that is seen moves
the FRFs.
"""
_SET_UP = {
    "few": ["setup_exam_310412"],
    "few, all draws": [
        *("setup_exam_310412", "setup_exam_301155", "setup_exam_291130", "setup_exam_281601"),
        *("setup_exam_281501", "setup_exam_281412", "setup_exam"),
    ],
    "about 24": ["setup_exam_many_310412"],
    "about 24, all draws": [
        *("setup_exam_many_310412", "setup_exam_many_301154"),
        *("setup_exam_many_291877", "setup_exam_many_291204"),
    ],
}
_MOTION = {
    "newest draw": ["motion_exam_301457"],
    "all draws": [
        *("motion_exam_301457", "motion_exam_291123", "motion_exam_290365"),
        *("motion_exam_518330", "motion_exam_446962", "motion_exam_640917"),
    ],
}
"""Newest draws are small: beside them all that were scored, those of earlier code among them."""
_POSTURES = 10
"""Measured postures that correct a map."""


def tables() -> dict[str, Rows]:
    """By title, the heads first."""
    return {
        "Discovery": _discovery(),
        "Many effects": _many(),
        "Set-up": _set_up(),
        "Motion": _motion(),
        "Other exams": _others(),
    }


def _read(name: str) -> Any:
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


def _of(right: int, count: int) -> str:
    return f"{right} of {count}"


def _seconds(seconds: list[float]) -> str:
    return f"{median(seconds):.0f} ({max(seconds):.0f})"


def _discovery() -> Rows:
    rows = [["Tests", "Number", "Effects named", "False names", "Nulls right", "Stiffnesses inside"]]
    rows[0] += ["Gap before, after", "Seconds", "Stored as"]
    for tests, name in _FEW.items():
        cases = list(_read(name).values())
        hidden, nulls = [one for one in cases if one["truth"]], [one for one in cases if not one["truth"]]
        found = sum(len({*one["truth"]} & {*one["named"]}) for one in hidden)
        gaps = [median(one[f"gap_{when}"] for one in hidden) for when in ("before", "after")]
        rows.append(
            [
                tests,
                str(len(cases)),
                _of(found, sum(len(one["truth"]) for one in hidden)),
                str(sum(one["false_additions"] for one in cases)),
                _of(sum(one["right"] for one in nulls), len(nulls)),
                _of(*(sum(one[f"stiffness_{what}"] for one in cases) for what in ("held", "told"))),
                f"{gaps[0]:.1f}, {gaps[1]:.2f}",
                _seconds([one["seconds"] for one in cases]),
                f"`{name}`",
            ]
        )
    for dirt, cases in _halls().items():
        seen = [(name in one["not named"]) for one in cases for name in _seen(one)]
        rows.append(
            [
                f"about 24 effects each, `{dirt}`",
                str(len(cases)),
                _of(seen.count(False), len(seen)),
                str(sum(len(one["false"]) for one in cases)),
                "no nulls",
                _of(*(sum(one["stiffness_held"][n] for one in cases) for n in (0, 1))),
                "{:.1f}, {:.2f}".format(*(median(one["gap"][n] for one in cases) for n in (0, 1))),
                _seconds([one["seconds"] for one in cases]),
                f"`{_MANY}`",
            ]
        )
    return rows


def _halls() -> dict[str, list[dict[str, Any]]]:
    """Cases of arms with many effects by what is stated of them."""
    stored = _read(_MANY)
    return {
        dirt: [one for name, one in stored["cases"].items() if name.startswith(dirt)]
        for dirt in stored["seeds"]
    }


def _seen(case: dict[str, Any]) -> list[str]:
    return [name for name, moved in case["importance"].items() if moved > _SEEN]


def _many() -> Rows:
    """What is worth knowing of arms with many effects beyond their row."""
    rows = [["Uncertainty", "Top three", "FRFs", "Frequencies", "Median stiffness", "Worst stiffness"]]
    for dirt, cases in _halls().items():
        off = [abs(one) for case in cases for one in case["stiffness_error_percent"]]
        areas = [one for case in cases for one in case["unseen_area_percent"]]
        frequencies = [one for case in cases for one in case["unseen_frequency_percent"]]
        top = [case["three most important among first five"] == 3 for case in cases]
        rows.append(
            [
                dirt,
                _of(sum(top), len(top)),
                f"{median(areas):.1f} %",
                f"{median(frequencies):.2f} %",
                f"{median(off):.1f} %",
                f"{max(off):.0f} %",
            ]
        )
    return rows


def _set_up() -> Rows:
    rows = [
        ["Missing effects", "Mistakes named exactly", "Single", "Two at once", "Beside stated uncertainty"]
    ]
    rows[0] += ["Named in right set-ups", "Seconds", "Stored as"]
    for effects, names in _SET_UP.items():
        stored = [_read(name) for name in names]
        right, wrong, pairs, stated = (
            _summed([one["score"] for one in stored], *keys)
            for keys in (
                ("named in right ones", "right set-ups"),
                ("named exactly", "slips"),
                ("of two, named exactly", "of two"),
                ("of these, named exactly", "beside stated uncertainty"),
            )
        )
        single = (wrong[0] - pairs[0], wrong[1] - pairs[1])
        seconds = [row["seconds"] for one in stored for row in one["rows"]]
        counts = [_of(*one) for one in (wrong, single, pairs, stated, right)]
        rows.append([effects, *counts, _seconds(seconds), f"`{names[0]}`" if len(names) == 1 else ""])
    return rows


def _motion() -> Rows:
    rows = [["Draws", "Tests", "Effects named", "False names", "Nulls right", "Seconds", "Stored as"]]
    for draws, names in _MOTION.items():
        stored = [_read(name) for name in names]
        [done, false] = _summed(stored, "done", "false_names")
        false_nulls, nulls = _summed(stored, "false_in_nulls", "nulls")
        seconds = [one["seconds"] for s in stored for one in s["cases"]]
        counts = [str(done), _of(*_summed(stored, "named", "hidden")), str(false)]
        where = f"`{names[0]}`" if len(names) == 1 else ""
        rows.append([draws, *counts, _of(nulls - false_nulls, nulls), _seconds(seconds), where])
    return rows


def _others() -> Rows:
    """One line each of what other pages have in full."""
    files, journeys = _read("descriptions")["summary"], _read("mesh_bodies_journey")
    merged, drives = _read("merged_setups_931028"), _read("drives_90417")["score"]
    motors, inputs = _read("motor_side_50731")["score"], _read("wrong_inputs")["counts"]
    maps = [
        one
        for one in _read("map_unknown_20571")["summary"]
        if one["postures"] == "all joints" and one["at_hand"] == _POSTURES
    ]
    gears = motors["rz.stiffness"]
    corrected = (f"{o['quantity']} {100 * o['rms_before']:.2g} → {100 * o['rms_after']:.2g} %" for o in maps)
    inside = _of(sum(one["held"] for one in journeys), sum(one["of"] for one in journeys))
    noticed = inputs["refused"] + inputs["named"] + inputs["harmless"]
    return [
        ["Exam", "Result", "More"],
        [
            "`descriptions`: robot files of public repositories",
            f"{_of(files['load'], files['files'] - files['of_no_robot'])} that describe a robot load;"
            f" {files['crashes']} crashes",
            "[descriptions](descriptions.md#census)",
        ],
        [
            "`mesh_bodies`: bodies made from meshes",
            f"{inside} stiffness intervals contain the truth",
            "[mesh bodies](mesh_bodies.md#how-sure)",
        ],
        [
            f"`merged_setups --seed {merged['seed']}`: {merged['structures']} structures in"
            f" {merged['setups']} setups, roving sensors of 30 to 50 g",
            f"{merged['missed']} of {merged['modes']} modes missed, {merged['spurious']} spurious; intervals"
            f" contain {merged['frequencies in their 95 % interval, %']:.0f} % of frequencies and"
            f" {merged['damping in its 95 % interval, %']:.0f} % of damping ratios",
            "[several setups](modal_setups.md#seen)",
        ],
        [
            "`drives --seed 90417`: records of 25 drives of two inertias, five of them rigid",
            f"stiffness named in {_of(drives['stiffness_named'], drives['soft'])},"
            f" {drives['within_1_percent']} within 1 %; {drives['truth_in_interval']} intervals contain the"
            f" truth; {drives['false_names']} false names",
            "[recorded motion](recorded_motion.md)",
        ],
        [
            f"`motor_side --seed 50731`: controllers' logs of {motors['arms']} arms",
            f"intervals contain {_of(gears['held'], gears['values'])} gear stiffnesses, largest error"
            f" {100 * gears['largest_error']:.2f} %; gaps up to {motors['largest_gap']}",
            "[motors](motors.md)",
        ],
        [
            f"`map_unknown --seed 20571`: maps of 12 arms that lack an effect, corrected by {_POSTURES}"
            " measured postures",
            f"RMS errors at other postures: {', '.join(corrected)}",
            "[maps](unknown.md#what-it-gains)",
        ],
        [
            "`wrong_inputs`: mistakes of new users in files and options",
            f"{_of(noticed, sum(inputs.values()))} handled correctly at the first attempt",
            "[below](#mistakes-of-new-users)",
        ],
    ]


def _summed(scores: list[dict[str, int]], one: str, other: str) -> tuple[int, int]:
    return sum(s[one] for s in scores), sum(s[other] for s in scores)


if __name__ == "__main__":
    keep(NAME, tables())
