"""Signals ask; work looks."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from identify.core.interruption import Interrupted, check, listening


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_heard_at_the_next_look_only(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with listening():
        check()
        signal.raise_signal(number)
        with pytest.raises(Interrupted):
            check()
    check()
    assert signal.getsignal(number) is before


def test_the_second_signal_ends_the_process_at_once() -> None:
    code = (
        "import signal\nfrom identify.core.interruption import listening\n"
        "with listening('said'):\n"
        "    signal.raise_signal(signal.SIGINT); print('on', flush=True)\n"
        "    signal.raise_signal(signal.SIGINT)\n"
        "    print('never', flush=True)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "on\n", "\nsaid\n")
