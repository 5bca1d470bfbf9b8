"""Every effect there is: one a file of this folder, and those of others, which stand in installed packages or in files."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

from drivetwin.emulator.effects.base import FAMILIES, DriveEffect, Effect, Parameter
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.plugins import Plugins


@dataclass(frozen=True)
class EffectFile:
    """A Python file with effects: its path, and its text, by which a process on another machine has the same."""

    path: str
    text: str

    @property
    def module(self) -> str:
        """Name under which it is imported."""
        return f"{Path(self.path).stem}_{sha256(self.text.encode()).hexdigest()[:12]}"


_added: list[EffectFile] = []


@cache
def library() -> Mapping[str, type[Effect]]:
    """Every effect class by its name: the product's own in the order of their names, then those of packages, then of files.

    Raises UserError for a package or a file that does not import, holds no effect, one that lacks something, or a name twice.
    """
    return EFFECTS.found((file.path, _of_file(file)) for file in _added)


def read_effect_file(path: Path) -> EffectFile:
    """Raises UserError where it cannot be read."""
    try:
        return EffectFile(str(path.absolute()), path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError(f"no file {path}; --effects-from takes a Python file that holds effects") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{path} cannot be read: {error}") from None


def add_effects(files: Iterable[EffectFile]) -> None:
    """From now on the library of this process has the effects of these files as well; what it has already stays once.

    Raises UserError as `library` does; the library then stays as it was.
    """
    before = list(_added)
    _added.extend(file for file in dict.fromkeys(files) if file not in before)
    library.cache_clear()
    try:
        library()
    except UserError:
        _added[:] = before
        library.cache_clear()
        raise


def added_effects() -> tuple[EffectFile, ...]:
    """The files that were added, for other processes to add."""
    return tuple(_added)


@cache
def _of_file(file: EffectFile) -> list[type[Effect]]:
    """Executed once a process, so that a class stays itself."""
    module = ModuleType(file.module)
    module.__file__ = file.path
    sys.modules[module.__name__] = module  # where dataclasses look up what annotations name
    try:
        exec(compile(file.text, file.path, "exec"), vars(module))
    except Exception as error:  # noqa: BLE001  # a stranger's code may raise anything
        del sys.modules[module.__name__]
        raise UserError(f"{file.path}{_line(error, file.path)}: {type(error).__name__}: {error}") from None
    return EFFECTS.some(module, file.path)


def _line(error: Exception, path: str) -> str:
    """Where in the file it happened."""
    at = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == path]
    line = error.lineno if isinstance(error, SyntaxError) else at[-1] if at else None
    return "" if line is None else f":{line}"


def _flaw(kind: type[Effect]) -> str | None:
    """What keeps a class from being an effect, if anything."""
    missing = [name for name in ("name", "family", "parameters", *kind.asked) if not hasattr(kind, name)]
    if lacking := sorted([*getattr(kind, "__abstractmethods__", ()), *missing]):
        return f"lacks {', '.join(lacking)}"
    if kind.family not in FAMILIES:
        return f"family is {kind.family!r}; expected one of {', '.join(FAMILIES)}"
    return _flaw_of_parameters(kind)


def _flaw_of_parameters(kind: type[Effect]) -> str | None:
    if not all(isinstance(parameter, Parameter) for parameter in kind.parameters):
        return "parameters: expected a tuple of Parameter(name, unit, low=..., high=...)"
    told = [parameter.name for parameter in kind.parameters]
    if not told or not is_dataclass(kind) or told != [field.name for field in fields(kind)]:
        return f"parameters: {', '.join(told) or 'none'}; expected a @dataclass(frozen=True) with just these fields"
    if issubclass(kind, DriveEffect) and len(told) != 1:
        return f"parameters: {', '.join(told)}; expected one, as of every DriveEffect"
    return None


EFFECTS: Plugins[Effect] = Plugins(
    "effect", Effect, "drivetwin.emulator.effects", "drivetwin.effects", "docs/effects.md", flaw=_flaw
)
