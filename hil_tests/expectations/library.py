"""Finds every expectation of this folder, so that adding a kind is adding a file."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from drivetwin.hil_tests.expectations.base import Expectation

_NOT_EXPECTATIONS = {"base", "library", "reading"}


@cache
def library() -> Mapping[str, type[Expectation]]:
    """Every expectation by its name."""
    folder = pkgutil.iter_modules([str(Path(__file__).parent)])
    names = [info.name for info in folder if info.name not in _NOT_EXPECTATIONS]
    modules = [importlib.import_module(f"drivetwin.hil_tests.expectations.{name}") for name in names]
    return {
        kind.name: kind
        for module in modules
        for kind in vars(module).values()
        if isinstance(kind, type) and issubclass(kind, Expectation) and kind.__module__ == module.__name__
    }
