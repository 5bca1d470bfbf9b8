"""The answer in words and rounded figures: the same in the report and in the terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import pi

from drivetwin.diagnosis.prepare.testable import NotTestable
from drivetwin.diagnosis.propose.search import ANGLES
from drivetwin.diagnosis.report.remains import TimeInterval
from drivetwin.diagnosis.report.result import AxisGap, Cause, CorrectedMass, Diagnosis, Estimate, Residual, Unknown, Verdict
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.foundation.quantities import Scale, number, quantity, scale_of
from drivetwin.twin.comparison import MODEL, WITH_EFFECTS, AxisComparison

_NAMED_AT_MOST = 3
"""Axes that the verdict names one by one."""
LIKELY = 0.05
"""Probability from which a cause is shown with all that is known of it."""
NEARLY = 0.9999
"""Probability as which certainty is written."""
UNDETERMINED = "not determined"
"""Of a parameter whose interval holds every value that it can have."""


def shrinks(axis: AxisComparison, signal: str) -> str:
    """How far a signal of a replay is off, in per cent of the measured one: as the model stands, and with the effects."""
    if signal not in axis.measured:
        return "-"
    before, after = (100.0 * axis.runs[run].apart[signal].relative for run in (MODEL, WITH_EFFECTS))
    return f"{before:.3g} → {after:.3g} %"


def percent(share: float) -> str:
    """A share in per cent, with a decimal near 0 and 100; 99.96 % is not called all, nor 0.04 % nothing."""
    if 0.9995 <= share < 1.0:
        return "> 99.9 %"
    if 0.0 < share < 0.0005:
        return "< 0.1 %"
    near_an_end = 0.0 < abs(share) < 0.015 or 0.985 <= share < 1.0
    return f"{100.0 * share:.1f} %" if near_an_end else f"{100.0 * share:.0f} %"


def chance(probability: float) -> str:
    """A probability in per cent; none is certain, so that 1 is "> 99.9 %"."""
    return percent(min(probability, NEARLY))


def span_percent(low: float, high: float) -> str:
    """An interval of shares; one figure where both ends are rounded to the same."""
    first, last = percent(low), percent(high)
    return last if first == last else f"{first.removesuffix(' %')} to {last}"


def level(value: float, unit: str) -> str:
    """A torque or force in a unit that fits its size."""
    return quantity(value, unit, 3)


def p_words(p_value: float) -> str:
    """Probability of such a gap by chance where there is none."""
    return f"p = {p_value:.2g}" if p_value > 1e-12 else "p < 1e-12"


def of_torque(value: float, gap: AxisGap, scale: Scale) -> str:
    """A level [N·m or N], in the unit of a scale, with its share of the torque's rms."""
    shown = number(scale.factor * value)
    return f"{shown} ({100.0 * value / gap.torque_rms:.1f} %)" if gap.torque_rms > 0.0 else shown


def closed(gap: AxisGap, after_rms: float) -> float:
    """Share of the gap's energy that is gone with the selected effects; contract gap-report/2, `gap_closed`."""
    return 1.0 - (after_rms / gap.gap_rms) ** 2 if gap.gap_rms > 0.0 else 0.0


def name_of(effect: str) -> str:
    """An effect, or another part of a gap, in a sentence."""
    return effect.replace("_", " ")


def cause_name(cause: Cause) -> str:
    """An effect and its axis."""
    return f"{name_of(cause.effect)} on {cause.axis}"


def undistinguished(cause: Cause) -> str:
    """From what a cause cannot be distinguished, and what would do it."""
    names = listed([name_of(effect) for effect in cause.indistinguishable_from], "or")
    ways = (("by motion", cause.tell_apart_by), ("by sensor", cause.or_by_sensor))
    told = "; ".join(f"{how}: {what}" for how, what in ways if what)
    return f"{cause_name(cause)} cannot be distinguished from {names} by these data{f'; {told}' if told else ''}"


def estimate_figures(estimate: Estimate) -> tuple[str, str, str, str]:
    """A parameter, both ends of its interval, and the unit that fits it, empty for a pure number."""
    scale = scale_of(estimate.unit, estimate.value)
    value, low, high = (number(scale.factor * each) for each in (estimate.value, *estimate.ci90))
    return value, low, high, scale.unit


def is_determined(name: str, estimate: Estimate) -> bool:
    """Whether recordings determine a parameter: not an angle whose interval is a turn, but for rounding, or more."""
    low, high = estimate.ci90
    return name not in ANGLES or high - low < 2.0 * pi * (1.0 - 1e-9)


def estimate_words(name: str, estimate: Estimate) -> str:
    """A parameter with its interval."""
    if not is_determined(name, estimate):
        return f"{name_of(name)} {UNDETERMINED}"
    value, low, high, unit = estimate_figures(estimate)
    return f"{name_of(name)} {value} ({low} to {high}) {unit}".rstrip()


def listed(words: Sequence[str], last: str = "and") -> str:
    """Words in a sentence: a, b and c."""
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def interval_words(count: int) -> str:
    """How many intervals of time."""
    return "one interval" if count == 1 else f"{count} intervals"


def time_words(interval: TimeInterval) -> str:
    """An interval of time, on its recording's own time."""
    return f"{interval.begin:.2f} to {interval.end:.2f} s"


_QUANTITIES: Mapping[str, str] = {"cross_axis": "the motion of another axis", "frequency": "a single frequency"}


def goes_with_words(unknown: Unknown) -> str:
    """What the unknown goes with and how fast it varies, as the end of a sentence."""
    if not unknown.goes_with:
        return "depends on none of the quantities tested"
    with_it = listed([_QUANTITIES.get(each, each) for each in unknown.goes_with])
    time = quantity(unknown.correlation_time, "s", 3)
    return f"goes with {with_it}{f' and has a correlation time of {time}' if unknown.correlation_time > 0.0 else ''}"


@dataclass(frozen=True)
class Untested:
    """Effects that recordings cannot answer for one and the same reason."""

    effects: tuple[str, ...]
    reason: str
    needed: str


def untested(entries: Iterable[NotTestable]) -> tuple[Untested, ...]:
    """One entry a reason, in the order in which reasons first appear."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for entry in entries:
        reasons.setdefault((entry.reason, entry.needed), []).append(entry.effect)
    return tuple(Untested(tuple(effects), *why) for why, effects in reasons.items())


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The verdict with the figures that it rests on."""
    if diagnosis.verdict is Verdict.NO_GAP:
        levels = ", ".join(f"{name} {level(gap.gap_rms, diagnosis.units[name])}" for name, gap in diagnosis.axes.items())
        return f"No gap beyond noise on any axis ({levels} rms)."
    significant = [name for name, gap in diagnosis.axes.items() if gap.significant]
    if len(significant) > _NAMED_AT_MOST:
        parts = [_counted(len(diagnosis.selected), "effect"), _counted(len(diagnosis.masses), "corrected mass", "es")]
        added = listed([each for each in parts if each])
        added += f" on {len(significant)} axes" if added else ""
        figures = _range(significant, diagnosis)
    else:
        added = listed([each for each in (added_words(_largest_first(diagnosis)), masses_words(diagnosis.masses)) if each])
        figures = "; ".join(_shrink(name, diagnosis) for name in significant)
    opening = f"{_BY[diagnosis.verdict]} {added}" if added else _BY_NOTHING[diagnosis.verdict]
    return f"{opening}: {figures}."


def _counted(count: int, what: str, plural: str = "s") -> str:
    """How many of something; empty for none."""
    return f"one {what}" if count == 1 else f"{count} {what}{plural}" if count else ""


def _largest_first(diagnosis: Diagnosis) -> list[PlacedEffect]:
    """What the patch adds, in the order of the causes."""
    order = [(cause.effect, cause.axis) for cause in diagnosis.causes]
    return sorted(
        diagnosis.selected,
        key=lambda one: order.index(where) if (where := (one.effect.name, one.axis)) in order else len(order),
    )


def _range(axes: Sequence[str], diagnosis: Diagnosis) -> str:
    """Of many axes how much of the gap is closed, and the one of which least is known."""
    shares = [closed(diagnosis.axes[name], diagnosis.after_rms[name]) for name in axes]
    worst = max(axes, key=lambda name: diagnosis.axes[name].unknown.share)
    unknown = f"most unknown on {worst}, {percent(diagnosis.axes[worst].unknown.share)}"
    return f"{span_percent(min(shares), max(shares))} of the gap's energy closed, {unknown}"


_BY: Mapping[Verdict, str] = {
    Verdict.EXPLAINED: "The gap is explained by",
    Verdict.PARTLY_EXPLAINED: "The gap is partly explained by",
    Verdict.UNEXPLAINED: "Only a small part of the gap is explained, by",
}
_BY_NOTHING: Mapping[Verdict, str] = {
    Verdict.EXPLAINED: "The gap is explained",
    Verdict.PARTLY_EXPLAINED: "The gap is partly explained",
    Verdict.UNEXPLAINED: "No effect of the library explains the gap",
}
"""Where nothing is added."""


def added_words(selected: Sequence[PlacedEffect]) -> str:
    """What the patch adds, axis by axis: "coulomb and 2 × torque ripple on lift"; empty where it adds nothing."""
    by_axis: dict[str, list[str]] = {}
    for placed in selected:
        by_axis.setdefault(placed.axis, []).append(name_of(placed.effect.name))
    axes = [f"{listed([_times(*one) for one in Counter(names).items()])} on {axis}" for axis, names in by_axis.items()]
    return "; ".join(axes) if any(" and " in each for each in axes) else listed(axes)


def masses_words(masses: Sequence[CorrectedMass]) -> str:
    """Bodies whose mass the patched model corrects: "the mass of forearm"; empty where it corrects none."""
    names = [one.body for one in masses]
    return f"the {'mass' if len(names) == 1 else 'masses'} of {listed(names)}" if names else ""


def mass_words(one: CorrectedMass) -> tuple[str, str]:
    """The mass in the model and as found, with its interval: "1.2 kg", "1.08 kg (1.05 to 1.11)"."""
    value, low, high, unit = estimate_figures(one.mass)
    before = number(scale_of("kg", one.mass.value).factor * one.nominal)
    return f"{before} {unit}", f"{value} {unit} ({low} to {high})"


def residual_words(diagnosis: Diagnosis) -> str:
    """What the tables of what has no name do; empty where there are none."""
    each = [_table_words(one, diagnosis) for one in diagnosis.residual]
    return f"A table of what has no name, which is not a cause, closes {'; '.join(each)}." if each else ""


def _table_words(one: Residual, diagnosis: Diagnosis) -> str:
    axis = one.table.axis
    scale = scale_of(diagnosis.units[axis], diagnosis.after_rms[axis])
    sizes = f"{number(scale.factor * diagnosis.after_rms[axis])} to {number(scale.factor * one.gap_rms)} {scale.unit} rms"
    return f"{percent(one.of_unknown)} of the unknown on {axis} ({sizes} on the validation motion)"


def _times(name: str, count: int) -> str:
    return name if count == 1 else f"{count} × {name}"


def _shrink(name: str, diagnosis: Diagnosis) -> str:
    gap, after = diagnosis.axes[name], diagnosis.after_rms[name]
    scale = scale_of(diagnosis.units[name], gap.gap_rms)
    before = f"{number(scale.factor * gap.gap_rms)} to " if after != gap.gap_rms else ""
    sizes = f"{before}{number(scale.factor * after)} {scale.unit}"
    return f"{name} {sizes} rms, {percent(gap.unknown.share)} unknown"
