"""A report's table, as a parser of HTML sees it."""

from __future__ import annotations

from html.parser import HTMLParser

from drivetwin.html_page import table


class Cells(HTMLParser):
    """Rows of (tag, attributes, text)."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.rows: list[list[tuple[str, dict[str, str | None], str]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.rows.append([])
        if tag in ("th", "td"):
            self.rows[-1].append((tag, dict(attrs), ""))

    def handle_data(self, data: str) -> None:
        tag, attributes, text = self.rows[-1][-1]
        self.rows[-1][-1] = tag, attributes, text + data


def test_numbers_stand_to_the_right_in_head_and_body() -> None:
    right: dict[str, str | None] = {"class": "n"}
    assert Cells(table(("axis", "peak"), [("lift", "1.5"), ("rotate", "2")], numeric=(1,))).rows == [
        [("th", {}, "axis"), ("th", right, "peak")],
        [("td", {}, "lift"), ("td", right, "1.5")],
        [("td", {}, "rotate"), ("td", right, "2")],
    ]


def test_the_last_cell_of_a_short_row_fills_it() -> None:
    rows = Cells(table(("a", "b", "c", "d"), [("x", "a remark")], numeric=(1, 3))).rows
    assert rows[1] == [("td", {}, "x"), ("td", {"colspan": "3"}, "a remark")]


def test_cells_are_html() -> None:
    assert Cells(table(("a",), [("1 &hellip; 2",)], numeric=())).rows[1] == [("td", {}, "1 … 2")]
