"""A report as one file that a browser shows without a network: the page around its sections, and its figures."""

from __future__ import annotations

import base64
import gzip
import html
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.io.json import to_json_plotly

from drivetwin.foundation.files import new_file

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
.machine { display: block; margin: 8px auto; max-width: 100%; }
ul { margin: 8px 0; padding-left: 20px; } .note { color: var(--soft); }
"""


PLOTLY = Path(__file__).with_name("plotly") / "plotly-cartesian.min.js"
"""The part of plotly.js that draws on pairs of axes, as its makers publish it; its licence stands beside it."""

_DRAW = """
(async () => {
  const draw = async () => {
    for (const told of document.querySelectorAll(".plotly-graph-div > script")) {
      const figure = told.parentElement;
      told.remove();
      const {data, layout} = JSON.parse(told.textContent);
      await Plotly.newPlot(figure, data, layout, {displaylogo: false, responsive: true});
    }
  };
  try {
    const packed = Uint8Array.from(atob(document.getElementById("plotly").textContent), (each) => each.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.appendChild(script);
    document.addEventListener("toggle", draw, true);
    await draw();
  } catch (error) {
    for (const told of document.querySelectorAll(".plotly-graph-div > script")) told.parentElement.textContent = error;
  }
})();
"""
"""Unpacks plotly.js and draws every figure, from the top of the page down, and those of what is unfolded later."""


def write_page(path: Path, title: str, sections: Sequence[str]) -> None:
    """Write the page to `path`, whole or not at all; `sections` are HTML. The same sections are the same bytes."""
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head>"
        f"<body><main>{''.join(sections)}</main>"
        f'<script id="plotly" type="text/plain">{_packed_plotly()}</script><script>{_DRAW}</script></body></html>\n'
    )
    with new_file(path) as part:
        part.write_text(page, encoding="utf-8")


@cache
def _packed_plotly() -> str:
    """plotly.js, gzip without a time stamp, in base 64: less than half as many bytes."""
    return base64.b64encode(gzip.compress(PLOTLY.read_bytes(), mtime=0)).decode("ascii")


def figure_div(figure: go.Figure) -> str:
    """An interactive figure within a section; it has no name, so that the same figure is the same text."""
    told = str(to_json_plotly(_in_single_precision(figure.to_dict()))).replace("<", "\\u003c")  # no tag within a string of it
    height = "100%" if figure.layout.height is None else f"{figure.layout.height:g}px"
    return (
        f'<div class="plotly-graph-div" style="height:{height}; width:100%">'
        f'<script type="application/json">{told}</script></div>'
    )


def _in_single_precision(part: Any) -> Any:
    """A figure's arrays as half as many bytes: seven digits are more than a picture shows."""
    if isinstance(part, Mapping):
        if part.get("dtype") == "f8":
            single = np.frombuffer(base64.b64decode(part["bdata"])).astype(np.float32)
            return {**part, "dtype": "f4", "bdata": base64.b64encode(single.tobytes()).decode("ascii")}
        return {name: _in_single_precision(inner) for name, inner in part.items()}
    return [_in_single_precision(inner) for inner in part] if isinstance(part, list | tuple) else part


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric: Iterable[int]) -> str:
    """A table within a section: cells are HTML, columns of `numeric` are set to the right; a short row's last cell fills it."""
    right = set(numeric)

    def line(tag: str, row: Sequence[str]) -> str:
        cells = [f'<{tag} class="n">{cell}</{tag}>' if at in right else f"<{tag}>{cell}</{tag}>" for at, cell in enumerate(row)]
        if len(row) < len(head):
            cells[-1] = f"<{tag} colspan={len(head) - len(row) + 1}>{row[-1]}</{tag}>"
        return f"<tr>{''.join(cells)}</tr>"

    return f'<div class="scroll"><table>{line("th", head)}{"".join(line("td", row) for row in rows)}</table></div>'
