"""docs/interoperability.md claims nothing without a test that exists and runs."""

from __future__ import annotations

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest
from interoperability_report import not_shown, outcomes

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "docs" / "interoperability.md"
TEST = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")
CELLS = tomllib.loads((ROOT / "tests" / "interoperability" / "cells.toml").read_text(encoding="utf-8"))
"""Tests by stack and column of what stands at a glance."""

NOTHING_SHOWN = 2
"""Column that is empty where a client does not offer a service, and the next says so."""


GLANCE = "## At a glance"
SHOWN = {"CI", "make"}


def sections() -> tuple[str, str]:
    """What stands at a glance, and all the rest."""
    before, _, text = TABLE.read_text(encoding="utf-8").partition(GLANCE)
    glance, _, rest = text.partition("\n## ")
    return glance, before + rest


def table_of(text: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.split("|")] for line in text.splitlines() if line.startswith("| ")]


def rows() -> list[list[str]]:
    """Cells of every row of every table of a stack, without heads."""
    table = table_of(sections()[1])
    return [cells for cells in table if set(cells[1]) != {"-"} and cells[1] not in {"service", "found by"}]


@cache
def unskipped(path: str) -> set[str]:
    """Test functions of a file that no marker skips."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")]
    return {node.name for node in functions if not any("skip" in ast.unparse(mark) for mark in node.decorator_list)}


@pytest.mark.parametrize("cells", rows(), ids=lambda cells: cells[1])
def test_every_row_names_tests_that_exist_or_says_why_not(cells: list[str]) -> None:
    named = TEST.findall(cells[3])
    assert bool(named) == bool(cells[NOTHING_SHOWN])
    assert named or cells[3]
    for path, name in named:
        assert (ROOT / path).exists(), path
        assert name in unskipped(path), f"{path} has no test {name}"


def at_a_glance() -> dict[tuple[str, str], str]:
    """Every cell by stack and column."""
    cells: dict[tuple[str, str], str] = {}
    heads: list[str] = []
    for row in table_of(sections()[0]):
        _, stack, *values, _ = row
        if stack in {"CANopen stack", "Modbus client"}:
            heads = values
        elif not stack.startswith("---"):
            cells |= {(stack, head): value for head, value in zip(heads, values, strict=True)}
    return cells


def where(test: str) -> str:
    """Where a test runs: `make` where a missing client skips it in CI too, for then it is in no package registry."""
    path, _, name = test.partition("::")
    assert name in unskipped(path), test
    return "make" if "pytest.skip(" in (ROOT / path).read_text(encoding="utf-8") else "CI"


def test_every_cell_at_a_glance_says_where_it_runs_or_why_not() -> None:
    reasons = set(re.findall(r"^- (\w): \S", sections()[0], re.MULTILINE))
    assert set(at_a_glance().values()) == SHOWN | reasons


def test_every_cell_at_a_glance_is_a_test_that_runs_where_it_says() -> None:
    """The cells with a letter have none."""
    shown = {cell: place for cell, place in at_a_glance().items() if place in SHOWN}
    tests = {(stack, column): names for stack, columns in CELLS.items() for column, names in columns.items()}
    assert shown == {cell: "+".join({where(name) for name in names}) for cell, names in tests.items()}


def test_make_interoperability_runs_every_test_of_the_cells() -> None:
    """All of tests/vcan by test-vcan, others by name; what is in process runs with `make test` alone."""
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8").partition("\ninteroperability:")[2].partition("\n\n")[0]
    files = {name.partition("::")[0] for columns in CELLS.values() for names in columns.values() for name in names}
    assert "scripts/vcan/test-vcan" in recipe
    named = {file for file in files if not file.startswith(("tests/vcan/", "tests/emulator/"))}
    assert named
    assert all(file in recipe for file in named)


def test_the_report_names_each_cell_whose_tests_did_not_all_pass(tmp_path: Path) -> None:
    (tmp_path / "run.xml").write_text(
        "<testsuites><testsuite>"
        '<testcase classname="tests.vcan.test_a" name="test_good[1]"/>'
        '<testcase classname="tests.vcan.test_a" name="test_good[2]"/>'
        '<testcase classname="tests.vcan.test_a" name="test_half[1]"/>'
        '<testcase classname="tests.vcan.test_a" name="test_half[2]"><failure/></testcase>'
        '<testcase classname="tests.vcan.test_b" name="test_client"><skipped/></testcase>'
        '<testcase classname="tests.vcan.test_b" name="test_client_that_breaks"><error/></testcase>'
        "</testsuite></testsuites>"
    )
    names = ["a.py::test_good", "a.py::test_half", "b.py::test_client", "b.py::test_client_that_breaks", "c.py::test_no_such"]
    cells = {"stack": {name.partition("::")[2]: [f"tests/vcan/test_{name}"] for name in names}}
    cells["stack"]["in process"] = ["tests/emulator/test_d.py::test_elsewhere"]
    assert not_shown(cells, outcomes(tmp_path)) == [
        "stack, test_half: tests/vcan/test_a.py::test_half: 1 passed, 1 failed",
        "stack, test_client: tests/vcan/test_b.py::test_client: 1 skipped",
        "stack, test_client_that_breaks: tests/vcan/test_b.py::test_client_that_breaks: 1 failed",
        "stack, test_no_such: tests/vcan/test_c.py::test_no_such: did not run",
    ]


def test_the_table_is_not_empty() -> None:
    assert len(rows()) > 50


def test_the_lock_file_names_no_host() -> None:
    """`npm ci` takes every package from the registry that the machine is set up for."""
    lock = (ROOT / "tests" / "foreign" / "package-lock.json").read_text(encoding="utf-8")
    assert '"integrity"' in lock
    assert "://" not in lock
