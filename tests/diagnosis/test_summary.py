"""The answer in words: in the terminal, and sentence by sentence."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from gap_bench import CAUSES, STRIBECK, died_out_case, stribeck_case
from rich.console import Console

from diagnosis.report.result import Diagnosis, Verdict
from diagnosis.report.wording import closed_of_explainable, fitted_note, percent, verdict_sentence
from drivetwin.cli.diagnose_summary import print_summary

CASE = stribeck_case(20.0)


def said(found: Diagnosis) -> str:
    """What the terminal shows, without its line breaks."""
    out = io.StringIO()
    print_summary(Console(file=out, width=112), found)
    return " ".join(out.getvalue().split())


def test_the_terminal_tells_the_verdict_the_causes_and_what_cannot_be_told_apart() -> None:
    words = said(CASE)
    assert words.startswith("The gap is explained by stribeck on rotate: rotate from ")
    gap, after = CASE.axes["rotate"], CASE.after_rms["rotate"]
    assert f"rotate {gap.gap_rms:.3g} ({100 * gap.gap_rms / gap.torque_rms:.1f} %) 0.02 {after:.3g}" in words
    assert "stretch 0.0" in words
    assert "no gap beyond noise" in words
    assert "1 stribeck on rotate 0.91 static torque 1.3 (1.2 to 1.4) N·m" in words
    assert "presliding on rotate 0.06" in words
    assert "a cause outside the library on rotate" not in words, "2 % is not worth a line"
    assert (
        "stribeck on rotate or presliding: these data cannot tell; told apart by slow constant-velocity sweeps below "
        "0.05 rad/s" in words
    )
    assert words.endswith("the friction of the model was 3 % low")


def test_a_gap_that_only_the_fitted_motion_shows_is_told_of_it() -> None:
    found = died_out_case()
    gap, after = found.fitted["rotate"].gap_rms, found.fitted["rotate"].after_rms
    sentence = verdict_sentence(found)
    assert sentence.startswith(f"The gap is explained by stribeck on rotate: rotate from {gap:.3g} to {after:.3g} N·m rms, ")
    assert sentence.endswith("of what can be explained, on the fitted motion.")
    assert found.axes["rotate"].gap_rms < 0.1 * gap
    level = f"{found.axes['rotate'].gap_rms:.3g} N·m rms there"
    assert f"the validation data do not show it, {level}" in fitted_note(found, "rotate")
    words = said(found)
    assert f"rotate {gap:.3g} (" in words
    assert "Gap on the validation recordings, of rotate on the fitted ones, rms in motion" in words


def test_every_verdict_has_its_sentence() -> None:
    partly = replace(CASE, verdict=Verdict.PARTLY_EXPLAINED, selected=(STRIBECK, STRIBECK, STRIBECK))
    assert "is partly explained by stribeck on rotate, stribeck on rotate and stribeck on rotate: " in verdict_sentence(partly)
    nothing = replace(CASE, verdict=Verdict.UNEXPLAINED, selected=(), causes=CAUSES[4:])
    assert verdict_sentence(nothing).startswith("The gap is not explained: no effect of the library explains it; rotate from ")
    assert verdict_sentence(replace(CASE, verdict=Verdict.NO_GAP)).startswith("No gap beyond noise on any axis (rotate ")


@pytest.mark.parametrize(
    ("share", "words"),
    [(0.5, "50 %"), (0.9849, "98 %"), (0.987, "98.7 %"), (0.9996, "> 99.9 %"), (1.0, "100 %"), (0.0, "0 %"), (-0.2, "-20 %")],
)
def test_what_is_nearly_all_is_not_called_all(share: float, words: str) -> None:
    assert percent(share) == words


def test_the_share_of_what_can_be_explained() -> None:
    gap = replace(CASE.axes["rotate"], gap_rms=0.5, noise_rms=0.3)
    assert closed_of_explainable(gap, 0.4) == pytest.approx((0.25 - 0.16) / (0.25 - 0.09))
    assert closed_of_explainable(gap, 0.2) == 1.0
    assert closed_of_explainable(replace(gap, noise_rms=0.5), 0.2) is None
