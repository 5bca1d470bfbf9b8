"""docs/interoperability.md claims nothing without a test that exists and runs."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "docs" / "interoperability.md"
TEST = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")
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


def test_every_cell_at_a_glance_says_where_it_runs_or_why_not() -> None:
    glance, _ = sections()
    reasons = set(re.findall(r"^- (\w): \S", glance, re.MULTILINE))
    cells = {cell for row in table_of(glance) if row[1][:3] != "---" and "stack" not in row[1] for cell in row[2:-1]}
    heads = {cell for row in table_of(glance) if row[1] == "Modbus client" for cell in row[2:-1]}
    assert cells - heads == SHOWN | reasons


def test_the_table_is_not_empty() -> None:
    assert len(rows()) > 50


def test_the_lock_file_names_no_host() -> None:
    """`npm ci` takes every package from the registry that the machine is set up for."""
    lock = (ROOT / "tests" / "foreign" / "package-lock.json").read_text(encoding="utf-8")
    assert '"integrity"' in lock
    assert "://" not in lock
