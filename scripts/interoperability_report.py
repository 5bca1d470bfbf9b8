"""How the last `make interoperability` ended: tests by file, and the cells of docs/interoperability.md that are not shown.

Reads out/interoperability/*.xml (pytest's JUnit reports) and tests/interoperability/cells.toml. Exits with 1 where a test of a
cell failed, was skipped or did not run. Tests of `tests/emulator` run in `make test` alone and are left out.
"""

from __future__ import annotations

import sys
import tomllib
from collections import Counter, defaultdict
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).parents[1]
REPORTS = ROOT / "out" / "interoperability"
CELLS = ROOT / "tests" / "interoperability" / "cells.toml"
PASSED, FAILED, SKIPPED = "passed", "failed", "skipped"


def outcomes(reports: Path) -> dict[str, Counter[str]]:
    """By `file::test`, how often it passed, failed and was skipped: once for each of its parameters."""
    found: dict[str, Counter[str]] = defaultdict(Counter)
    for report in sorted(reports.glob("*.xml")):
        for case in ElementTree.parse(report).iter("testcase"):
            file = case.get("classname", "").replace(".", "/") + ".py"
            name = case.get("name", "").partition("[")[0]
            found[f"{file}::{name}"][_outcome(case)] += 1
    return found


def _outcome(case: ElementTree.Element) -> str:
    if case.find("failure") is not None or case.find("error") is not None:
        return FAILED
    return SKIPPED if case.find("skipped") is not None else PASSED


def by_file(tests: dict[str, Counter[str]]) -> dict[str, Counter[str]]:
    """The same, summed over each file."""
    files: dict[str, Counter[str]] = defaultdict(Counter)
    for test, counts in tests.items():
        files[test.partition("::")[0]].update(counts)
    return files


def not_shown(cells: dict[str, dict[str, list[str]]], tests: dict[str, Counter[str]]) -> list[str]:
    """A line for each test of a cell that did not pass with all of its parameters."""
    lines = []
    for stack, columns in cells.items():
        for column, names in columns.items():
            for name in names:
                if not name.startswith("tests/emulator/") and set(tests.get(name, ())) != {PASSED}:
                    ended = ", ".join(f"{count} {how}" for how, count in tests.get(name, Counter()).items()) or "did not run"
                    lines.append(f"{stack}, {column}: {name}: {ended}")
    return lines


def main() -> int:
    tests = outcomes(REPORTS)
    files = by_file(tests)
    for file in sorted(files):
        print(f"{file}: {', '.join(f'{count} {how}' for how, count in sorted(files[file].items()))}")
    total = sum(files.values(), Counter[str]())
    print(f"in all: {', '.join(f'{total[how]} {how}' for how in (PASSED, FAILED, SKIPPED))}")
    cells = tomllib.loads(CELLS.read_text(encoding="utf-8"))
    missing = not_shown(cells, tests)
    print(f"cells: {sum(map(len, cells.values()))}, tests of them that did not pass: {len(missing)}")
    print("\n".join(missing), end="\n" if missing else "")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
