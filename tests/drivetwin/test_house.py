"""The house is as docs/data-flow.md draws it: its sentences are import-linter's contracts, its rooms have one name each."""

from __future__ import annotations

import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PAGE = (ROOT / "docs" / "data-flow.md").read_text(encoding="utf-8")


def test_each_sentence_about_imports_is_a_contract() -> None:
    said = PAGE.partition("is a contract of import-linter")[2].partition("\n\n")[2].partition("\n\n")[0].splitlines()
    contracts = PROJECT["tool"]["importlinter"]["contracts"]
    assert said == [f"- {contract['name']}." for contract in contracts]


def test_the_drawing_is_the_contract_of_the_layers() -> None:
    drawing = PAGE.partition("no room imports its neighbour on the same line:\n\n")[2].partition("\n\n")[0]
    drawn = [{word.rstrip("/") for word in line[:42].split() if word.endswith("/")} for line in drawing.splitlines()]
    (house,) = [each for each in PROJECT["tool"]["importlinter"]["contracts"] if each.get("containers") == ["drivetwin"]]
    layers = [set(layer.split(" | ")) for layer in house["layers"]]
    assert drawn == [{"drivetwin"}, *layers[2:]]
    assert layers[:2] == [{"__main__"}, {"cli", "api"}]


def test_each_room_has_one_name() -> None:
    links = {path.name: path for path in (ROOT / "drivetwin").iterdir() if path.is_symlink()}
    rooms = {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"drivetwin"}
    assert set(links) == rooms
    assert all(path.readlink() == Path("..") / name for name, path in links.items())
    assert set(PROJECT["tool"]["ruff"]["lint"]["flake8-tidy-imports"]["banned-api"]) == rooms
