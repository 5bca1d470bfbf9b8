"""The score as tables: on the terminal, and as the Markdown that documentation keeps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_file
from measured.run import Status
from measured.score import CaseScore, Score

HEAD = (
    *("case", "machine", "expected", "first answer", "p", "share", "right", "both"),
    *("closed", "reference", "ratio", "must not", "time [s]"),
)
MACHINE = HEAD.index("machine")
NUMERIC = (4, 5, 8, 9, 10, 12)
WITHIN = "\\*"
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def row(case: CaseScore) -> tuple[str, ...]:
    """One row under `HEAD`."""
    first, answered = case.first, case.status is Status.ANSWERED
    return (
        case.name,
        case.machine,
        case.expected,
        _answer(case),
        "-" if first is None else f"{first.probability:.2f}",
        "-" if first is None else percent(first.share),
        _right(case) if answered else "-",
        _yes(case.both) if answered else "-",
        percent(case.closed),
        percent(case.reference.closed) + ("*" if case.reference.within_file else ""),
        "-" if case.ratio is None else f"{case.ratio:.2f}",
        ", ".join(case.must_not) or "-",
        f"{case.seconds:.0f}" if case.status is not Status.NOT_RUN else "-",
    )


def percent(share: float | None) -> str:
    """A share in whole per cent; a dash for None."""
    return "-" if share is None else "below 0" if share < 0.0 else f"{100.0 * share:.0f} %"


def notes(score: Score) -> list[str]:
    """What has to be said under the table."""
    told = [
        f"* fitted within each validation recording; without that it closes {percent(case.reference.closed_carried)}"
        for case in score.cases
        if case.reference.within_file
    ]
    if score.differing:
        told.append(f"Fault: the settings of the diagnosis are not alike in all reports: {', '.join(score.differing)}")
    return told


def print_score(console: Console, score: Score, out: Path) -> None:
    """The closing table, the faults, the counts."""
    shown = [at for at in range(len(HEAD)) if at != MACHINE]
    table = Table(title="Measured cases", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for at in shown:
        table.add_column(HEAD[at], justify="right" if at in NUMERIC else "left", no_wrap=at == 0, overflow="fold")
    for case in score.cases:
        cells = row(case)
        table.add_row(*(cells[at] for at in shown))
    console.print(table)
    for note in notes(score):
        console.print(note, highlight=False, markup=False)
    for case in score.cases:
        for fault in case.faults:
            console.print(f"{case.name}: {fault}", highlight=False, markup=False, soft_wrap=True)
    settings = ", ".join(f"{key} {value}" for key, value in score.settings.items()) or "no report tells them"
    console.print(f"settings of the diagnosis, alike in all: {settings}", highlight=False, markup=False)
    console.print(score.summary, style="bold", highlight=False)
    console.print(f"{out / 'score.html'}  {out / 'score.json'}", highlight=False, soft_wrap=True)


def fill_table(file: Path, score: Score) -> None:
    """Put the table between the two markers of a Markdown file. Raises UserError where they are not there."""
    before, after = around_markers(file)
    with new_file(file) as part:
        part.write_text(f"{before}{BEGIN}\n{markdown(score)}\n{END}{after}", encoding="utf-8")


def around_markers(file: Path) -> tuple[str, str]:
    """What stands before and after the two markers; ask before long work. Raises UserError as `fill_table`."""
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise UserError(f"{file} cannot be read: {error.strerror}; --table names a Markdown file with {BEGIN} in it") from None
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise UserError(f"{file} lacks {BEGIN} and, below it, {END}: the table goes between these two lines")
    return before, after


def markdown(score: Score) -> str:
    """Counts, table, notes."""
    lines = [f"{score.summary[0].upper()}{score.summary[1:]}.", "", _line(HEAD), _line(["---"] * len(HEAD))]
    lines += [_line([cell.replace("*", WITHIN) for cell in row(case)]) for case in score.cases]
    told = [note.replace("*", WITHIN) for note in notes(score)]
    return "\n".join([*lines, *(f"\n{note}." for note in told)])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _answer(case: CaseScore) -> str:
    if case.status is not Status.ANSWERED:
        return str(case.status)
    if case.first is None:
        return case.verdict or "-"
    return case.first.effect


def _right(case: CaseScore) -> str:
    return "strict" if case.strict else "accepted" if case.right else "no"


def _yes(both: bool | None) -> str:
    return "-" if both is None else "yes" if both else "no"
