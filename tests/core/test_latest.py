"""What was made last is made anew only of other objects."""

from __future__ import annotations

import pickle

import numpy as np

from identify.core.latest import Latest, LatestAt, LatestLike


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


def test_of_equal_contents_it_is_made_once_unless_they_are_large() -> None:
    latest, asked = LatestLike[float](2, largest=40), list[float]()

    def total(values: np.ndarray, more: str = "") -> float:
        def make() -> float:
            asked.append(float(values.sum()))
            return asked[-1]

        return latest.of((values, more), make)

    values = np.arange(4.0)
    assert [total(values), total(values.copy()), total(values[::1])] == [6.0] * 3
    assert len(asked) == 1
    assert total(values, "more") == 6.0
    assert total(values.reshape(2, 2)) == 6.0
    assert len(asked) == 3, "another name, another shape"
    values[0] = 5.0
    assert total(values) == 11.0
    assert total(values[::-1]) == 11.0, "of any layout"
    large = np.ones(6)
    assert [total(large), total(large)] == [6.0, 6.0]
    assert asked[-2:] == [6.0, 6.0], "is not kept"
