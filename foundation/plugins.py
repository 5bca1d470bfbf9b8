"""Plug-ins are found in one way: those of the product in the modules of their folder, others by entry points of packages.

So adding one to the product is adding a file, and adding one to an installation is installing a package.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from inspect import isabstract
from types import ModuleType
from typing import Any, Generic, TypeVar

from drivetwin.foundation.errors import UserError

T = TypeVar("T")

Source = tuple[str, list[type[T]]]
"""Where plug-ins stand, in words, and which."""


def _sound(_kind: type[Any]) -> str | None:
    return None


@dataclass(frozen=True)
class Plugins(Generic[T]):
    """One kind of plug-in: the subclasses of `base` that give themselves a `key`, each under its own.

    `package`: its modules hold the product's own. `group`: of entry points, each of a module or a class.
    `noun`: the kind in messages. `page`: says how to write one. `flaw`: what is wrong with a class, None where it is sound.
    """

    noun: str
    base: type[Any]
    package: str
    group: str
    page: str
    key: str = "name"
    flaw: Callable[[type[T]], str | None] = _sound

    def found(self, further: Iterable[Source[T]] = ()) -> Mapping[Any, type[T]]:
        """Every class by its key: the product's own in the order of their modules, then those of packages, then `further`.

        Raises UserError for what does not import, holds none, has a flaw, or has a key that is taken.
        """
        found: dict[Any, type[T]] = {}
        origin: dict[Any, str] = {}
        for where, kinds in (*self._own(), *self._of_packages(), *further):
            for kind in kinds:
                key = getattr(kind, self.key)
                if key in found:
                    raise UserError(
                        f"{where}: {self.noun} {key!r} is in the library already, by {origin[key]}: rename one"
                    )
                found[key], origin[key] = kind, where
        return found

    def some(self, module: ModuleType, where: str) -> list[type[T]]:
        """The plug-ins that a stranger's module defines. Raises UserError where there is none, or one has a flaw."""
        if not (kinds := self._in_module(module, where)):
            raise UserError(f"{where}: holds no {self.noun}; expected {self._expected} with a `{self.key}`")
        return kinds

    @property
    def _expected(self) -> str:
        return f"a subclass of {self.base.__module__}.{self.base.__qualname__}"

    def _own(self) -> Iterator[Source[T]]:
        for name in module_names(self.package):
            module = import_module(f"{self.package}.{name}")
            yield module.__name__, self._in_module(module, module.__name__)

    def _of_packages(self) -> Iterator[Source[T]]:
        for where, loaded in installed(self.group):
            if isinstance(loaded, ModuleType):
                yield where, self.some(loaded, where)
            elif isinstance(loaded, type) and issubclass(loaded, self.base):
                self._check(loaded, where)
                yield where, [loaded]
            else:
                raise UserError(f"{where}: expected a module or {self._expected}, got {loaded!r}")

    def _in_module(self, module: ModuleType, where: str) -> list[type[T]]:
        """Classes that the module defines and gives a key; its helpers and bases have none."""
        own = [kind for kind in vars(module).values() if isinstance(kind, type) and issubclass(kind, self.base)]
        keyed = [kind for kind in own if kind.__module__ == module.__name__ and self.key in vars(kind)]
        for kind in keyed:
            self._check(kind, where)
        return keyed

    def _check(self, kind: type[Any], where: str) -> None:
        abstract = f"lacks {', '.join(sorted(kind.__abstractmethods__))}" if isabstract(kind) else None
        if flaw := self.flaw(kind) or abstract:
            raise UserError(f"{where}: {kind.__name__}: {flaw}; {self.page} says what is expected")


def module_names(package: str) -> tuple[str, ...]:
    """The modules of a package, none of them imported, in the order of their names."""
    return tuple(sorted(info.name for info in pkgutil.iter_modules(import_module(package).__path__)))


def named(group: str) -> Mapping[str, EntryPoint]:
    """The entry points of a group by their names, none of them loaded."""
    return {point.name: point for point in sorted(entry_points(group=group))}


def installed(group: str) -> Iterator[tuple[str, Any]]:
    """What the entry points of a group load, each with where it stands. Raises UserError for what does not import."""
    for point in named(group).values():
        where = f"entry point {point.name} = {point.value} ({group})"
        try:
            yield where, point.load()
        except Exception as error:  # noqa: BLE001  # a stranger's code may raise anything
            told = f"{type(error).__name__}: {error}; mend or uninstall the package"
            raise UserError(f"{where} does not import: {told}") from None
