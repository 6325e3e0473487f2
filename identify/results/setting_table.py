"""Every setting of a run with its value and where the value came from: the config file and its line, the
command line, or a default.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from pydantic import BaseModel
from pydantic_core import to_jsonable_python

from identify.core.config import ConfigFile, FlatSettings
from identify.core.yaml_input import line_of, parse_yaml
from identify.results.tables import SettingTable

DEFAULT, COMMAND_LINE = "default", "command line"
Keys = tuple[str | int, ...]
Row = tuple[str, str, str]


def config_settings(file: ConfigFile[Any], filled: Mapping[str, Any] | None = None) -> SettingTable:
    """Every key of a config in the order of the schema, nested keys joined by points as in error messages.

    filled: what runs in place of keys that were not given, by key.
    """
    data = parse_yaml(file.text, str(file.path))
    found = {
        row[0]: row
        for row in _rows(file.study, (), lambda keys: f"{file.path.name}{line_of(data, list(keys))}")
    }
    defaults = {key: (key, _text(value), DEFAULT) for key, value in (filled or {}).items()}
    return _table({**found, **defaults, **_replaced(file.overrides)})


def option_settings(models: Mapping[str, BaseModel], given: Mapping[str, Any]) -> SettingTable:
    """Every key of settings that have no config file (by their prefix, which may be empty); given: those of
    the command line.
    """
    rows = (
        row
        for prefix, model in models.items()
        for row in _rows(model, (prefix,) if prefix else (), lambda keys: DEFAULT)
    )
    return _table({**{row[0]: row for row in rows}, **_replaced(given)})


def _replaced(overrides: Mapping[str, Any]) -> dict[str, Row]:
    return {key: (key, _text(value), COMMAND_LINE) for key, value in overrides.items()}


def _rows(model: BaseModel, above: Keys, given: Callable[[Keys], str] | None) -> Iterator[Row]:
    """Rows of a model and all below it; given: what the source of a given key is, None where all of the model
    is a default.
    """
    for name, field in type(model).model_fields.items():
        key = () if isinstance(model, FlatSettings) and name == model.INNER else (field.alias or name,)
        keys, source = (*above, *key), given if name in model.model_fields_set else None
        yield from _value(getattr(model, name), keys, source)


def _value(value: Any, keys: Keys, given: Callable[[Keys], str] | None) -> Iterator[Row]:
    if isinstance(value, BaseModel):
        yield from _rows(value, keys, given)
    elif isinstance(value, (list, tuple)) and any(isinstance(entry, BaseModel) for entry in value):
        for number, entry in enumerate(value):
            yield from _value(entry, (*keys, number), given)
    else:
        yield ".".join(map(str, keys)), _text(value), DEFAULT if given is None else given(keys)


def given_of(model: BaseModel) -> dict[str, Any]:
    """What was given of a model and of those in it."""
    given: dict[str, Any] = {}
    for name in (name for name in type(model).model_fields if name in model.model_fields_set):
        value = getattr(model, name)
        plain = given_of(value) if isinstance(value, BaseModel) else value
        given |= plain if isinstance(model, FlatSettings) and name == model.INNER else {name: plain}
    return given


def _text(value: Any) -> str:
    """A value as it would stand in a config, in a line."""
    plain = to_jsonable_python(value)
    return plain if isinstance(plain, str) else json.dumps(plain, ensure_ascii=False)


def _table(rows: Mapping[str, Row]) -> SettingTable:
    return SettingTable(*(tuple(column) for column in zip(*rows.values(), strict=True)))
