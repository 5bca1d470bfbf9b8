"""Finds every fault of this folder, so that adding a fault is adding a file, and reads one of a scenario or a command line."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from dataclasses import MISSING, fields
from inspect import isabstract
from pathlib import Path
from types import ModuleType

from drivetwin.emulator.faults.base import Fault
from drivetwin.foundation.errors import UserError

_NOT_FAULTS = {"base", "frame_fault", "library", "parameter", "restart"}


def _faults_in(module: ModuleType) -> list[type[Fault]]:
    return [
        kind
        for kind in vars(module).values()
        if isinstance(kind, type) and issubclass(kind, Fault) and not isabstract(kind) and kind.__module__ == module.__name__
    ]


def _every_fault() -> dict[str, type[Fault]]:
    folder = pkgutil.iter_modules([str(Path(__file__).parent)])
    names = [info.name for info in folder if info.name not in _NOT_FAULTS]
    modules = [importlib.import_module(f"drivetwin.emulator.faults.{name}") for name in names]
    return {fault.name: fault for module in modules for fault in _faults_in(module)}


FAULTS: Mapping[str, type[Fault]] = _every_fault()
"""Every fault by its name."""


def read_fault(given: Mapping[str, object]) -> Fault:
    """The fault that `given` names under `fault`, with its parameters beside it; None stands for a default.

    Raises UserError for an unknown fault, and for a missing, unknown or out-of-range parameter. Whether the machine has the
    node says `Fault.axes`.
    """
    name = given.get("fault")
    if not isinstance(name, str) or name not in FAULTS:
        raise UserError(f"unknown fault {name!r}; there are {', '.join(FAULTS)}")
    kind = FAULTS[name]
    told = {key: value for key, value in given.items() if key != "fault" and value is not None}
    known = {parameter.name: parameter for parameter in kind.parameters}
    if unknown := set(told) - set(known):
        raise UserError(f"{name} has no parameter {sorted(unknown)[0]!r}; it has {', '.join(known)}")
    values = {}
    for key, value in told.items():
        try:
            values[key] = known[key].read(value)
        except ValueError:
            raise UserError(f"{name}: {key} is {value!r}, expected {known[key].expected}") from None
    if missing := required(kind) - set(values):
        raise UserError(f"{name} needs {', '.join(sorted(missing))}")
    return kind(**values)  # type: ignore[arg-type]  # the parameters read what the fields are


def required(kind: type[Fault]) -> set[str]:
    """Names of the parameters that have no default."""
    return {field.name for field in fields(kind) if field.default is MISSING}
