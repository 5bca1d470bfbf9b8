"""`make measured`: `drivetwin diagnose` on machines whose gap is known, and how it compares with plain least squares.

Example: python -m measured --data ../shared/data --out out/measured

Runs every case that this code has not answered yet, then scores all of them: OUT/score.html and OUT/score.json.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from drivetwin.blind.place import code_hash
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import own_directory, write_json
from measured.cases import Case, read_cases
from measured.judge import judge_case
from measured.page import write_score_page
from measured.run import DRIVETWIN, Place, Status, import_inputs, run_case
from measured.score import CaseScore, score
from measured.table import around_markers, fill_table, percent, print_score


def main(words: Sequence[str] | None = None, drivetwin: Sequence[str] = DRIVETWIN) -> int:
    """Run and score; 1 where a case crashed, 2 where the data cannot be used, 0 else, whatever the score."""
    console = Console(width=max(150, Console().width))
    try:
        return _measured(console, _options(words), drivetwin)
    except UserError as error:
        print(f"measured: {error}", file=sys.stderr)
        return error.exit_status


def _options(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m measured", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"), help="folder of the data (../shared/data)")
    parser.add_argument("--out", type=Path, default=Path("out/measured"), help="where everything goes (out/measured)")
    parser.add_argument("--only", action="append", metavar="CASE", help="ask only this case, and anew; may be given again")
    parser.add_argument("--limit", type=float, default=1800.0, metavar="S", help="longest that a case may take in s (1800)")
    parser.add_argument("--table", type=Path, metavar="FILE.md", help="put the table between the markers of this file")
    return parser.parse_args(words)


def _measured(console: Console, options: argparse.Namespace, drivetwin: Sequence[str]) -> int:
    place, code = Place(options.out), code_hash()
    cases = read_cases(options.data, place.inputs)
    pending = _pending(cases, options.only, place, code)
    if options.table is not None:
        around_markers(options.table)
    own_directory(options.out)
    with console.status("importing"):
        for case in cases:
            import_inputs(case, place, code, options.limit, drivetwin)
    scores = {}
    for number, case in enumerate(pending, start=1):
        with console.status(f"{number} of {len(pending)}: {case.name}"):
            outcome = run_case(case, place, code, options.limit, drivetwin)
            scores[case.name] = judge_case(case, place, code)
        said = _said(scores[case.name])
        line = f"{number:2d} of {len(pending)}  {case.name:22s} {outcome.seconds:5.0f} s  {said}"
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    with console.status("reference least squares"):
        found = score(code, [scores.get(case.name) or judge_case(case, place, code) for case in cases])
    write_json(options.out / "score.json", found.to_json())
    write_score_page(place, found)
    if options.table is not None:
        fill_table(options.table, found)
    print_score(console, found, options.out)
    return 1 if found.crashed else 0


def _pending(cases: Sequence[Case], only: Sequence[str] | None, place: Place, code: str) -> list[Case]:
    """Those that this code has not been asked, or those that are asked for. Raises UserError for one that there is not."""
    if only is None:
        return [case for case in cases if place.outcome(case.name, code).status is Status.NOT_RUN]
    names = [case.name for case in cases]
    if unknown := sorted(set(only) - set(names)):
        raise UserError(f"--only {unknown[0]} is no case; there are {', '.join(names)}")
    return [case for case in cases if case.name in only]


def _said(case: CaseScore) -> str:
    """The answer in a line."""
    if case.status is not Status.ANSWERED:
        return f"{case.status}: {case.line}"
    first = "nothing" if case.first is None else f"{case.first.effect} {case.first.probability:.2f}"
    right = "right" if case.right else "WRONG"
    closed = f"closes {percent(case.closed)} of the gap, the reference {percent(case.reference.closed)}"
    return f"{right}: {first} for {case.expected}; {closed}"


if __name__ == "__main__":
    sys.exit(main())
