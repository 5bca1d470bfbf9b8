"""The cases of a suite: the product's, those of a user's folder, and the selection from them."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatch
from itertools import pairwise
from pathlib import Path

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.scenario import Scenario, read_scenario

CASES = Path(__file__).parent / "cases"
"""The product's own."""


def find_cases(bench: Bench, folders: Sequence[Path], select: Sequence[str]) -> list[Scenario]:
    """The cases of `folders` in the order in which a machine comes alive; all, or those that a pattern of `select` names.

    A pattern is a group's number (`8`), or a name with wildcards: `04_moves`, `*.single`, `08_faults.*`. Raises UserError for a
    folder without cases, a case that is wrong or twice there, and a pattern that chooses nothing.
    """
    cases = [read_scenario(path, bench) for folder in folders for path in _files(folder)]
    cases.sort(key=lambda case: (case.number, case.group, case.name))
    for case, following in pairwise(cases):
        if case.identity == following.identity:
            raise UserError(f"{following.path}: there is a case {case.identity} already, {case.path}; give it another name")
    for pattern in select:
        if not any(_named(case, pattern) for case in cases):
            groups = sorted({f"{case.number:02d}_{case.group}" for case in cases})
            raise UserError(f"--select {pattern} names no case; there are groups {', '.join(groups)}, and NN_group.name")
    return [case for case in cases if not select or any(_named(case, pattern) for pattern in select)]


def _files(folder: Path) -> list[Path]:
    files = sorted(folder.glob("[0-9]*_*/*.yaml"))
    if not files:
        raise UserError(f"{folder} has no cases; expected files NN_group/name.yaml, such as 04_moves/single.yaml")
    return files


def _named(case: Scenario, pattern: str) -> bool:
    if pattern.isdecimal():
        return case.number == int(pattern)
    group = f"{case.number:02d}_{case.group}"
    return any(fnmatch(name, pattern) for name in (case.identity, group, case.group, case.name))
