"""A report's table as a parser of HTML sees it; a page is the same bytes twice, small, and needs no network."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs_version

from drivetwin.foundation.html_page import PLOTLY, figure_div, table, write_page


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


def figure() -> go.Figure:
    drawn = go.Figure()
    drawn.add_scatter(x=[0.0, 1.0], y=[2.0, 3.0], name="</script><b>own</b>")
    return drawn.update_layout(height=300)


def test_the_same_page_is_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        write_page(tmp_path / name, "a page", [figure_div(figure()), figure_div(figure())])
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_a_page_is_half_of_what_a_report_may_be_and_loads_nothing(tmp_path: Path) -> None:
    write_page(tmp_path / "page", "a page", [figure_div(figure())])
    page = (tmp_path / "page").read_text(encoding="utf-8")
    assert len(page) < 750_000
    assert not re.search(r"<(script|link|img)[^>]*(src|href)=", page)


def test_what_a_figure_says_is_no_tag_of_the_page() -> None:
    told = figure_div(figure())
    assert told.count("</script>") == 1
    assert "<b>" not in told


def test_what_draws_is_of_the_version_that_the_figures_are_made_for_and_its_licence_stands_beside_it() -> None:
    assert f"v{get_plotlyjs_version()}\n" in PLOTLY.read_text(encoding="utf-8")[:200]
    assert (PLOTLY.parent / "LICENSE").read_text(encoding="utf-8").startswith("MIT License")
