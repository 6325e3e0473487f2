"""FMI is refused, by name and with the reason."""

from __future__ import annotations

from typing import ClassVar

from identify.core.errors import InputError
from identify.export.base import Exported, Format, Job


class Fmu(Format):
    """A unit for model exchange is a zip with a compiled library for each system on which it is to run."""

    suffix: ClassVar[str] = ".fmu"

    def write(self, job: Job) -> Exported:
        """InputError always."""
        raise InputError(
            "--to",
            "fmu, which holds a library compiled for each system that it is to run on",
            "a format that needs no compiler",
            "use `--to mat` and let Simulink or OpenModelica make the FMU (docs/export.md)",
        )
