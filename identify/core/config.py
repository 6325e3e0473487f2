"""A config read into settings: every error with its key, its line and a fix, all at once.

`FlatSettings` are those that a config writes in one mapping with those of something they hold.
"""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from inspect import isabstract
from math import isnan
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, ValidationError, model_validator
from pydantic_core import CoreSchema, InitErrorDetails

from identify.core.analyses import ANALYSES
from identify.core.errors import InputError, InputErrors
from identify.core.text_input import read_text
from identify.core.yaml_input import leaves, line_of, parse_yaml

S = TypeVar("S", bound=BaseModel)
_PLAIN = {"a valid tuple": "a list", "a valid list": "a list", "a valid dictionary": "keys and values"}
"""Words of Python for what a config may hold, and those of YAML."""


def without_old_keys(renamed: Mapping[str, str], data: Any) -> Any:
    """The data of a config, for a validator; ValueError for a key that is called something else now."""
    for old, new in renamed.items():
        if isinstance(data, Mapping) and old in data:
            raise ValueError(f"{old}: an old name; expected `{new}`: rename the key")
    return data


class Settings(BaseModel):
    """A part of the config; keys that do not exist are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)
    RENAMED: ClassVar[Mapping[str, str]] = {}
    """Keys of older versions and what they are called now."""

    @model_validator(mode="before")
    @classmethod
    def _no_old_key(cls, data: Any) -> Any:
        return without_old_keys(cls.RENAMED, data)


class ConfigFile(Settings, Generic[S]):
    """A study with the file it came from: text and sha256 go into the result, paths in it are relative to its
    folder.
    """

    path: Path
    text: str
    sha256: str
    study: S
    overrides: dict[str, Any] = {}
    """What the command line said in place of keys of the study, by key."""

    @classmethod
    def of(cls, path: Path, study: S, text: str) -> Self:
        """A study, the text that says it, and where that is."""
        return cls(path=path, text=text, sha256=hashlib.sha256(text.encode()).hexdigest(), study=study)

    def resolve(self, path: Path) -> Path:
        """A path of the config, relative to the config's folder."""
        return self.path.parent / path

    @contextmanager
    def located(self) -> Iterator[None]:
        """Errors about keys of the config, such as `effects.2.link`, name the file and the line too."""
        try:
            yield
        except InputError as error:
            raise self.at_its_line(error) from error
        except InputErrors as several:
            raise InputErrors([self.at_its_line(error) for error in several.errors]) from several

    def at_its_line(self, error: InputError) -> InputError:
        """The same error with file and line of the key that it is about, or that names the file that it is
        about.
        """
        data = parse_yaml(self.text, str(self.path))
        keys = [int(key) if key.isdigit() else key for key in error.where.split(".")]
        if not isinstance(data, dict):
            return error
        if keys[0] in data:
            where = f"{self.path}{line_of(data, keys)}: {error.where}"
            return InputError(where, error.found, error.expected, error.fix)
        for named, text in leaves(data, str):
            if error.where in (str(self.resolve(Path(text))), text):
                key = ".".join(map(str, named))
                where = f"{error.where} ({key} in {self.path}{line_of(data, named)})"
                return InputError(where, error.found, error.expected, error.fix)
        return error


def family_of(path: Path) -> str:
    """The family of schemas that a config says it is of, such as `identify-motion`; empty where it says
    none.
    """
    data, _ = read_yaml(path)
    return str(data.get("schema", "")).partition("/")[0] if isinstance(data, dict) else ""


def read_settings(path: Path, kind: type[S], schema: str) -> tuple[S, str]:
    """The settings of that kind in a YAML file, whose `schema:` is to be `schema`, and its text; raises as
    `read_study` does.
    """
    data, text = read_yaml(path)
    if not isinstance(data, dict):
        raise InputError(
            str(path),
            "not a mapping of keys",
            f"`schema: {schema}` and the other keys",
            "see `identify config`",
        )
    _check_family(path, data, schema)
    return validated(path, data, kind), text


def _check_family(path: Path, data: Mapping[str, Any], schema: str) -> None:
    """Raise an InputError for a config of another kind of study, all of whose keys would be unknown."""
    said = str(data.get("schema", ""))
    other = next((one for one in ANALYSES if one.study and one.family == said.partition("/")[0]), None)
    if other is not None and other.schema != schema:
        fix = f"use `identify {next(iter(other.runs))}`" if other.runs else ""
        where = f"{path}{line_of(data, ['schema'])}: schema"
        raise InputError(where, f"{said!r}, {other.takes}", repr(schema), fix)


def validated(path: Path, data: Any, kind: type[S]) -> S:
    """Settings of that kind from the data of a config; raises InputErrors with every key that is wrong, and
    its line.
    """
    try:
        return kind.model_validate(_read_as(path, data))
    except ValidationError as error:
        raise InputErrors([_input_error(path, data, fault, kind) for fault in error.errors()]) from error


def _read_as(path: Path, data: Any) -> Any:
    """The data with truth values as text, since pydantic takes `true` for the number 1; InputError for what
    is no number.
    """
    nowhere = next((keys for keys, value in leaves(data, float) if isnan(value)), None)
    if nowhere is not None:
        where = f"{path}{line_of(data, nowhere)}: {'.'.join(map(str, nowhere))}"
        raise InputErrors([InputError(where, "found .nan", "a number")])
    return _in_words(data)


def _in_words(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {key: _in_words(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_in_words(value) for value in data]
    return str(data).lower() if isinstance(data, bool) else data


def read_yaml(path: Path) -> tuple[Any, str]:
    """What a YAML file holds, and its text; raises InputError for one that cannot be read or is no YAML."""
    text = read_text(path, "a config file", fix="write one with `identify init`")
    return parse_yaml(text, str(path), "`key: value` lines"), text


def _input_error(path: Path, data: Any, fault: Any, kind: type[BaseModel]) -> InputError:
    """A pydantic error as a sentence with the key and its line."""
    keys = _keys(data, fault["loc"])
    where = f"{path}{line_of(data, keys)}: {'.'.join(map(str, keys)) or 'config'}"
    if fault["type"] == "extra_forbidden":
        known = [field.alias or name for name, field in _fields_at(kind, keys[:-1]).items()]
        near = difflib.get_close_matches(str(keys[-1]), known, n=1)
        fix = f"did you mean `{near[0]}`?" if near else "remove it"
        return InputError(where, "unknown key", "one of " + ", ".join(known) if known else "a known key", fix)
    if fault["type"] == "missing":
        return InputError(where, "missing", "a value", "see `identify config` for what it means")
    if fault["type"] == "value_error":
        return InputError(where, str(fault["ctx"]["error"]).rstrip("."))
    expected = fault["msg"].removeprefix("Input should be ")
    for python, plain in _PLAIN.items():
        expected = expected.replace(python, plain)
    expected = expected[:1].lower() + expected[1:]
    if fault["input"] is None:
        return InputError(where, "not filled in", expected)
    return InputError(where, f"found {_found(fault['input'])}", expected)


def _found(value: Any) -> str:
    """A value of a config in words of YAML."""
    if isinstance(value, Mapping):
        return "keys (" + ", ".join(map(str, value)) + ")"
    return "a list" if isinstance(value, list) else repr(value)


def _keys(data: Any, location: Sequence[Any]) -> list[Any]:
    """Where in the data a fault is: without the class names that stand for the members of unions."""
    keys, here = [], data
    for key in location:
        inside = isinstance(here, Mapping) and key in here
        if inside or not (isinstance(key, str) and key[:1].isupper()):
            keys.append(key)
            inside |= isinstance(here, list) and isinstance(key, int) and key < len(here)
            here = here[key] if inside else None
    return keys


def _fields_at(kind: type[BaseModel], keys: list[Any]) -> dict[str, Any]:
    """The fields that are known where an unknown key was found; empty inside plug points, whose errors name
    them.
    """
    models: list[type[BaseModel]] = [kind]
    for key in (key for key in keys if isinstance(key, str)):
        models = [
            inner
            for model in models
            if key in model.model_fields
            for inner in models_in(model.model_fields[key].annotation)
        ]
    known = [model for model in models if not isabstract(model) and not getattr(model, "INNER", "")]
    return {name: field for model in known for name, field in model.model_fields.items()}


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """The settings models that a field's type mentions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in models_in(part)]


class FlatSettings(BaseModel):
    """Settings whose keys stand beside those of the settings in their field `INNER`, as a stage beside its
    optimizer.
    """

    model_config = Settings.model_config
    INNER: ClassVar[str]

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Without the inner settings, whose keys are those of a registered kind (`identify.core.schema`)."""
        schema: dict[str, Any] = handler.resolve_ref_schema(handler(core_schema))
        schema["properties"].pop(cls.INNER)
        schema["required"] = [key for key in schema["required"] if key != cls.INNER]
        return schema

    @classmethod
    def parse(cls, data: Any) -> Self:
        """The settings from one mapping, or from the name of what they hold.

        Raises ValueError for pydantic to report, every wrong key under its own name.
        """
        if isinstance(data, cls):
            return data
        own = {key for key in cls.model_fields if key != cls.INNER}
        if not isinstance(data, dict):
            data = {"kind": data} if isinstance(data, str) else {}
        held = {key: value for key, value in data.items() if key not in own}
        try:
            return cls.model_validate({**{key: data[key] for key in data if key in own}, cls.INNER: held})
        except ValidationError as error:
            raise ValidationError.from_exception_data(error.title, _flattened(error, cls.INNER)) from None


def _flattened(error: ValidationError, inner: str) -> list[InitErrorDetails]:
    """The faults of an error, those of the inner settings where the config has their keys."""
    return [
        InitErrorDetails(
            type=fault["type"],
            loc=fault["loc"][1:] if fault["loc"][:1] == (inner,) else fault["loc"],
            input=fault["input"],
            ctx=fault.get("ctx", {}),
        )
        for fault in error.errors()
    ]
