"""The cases: a simulation as it stands, recordings, and what is known of the machine beyond the simulation."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import INSTALLED

EXTRA_LABELS = Path(__file__).with_name("extra_labels.json")


@dataclass(frozen=True)
class Lacking:
    """One effect that the simulation lacks; any of `others` is the same thing on these recordings."""

    effect: str
    axis: str
    others: tuple[str, ...] = ()

    @property
    def names(self) -> frozenset[str]:
        """All that it may be called."""
        return frozenset((self.effect, *self.others))


@dataclass(frozen=True)
class Label:
    """What is known: the effects that are lacking, what is no error besides, what is one."""

    effects: tuple[Lacking, ...]
    also: frozenset[str]
    must_not: frozenset[str]

    @property
    def strict(self) -> frozenset[str]:
        """The right first answers."""
        return frozenset(lacking.effect for lacking in self.effects)

    @property
    def accepted(self) -> frozenset[str]:
        """Every first answer that is no error."""
        return self.also.union(*(lacking.names for lacking in self.effects))

    @property
    def axes(self) -> frozenset[str]:
        """Where something is lacking; empty for a control."""
        return frozenset(lacking.axis for lacking in self.effects)


@dataclass(frozen=True)
class Import:
    """`drivetwin import` of `files` by `map`, into the folder `to`."""

    files: tuple[Path, ...]
    map: Path
    to: Path


@dataclass(frozen=True)
class Case:
    """One call of `drivetwin diagnose` and what is right to say; `imports` come first."""

    name: str
    model: Path
    training: tuple[Path, ...]
    validation: tuple[Path, ...]
    label: Label
    imports: tuple[Import, ...] = ()

    @property
    def machine(self) -> str:
        """As the recordings name it; they exist."""
        told = json.loads((self.training[0] / "recording.json").read_text(encoding="utf-8"))
        return str(told["machine"])


def read_cases(data: Path, inputs: Path) -> list[Case]:
    """All cases below `data`; recordings that are imported first go below `inputs`.

    Raises UserError where a folder or file of the data is missing.
    """
    labels = _read_json(data / "measured" / "labels.json")
    folders = [_labelled(data / "measured" / name, told) for name, told in labels.items()]
    extra = _read_json(EXTRA_LABELS)
    return [*folders, *(_imported(name, told, data, inputs / name) for name, told in extra.items())]


def read_label(told: Mapping[str, Any]) -> Label:
    """One entry of labels.json."""
    effects = tuple(Lacking(one["effect"], one["axis"], tuple(one.get("or", ()))) for one in told["effects"])
    return Label(effects, frozenset(told["also"]), frozenset(told["must_not"]))


def _labelled(folder: Path, told: Mapping[str, Any]) -> Case:
    training, validation = (tuple(sorted(folder.glob(f"{kind}*"))) for kind in ("train", "validate"))
    if not training or not validation:
        raise UserError(f"{folder} lacks recordings: expected train_*/ and validate*/, as README.md of the data says")
    return Case(folder.name, folder / "nominal.xml", training, validation, read_label(told))


def _imported(name: str, told: Mapping[str, Any], data: Path, inputs: Path) -> Case:
    imports = tuple(
        Import(_found(data, each["files"]), INSTALLED / each["map"], inputs / each["to"]) for each in told["imports"]
    )
    training, validation = (tuple(inputs / each for each in told[kind]) for kind in ("train", "validate"))
    return Case(name, INSTALLED / told["model"], training, validation, read_label(told), imports)


def _found(data: Path, patterns: Sequence[str]) -> tuple[Path, ...]:
    files = tuple(file for pattern in patterns for file in sorted(data.glob(pattern)))
    if not files:
        raise UserError(f"no file {data / patterns[0]}: --data is the folder that holds measured/, emps/, epos_screw_drive_1/")
    return files


def _read_json(file: Path) -> dict[str, Any]:
    try:
        told: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError(f"no file {file}: --data is the folder that holds measured/labels.json") from None
    return told
