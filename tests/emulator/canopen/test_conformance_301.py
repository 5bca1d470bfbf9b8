"""docs/conformance-301.md claims nothing without a test that exists and runs."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
TABLE = ROOT / "docs" / "conformance-301.md"
TEST = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")
CLAIMS = ("## CiA 301", "## CiA 305")


def rows() -> list[str]:
    """Rows of the tables that claim something, without their heads."""
    text = TABLE.read_text(encoding="utf-8")
    found = []
    for claim in CLAIMS:
        section = text.split(claim + "\n")[1].split("\n## ")[0]
        found += [line for line in section.splitlines() if line.startswith("| ")][2:]
    return found


def unskipped(path: str) -> set[str]:
    """Test functions of a file that no marker skips."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")]
    return {node.name for node in functions if not any("skip" in ast.unparse(mark) for mark in node.decorator_list)}


@pytest.mark.parametrize("row", rows(), ids=lambda row: row.split("|")[2].strip()[:50] if row.count("|") > 3 else row[2:52])
def test_every_row_names_tests_that_exist(row: str) -> None:
    named = TEST.findall(row)
    assert named, "a row without a test claims nothing"
    for path, name in named:
        assert (ROOT / path).exists(), path
        assert name in unskipped(path), f"{path} has no test {name}"


def test_the_table_is_not_empty() -> None:
    assert len(rows()) > 50
