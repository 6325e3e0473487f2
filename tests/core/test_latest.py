"""What was made last is made anew only of other objects."""

from __future__ import annotations

from identify.core.latest import Latest


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
