"""YAML files that a person wrote, read into typed values; errors name the file and the key."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.text_files import parse_yaml


class Strict(BaseModel):
    """A mapping whose keys are all known, and whose numbers are finite."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Model = TypeVar("Model", bound=Strict)


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping of a YAML file. Raises UserError where it cannot be read, or is none."""
    try:
        content = parse_yaml(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError(f"{path} does not exist: give the path of a YAML file") from None
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise UserError(f"{path} is not YAML: {error}") from None
    if not isinstance(content, dict):
        raise UserError(f"{path} is not a mapping of keys to values; expected a first line like 'format: ...'")
    return content


def typed(kind: type[Model], content: dict[str, Any], path: Path) -> Model:
    """The content as a value. Raises UserError naming the first key that is missing, unknown or wrong."""
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        if first["type"] == "extra_forbidden":
            message = f"is not a known key; there are {', '.join(_keys_at(kind, first['loc'][:-1]))}"
        raise UserError(f"{path}: {where}: {message}") from None


def _keys_at(kind: type[BaseModel], way: tuple[int | str, ...]) -> list[str]:
    """The keys that the model knows at the end of a way through its fields."""
    for step in way:
        field = kind.model_fields.get(str(step))  # none: the key of a mapping, or a number in a list
        kind = (None if field is None else _model_in(field.annotation)) or kind
    return sorted(field.alias or name for name, field in kind.model_fields.items())


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The first model that an annotation is, or that its mapping, list or union holds."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for inner in get_args(annotation) if (found := _model_in(inner)) is not None), None)
