"""Settings that a config writes in one mapping with those of something they hold."""

from __future__ import annotations

from typing import Any, ClassVar, Self

from pydantic import BaseModel, GetJsonSchemaHandler, ValidationError
from pydantic_core import CoreSchema, InitErrorDetails

from identify.core.config import Settings


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
