"""Few lines are solved for, as the independent route of the tests does: here they go the way of many."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _as_of_many_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("identify.model.frf._SOLVED", 0)
