"""The config's schema for people and editors: the JSON Schema of `Study` with the plug points' own keys
filled in.
"""

from __future__ import annotations

from typing import Any

from pydantic_core import to_jsonable_python

from identify.fitting.optimizers.base import OPTIMIZERS
from identify.model.effects.base import EFFECTS
from identify.motion.controller import CONTROLLERS
from identify.motion.study import MotionStudy
from identify.vibration.costs.base import COSTS
from identify.vibration.study import Study


def study_schema() -> dict[str, Any]:
    """JSON Schema of a study; `effects`, `cost` and `optimizer` list the schema of every registered kind."""
    schema = Study.model_json_schema(by_alias=True)
    for key, registry in (("effects", EFFECTS), ("cost", COSTS), ("optimizer", OPTIMIZERS)):
        kinds = {name: registry.get(name).model_json_schema() for name in registry.names()}
        schema["properties"][key]["kinds"] = kinds
    return schema


def motion_schema() -> dict[str, Any]:
    """JSON Schema of a study of motion; `servo` and `optimizer` list the schema of every registered kind."""
    schema = MotionStudy.model_json_schema(by_alias=True)
    for key, registry in (("servo", CONTROLLERS), ("optimizer", OPTIMIZERS)):
        schema["properties"][key]["kinds"] = {
            name: registry.get(name).model_json_schema() for name in registry.names()
        }
    plain: dict[str, Any] = to_jsonable_python(
        schema, inf_nan_mode="strings"
    )  # JSON has no infinity, and limits default to it
    return plain
