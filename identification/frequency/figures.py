"""The plots of a commissioning report: mechanics, open and closed loops, step, torque over speed."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from drivetwin.foundation.figure_style import AFTER, BEFORE, MEASURED, small, styled
from drivetwin.foundation.quantities import scale_of
from drivetwin.identification.frequency.bode import Mask, loops_over
from drivetwin.identification.frequency.margins import decibel, degrees
from drivetwin.identification.frequency.phasors import Complex
from drivetwin.identification.frequency.resonances import Resonances
from drivetwin.identification.frequency.result import AxisResponse
from drivetwin.identification.result import Units
from drivetwin.recording.recording import Samples

_DOUBTFUL = "#b8c4cf"


class Mechanics(Protocol):
    """Speed over torque (m,) at each `frequency` [Hz], its coherence 0..1, and which lines are reliable."""

    @property
    def frequency(self) -> Samples: ...
    @property
    def mechanics(self) -> Complex: ...
    @property
    def coherence(self) -> Samples: ...
    @property
    def sure(self) -> Mask: ...


def mechanics_figure(found: Mechanics, shapes: Resonances, units: Units) -> go.Figure:
    """Gain, phase and coherence over frequency; grey where nothing is concluded. Resonances and anti-resonances are marked."""
    unit = f"{units.velocity}/({units.torque})"
    figure = _panels(("gain", "phase", "coherence"), (f"dB re 1 {unit}", "degrees", "1"))
    phase = np.angle(found.mechanics, deg=True)
    for row, values in enumerate((decibel(found.mechanics), phase, found.coherence), start=1):
        for chosen, colour, name in ((~found.sure, _DOUBTFUL, "not reliable"), (found.sure, MEASURED, "measured")):
            _line(figure, row, found.frequency, np.where(chosen, values, np.nan), name, colour, markers=True)
    for frequency, colour in [(each, BEFORE) for each in shapes.resonances] + [(each, AFTER) for each in shapes.antiresonances]:
        figure.add_vline(x=frequency, line={"color": colour, "width": 1, "dash": "dot"})
        figure.add_annotation(
            x=np.log10(frequency), y=1.0, yref="paper", yanchor="bottom", text=f"{frequency:.1f} Hz", showarrow=False,
            font={"color": colour},
        )  # fmt: skip
    return styled(figure, 620)


def open_figure(found: AxisResponse) -> go.Figure:
    """Both loops, cut open, as they are and with the proposed gains."""
    figure = _panels(("open loops", "phase"), ("dB", "degrees"))
    bode, sure = found.bode, found.bode.fair
    frequency = bode.frequency[sure]
    _loop(figure, frequency, bode.velocity[sure], "velocity loop", BEFORE)
    _loop(figure, frequency, bode.position[sure], "position loop", AFTER)
    if found.proposal is not None:
        velocity, position = loops_over(bode.mechanics[sure], frequency, found.proposal.cascade)
        _loop(figure, frequency, velocity, "velocity loop, proposed gains", BEFORE, dash="dash")
        _loop(figure, frequency, position, "position loop, proposed gains", AFTER, dash="dash")
    figure.add_hline(y=0.0, line={"color": "#333333", "width": 1}, row=1, col=1)
    figure.add_hline(y=-180.0, line={"color": "#333333", "width": 1}, row=2, col=1)
    return styled(figure, 520)


def closed_figure(found: AxisResponse) -> go.Figure:
    """Both loops closed: measured speed for the demanded one, position for the demanded one."""
    figure = _panels(("closed loops", "phase"), ("dB", "degrees"))
    bode, sure = found.bode, found.bode.fair
    _loop(figure, bode.frequency[sure], bode.closed_velocity[sure], "velocity loop", BEFORE)
    _loop(figure, bode.frequency[sure], bode.closed_position[sure], "position loop", AFTER)
    figure.add_hline(y=-3.0, line={"color": "#333333", "width": 1, "dash": "dot"}, row=1, col=1)
    return styled(figure, 480)


def step_figure(found: AxisResponse) -> go.Figure:
    """Position after a step of its set-point."""
    figure = go.Figure()
    figure.add_hline(y=1.0, line={"color": "#333333", "width": 1})
    figure.add_scatter(x=small(1e3 * found.step.time), y=small(found.step.position), mode="lines", line={"color": AFTER})
    figure.update_layout(xaxis_title="time since the step [ms]", yaxis_title="position [of the step]", showlegend=False)
    return styled(figure, 300)


def torque_speed_figure(found: AxisResponse) -> go.Figure:
    """Torque at constant speed, with the rated torque."""
    speeds = np.array([point.speed for point in found.curve])
    torques = np.array([point.torque for point in found.curve])
    rated = found.rated_torque or 0.0
    scale = scale_of(found.units.torque, max(float(np.abs(torques).max(initial=0.0)), rated))
    figure = go.Figure()
    figure.add_scatter(x=small(speeds), y=small(scale.factor * torques), mode="lines+markers", line={"color": MEASURED})
    if rated:
        for side in (-rated, rated):
            figure.add_hline(y=scale.factor * side, line={"color": BEFORE, "width": 1, "dash": "dash"})
    speed_unit = found.units.velocity
    figure.update_layout(
        xaxis_title=f"speed [{speed_unit}]",
        yaxis_title=f"{found.units.word} at constant speed [{scale.unit}]",
        showlegend=False,
    )
    return styled(figure, 320)


def _panels(titles: tuple[str, ...], units: tuple[str, ...]) -> go.Figure:
    figure = make_subplots(len(titles), 1, shared_xaxes=True, vertical_spacing=0.06)
    for row, (title, unit) in enumerate(zip(titles, units, strict=True), start=1):
        figure.update_yaxes(title_text=f"{title} [{unit}]", row=row, col=1)
    figure.update_xaxes(type="log", dtick="D2")
    figure.update_xaxes(title_text="frequency [Hz]", row=len(titles), col=1)
    return figure


def _loop(figure: go.Figure, frequency: Samples, values: Complex, name: str, colour: str, dash: str = "solid") -> None:
    _line(figure, 1, frequency, decibel(values), name, colour, dash=dash)
    _line(figure, 2, frequency, degrees(values), name, colour, dash=dash)


def _line(
    figure: go.Figure, row: int, x: Samples, y: Samples, name: str, colour: str, dash: str = "solid", *, markers: bool = False
) -> None:
    figure.add_scatter(
        x=small(x), y=small(y), name=name, legendgroup=name, showlegend=row == 1, row=row, col=1,
        mode="lines+markers" if markers else "lines", marker={"size": 4}, line={"color": colour, "width": 1.8, "dash": dash},
    )  # fmt: skip
