"""Fit elastic robot models to measured vibration.

The commands as functions: `identify.fit("config.yaml")`, `discover`, `modes`, `explain`, `excite`,
`simulate`, `batch`, `map_postures`, `stability`, `deflection`, `plan`, `export_model`, `read_result`; see
`identify.api.commands`, which is imported when one of them is first used, so that `import identify` itself
costs nothing.  `identify.cli` has the commands of the terminal.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from identify.core.version import VERSION

if TYPE_CHECKING:
    from identify.api.commands import (
        Result,
        batch,
        deflection,
        discover,
        excite,
        explain,
        export_model,
        fit,
        map_postures,
        modes,
        plan,
        read_result,
        simulate,
        stability,
    )
    from identify.core.errors import InputError, InputErrors

__version__ = VERSION
__all__ = [
    "InputError",
    "InputErrors",
    "Result",
    "batch",
    "deflection",
    "discover",
    "excite",
    "explain",
    "export_model",
    "fit",
    "map_postures",
    "modes",
    "plan",
    "read_result",
    "simulate",
    "stability",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'identify' has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415

    if name in ("batch", "excite", "explain", "modes"):  # packages that can be called
        return import_module(f"identify.{name}")
    return getattr(
        import_module("identify.core.errors" if "Error" in name else "identify.api.commands"), name
    )
