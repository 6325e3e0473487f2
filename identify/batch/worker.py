"""The worker process: `python -m identify.batch.worker MODULE` reads jobs as lines of JSON and answers each
with a line.

MODULE, of the first job, is imported before it is asked for, so that the time limit is for the job alone.

It ends when its input does, so that it does not outlive the process that started it, however that ended.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import queue
import signal
import sys
import threading
from importlib import import_module
from typing import Any, BinaryIO

from identify.batch.job import performed
from identify.core.threads import work_in
from identify.results.provenance import computing


def main() -> None:
    """Serve until the input ends."""
    signal.signal(
        signal.SIGINT, signal.SIG_IGN
    )  # Ctrl-C goes to a whole terminal; the parent decides what ends
    work_in(1)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not get between the answers
    with contextlib.suppress(ImportError):  # the job will say it
        import_module(sys.argv[1])
    lines: queue.Queue[bytes] = queue.Queue()
    threading.Thread(target=_listen, args=(sys.stdin.buffer, lines), daemon=True).start()
    _say(answers, {"ready": computing()})
    while True:
        asked = json.loads(lines.get())
        _say(answers, dataclasses.asdict(performed(**asked)))


def _listen(source: BinaryIO, lines: queue.Queue[bytes]) -> None:
    """Pass lines on; at the end of the input stop at once, in whatever the process is: nobody wants the
    answer.
    """
    for line in source:
        lines.put(line)
    os._exit(0)


def _say(answers: BinaryIO, what: dict[str, Any]) -> None:
    answers.write(json.dumps(what).encode() + b"\n")
    answers.flush()


if __name__ == "__main__":
    main()
