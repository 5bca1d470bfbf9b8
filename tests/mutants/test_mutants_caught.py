"""Three mutants, and the controller that none of them is, before the real judge; and how a table goes on where it ended."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.suite import CASES, find_cases
from drivetwin.mutants.cells import REFERENCE, Field, broken_bench, fill
from drivetwin.mutants.library import mutant
from drivetwin.mutants.table import BENCH


@pytest.fixture
def bench() -> Bench:
    return read_bench(BENCH)


def case(bench: Bench, identity: str) -> Scenario:
    (found,) = find_cases(bench, [CASES], [identity])
    return found


@pytest.mark.parametrize("name", ["maps_pdo_in_the_wrong_order", "leaves_a_process", "leaves_drives_enabled"])
def test_a_mutant_is_rejected_by_the_case_and_the_expectation_meant_for_it(name: str, bench: Bench, tmp_path: Path) -> None:
    meant = mutant(name).caught_by
    cell = fill(bench, Field(name, case(bench, meant.case), True), tmp_path)
    assert cell.outcome == "rejected"
    assert meant.expectation in cell.failed


@pytest.mark.parametrize("identity", ["01_boot.configured", "02_enable.enable"])
def test_the_unbroken_controller_is_accepted_by_those_cases(identity: str, bench: Bench, tmp_path: Path) -> None:
    cell = fill(bench, Field(REFERENCE, case(bench, identity), True), tmp_path)
    assert (cell.outcome, cell.failed) == ("accepted", ())


def test_what_was_run_is_not_run_again_until_the_mutant_changes(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    field = Field("crashes", case(bench, "01_boot.configured"), False)
    first = fill(bench, field, tmp_path)
    assert "outcome" in first.failed
    folder = tmp_path / "crashes" / "01_boot.configured"
    assert sorted(path.name for path in folder.iterdir()) == ["cell.json", "controller.log", "verdict.json"]
    (folder / "controller.log").write_text("of the first run", encoding="utf-8")
    assert fill(bench, field, tmp_path) == first
    assert (folder / "controller.log").read_text(encoding="utf-8") == "of the first run"
    monkeypatch.setattr("drivetwin.mutants.cells._state_of", lambda _bench, _name: "of other code")
    assert fill(bench, field, tmp_path) == first
    assert "IndexError" in (folder / "controller.log").read_text(encoding="utf-8")


def test_only_the_reference_controller_can_be_broken(bench: Bench) -> None:
    foreign = bench.model_copy(update={"controller": bench.controller.model_copy(update={"command": ["./mine"]})})
    with pytest.raises(UserError, match="expected the reference controller"):
        broken_bench(foreign, "crashes")
