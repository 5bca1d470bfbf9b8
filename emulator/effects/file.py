"""Reads and writes effects/1: the true effects of a plant, or the effects that a diagnosis added to a simulation."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from drivetwin.emulator.effects.base import Effect
from drivetwin.emulator.effects.library import library
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.text_files import parse_json


class _Value(BaseModel):
    value: FiniteFloat
    unit: str


class _Entry(BaseModel):
    effect: str
    axis: str
    parameters: dict[str, _Value]


class _File(BaseModel):
    model_config = ConfigDict(extra="ignore")

    schema_: Literal["effects/1"] = Field(alias="schema")
    effects: list[_Entry]


@dataclass(frozen=True)
class PlacedEffect:
    """An effect and the axis it acts on, with the units that its file states for each parameter."""

    axis: str
    effect: Effect
    units: dict[str, str]


def read_effects(path: Path) -> tuple[PlacedEffect, ...]:
    """Effects of an effects/1 file, in its order.

    Raises UserError naming the file and the entry for an unknown effect, one that stands twice on an axis, a missing,
    unknown or out-of-range parameter. Whether the units are those of the joint is for the plant to judge.
    """
    try:
        content = _File.model_validate(parse_json(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise UserError(f"no effects file {path}; give an effects/1 JSON file") from None
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path} is not JSON: {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ": ".join(filter(None, [str(path), ".".join(str(part) for part in first["loc"])]))
        raise UserError(f"{where}: {first['msg']} (expected format effects/1)") from None
    _refuse_twice(path, content.effects)
    return tuple(_place(path, number, entry) for number, entry in enumerate(content.effects))


def _refuse_twice(path: Path, entries: list[_Entry]) -> None:
    seen = set()
    for number, entry in enumerate(entries):
        if (entry.effect, entry.axis) in seen and not _several(entry.effect):
            raise UserError(f"{path}: effects[{number}]: {entry.effect} stands twice on axis {entry.axis!r}")
        seen.add((entry.effect, entry.axis))


def _several(name: str) -> bool:
    known = library()
    return name in known and known[name].several


def _place(path: Path, number: int, entry: _Entry) -> PlacedEffect:
    where = f"{path}: effects[{number}]"
    known = library()
    if entry.effect not in known:
        raise UserError(
            f"{where}: unknown effect {entry.effect!r}; the library has {', '.join(known)}; one of another's file needs its "
            "--effects-from"
        )
    kind = known[entry.effect]
    names = {parameter.name for parameter in kind.parameters}
    if unknown := set(entry.parameters) - names:
        raise UserError(f"{where}: {entry.effect} has no parameter {sorted(unknown)[0]!r}; it has {', '.join(sorted(names))}")
    for parameter in kind.parameters:
        given = entry.parameters.get(parameter.name)
        if given is not None and not parameter.low <= given.value <= parameter.high:
            raise UserError(f"{where}: {parameter.name} = {given.value} is outside {parameter.low} .. {parameter.high}")
    required = {field.name for field in fields(kind) if field.default is MISSING}
    if missing := required - set(entry.parameters):
        raise UserError(f"{where}: {entry.effect} needs {', '.join(sorted(missing))}")
    effect = kind(**{name: given.value for name, given in entry.parameters.items()})
    return PlacedEffect(entry.axis, effect, {name: given.unit for name, given in entry.parameters.items()})


def effects_payload(placed: Sequence[PlacedEffect]) -> dict[str, Any]:
    """effects/1 of these effects, every parameter with its unit."""
    return {"schema": "effects/1", "effects": [_entry(each) for each in placed]}


def _entry(placed: PlacedEffect) -> dict[str, Any]:
    parameters = {
        parameter.name: {"value": float(getattr(placed.effect, parameter.name)), "unit": placed.units[parameter.name]}
        for parameter in placed.effect.parameters
    }
    return {"effect": placed.effect.name, "axis": placed.axis, "parameters": parameters}
