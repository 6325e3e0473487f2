"""What was made last is made anew only of other objects."""

from __future__ import annotations

import pickle

import numpy as np

from identify.core.latest import Latest, LatestAt


def test_one_that_is_compared_with_many_others_is_made_once() -> None:
    latest, asked = Latest[list[str]](2), list[str]()
    one, other, third = ["one"], ["other"], ["third"]

    def of(*things: list[str]) -> list[str]:
        def make() -> list[str]:
            asked.append("+".join(thing[0] for thing in things))
            return [asked[-1]]

        return latest.of(things, make)

    for thing in (one, other, one, third, one):
        assert of(thing) == thing
    assert asked == ["one", "other", "third"]
    of(other)
    assert asked[-1] == "other", "only two are kept"
    assert of(["other"]) == ["other"]
    assert len(asked) == 5, "what is equal is another object"
    of(one, other)
    assert asked[-1] == "one+other"


def test_at_the_same_values_it_is_made_once_and_at_others_anew() -> None:
    latest, asked = LatestAt[float](), list[float]()

    def total(values: np.ndarray) -> float:
        asked.append(float(values.sum()))
        return asked[-1]

    values = np.array([1.0, 2.0])
    assert [latest.of(values, total), latest.of(values.copy(), total)] == [3.0, 3.0]
    assert asked == [3.0]
    values[0] = 5.0
    assert latest.of(values, total) == 7.0
    assert pickle.loads(pickle.dumps(latest)).of(values, total) == 7.0
    assert asked == [3.0, 7.0, 7.0], "another process makes it itself"
