"""Every row of docs/conformance-402.md names a test that exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

HERE = Path(__file__).parent
DOCUMENT = HERE.parents[2] / "docs" / "conformance-402.md"
ROWS = [line for line in DOCUMENT.read_text(encoding="utf-8").splitlines() if line.startswith("| ") and "---" not in line]
NAMED = re.compile(r"`(test_\w+\.py)::(test_\w+)` \|$")


def names_in(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("row", [row for row in ROWS if not row.startswith(("| clause", "| what"))])
def test_a_row_names_a_test_that_exists(row: str) -> None:
    found = NAMED.search(row)
    assert found is not None, "no row is claimed without a test"
    assert found[2] in names_in(HERE / found[1])
