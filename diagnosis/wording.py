"""The answer in words and rounded figures: the same in the report and in the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from diagnosis.remains import Spell
from diagnosis.result import NONE, UNKNOWN, AxisGap, Cause, Diagnosis, Estimate, Verdict


def number(value: float) -> str:
    """Three significant digits."""
    return f"{value:.3g}"


def percent(share: float) -> str:
    """A share in per cent; 99.95 % is not called 100."""
    rounded = f"{100.0 * share:.0f}" if abs(share) < 0.985 or share >= 1.0 else f"{100.0 * share:.1f}"
    return "> 99.9 %" if rounded == "100.0" else f"{rounded} %"


def of_torque(level: float, gap: AxisGap) -> str:
    """A level with its share of the torque's rms."""
    return f"{number(level)} ({100.0 * level / gap.torque_rms:.1f} %)" if gap.torque_rms > 0.0 else number(level)


def closed(gap: AxisGap, after_rms: float) -> float:
    """Share of the gap's energy that is gone with the selected effects; contract gap-report/1, `gap_closed`."""
    return 1.0 - (after_rms / gap.gap_rms) ** 2 if gap.gap_rms > 0.0 else 0.0


def closed_of_explainable(gap: AxisGap, after_rms: float) -> float | None:
    """The same with the noise taken off both; None where the gap is no larger than the noise."""
    explainable = gap.gap_rms**2 - gap.noise_rms**2
    return (gap.gap_rms**2 - max(after_rms, gap.noise_rms) ** 2) / explainable if explainable > 0.0 else None


def name_of(effect: str) -> str:
    """An effect's name in a sentence."""
    return {UNKNOWN: "a cause outside the library", NONE: "nothing (more)"}.get(effect, effect.replace("_", " "))


def others_words(count: int) -> str:
    """Answers that are told as a number."""
    return "one other answer" if count == 1 else f"{count} other answers together"


def cause_name(cause: Cause) -> str:
    """An effect and its axis."""
    return f"{name_of(cause.effect)} on {cause.axis}" if cause.axis else name_of(cause.effect)


def estimate_words(name: str, estimate: Estimate) -> str:
    """A parameter with its interval."""
    low, high = estimate.ci90
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    return f"{name.replace('_', ' ')} {number(estimate.value)} ({number(low)} to {number(high)}){unit}"


def spells_words(count: int) -> str:
    """So many spells."""
    return "one spell" if count == 1 else f"{count} spells"


def time_words(spell: Spell) -> str:
    """When a spell was, on its recording's own time."""
    return f"{spell.begin:.2f} to {spell.end:.2f} s"


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The verdict with the figures that it rests on."""
    significant = [name for name, gap in diagnosis.axes.items() if gap.significant]
    if diagnosis.verdict is Verdict.NO_GAP:
        levels = ", ".join(f"{name} {_level(gap.gap_rms, diagnosis.units[name])}" for name, gap in diagnosis.axes.items())
        return f"No gap beyond noise on any axis ({levels} rms)."
    shrink = "; ".join(_shrink(name, diagnosis) for name in significant)
    added = _listed([f"{name_of(placed.effect.name)} on {placed.axis}" for placed in diagnosis.selected])
    if not diagnosis.selected:
        return f"{_OPENING[diagnosis.verdict]}: no effect of the library explains it; {shrink}."
    return f"{_OPENING[diagnosis.verdict]} by {added}: {shrink}."


_OPENING: Mapping[Verdict, str] = {
    Verdict.EXPLAINED: "The gap is explained",
    Verdict.PARTLY_EXPLAINED: "The gap is partly explained",
    Verdict.UNEXPLAINED: "The gap is not explained",
}


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def fitted_note(diagnosis: Diagnosis, axis: str) -> str:
    """What the reader needs to know of an axis whose gap only the fitted motion shows."""
    there = _level(diagnosis.axes[axis].gap_rms, diagnosis.units[axis])
    return (
        f"The gap on {axis} is on the fitted motion only: the validation data do not show it, {there} rms there. What is told "
        f"of {axis}, the verdict too, is of the fitted motion; it was not checked on motion that was not fitted."
    )


def _shrink(name: str, diagnosis: Diagnosis) -> str:
    gap, after = diagnosis.told(name)
    unit = diagnosis.units[name]
    share = closed_of_explainable(gap, after)
    explained = f", {percent(share)} of what can be explained" if share is not None else ""
    fitted = ", on the fitted motion" if name in diagnosis.fitted else ""
    return f"{name} from {number(gap.gap_rms)} to {_level(after, unit)} rms{explained}{fitted}"


def _level(value: float, unit: str) -> str:
    return f"{number(value)} {unit}"
