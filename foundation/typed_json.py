"""JSON files that a command of the product wrote, read into typed values; errors name the file and the key."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from drivetwin.foundation.errors import UserError

Model = TypeVar("Model", bound=BaseModel)


def read_json(kind: type[Model], path: Path, schema: str, written_by: str, *, strict: bool = False) -> Model:
    """The file as a value of a `schema`, named with its version; `written_by`: the command that writes it, and as what.

    Raises UserError where the file cannot be read, or names the first key that is missing or wrong.
    """
    try:
        return kind.model_validate_json(path.read_bytes(), strict=strict)
    except FileNotFoundError:
        raise UserError(f"no file {path}; {written_by}") from None
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        message = first["msg"].removeprefix("Value error, ")
        raise UserError(f"{path} is not a valid {schema} file: {where}: {message}") from None
