"""All faults, one file each in this folder and those of packages; and how a scenario or a command line names one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache

from drivetwin.emulator.faults.base import Fault, LastingFault
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.plugins import Plugins


def _flaw(kind: type[Fault]) -> str | None:
    parameters = [parameter.name for parameter in getattr(kind, "parameters", ())]
    own = [field.name for field in fields(kind)]
    if parameters == own:
        return None
    return f"parameters: {', '.join(parameters) or 'none'}; expected its fields: {', '.join(own)}"


FAULTS: Plugins[Fault] = Plugins("fault", Fault, "drivetwin.emulator.faults", "drivetwin.faults", "docs/faults.md", flaw=_flaw)


@cache
def library() -> Mapping[str, type[Fault]]:
    """Every fault by its name."""
    return FAULTS.found()


def read_fault(given: Mapping[str, object]) -> Fault:
    """The fault that `given` names under `fault`, with its parameters beside it; None stands for a default.

    Raises UserError for an unknown fault, and for a missing, unknown or out-of-range parameter. Whether the machine has the
    node says `Fault.axes`.
    """
    name = given.get("fault")
    if not isinstance(name, str) or name not in library():
        raise UserError(f"unknown fault {name!r}; there are {', '.join(library())}")
    kind = library()[name]
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


def described(kind: type[Fault]) -> dict[str, object]:
    """What a fault is and takes, for a program: as JSON's types."""
    defaults = {field.name: field.default for field in fields(kind)}
    needed = {parameter.name: defaults[parameter.name] is MISSING for parameter in kind.parameters}
    return {
        "lasts": issubclass(kind, LastingFault),
        "summary": " ".join((kind.__doc__ or "").split()),
        "parameters": {
            parameter.name: {
                "needed": needed[parameter.name],
                "default": None if needed[parameter.name] else defaults[parameter.name],
                "meaning": parameter.meaning,
                "expected": parameter.expected,
            }
            for parameter in kind.parameters
        },
    }
