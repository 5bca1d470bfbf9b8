"""What was found about an axis, as rows of text with units: for the terminal and for the page."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.foundation.quantities import quantity
from drivetwin.identification.frequency.margins import Margins
from drivetwin.identification.frequency.result import AxisResponse


@dataclass(frozen=True)
class Row:
    """A quantity: as it is, and with the proposed gains (empty: the proposal does not change it)."""

    quantity: str
    now: str
    proposed: str = ""


def rows(found: AxisResponse) -> list[Row]:
    """Everything in order: mechanics, gains and margins of both loops, step response."""
    proposal, cascade = found.proposal, found.bode.cascade
    shapes = found.resonances
    unit = found.units.viscous
    return [
        Row("inertia", quantity(found.inertia, found.units.inertia)),
        Row("anti-resonances", _frequencies(shapes.antiresonances)),
        Row("resonances", _frequencies(shapes.resonances)),
        Row("reliable", _reliable(found)),
        Row("current loop, time constant", quantity(cascade.current_lag, "s")),
        Row(
            "velocity gain",
            quantity(cascade.velocity_gain, unit),
            "" if proposal is None else quantity(proposal.cascade.velocity_gain, unit),
        ),
        Row(
            "integral time",
            _integral(cascade.integral_time),
            "" if proposal is None else _integral(proposal.cascade.integral_time),
        ),
        Row(
            "position gain",
            f"{cascade.position_gain:.4g} 1/s",
            "" if proposal is None else f"{proposal.cascade.position_gain:.4g} 1/s",
        ),
        *_margins("velocity loop", found.velocity, None if proposal is None else proposal.velocity),
        *_margins("position loop", found.position, None if proposal is None else proposal.position),
        Row("step: rise, 10 to 90 %", "not within a step" if found.step.rise is None else quantity(found.step.rise, "s")),
        Row("step: overshoot", f"{100.0 * found.step.overshoot:.1f} %"),
        Row("step: settled to 2 %", "not within a step" if found.step.settling is None else quantity(found.step.settling, "s")),
    ]


def _margins(loop: str, now: Margins, proposed: Margins | None) -> list[Row]:
    def pair(name: str, unit: str, digits: int, one: float | None, other: float | None) -> Row:
        shown = "" if proposed is None else _or_beyond(other, unit, digits)
        return Row(f"{loop}: {name}", _or_beyond(one, unit, digits), shown)

    other = proposed or now
    return [
        pair("crossover", "Hz", 1, now.crossover, other.crossover),
        pair("phase margin", "°", 0, now.phase, other.phase),
        pair("gain margin", "dB", 1, now.gain, other.gain),
        pair("peak of the sensitivity", "dB", 1, now.peak, other.peak),
    ]


def _or_beyond(value: float | None, unit: str, digits: int) -> str:
    return "not within the lines" if value is None else f"{value:.{digits}f} {unit}"


def _integral(time: float | None) -> str:
    return "none (P)" if time is None else quantity(time, "s")


def _frequencies(found: tuple[float, ...]) -> str:
    return ", ".join(f"{each:.0f} Hz" for each in found) or "none"


def _reliable(found: AxisResponse) -> str:
    frequency = found.bode.frequency[found.bode.sure]
    return f"{len(frequency)} of {len(found.bode.frequency)} lines, {frequency.min():.0f} to {frequency.max():.0f} Hz"
