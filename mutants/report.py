"""The table of mutants as data and as Markdown: which mutant is caught where, by which expectation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from drivetwin.foundation.files import provenance
from drivetwin.hil_tests.scenario import Scenario
from drivetwin.mutants.base import Mutant
from drivetwin.mutants.cells import REFERENCE, Cell

FORMAT = "mutants/1"

OWN, REJECTED, ACCEPTED, SKIPPED, NOT_RUN = "**●**", "●", "", "–", "·"


@dataclass(frozen=True)
class Table:
    """All cells that were filled, by mutant and case, the reference's among them."""

    mutants: Sequence[Mutant]
    scenarios: Sequence[Scenario]
    cells: Mapping[tuple[str, str], Cell]

    def caught(self, mutant: Mutant) -> bool:
        """Whether the case that is meant to catch it rejects it by the expectation that is meant to."""
        cell = self.cells.get((mutant.name, mutant.caught_by.case))
        return cell is not None and mutant.caught_by.expectation in cell.failed

    def sound(self, case: str) -> bool:
        """Whether a case accepts the reference controller."""
        cell = self.cells.get((REFERENCE, case))
        return cell is not None and cell.outcome == "accepted"

    def wrong(self) -> list[str]:
        """What keeps the suite from being believed, in words; nothing: every mutant is caught, and no sound controller."""
        missed = [
            f"{mutant.name} is not caught by {mutant.caught_by.expectation} of {mutant.caught_by.case}"
            for mutant in self.mutants
            if not self.caught(mutant)
        ]
        cells = self.cells.values()
        refused = [
            f"{cell.case} rejects the reference controller: {', '.join(cell.failed)}"
            for cell in cells
            if cell.mutant == REFERENCE and cell.outcome == "rejected"
        ]
        return missed + refused


def payload(table: Table, seed: int) -> dict[str, object]:
    """table.json (mutants/1)."""
    return {
        "format": FORMAT,
        **provenance(seed, ()),
        "mutants": [
            {"name": mutant.name, "breaks": mutant.breaks, **asdict(mutant.caught_by), "caught": table.caught(mutant)}
            for mutant in table.mutants
        ],
        "cells": [asdict(cell) for cell in table.cells.values()],
    }


def markdown(table: Table) -> str:
    """table.md: what each mutant is and who catches it; and the matrix, where more than the cases meant for them were run."""
    lines = ["| mutant | what it breaks | caught by | expectation |", "| --- | --- | --- | --- |"]
    lines += [_row(table, mutant) for mutant in table.mutants]
    if any(_strange(table, mutant) for mutant in table.mutants):
        lines += ["", *_matrix(table)]
    return "\n".join(lines) + "\n"


def _row(table: Table, mutant: Mutant) -> str:
    case, expectation = mutant.caught_by.case, mutant.caught_by.expectation
    said = f"`{expectation}`" if table.caught(mutant) else f"**not** `{expectation}`"
    return f"| `{mutant.name}` | {mutant.breaks} | `{case}` | {said} |"


def _strange(table: Table, mutant: Mutant) -> bool:
    """Whether it was run in a case that is not the one meant for it."""
    return any(name == mutant.name and case != mutant.caught_by.case for name, case in table.cells)


def _matrix(table: Table) -> list[str]:
    """Mutant by case; cases are numbered within their group."""
    numbers = _numbers(table.scenarios)
    lines = [f"| mutant | {' | '.join(numbers.values())} |", f"| --- |{' :-: |' * len(numbers)}"]
    for name in (REFERENCE, *(mutant.name for mutant in table.mutants)):
        own = {mutant.name: mutant.caught_by.case for mutant in table.mutants}.get(name)
        signs = [_sign(table.cells.get((name, case)), case == own) for case in numbers]
        lines.append(f"| `{name}` | {' | '.join(signs)} |")
    told = ", ".join(f"{number} `{case}`" for case, number in numbers.items())
    return [*lines, "", f"{OWN} rejected by the case meant for it, {REJECTED} rejected, {NOT_RUN} not run. {told}."]


def _numbers(scenarios: Sequence[Scenario]) -> dict[str, str]:
    """4.2 for the second case of the fourth group, by the case's name; those that the bench skips are left out."""
    numbers: dict[str, str] = {}
    counted: dict[int, int] = {}
    for scenario in scenarios:
        if scenario.skipped_because is None:
            counted[scenario.number] = counted.get(scenario.number, 0) + 1
            numbers[scenario.identity] = f"{scenario.number}.{counted[scenario.number]}"
    return numbers


def _sign(cell: Cell | None, own: bool) -> str:
    if cell is None:
        return NOT_RUN
    if cell.outcome == "rejected":
        return OWN if own else REJECTED
    return ACCEPTED if cell.outcome == "accepted" else SKIPPED
