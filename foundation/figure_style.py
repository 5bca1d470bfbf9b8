"""The style of a report's figures (plotly): colours, size, buttons."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

MEASURED, BEFORE, AFTER = "#1b2630", "#d55e00", "#0072b2"
"""Before and after in colours that no common colour blindness confuses (Okabe and Ito 2008)."""
BUTTONS_LEFT_OUT = ["sendChartToCloud", "select2d", "lasso2d", "zoomIn2d", "zoomOut2d", "autoScale2d"]
"""Of plotly's: the first would open a web page, the others crowd a phone's screen."""


def range_buttons(ranges: dict[str, list[float]]) -> dict[str, Any]:
    """Buttons above a figure of two rows, each of which shows a span of time [s]."""
    buttons = [
        {"label": name, "method": "relayout", "args": [{"xaxis.range": span, "xaxis2.range": span}]}
        for name, span in ranges.items()
    ]
    place = {"x": 0.0, "xanchor": "left", "y": 1.01, "yanchor": "bottom", "pad": {"t": 0, "b": 4}}
    return {"type": "buttons", "direction": "right", "buttons": buttons, **place}


def small(values: NDArray[np.float64]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Half the bytes in the file, and more digits than a screen."""
    return values.astype(np.float32)


def styled(figure: go.Figure, height: int) -> go.Figure:
    """The legend stands below, where it has room to wrap on a narrow screen."""
    figure.update_layout(
        template="plotly_white",
        height=height,
        margin={"l": 62, "r": 12, "t": 30, "b": 45},
        font={"family": "system-ui, sans-serif", "size": 12},
        legend={"orientation": "h", "y": -0.14 if height > 450 else -0.2, "yanchor": "top", "x": 0, "itemsizing": "constant"},
        hoverlabel={"namelength": -1},
        modebar={"remove": BUTTONS_LEFT_OUT},
    )
    return figure
