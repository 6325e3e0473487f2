"""What a user says of an analysis of modes: settings from options and files, and the record of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from identify.core.errors import InputError
from identify.core.yaml_input import yaml_text
from identify.measured.frf_records import FrfFileOptions
from identify.modal.operational.settings import OperationalSettings
from identify.modal.settings import ModalSettings
from identify.results import tables
from identify.results.setting_table import option_settings

T = TypeVar("T", bound=BaseModel)


def file_options(**given: Any) -> FrfFileOptions:
    """Options of a data file from values that may be None; InputError for one that is not possible."""
    return checked(FrfFileOptions, given)


def operational_settings(**given: Any) -> OperationalSettings:
    """Settings of an analysis of responses alone; InputError for one that is not possible."""
    return checked(OperationalSettings, given)


def modal_settings(base: ModalSettings, given: dict[str, Any] | None) -> ModalSettings:
    """Settings with the given keys replaced; InputError for a value that is not possible."""
    return checked(ModalSettings, {**base.model_dump(), **(given or {})})


def checked(model: type[T], values: dict[str, Any]) -> T:
    """Settings from values; InputError for one that is not possible."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        fault = error.errors()[0]
        where = str(fault["loc"][0]) if fault["loc"] else "options"
        if fault["type"] == "value_error":
            raise InputError(where, str(fault["ctx"]["error"]).rstrip(".")) from error
        expected = fault["msg"].removeprefix("Input should be ")
        raise InputError(where, f"found {fault['input']!r}", expected[:1].lower() + expected[1:]) from error


def sources(
    file: FrfFileOptions,
    settings: ModalSettings,
    modal: dict[str, Any] | None,
    operational: OperationalSettings | None = None,
    scaled_by: Mapping[str, Any] | None = None,
    beside: Mapping[str, Any] | None = None,
) -> tables.SettingTable:
    """The settings of an analysis of a file, each with its source; operational: of one of responses alone,
    and what scales its shapes; beside: what else was said.
    """
    given = {
        **file.model_dump(exclude_defaults=True),
        **{f"modal.{key}": value for key, value in (modal or {}).items()},
        **(beside or {}),
    }
    if operational is None:
        return option_settings({"": file, "modal": settings}, given)
    more = operational.model_dump(exclude_unset=True)
    given |= {f"operational.{key}": value for key, value in more.items()}
    given |= {f"operational.{key}": value for key, value in (scaled_by or {}).items()}
    return option_settings({"": file, "modal": settings, "operational": operational}, given)


def asked(
    file: FrfFileOptions,
    settings: ModalSettings,
    geometry: Path | None,
    length_unit: str | None,
    operational: OperationalSettings | None = None,
    scaled_by: Mapping[str, Any] | None = None,
    beside: Mapping[str, Any] | None = None,
) -> str:
    """What was asked of a data file as YAML, with every setting of the analysis."""
    said: dict[str, Any] = {**file.model_dump(exclude_defaults=True), **(beside or {})}
    said |= {
        key: value
        for key, value in (("geometry", geometry and str(geometry)), ("length_unit", length_unit))
        if value is not None
    }
    if operational is not None:
        said["operational"] = {**operational.model_dump(mode="json"), **(scaled_by or {})}
    return yaml_text({**said, "modal": settings.model_dump(mode="json")})
