"""Every mutant is whole: what it breaks in a sentence, and a case with an expectation that are meant to catch it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from drivetwin.controller import supervision
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import read_bench
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.suite import CASES, find_cases
from drivetwin.mutants import broken
from drivetwin.mutants.library import mutant, mutant_names
from drivetwin.mutants.surgery import leave_out, replace
from drivetwin.mutants.table import BENCH

BROKEN = Path(broken.__file__).parent

OF_THE_JUDGE = {"fault", "leaves nothing"}
"""What every case expects without saying so."""

MEANT = {name: mutant(name) for name in mutant_names()}


@pytest.fixture(scope="module")
def cases() -> dict[str, Scenario]:
    """Those that the reference controller's bench runs."""
    return {case.identity: case for case in find_cases(read_bench(BENCH), [CASES], ()) if case.skipped_because is None}


def test_every_file_is_a_mutant() -> None:
    assert sorted(path.stem for path in BROKEN.glob("*.py") if path.stem != "__init__") == list(MEANT)


def test_there_are_enough_of_them_and_some_for_every_group() -> None:
    assert len(MEANT) >= 24
    assert {int(one.caught_by.case[:2]) for one in MEANT.values()} == set(range(1, 12))


@pytest.mark.parametrize("name", MEANT)
def test_a_mutant_says_what_it_breaks_and_is_meant_for_a_case_that_can_tell(name: str, cases: dict[str, Scenario]) -> None:
    one = MEANT[name]
    assert one.breaks.endswith(".")
    assert one.breaks.count(". ") == 0
    assert one.caught_by.case in cases
    expected = {expectation.name for expectation in cases[one.caught_by.case].expectations}
    assert one.caught_by.expectation in expected | OF_THE_JUDGE


@pytest.mark.parametrize("name", MEANT)
def test_a_mutant_knows_the_controller_alone(name: str) -> None:
    imported = set(_imported(BROKEN / f"{name}.py"))
    rooms = {module.removeprefix("drivetwin.").partition(".")[0] for module in imported if module.startswith("drivetwin")}
    assert rooms <= {"controller", "mutants", "identification", "motion", "recording", "bus", "foundation"}


def _imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)


def test_a_name_that_is_none() -> None:
    with pytest.raises(UserError, match="there is no mutant 'sound'; there are adopts_a_stranger"):
        mutant("sound")


def test_what_would_break_nothing_is_a_mistake() -> None:
    with pytest.raises(AttributeError):
        replace(SimpleNamespace(run=1), "walk", 2)
    with pytest.raises(ValueError, match=r"not in (list|deque)"):
        leave_out(supervision.jump, supervision.jump)
