"""All mutants by module name: one file each in mutants/broken, and those of packages.

Only the one that is asked for is imported.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.plugins import module_names, named
from drivetwin.mutants.base import Mutant

PACKAGE = "drivetwin.mutants.broken"

GROUP = "drivetwin.mutants"
"""Of entry points: the name of each is the mutant's, its value the module."""


def mutant_names() -> tuple[str, ...]:
    """What `mutant` knows, in the order of the alphabet."""
    return tuple(sorted({*module_names(PACKAGE), *named(GROUP)}))


def mutant(name: str) -> Mutant:
    """A mutant by its name. Raises UserError naming those that there are."""
    module = import_module(_module_name(name))
    return Mutant(name, " ".join(str(module.__doc__).split()), module.CAUGHT_BY, module.break_controller)


def mutant_file(name: str) -> Path:
    """The file that a mutant stands in. Raises UserError as `mutant`."""
    spec = find_spec(_module_name(name))
    if spec is None or spec.origin is None:
        raise UserError(f"mutant {name} has no file: {_module_name(name)} does not exist; correct its entry point ({GROUP})")
    return Path(spec.origin)


def _module_name(name: str) -> str:
    if name not in mutant_names():
        raise UserError(f"there is no mutant {name!r}; there are {', '.join(mutant_names())}")
    return f"{PACKAGE}.{name}" if name in module_names(PACKAGE) else named(GROUP)[name].module
