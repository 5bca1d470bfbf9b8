"""The answer in words: in the terminal, and sentence by sentence."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from report_case import ANY_PHASE, LIGHTER, NOT_TESTABLE, ONE_WAY, RIPPLE, SLOW, STRIBECK, placed, small, two_axes
from rich.console import Console

from drivetwin.cli.diagnose_summary import print_summary
from drivetwin.diagnosis.prepare.testable import NotTestable
from drivetwin.diagnosis.report.result import Diagnosis, Estimate, Unknown, Verdict
from drivetwin.diagnosis.report.wording import (
    added_words,
    chance,
    estimate_words,
    goes_with_words,
    percent,
    span_percent,
    untested,
    verdict_sentence,
)
from drivetwin.foundation.quantities import number

CASE = two_axes()


def said(found: Diagnosis) -> str:
    """What the terminal shows, without its line breaks."""
    out = io.StringIO()
    print_summary(Console(file=out, width=112), found)
    return " ".join(out.getvalue().split())


def test_the_terminal_says_the_verdict_the_causes_and_what_cannot_be_distinguished() -> None:
    words = said(CASE)
    gap, after = CASE.axes["rotate"], CASE.after_rms["rotate"]
    assert words.startswith(
        f"The gap is partly explained by stribeck, torque ripple and spring on rotate: rotate {gap.gap_rms:.3g} to {after:.3g} "
        "N·m rms, 9 % unknown."
    )
    assert f"rotate {gap.gap_rms:.3g} ({100 * gap.gap_rms / gap.torque_rms:.1f} %) 0.02 {after:.3g}" in words
    assert "no gap beyond noise" in words
    assert "stribeck rotate 97 % 62 % static torque 1.3 (1.17 to 1.43) N·m" in words
    assert "unknown rotate 93 % 9 % goes with position and the motion of another axis" in words
    assert "presliding rotate 6 % 5 %" in words
    assert "delay" not in words, "3 % is not worth a line"
    assert (
        f"stribeck on rotate cannot be distinguished from presliding by these data; by motion: {SLOW}; "
        "by sensor: an encoder on the joint" in words
    )
    assert words.endswith("the friction of the model was 3 % low")


def test_an_angle_that_may_be_anywhere_has_no_figures() -> None:
    assert "amplitude 0.11 (0.099 to 0.121) N·m phase not determined" in said(replace(CASE, causes=(ANY_PHASE,)))


def test_the_first_table_is_in_the_unit_that_fits_the_gap() -> None:
    gap, after = CASE.axes["rotate"], CASE.after_rms["rotate"]
    shown = f"rotate {gap.gap_rms:.3g} ({100 * gap.gap_rms / gap.torque_rms:.1f} %) 0.02 {after:.3g}"
    words = said(small(CASE))
    assert shown in words
    assert words[words.index(shown) :].split()[8] == "mN·m"


def test_what_could_not_be_tested_is_said_once_a_reason_for_all_its_axes() -> None:
    both = {name: replace(gap, not_testable=NOT_TESTABLE) for name, gap in CASE.axes.items()}
    words = said(replace(CASE, axes=both))
    line = f"not testable on rotate and stretch: coulomb asymmetry and viscous asymmetry ({ONE_WAY[0]}; needed: {ONE_WAY[1]})"
    assert words.count(line) == 1
    assert words.count("coulomb asymmetry") == 1


def test_without_causes_there_is_no_table_of_them() -> None:
    axes = {"rotate": CASE.axes["stretch"]}
    calm = replace(CASE, verdict=Verdict.NO_GAP, axes=axes, causes=(), selected=(), held_back=True)
    words = said(calm)
    assert words.startswith("No gap beyond noise on any axis (rotate 19.5 mN·m rms)")
    assert "Gap on blocks held back from the recordings" in words
    assert "Causes" not in words


def test_a_mass_that_was_corrected_has_its_row() -> None:
    assert "forearm rotate 14 % 1.2 kg 1.08 kg (1.05 to 1.11)" in said(replace(CASE, masses=(LIGHTER,)))
    assert "Masses" not in said(CASE)


def test_every_verdict_has_its_sentence() -> None:
    gap = f"{CASE.axes['rotate'].gap_rms:.3g}"
    good = replace(CASE, verdict=Verdict.EXPLAINED, selected=(STRIBECK,))
    assert verdict_sentence(good).startswith(f"The gap is explained by stribeck on rotate: rotate {gap} to ")
    little = replace(good, verdict=Verdict.UNEXPLAINED)
    assert verdict_sentence(little).startswith("Only a small part of the gap is explained, by stribeck on rotate: rotate ")
    nothing = replace(little, selected=(), after_rms={name: each.gap_rms for name, each in CASE.axes.items()})
    assert verdict_sentence(nothing) == f"No effect of the library explains the gap: rotate {gap} N·m rms, 9 % unknown."
    bodies = replace(good, selected=(), masses=(LIGHTER,))
    assert verdict_sentence(bodies).startswith(f"The gap is explained by the mass of forearm: rotate {gap} to ")
    both = replace(good, masses=(LIGHTER,))
    assert "explained by stribeck on rotate and the mass of forearm: " in verdict_sentence(both)
    assert verdict_sentence(replace(CASE, verdict=Verdict.NO_GAP)).startswith("No gap beyond noise on any axis (rotate ")


def test_the_verdict_names_the_largest_cause_first() -> None:
    assert verdict_sentence(replace(CASE, selected=tuple(reversed(CASE.selected)))) == verdict_sentence(CASE)
    assert "explained by stribeck, torque ripple and spring on rotate" in verdict_sentence(CASE)


def test_of_many_axes_the_verdict_gives_the_range_and_the_worst() -> None:
    names = ("a", "b", "c", "d")
    gaps = {name: replace(CASE.axes["rotate"], gap_rms=1.0, unknown=Unknown(0.1 * k, (), 0.1)) for k, name in enumerate(names)}
    many = replace(CASE, axes=gaps, after_rms=dict(zip(names, (0.1, 0.2, 0.3, 0.4), strict=True)))
    assert verdict_sentence(many) == (
        "The gap is partly explained by 3 effects on 4 axes: 84 to 99.0 % of the gap's energy closed, most unknown on d, 30 %."
    )


def test_of_many_axes_the_verdict_counts_masses_too() -> None:
    gaps = dict.fromkeys(("a", "b", "c", "d"), CASE.axes["rotate"])
    many = replace(CASE, axes=gaps, after_rms=dict.fromkeys(gaps, 0.1), masses=(LIGHTER,))
    assert verdict_sentence(many).startswith("The gap is partly explained by 3 effects and one corrected mass on 4 axes: ")
    alone = replace(many, selected=(), masses=(LIGHTER, LIGHTER))
    assert verdict_sentence(alone).startswith("The gap is partly explained by 2 corrected masses on 4 axes: ")


def test_what_is_added_is_named_axis_by_axis() -> None:
    offset = placed("torque_offset", "lift", offset=0.3)
    assert added_words((STRIBECK, offset)) == "stribeck on rotate and torque offset on lift"
    assert added_words((RIPPLE, STRIBECK, RIPPLE, offset)) == "2 × torque ripple and stribeck on rotate; torque offset on lift"
    assert added_words(()) == ""


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.5, "50 %"), (0.9849, "98 %"), (0.987, "98.7 %"), (0.9996, "> 99.9 %"), (1.0, "100 %"),
        (0.0, "0 %"), (0.003, "0.3 %"), (0.0004, "< 0.1 %"), (-0.003, "-0.3 %"), (-0.2, "-20 %"), (0.016, "2 %"),
    ],
)  # fmt: skip
def test_what_is_nearly_all_is_not_called_all_nor_little_nothing(share: float, words: str) -> None:
    assert percent(share) == words


def test_no_probability_is_called_certain() -> None:
    assert [chance(one) for one in (1.0, 0.9996, 0.92, 0.0)] == ["> 99.9 %", "> 99.9 %", "92 %", "0 %"]


def test_an_interval_has_its_unit_once() -> None:
    assert span_percent(0.58, 0.66) == "58 to 66 %"
    assert span_percent(0.0, 0.003) == "0 to 0.3 %"
    assert span_percent(0.941, 0.944) == "94 %"


@pytest.mark.parametrize(("value", "words"), [(1234.5, "1230"), (0.001234, "0.00123"), (2.5e7, "2.5e+07"), (48.0, "48")])
def test_figures_are_rounded_to_what_can_be_read(value: float, words: str) -> None:
    assert number(value) == words


def test_a_pure_number_has_no_unit() -> None:
    assert estimate_words("order", Estimate(24.0, "1", (23.9, 24.1))) == "order 24 (23.9 to 24.1)"


def test_what_goes_with_nothing_says_so() -> None:
    assert goes_with_words(Unknown(0.3, (), 0.0)) == "depends on none of the quantities tested"
    assert goes_with_words(Unknown(0.3, ("time",), 12.0)) == "goes with time and has a correlation time of 12 s"


def test_reasons_stand_in_the_order_in_which_they_come() -> None:
    found = untested([NotTestable("b", "x", "y"), NotTestable("a", "u", "v"), NotTestable("c", "x", "y")])
    assert [(each.effects, each.reason, each.needed) for each in found] == [(("b", "c"), "x", "y"), (("a",), "u", "v")]
