"""What each number of the diagnosis's `Settings` decides: halved and doubled, how many answers of known cases change.

Example: python scripts/sensitivity.py --data ../shared/data --measured kinova_joint_7 --blind out/sensitivity/blind

Every answer is kept in OUT/answers by the hash of the code, and not asked again: an interrupted run goes on. After each case
the table goes to FILE.md (between its markers) and to FILE.json beside it; only cases that have every answer are counted.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from measured.cases import read_cases
from measured.run import Place, import_inputs
from rich.console import Console

from drivetwin.blind.place import code_hash
from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.prepare.inputs import read_inputs
from drivetwin.diagnosis.report.result import Diagnosis, Verdict
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import new_file, write_json

BEGIN, END = "<!-- sensitivity: begin -->", "<!-- sensitivity: end -->"
FACTORS = (0.5, 2.0)
AS_IT_IS = "as it is"
NOT_A_SIZE = ("cutoff_hz", "seed")
"""Not halved: a frequency that the recordings choose, and the seed of random draws."""
LEAST_WHOLE = {"folds": 2}
"""Of whole numbers that make no sense below."""


@dataclass(frozen=True)
class Asked:
    """A case: its name, its model and recordings."""

    name: str
    model: Path
    training: tuple[Path, ...]
    validation: tuple[Path, ...]


@dataclass(frozen=True)
class Told:
    """An answer: the first cause as effect@axis (`no gap`, `refused`), and what was selected."""

    first: str
    selected: frozenset[str]


def variants() -> dict[str, Settings]:
    """Every number halved and doubled, by its name and factor; the settings as they are first."""
    usual = Settings()
    found = {AS_IT_IS: usual}
    for one in fields(Settings):
        value = getattr(usual, one.name)
        if one.name in NOT_A_SIZE or isinstance(value, bool) or not isinstance(value, int | float):
            continue
        for factor in FACTORS:
            changed = max(int(value * factor), LEAST_WHOLE.get(one.name, 1)) if isinstance(value, int) else value * factor
            more: dict[str, Any] = {one.name: changed}
            found[f"{one.name} x {factor:g}"] = replace(usual, **more)
    return found


def ask(case: Asked, settings: Settings) -> dict[str, Any]:
    """What the diagnosis says of a case; a case that it refuses, or breaks on, has an answer too."""
    begun = time.process_time()
    try:
        inputs = read_inputs(case.model, case.training, case.validation, cutoff_hz=None, allow_gaps=False)
        told = _answer(diagnose(case.model, inputs.training, inputs.validation, settings, lambda _what, _share: None))
    except UserError as error:
        told = {"first": "refused", "selected": [], "why": str(error)}
    except Exception as error:  # noqa: BLE001  # a setting that breaks the diagnosis is a finding
        told = {"first": "broken", "selected": [], "why": f"{type(error).__name__}: {error}"}
    return {**told, "cpu_seconds": time.process_time() - begun}


def _answer(found: Diagnosis) -> dict[str, Any]:
    first = "no gap" if found.verdict is Verdict.NO_GAP else f"{found.causes[0].effect}@{found.causes[0].axis}"
    closed = {axis: 1.0 - (found.after_rms[axis] / max(gap.gap_rms, 1e-300)) ** 2 for axis, gap in found.axes.items()}
    return {"first": first, "selected": sorted(f"{one.effect.name}@{one.axis}" for one in found.selected), "closed": closed}


def measured_cases(data: Path, names: Sequence[str], out: Path) -> Iterator[Asked]:
    """Cases of `make measured`. Raises UserError for one that there is not."""
    place = Place(out / "measured")
    known = {case.name: case for case in read_cases(data, place.inputs)} if names else {}
    for name in names:
        if name not in known:
            raise UserError(f"--measured {name} is no case; there are {', '.join(known)}")
        case = known[name]
        import_inputs(case, place, code_hash(), 600.0)
        yield Asked(name, case.model, case.training, case.validation)


def blind_cases(folder: Path | None) -> Iterator[Asked]:
    """Every case_NNN of a folder by `python -m drivetwin.blind.wide.write`."""
    for case in sorted(folder.glob("case_*")) if folder is not None else ():
        training, validation = (tuple(sorted(case.glob(f"{kind}_*"))) for kind in ("train", "validate"))
        yield Asked(f"blind_{case.name}", case / "model.xml", training, validation)


def answers(cases: Sequence[Asked], out: Path, code: str) -> dict[str, dict[str, Told]]:
    """By case and variant what is answered, by this code."""
    found: dict[str, dict[str, Told]] = {}
    for case in cases:
        for name in variants():
            kept = _kept(out, case, name)
            told = json.loads(kept.read_text(encoding="utf-8")) if kept.is_file() else {}
            if told.get("code") == code:
                found.setdefault(case.name, {})[name] = Told(told["first"], frozenset(told["selected"]))
    return found


def _kept(out: Path, case: Asked, variant: str) -> Path:
    return out / "answers" / case.name / f"{variant.replace(' ', '_')}.json"


def rows(found: Mapping[str, Mapping[str, Told]]) -> list[dict[str, Any]]:
    """One row a setting: how many first answers and selected effects change when it is halved and doubled."""
    usual, whole = Settings(), [each for each in found.values() if len(each) == len(variants())]
    told = []
    for name in dict.fromkeys(variant.split(" x ")[0] for variant in variants() if variant != AS_IT_IS):
        row: dict[str, Any] = {"setting": name, "value": getattr(usual, name), "cases": len(whole)}
        for factor, word in zip(FACTORS, ("halved", "doubled"), strict=True):
            pairs = [(each[AS_IT_IS], each[f"{name} x {factor:g}"]) for each in whole]
            row[word] = {
                "first": sum(before.first != after.first for before, after in pairs),
                "selected": sum(len(before.selected ^ after.selected) for before, after in pairs),
            }
        told.append(row)
    return told


def markdown(found: Mapping[str, Mapping[str, Told]]) -> str:
    """The table, and which cases it is of."""
    whole = {name: each for name, each in found.items() if len(each) == len(variants())}
    selected = sum(len(each[AS_IT_IS].selected) for each in whole.values())
    names = ", ".join(sorted(whole)) or "none yet"
    lines = [
        f"{len(whole)} cases, {selected} selected effects with the settings as they are: {names}.",
        "",
        "| setting | value | halved: first answers | selected | doubled: first answers | selected |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows(found):
        figures = [str(row[word][what]) for word in ("halved", "doubled") for what in ("first", "selected")]
        lines.append(f"| `{row['setting']}` | {row['value']:g} | {' | '.join(figures)} |")
    return "\n".join(lines)


def publish(file: Path, found: Mapping[str, Mapping[str, Told]], code: str) -> None:
    """Put the table between the markers of a Markdown file, and the same as JSON beside it."""
    before, _, rest = file.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    with new_file(file) as part:
        part.write_text(f"{before}{BEGIN}\n{markdown(found)}\n{END}{after}", encoding="utf-8")
    said = {case: {name: [one.first, *sorted(one.selected)] for name, one in each.items()} for case, each in found.items()}
    write_json(file.with_suffix(".json"), {"schema": "sensitivity/1", "code": code, "settings": rows(found), "answers": said})


def main() -> int:
    """Ask what is not answered yet, a line an answer; then the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"), help="folder of the data (../shared/data)")
    parser.add_argument("--measured", action="append", default=[], metavar="CASE", help="a case of make measured; repeatable")
    parser.add_argument("--blind", type=Path, metavar="DIR", help="cases by python -m drivetwin.blind.wide.write")
    parser.add_argument("--out", type=Path, default=Path("out/sensitivity"), help="where answers go (out/sensitivity)")
    parser.add_argument("--table", type=Path, default=Path("docs/sensitivity.md"), metavar="FILE.md")
    options = parser.parse_args()
    console = Console(width=150)
    try:
        cases = [*measured_cases(options.data, options.measured, options.out), *blind_cases(options.blind)]
    except UserError as error:
        print(f"sensitivity: {error}", file=sys.stderr)
        return error.exit_status
    code = code_hash()
    known = answers(cases, options.out, code)
    todo = [(case, name) for case in cases for name in variants() if name not in known.get(case.name, {})]
    for number, (case, name) in enumerate(todo, start=1):
        told = ask(case, variants()[name])
        write_json(_kept(options.out, case, name), {"code": code, **told})
        line = f"{number} of {len(todo)}  {case.name}, {name}: {told['first']}, {len(told['selected'])} selected"
        console.print(f"{line}, {told['cpu_seconds']:.0f} s", highlight=False, markup=False, soft_wrap=True)
        if number == len(todo) or todo[number][0] is not case:
            publish(options.table, answers(cases, options.out, code), code)
    publish(options.table, answers(cases, options.out, code), code)
    return 0


if __name__ == "__main__":
    sys.exit(main())
