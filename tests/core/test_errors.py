"""What a user is told stays one sentence, however long the line that was found."""

from __future__ import annotations

from identify.core.errors import InputError


def test_what_was_found_is_told_whole_unless_it_is_a_damaged_file() -> None:
    short = InputError("data.uff, line 3", "record 6 'abc' is not in its columns", "a record", "export again")
    assert str(short) == (
        "data.uff, line 3: record 6 'abc' is not in its columns; expected a record; export again."
    )
    long = str(
        InputError("data.uff, line 3", f"record 6 {'x' * 200_000!r} is not in its columns", "a record")
    )
    assert len(long) < 1_200
    assert long.startswith("data.uff, line 3: record 6 'xxx")
    assert long.endswith("xxx' is not in its columns; expected a record.")
