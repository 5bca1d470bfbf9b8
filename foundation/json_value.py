"""What a file says beyond what its contract knows: kept, in the values that JSON has."""

from __future__ import annotations

import math
from datetime import date
from typing import Annotated, Any

from pydantic import AfterValidator


def json_value(value: object) -> object:
    """A value of a YAML or JSON document as JSON has it: a date as ISO text, a tuple as a list.

    Raises ValueError for a number that is not finite, for a key that is no text, and for what JSON has not (bytes, sets).
    """
    match value:
        case None | bool() | int() | str():
            return value
        case float():
            if not math.isfinite(value):
                raise ValueError(f"{value} is not a finite number")
            return value
        case date():
            return value.isoformat()
        case list() | tuple():
            return [json_value(each) for each in value]
        case dict():
            return {_key(key): json_value(each) for key, each in value.items()}
    raise ValueError(f"a {type(value).__name__} cannot be kept; write text, a number, a list or keys with values")


def _key(key: object) -> str:
    if not isinstance(key, str):
        raise ValueError(f"the key {key!r:.40} is not text; put it in quotes")
    return key


JsonValue = Annotated[Any, AfterValidator(json_value)]
"""A field of a pydantic model that takes any value which JSON has."""
