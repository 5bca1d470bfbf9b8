"""The table: what counts as caught, what is said of one that is not, and the page that holds it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.judge import skipped
from drivetwin.hil_tests.suite import CASES, find_cases
from drivetwin.hil_tests.verdict import CaseResult
from drivetwin.mutants.base import CaughtBy, Mutant
from drivetwin.mutants.cells import REFERENCE, Cell, Field, fill
from drivetwin.mutants.library import mutant, mutant_names
from drivetwin.mutants.report import Table, markdown
from drivetwin.mutants.table import BENCH

DOCS = Path(__file__).parents[2] / "docs" / "mutants.md"

BOOT, ENABLE = "01_boot.configured", "02_enable.enable"


def breaks_nothing() -> None:
    """Of a mutant that is only talked about."""


def table(*cells: Cell) -> Table:
    """Of one mutant that the boot case is meant to catch by `outcome`, in two cases."""
    dull = Mutant("dull", "Does nothing.", CaughtBy(BOOT, "outcome"), breaks_nothing)
    scenarios = find_cases(read_bench(BENCH), [CASES], [BOOT, ENABLE])
    return Table([dull], scenarios, {(cell.mutant, cell.case): cell for cell in cells})


SOUND = Cell(REFERENCE, BOOT, "accepted", (), "")
CAUGHT = Cell("dull", BOOT, "rejected", ("heartbeat", "outcome"), "it said nothing")


def test_a_mutant_that_its_case_rejects_by_its_expectation_is_caught() -> None:
    assert table(SOUND, CAUGHT).wrong() == []
    assert "| `dull` | Does nothing. | `01_boot.configured` | `outcome` |" in markdown(table(SOUND, CAUGHT))


@pytest.mark.parametrize(
    "cell",
    [
        Cell("dull", BOOT, "accepted", (), ""),
        Cell("dull", BOOT, "rejected", ("heartbeat",), "for another reason"),
        Cell("dull", ENABLE, "rejected", ("outcome",), "by another case"),
    ],
)
def test_one_that_slips_through_or_is_caught_for_another_reason_is_told(cell: Cell) -> None:
    assert table(SOUND, cell).wrong() == ["dull is not caught by outcome of 01_boot.configured"]
    assert "**not** `outcome`" in markdown(table(SOUND, cell))


def test_a_case_that_rejects_the_sound_controller_is_told() -> None:
    refused = Cell(REFERENCE, ENABLE, "rejected", ("holds",), "too short")
    assert table(SOUND, CAUGHT, refused).wrong() == ["02_enable.enable rejects the reference controller: holds"]


def test_the_matrix_is_there_where_more_than_the_cases_meant_were_run() -> None:
    assert "| mutant | 1.1 | 2.1 |" not in markdown(table(SOUND, CAUGHT))
    told = markdown(table(SOUND, CAUGHT, Cell("dull", ENABLE, "accepted", (), "")))
    assert "| `dull` | **●** |  |" in told
    assert "| `reference` |  | · |" in told


def test_the_page_has_every_mutant_as_it_is_meant() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (.+) \| `([\w.]+)` \| `([\w ]+)` \|$", DOCS.read_text(encoding="utf-8"), re.MULTILINE)
    meant = [mutant(name) for name in mutant_names()]
    assert rows == [(one.name, one.breaks, one.caught_by.case, one.caught_by.expectation) for one in meant]


def test_a_case_that_is_skipped_is_a_cell_too(tmp_path: Path) -> None:
    bench = read_bench(BENCH)
    (jitter,) = find_cases(bench, [CASES], ["09_bus.sync_jitter"])  # of the wall clock, and this bench is in lockstep
    first = fill(bench, Field("drifts", jitter, evidence=False), tmp_path)
    assert first.outcome == "skipped"
    assert fill(bench, Field("drifts", jitter, evidence=False), tmp_path) == first


def test_a_cell_is_of_one_bench_and_its_truth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cell that is of disk is not run again; with another bench, or another truth beside it, it is."""
    (jitter,) = find_cases(read_bench(BENCH), [CASES], ["09_bus.sync_jitter"])
    path, truth = tmp_path / "bench.yaml", tmp_path / "truth.json"
    runs: list[tuple[object, ...]] = []

    def run(*given: object) -> CaseResult:
        runs.append(given)
        return skipped(jitter, "by the test")

    monkeypatch.setattr("drivetwin.mutants.cells.run_one", run)
    own = read_truth(read_bench(BENCH))
    for text, effects, number in (("", own, 1), ("", own, 1), ("# other\n", own, 2), ("# other\n", f"{own}\n", 3)):
        path.write_text(f"{BENCH.read_text(encoding='utf-8')}\ntruth: truth.json\n{text}", encoding="utf-8")
        truth.write_text(effects, encoding="utf-8")
        fill(read_bench(path), Field("drifts", jitter, evidence=False), tmp_path / "out")
        assert len(runs) == number


def read_truth(bench: Bench) -> str:
    """The machine's own effects file."""
    return bench.virtual.effects_path.read_text(encoding="utf-8")
