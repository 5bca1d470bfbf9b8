"""The section of the shares: what the gap of each axis is made of, as a stacked bar and as figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import cycle

from drivetwin.diagnosis.report.result import NOISE, UNKNOWN, AxisGap, Diagnosis, Share
from drivetwin.diagnosis.report.wording import level, name_of, percent, span_percent
from drivetwin.foundation.page_table import plain_table

STYLE = """<style>
.stack { display: grid; grid-template-columns: 150px minmax(0, 1fr); gap: 4px 12px; align-items: center; margin: 6px 0; }
.stack > b { overflow-wrap: anywhere; line-height: 1.3; }
.stack .parts { display: flex; height: 34px; border-radius: 5px; overflow: hidden; }
.stack .note { display: block; font-weight: 400; }
.parts > span { flex-basis: 0; min-width: 0; overflow: hidden; display: flex; flex-wrap: wrap; border-right: 1px solid #fff; }
.parts i { flex: none; font: 13px/34px system-ui, sans-serif; height: 34px; padding-left: 5px; white-space: nowrap; }
.parts i:first-child { width: 1px; padding: 0; }
.key { display: inline-block; width: 12px; height: 12px; border-radius: 3px; margin-right: 7px; vertical-align: -1px; }
@media (max-width: 700px) { .stack { grid-template-columns: minmax(0, 1fr); } .stack .note { display: inline; } }
</style>"""


@dataclass(frozen=True)
class _Paint:
    """Colour of a part and of the words on it."""

    background: str
    ink: str


_DARK, _LIGHT = "#111111", "#ffffff"
_UNKNOWN = _Paint("repeating-linear-gradient(45deg, #4a4a4a 0 6px, #626262 6px 12px)", _LIGHT)
_NOISE = _Paint("#d5dbe0", _DARK)
_EFFECTS = (
    _Paint("#0072b2", _LIGHT),
    _Paint("#e69f00", _DARK),
    _Paint("#007a5a", _LIGHT),
    _Paint("#cc79a7", _DARK),
    _Paint("#56b4e9", _DARK),
    _Paint("#b84a00", _LIGHT),
    _Paint("#f0e442", _DARK),
)
"""After Okabe and Ito (2008), green and vermilion darker so that white words on them can be read (WCAG 2, 4.5 to 1)."""


def shares_section(diagnosis: Diagnosis) -> str:
    """Bars and table of the axes that have a gap; empty where none has."""
    gaps = {name: gap for name, gap in diagnosis.axes.items() if gap.significant and gap.shares}
    if not gaps:
        return ""
    paints = _paints(share.of for gap in gaps.values() for share in gap.shares)
    words = {axis: _words(diagnosis, axis) for axis in gaps}
    bars = "".join(_stack(name, gap, diagnosis.units[name], paints, words[name]) for name, gap in gaps.items())
    rows = [row for name, gap in gaps.items() for row in _rows(name, gap, diagnosis.units[name], paints, words[name])]
    head = ["Part", "Share", "90 % interval", "Level, rms"]
    return (
        f"<section><h2>What the gap is made of</h2>{bars}"
        f"{plain_table(head, rows, numeric=(1, 2, 3))}"
        '<p class="note">Shares are of the energy of the gap (its mean square) on motion that was not fitted; with unknown and '
        "noise they add up to 100 %. Unknown is what no effect of the library explains. A level is the root of the share times "
        "the gap.</p></section>"
    )


def _paints(parts: Iterable[str]) -> Mapping[str, _Paint]:
    """The same colour for the same effect on every axis."""
    effects = [name for name in dict.fromkeys(parts) if name not in (UNKNOWN, NOISE)]
    return dict(zip(effects, cycle(_EFFECTS), strict=False)) | {UNKNOWN: _UNKNOWN, NOISE: _NOISE}


def _words(diagnosis: Diagnosis, axis: str) -> list[str]:
    """What each share of an axis's gap is of; several of a kind by their order or period."""
    own = [one.effect for one in diagnosis.selected if one.axis == axis]
    names = [share.of for share in diagnosis.axes[axis].shares]
    found = [name_of(name) for name in names]
    for k, (name, effect) in enumerate(zip(names, own, strict=False)):
        waves = [each for each in ("order", "period") if hasattr(effect, each)]
        if names.count(name) > 1:
            found[k] += "".join(f", {each} {getattr(effect, each):.3g}" for each in waves)
    return found


def _stack(axis: str, gap: AxisGap, unit: str, paints: Mapping[str, _Paint], names: Sequence[str]) -> str:
    told = list(zip(gap.shares, names, strict=True))
    parts = "".join(_part(share, name, paints[share.of]) for share, name in told if share.share > 0.0)
    words = ", ".join(f"{name} {percent(share.share)}" for share, name in told)
    return (
        f'<div class="stack"><b>{escape(axis)} <span class="note">{escape(level(gap.gap_rms, unit))}</span></b>'
        f'<div class="parts" role="img" aria-label="{escape(words)}">{parts}</div></div>'
    )


def _part(share: Share, name: str, paint: _Paint) -> str:
    """Of its words those are seen that fit: what does not goes to a next line, which is hidden."""
    size = percent(share.share)
    told = f"{size} {name}, 90 % interval {span_percent(*share.ci90)}"
    return (
        f'<span style="flex-grow:{1000.0 * share.share:.2f};background:{paint.background};color:{paint.ink}" '
        f'title="{escape(told)}"><i></i><i>{escape(size)}</i><i>{escape(name)}</i></span>'
    )


def _rows(axis: str, gap: AxisGap, unit: str, paints: Mapping[str, _Paint], names: Sequence[str]) -> list[list[str]]:
    return [[escape(axis)]] + [
        [
            f'<span class="key" style="background:{paints[share.of].background}"></span>{escape(name)}',
            percent(share.share),
            span_percent(*share.ci90),
            escape(level(gap.gap_rms * max(share.share, 0.0) ** 0.5, unit)),
        ]
        for share, name in zip(gap.shares, names, strict=True)
    ]
