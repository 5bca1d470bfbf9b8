"""Tables and figures of a report, laid out so that a phone needs no sideways scrolling."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape

import plotly.graph_objects as go

from drivetwin.foundation.html_page import figure_div

DASH = "&ndash;"

STYLE = """<style>
.stacks th, .stacks td { white-space: normal; vertical-align: top; padding-right: 14px; }
.stacks td.n, .tight { white-space: nowrap; } .plain { width: auto; max-width: 100%; }
.plain th, .plain td { white-space: normal; padding-right: 28px; } .plain td.n { white-space: nowrap; }
.bar { display: inline-block; width: 64px; height: 9px; background: #e8edf1; border-radius: 5px; margin-right: 8px; }
.bar i { display: block; height: 100%; background: var(--accent); border-radius: 5px; min-width: 2px; }
.pair { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 4px 20px; }
.pair > div, .figure { min-width: 0; }
code { font-size: 12px; color: var(--soft); } code, .path { overflow-wrap: anywhere; }
.note { font-size: 13px; } .verdict { font-size: 18px; margin: 4px 0 12px; }
.verdict.good { color: var(--good); } .verdict.bad { color: var(--bad); }
@media (max-width: 700px) {
  main { padding: 16px 8px 40px; } section { padding: 14px 12px; } header { padding: 0 12px; }
  .stacks, .stacks tbody, .stacks tr, .stacks td { display: block; width: auto; } .stacks thead { display: none; }
  .stacks tr { padding: 8px 0; border-bottom: 1px solid var(--line); }
  .stacks td { border: 0; padding: 1px 0; display: grid; grid-template-columns: 118px minmax(0, 1fr); gap: 8px; }
  .pair { grid-template-columns: minmax(0, 1fr); } .plain { font-size: 14px; } .plain th, .plain td { padding-right: 10px; }
  .stacks td.none { display: none; } .stacks td.n { text-align: left; white-space: normal; }
  .stacks td::before { content: attr(data-label); color: var(--soft); font-size: 13px; }
  .stacks td > span { overflow-wrap: anywhere; } .stacks td:first-child { font-weight: 600; }
}
</style>"""


def stacking_table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: Iterable[int] = ()) -> str:
    """A table whose cells are HTML and wrap; columns of `numeric` are set to the right. A phone shows each row as a block."""
    right = set(numeric)
    titles = "".join(f"<th{_set_right(at in right)}>{escape(title)}</th>" for at, title in enumerate(head))
    lines = "".join(f"<tr>{_cells(head, row, right)}</tr>" for row in rows)
    return f'<table class="stacks"><thead><tr>{titles}</tr></thead><tbody>{lines}</tbody></table>'


def _cells(head: Sequence[str], row: Sequence[str], right: set[int]) -> str:
    """A cell has one child, for on a phone it stands beside its label; there one with a dash is left out."""
    return "".join(
        f'<td{_set_right(at in right, cell == DASH)} data-label="{escape(title)}"><span>{cell}</span></td>'
        for at, (title, cell) in enumerate(zip(head, row, strict=True))
    )


def _set_right(is_number: bool, is_nothing: bool = False) -> str:
    names = " ".join(name for name, holds in (("n", is_number), ("none", is_nothing)) if holds)
    return f' class="{names}"' if names else ""


def plain_table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: Iterable[int] = ()) -> str:
    """A table of few narrow columns, no wider than it has to be, that is a table on a phone as well; cells are HTML.

    A row of one cell is a heading within the table.
    """
    right = set(numeric)
    titles = "".join(f"<th{_set_right(at in right)}>{escape(title)}</th>" for at, title in enumerate(head))
    lines = "".join(
        f'<tr><th colspan="{len(head)}">{row[0]}</th></tr>'
        if len(row) == 1 < len(head)
        else f"<tr>{''.join(f'<td{_set_right(at in right)}>{cell}</td>' for at, cell in enumerate(row))}</tr>"
        for row in rows
    )
    return f'<table class="plain"><thead><tr>{titles}</tr></thead><tbody>{lines}</tbody></table>'


def inputs_section(inputs: Mapping[str, str]) -> str:
    """What was read, with its sha256."""
    rows = [[f'<span class="path">{escape(path)}</span>', f"<code>{digest}</code>"] for path, digest in inputs.items()]
    return f"<section><h2>Inputs</h2>{stacking_table(['File', 'sha256'], rows)}</section>"


def bar(share: float) -> str:
    """A share as a bar, to be followed by its figure."""
    return f'<span class="bar"><i style="width:{100.0 * min(max(share, 0.0), 1.0):.1f}%"></i></span>'


def pictured(title: str, *figures: go.Figure) -> str:
    """Figures under a heading, beside each other where there is room."""
    divs = "".join(f"<div>{figure_div(figure)}</div>" for figure in figures)
    return f'<h3>{escape(title)}</h3><div class="{"pair" if len(figures) > 1 else "figure"}">{divs}</div>'
