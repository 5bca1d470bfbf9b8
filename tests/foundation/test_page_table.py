"""The tables of a report as a parser of XML sees them: labels for a phone, headings within, gaps, what is escaped."""

from __future__ import annotations

from xml.etree import ElementTree

from drivetwin.foundation.page_table import DASH, bar, inputs_section, plain_table, stacking_table


def parsed(html: str) -> ElementTree.Element:
    return ElementTree.fromstring(html.replace(DASH, "–"))


def test_each_cell_of_a_stacking_table_has_its_column_s_title_as_label() -> None:
    table = parsed(stacking_table(["axis", "gap < noise"], [["<b>lift</b>", "0.2 N"], ["rotate", DASH]], numeric=(1,)))
    assert [head.text for head in table.iter("th")] == ["axis", "gap < noise"]
    rows = [list(row) for row in table.findall("tbody/tr")]
    assert [[cell.get("data-label") for cell in row] for row in rows] == [["axis", "gap < noise"]] * 2
    assert [cell.get("class") for cell in rows[0]] == [None, "n"]
    assert rows[1][1].get("class") == "n none", "a phone leaves out a cell with nothing in it"
    assert rows[0][0].find("span/b") is not None, "cells are HTML"


def test_a_row_of_one_cell_is_a_heading_over_the_whole_table() -> None:
    table = parsed(plain_table(["file", "size", "unit"], [["Models"], ["a.xml", "3", "kB"]], numeric=(1,)))
    heading, row = list(table.iter("tr"))[-2:]
    assert [(cell.tag, cell.get("colspan"), cell.text) for cell in heading] == [("th", "3", "Models")]
    assert [cell.get("class") for cell in row] == [None, "n", None]


def test_a_table_of_one_column_has_no_headings_within() -> None:
    assert "colspan" not in plain_table(["file"], [["a.xml"]])


def test_a_bar_never_leaves_its_frame() -> None:
    assert ["width:100.0%" in bar(1.7), "width:0.0%" in bar(-0.2), "width:25.0%" in bar(0.25)] == [True] * 3


def test_names_of_inputs_are_shown_as_they_are() -> None:
    section = parsed(inputs_section({"rec/<script>&.parquet": "ab" * 32}))
    (cells,) = [[cell.find("span") for cell in row] for row in section.findall("table/tbody/tr")]
    assert cells[0] is not None
    assert cells[1] is not None
    assert ["".join(cell.itertext()) for cell in cells if cell is not None] == ["rec/<script>&.parquet", "ab" * 32]
