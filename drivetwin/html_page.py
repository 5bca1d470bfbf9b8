"""A report as one file that a browser shows without a network: the page around its sections, and its figures."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from pathlib import Path

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from drivetwin.files import new_file

_STYLE = """
:root { --ink: #1b2630; --soft: #5d6b78; --line: #d9e0e6; --accent: #00506b; --good: #2c7a4b; --bad: #b3362b; }
* { box-sizing: border-box; }
body { font: 15px/1.55 system-ui, -apple-system, "Segoe UI", sans-serif; color: var(--ink); }
body { margin: 0; background: #f4f6f8; }
main { max-width: 1080px; margin: 0 auto; padding: 32px 24px 64px; }
header h1 { margin: 0 0 4px; font-size: 28px; } header p { margin: 0; color: var(--soft); }
section { background: #fff; border: 1px solid var(--line); border-radius: 8px; padding: 20px 24px; margin-top: 20px; }
h2 { margin: 0 0 8px; font-size: 20px; color: var(--accent); } h3 { margin: 20px 0 4px; font-size: 15px; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; margin: 8px 0; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: 13px; }
th, td { padding: 5px 12px 5px 0; border-bottom: 1px solid var(--line); white-space: nowrap; }
td.n, th.n { text-align: right; } .in { color: var(--good); } .out { color: var(--bad); font-weight: 600; }
ul { margin: 8px 0; padding-left: 20px; } .note { color: var(--soft); }
"""


def write_page(path: Path, title: str, sections: Sequence[str]) -> None:
    """Write the page to `path`, whole or not at all; `sections` are HTML."""
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style><script>{get_plotlyjs()}</script></head>"
        f"<body><main>{''.join(sections)}</main></body></html>\n"
    )
    with new_file(path) as part:
        part.write_text(page, encoding="utf-8")


def figure_div(figure: go.Figure) -> str:
    """An interactive figure within a section."""
    return str(figure.to_html(full_html=False, include_plotlyjs=False, config={"displaylogo": False, "responsive": True}))


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: Iterable[int]) -> str:
    """A table within a section: cells are HTML, columns of `numeric` are set to the right; a short row's last cell fills it."""
    right = set(numeric)

    def line(tag: str, row: Sequence[str]) -> str:
        cells = [f'<{tag} class="n">{cell}</{tag}>' if at in right else f"<{tag}>{cell}</{tag}>" for at, cell in enumerate(row)]
        if len(row) < len(head):
            cells[-1] = f"<{tag} colspan={len(head) - len(row) + 1}>{row[-1]}</{tag}>"
        return f"<tr>{''.join(cells)}</tr>"

    return f'<div class="scroll"><table>{line("th", head)}{"".join(line("td", row) for row in rows)}</table></div>'
