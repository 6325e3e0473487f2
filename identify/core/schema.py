"""The schema of a config for people and editors, as JSON Schema with the plug points' own keys filled in."""

from __future__ import annotations

from collections.abc import Sequence
from inspect import cleandoc
from typing import Any

from pydantic import BaseModel
from pydantic_core import to_jsonable_python

from identify.core.analyses import Analysis
from identify.core.config import FlatSettings, models_in
from identify.core.registry import Registry, load


def config_schema(analysis: Analysis) -> dict[str, Any]:
    """JSON Schema of the config of an analysis; keys that name a registered kind list the schema of each."""
    study: type[BaseModel] = load(analysis.study)
    schema = study.model_json_schema(by_alias=True)
    for key, plug in analysis.plugs.items():
        holders = models_in(study.model_fields[key].annotation)
        schema["properties"][key]["kinds"] = _kinds(load(plug), holders, f"#/properties/{key}/kinds")
    for settings in schema.get("$defs", {}).values():
        if "kind" in settings.get("properties", {}):
            settings["properties"]["kind"].setdefault("description", "which of these")
    plain: dict[str, Any] = to_jsonable_python(schema, inf_nan_mode="strings")  # JSON has no infinity
    return plain


def _kinds(registry: Registry, holders: Sequence[type[BaseModel]], where: str) -> dict[str, Any]:
    """The schema of every registered kind that a key takes.

    holders: the settings that the key holds, any of them, of `FlatSettings` those beside the settings of a
    kind; none where the key names kinds that have no settings.
    """
    kinds = registry.usable()
    if not holders:
        return {name: {"description": cleandoc(kind.__doc__ or "")} for name, kind in kinds.items()}
    holder, inner = holders[0], list(holders)
    if issubclass(holder, FlatSettings):
        inner = models_in(holder.model_fields[holder.INNER].annotation)
    found = {}
    for name in (name for name, kind in kinds.items() if issubclass(kind, tuple(inner))):
        found[name] = _schema(kinds[name], f"{where}/{name}")
        found[name]["properties"]["kind"].setdefault("description", f"which {registry.what}")
        if holder not in inner:
            beside = _schema(holder, f"{where}/{name}")
            found[name]["properties"] |= beside["properties"]
            found[name].setdefault("$defs", {}).update(beside.get("$defs", {}))
    return found


def _schema(model: type[BaseModel], where: str) -> dict[str, Any]:
    """The schema of a model that is to stand at a place in another one, to which its references point."""
    return model.model_json_schema(by_alias=True, ref_template=f"{where}/$defs/{{model}}")
