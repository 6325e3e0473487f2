"""All that the program imports at one time or another, for processes that are forked off one that has it: a
short command would spend most of its time on importing.
"""

from __future__ import annotations

import gc
import os
import pkgutil
from importlib import import_module

import identify
from identify.core.threads import work_in

os.environ.setdefault("MUJOCO_GL", "disable")  # as the program does
for _module in pkgutil.walk_packages(identify.__path__, "identify."):
    if not _module.name.endswith("__main__"):
        import_module(_module.name)
if "PYTEST_XDIST_WORKER" in os.environ:
    work_in(1)
gc.collect()
gc.freeze()  # what the collector does not look at is not copied for each process
