"""The process that reads files of strangers that libraries have to read: `python -m
identify.core.binary_child`.

Each line on its standard input asks for one file; the answer on its standard output is what `tree.pack`
makes.  Where the system has limits of memory and processor time, each request is bound by them; what breaks
the C libraries breaks this process, and the one that asked says so in a sentence.
"""

from __future__ import annotations

import json
import os
import signal
import struct
import sys
import zlib
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from identify.core.hdf5_tree import Refused, read_tree
from identify.core.tree import Group, pack

_DAMAGED = (
    *(OSError, EOFError, ValueError, TypeError, LookupError, RuntimeError, AttributeError, ArithmeticError),
    *(
        MemoryError,
        AssertionError,
        RecursionError,
        NotImplementedError,
        UnicodeError,
        struct.error,
        zlib.error,
    ),
)
"""What h5py, scipy and pymatreader raise on damaged files."""

_MAT = "identify.core.mat_tree:read_mat_tree"
"""What reads MATLAB files; imported when needed, because scipy takes a while."""
_WORDS = {"hdf5": "HDF5", "mat": "MATLAB", "made": "a description", "none": "nothing"}


def main() -> None:
    """Answer requests until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what libraries print is no answer
    for line in sys.stdin.buffer:
        request = json.loads(line)
        _limit(request["memory"], request["seconds"])
        answer, tree = _read(request)
        for piece in pack(answer, tree):
            answers.write(piece)
        answers.flush()


def _read(request: dict[str, Any]) -> tuple[dict[str, Any], Group | None]:
    path, form = Path(request["path"]), request["form"]
    try:
        if form == "none":
            return {}, None
        if form == "hdf5":
            return {}, read_tree(path, request["names"])
        maker, arguments = request.get("maker", _MAT), request.get("arguments", ())
        module, _, name = maker.partition(":")
        return {}, getattr(import_module(module), name)(path, *arguments)
    except Refused as refused:
        return {"place": refused.place, "found": refused.found}, None
    except MemoryError:
        found = f"unpacks to more than the {request['memory'] / 2**30:.1f} GiB that it may"
        return {"place": "", "found": found}, None
    except _DAMAGED as error:
        words = " ".join(str(error).split()) or type(error).__name__
        return {"place": "", "found": f"it cannot be read as {_WORDS[form]} ({words[:200]})"}, None


def _limit(memory: int, seconds: float) -> None:
    """Bytes of address space and seconds of processor time from now on."""
    if not find_spec("resource"):
        return  # Windows: the one that asks still limits the time
    resource = import_module("resource")
    used = resource.getrusage(resource.RUSAGE_SELF)
    processor = int(used.ru_utime + used.ru_stime + seconds) + 1
    for kind, limit in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, processor)):
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


if __name__ == "__main__":
    main()
