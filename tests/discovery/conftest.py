"""What tests of discovery share."""

from __future__ import annotations

import pytest

from identify.discovery import workbench
from identify.discovery.candidates import candidates
from identify.model.effects.base import Effect


@pytest.fixture
def small_catalogue(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the catalogue only a delay and what one joint may do are tried, so that what is tested of the loop
    is tested quickly; all of it is in tests/benchmarks/discovery.py.
    """

    def some(effect: Effect) -> bool:
        compliance = effect.kind == "joint-compliance" and " of joint 2 " in effect.sentence()
        return compliance or effect.kind == "time-delay"

    monkeypatch.setattr(
        workbench, "candidates", lambda *known: [effect for effect in candidates(*known) if some(effect)]
    )
