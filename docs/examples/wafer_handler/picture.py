"""tracking.png: Figs 5 to 7 in one picture, for where no browser is."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from drivetwin.controller.feedforward.stage import Stage
from drivetwin.identification.plots import STYLE
from wafer_handler.figures import COLOURS, EQ14, LEARNED, MICRO
from wafer_handler.metrics import BAND
from wafer_handler.results import AxisResult


def draw_tracking(axes: dict[str, AxisResult], path: Path) -> None:
    """Tracking difference of each axis: above with velocity alone and with torque, below enlarged, with what was learned."""
    with mpl.rc_context(rc=STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(12.5, 5.6), dpi=150, layout="constrained")
        panels = figure.subplots(2, len(axes), sharex="col", squeeze=False)
        for column, (axis, result) in enumerate(axes.items()):
            drawn = (
                ("velocity", result.stages[Stage.VELOCITY], COLOURS[Stage.VELOCITY]),
                ("velocity, torque by eq. 14", result.eq14, EQ14),
                (f"the same, learned in {len(result.learned) - 1} runs", result.learned[-1], LEARNED),
                ("velocity, torque with Stribeck", result.stages[Stage.TORQUE], COLOURS[Stage.TORQUE]),
            )
            band = 1e6 * BAND * result.baseline
            for row, panel in enumerate(panels[:, column]):
                for name, found, colour in drawn:
                    panel.plot(1e3 * found.time, 1e6 * found.error, color=colour, linewidth=1.3, label=name)
                panel.axhspan(-band, band, color="#edae49", alpha=0.2, linewidth=0)
                panel.set_ylabel(f"demand - actual [{MICRO[axis]}]")
                if row == 1:
                    panel.set(ylim=(-1.6 * band, 1.6 * band), xlabel="time from the start of the move [ms]")
            panels[0, column].set_title(f"{axis}: peak {result.error_reduction:.0f} times lower")
        panels[0, -1].legend(fontsize=8, title="fed forward", loc="upper right")
        figure.savefig(path)

