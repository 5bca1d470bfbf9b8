"""An option that takes every value up to the next option: `--validate A B C` is `--validate A --validate B --validate C`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from typer.core import TyperCommand


class ManyToValidate(TyperCommand):
    """A command whose --validate takes many values; what would else be read as recordings to fit on."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        return super().parse_args(ctx, list(repeated("--validate", args)))


def repeated(option: str, args: Sequence[str]) -> Iterator[str]:
    """`args` with `option` before each of the values that follow it."""
    values: int | None = None
    for arg in args:
        if arg.startswith("-"):
            name, equals, _value = arg.partition("=")
            values = len(equals) if name == option else None
        elif values is not None:
            values += 1
            if values > 1:
                yield option
        yield arg
