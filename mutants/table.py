"""Runs every mutant through the acceptance suite; says who is caught: `python -m drivetwin.mutants.table --out out/mutants`."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from typer.exceptions import TyperException

from drivetwin.foundation.children import tied_processes
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import INSTALLED, new_file, own_directory, write_json
from drivetwin.hil_tests.bench import Bench, read_bench
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.hil_tests.suite import CASES, find_cases
from drivetwin.mutants.base import Mutant
from drivetwin.mutants.cells import REFERENCE, Cell, Field, fill
from drivetwin.mutants.library import mutant, mutant_names
from drivetwin.mutants.report import Table, markdown, payload

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
console = Console(width=max(112, Console().width))

NOT_CAUGHT = 1
"""Exit status where a mutant is not caught, or the reference controller is rejected."""

BENCH = INSTALLED / "hil_tests" / "benches" / "scara.yaml"


@app.command()
def table_command(
    bench: Annotated[Path, typer.Option(metavar="FILE", help="A bench of the reference controller.")] = BENCH,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Output folder for table.json and table.md.")] = Path("out/mutants"),
    own: Annotated[bool, typer.Option("--own", help="Each mutant only in the case meant for it.")] = False,
    only: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Only this mutant; may be given again.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Cases at once; default: one a core.", show_default=False)] = None,
) -> None:
    """Run broken controllers, and the one that is not, through the cases; print who is rejected by which expectation.

    What was run before and has not changed since is not run again. Exit status: 0 every mutant is rejected by the case and the
    expectation meant for it, and the reference controller is accepted; 1 not so; 2 wrong input.

    Example: python -m drivetwin.mutants.table --own --only floods_the_bus
    """
    chosen = read_bench(bench)
    scenarios = find_cases(chosen, [CASES], ())
    mutants = [mutant(name) for name in only or mutant_names()]
    _refuse_unknown_cases(mutants, scenarios)
    own_directory(out)
    cells = {}
    wanted = _fields(mutants, scenarios, own)
    for number, cell in enumerate(_filled(chosen, wanted, out.absolute(), jobs or os.cpu_count() or 1), start=1):
        cells[cell.mutant, cell.case] = cell
        by = f" by {', '.join(cell.failed)}" if cell.failed else ""
        _say(f"{number}/{len(wanted)} {cell.mutant} in {cell.case}: {cell.outcome}{by}")
    _tell(Table(mutants, scenarios, cells), chosen, out)


def _fields(mutants: Sequence[Mutant], scenarios: Sequence[Scenario], own: bool) -> list[Field]:
    """The reference controller first: a case that rejects it says nothing of a mutant."""
    meant = {one.caught_by.case for one in mutants}
    sound = [Field(REFERENCE, scenario, True) for scenario in scenarios if not own or scenario.identity in meant]
    broken = [
        Field(one.name, scenario, scenario.identity == one.caught_by.case)
        for one in mutants
        for scenario in scenarios
        if not own or scenario.identity == one.caught_by.case
    ]
    return sound + broken


def _filled(bench: Bench, fields: Sequence[Field], out: Path, jobs: int) -> Iterator[Cell]:
    """The cells as they come."""
    pool = ProcessPoolExecutor(jobs, tied_processes())
    try:
        for task in as_completed([pool.submit(fill, bench, field, out) for field in fields]):
            yield task.result()
    except BrokenProcessPool:
        raise UserError("a process that ran a case was killed: is there enough memory? --jobs 1 needs the least") from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _refuse_unknown_cases(mutants: Sequence[Mutant], scenarios: Sequence[Scenario]) -> None:
    there = {scenario.identity for scenario in scenarios if scenario.skipped_because is None}
    for one in mutants:
        if one.caught_by.case not in there:
            raise UserError(f"{one.name} is to be caught by {one.caught_by.case}, which this bench has not or skips")


def _tell(table: Table, bench: Bench, out: Path) -> None:
    write_json(out / "table.json", payload(table, bench.seed))
    with new_file(out / "table.md") as part:
        part.write_text(markdown(table), encoding="utf-8")
    wrong = table.wrong()
    for line in wrong:
        _say(line, "red")
    caught = sum(table.caught(one) for one in table.mutants)
    _say(f"{caught} of {len(table.mutants)} mutants caught as intended: {out / 'table.md'}")
    if wrong:
        raise typer.Exit(NOT_CAUGHT)


def _say(line: str, style: str = "") -> None:
    console.print(line, style=style, highlight=False, soft_wrap=True)


def main() -> None:
    """Run the command line; whatever a user can set right is one line on stderr."""
    try:
        sys.exit(app(standalone_mode=False) or 0)
    except UserError as error:
        print(f"mutants: {error}", file=sys.stderr)
        sys.exit(error.exit_status)
    except TyperException as error:
        print(f"mutants: {error.format_message()}; see: python -m drivetwin.mutants.table --help", file=sys.stderr)
        sys.exit(UserError.exit_status)


if __name__ == "__main__":
    main()
