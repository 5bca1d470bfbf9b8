"""The report as a parser of HTML sees it."""

from __future__ import annotations

import re
from dataclasses import asdict, replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from report_case import ANY_PHASE, CASE, LIGHTER, ONE_WAY, RIPPLE, SHARES, SLOW, placed, slowly, small

from drivetwin.diagnosis.prepare.testable import NotTestable
from drivetwin.diagnosis.report import page_shares
from drivetwin.diagnosis.report.page import write_report_page
from drivetwin.diagnosis.report.result import Cause, Diagnosis, Estimate, FrequencyResponse, NoResponse, Share, Shrink, Verdict
from drivetwin.diagnosis.settings import Settings
from drivetwin.identification.frequency.resonances import Resonances

INPUTS = {"model.xml": "ab" * 32, "rec/<sweep>/signals.parquet": "cd" * 32}


class Page(HTMLParser):
    """Text outside scripts and styles, cells of tables, titles, what is loaded from elsewhere, and how many figures."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.text = ""
        self.loaded: list[str | None] = []
        self.titles: list[str | None] = []
        self.figures = self._hidden = 0
        self._in_cell = False
        self.widths: list[float] = []
        self.rows: list[list[str]] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self._hidden += tag in ("script", "style")
        self.loaded += [value for name, value in named.items() if name in ("src", "href")]
        self.figures += named.get("class") == "plotly-graph-div"
        if "title" in named:
            self.titles.append(named["title"])
            self.widths += [float(grow) for grow in re.findall(r"flex-grow:([\d.]+)", named.get("style") or "")]
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
            self._in_cell = True

    def handle_endtag(self, tag: str) -> None:
        self._hidden -= tag in ("script", "style")
        self._in_cell = self._in_cell and tag not in ("td", "th")

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.text += data
            if self._in_cell:
                self.rows[-1][-1] += data

    def row(self, *begin: str) -> list[str]:
        """The first row that begins with these cells."""
        return next(row for row in self.rows if row[: len(begin)] == list(begin))


def page_of(diagnosis: Diagnosis, folder: Path) -> Page:
    write_report_page(diagnosis, INPUTS, folder / "report.html")
    return Page(folder / "report.html")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Page:
    """The report of the two axes."""
    return page_of(CASE, tmp_path_factory.mktemp("page"))


def test_the_verdict_stands_first_with_a_table_of_the_axes(page: Page) -> None:
    gap, after = CASE.axes["rotate"].gap_rms, CASE.after_rms["rotate"]
    assert "partly explained by stribeck, torque ripple and spring on rotate" in page.text
    assert page.text.index("partly explained by") < page.text.index("Causes") < page.text.index("Axis rotate")
    levels = ["1.31", f"{gap:.3g} ({100 * gap / 1.31:.1f} %)", "0.02", f"{after:.3g} ({100 * after / 1.31:.1f} %)"]
    assert page.row("rotate") == ["rotate", "yes p < 1e-12", "N·m", *levels, f"{100 * (1 - (after / gap) ** 2):.0f} %", "9 %"]
    assert page.row("stretch")[1:3] == ["no p = 0.41", "mN"]


def test_the_first_table_is_in_the_unit_that_fits_the_gap(page: Page, tmp_path: Path) -> None:
    little = page_of(small(CASE), tmp_path)
    assert little.row("rotate")[2] == "mN·m"
    assert little.row("rotate")[3:7] == page.row("rotate")[3:7], "the same digits"
    assert page.row("stretch")[-2:] == ["–", "–"], "of noise nothing is closed"


def test_every_share_of_a_gap_has_its_width_its_interval_and_a_row(page: Page) -> None:
    assert page.widths == pytest.approx([1000.0 * share.share for share in SHARES])
    assert page.titles[0] == "62 % stribeck, 90 % interval 58 to 66 %"
    assert page.titles[3] == "9 % unknown, 90 % interval 5 to 12 %"
    level = CASE.axes["rotate"].gap_rms * np.sqrt(0.18)
    assert page.row("torque ripple", "18 %") == ["torque ripple", "18 %", "15 to 20 %", f"{1e3 * level:.3g} mN·m"]
    assert page.row("noise")[1:3] == ["4 %", "3 to 5 %"]
    assert sum(row[0] == "noise" for row in page.rows) == 1, "what is no gap is not divided up"


def test_words_on_the_bars_can_be_read() -> None:
    """WCAG 2.1, 1.4.3: contrast of 4.5 to 1 at least."""
    for paint in (*page_shares._EFFECTS, page_shares._UNKNOWN, page_shares._NOISE):
        for background in re.findall("#[0-9a-f]{6}", paint.background):
            light, dark = sorted((luminance(background), luminance(paint.ink)), reverse=True)
            assert (light + 0.05) / (dark + 0.05) >= 4.5, paint


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb (WCAG 2.1)."""
    channels = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    linear = np.where(channels <= 0.03928, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_a_cause_has_its_parameters_with_units_and_what_would_distinguish_it(page: Page) -> None:
    first = page.row("stribeck", "rotate")
    assert first[2:4] == ["97 %", "62 %"]
    assert first[4] == "63 % (58 to 67 %)66 % of explainable"
    assert "static torque 1.3 N·m (1.17 to 1.43)" in first[5]
    assert "exponent 1 (0.9 to 1.1)" in first[5], "a pure number has no unit"
    assert first[6] == "presliding"
    assert page.row("rotate: presliding or stribeck")[1:] == [SLOW, "an encoder on the joint"]
    assert page.row("torque ripple", "rotate")[6] == "–"
    assert page.row("spring", "rotate")[4] == "7 %without it the gap is no larger than the noise"
    assert "Below 5 %: delay on rotate 3 %." in page.text
    assert "patched.xml with effects.json adds stribeck, torque ripple and spring on rotate." in page.text


def test_what_distinguishes_several_waves_from_the_same_others_is_said_once(tmp_path: Path) -> None:
    wave = next(cause for cause in CASE.causes if cause.effect == "torque_ripple")
    wave = replace(wave, indistinguishable_from=("transmission_error",), tell_apart_by=SLOW, or_by_sensor="")
    others = [cause for cause in CASE.causes if cause.effect != "torque_ripple"]
    told = page_of(replace(CASE, causes=(wave, wave, *others)), tmp_path)
    assert sum(row[0] == "rotate: torque ripple or transmission error" for row in told.rows) == 1


def test_a_mass_that_was_corrected_stands_with_the_causes(page: Page, tmp_path: Path) -> None:
    may_be = replace(LIGHTER, instead=("torque_offset", "gravity"))
    corrected = page_of(replace(CASE, masses=(may_be,)), tmp_path)
    row = corrected.row("forearm", "rotate")
    assert row[2:6] == ["14 %", "14 % (10 to 20 %)15 % of explainable", "1.2 kg", "1.08 kg (1.05 to 1.11)"]
    assert row[6] == "torque offset or gravity"
    assert "patched.xml corrects the mass of forearm." in corrected.text
    assert "Corrected mass" not in page.text


def test_a_parameter_is_in_the_unit_that_fits_it(tmp_path: Path) -> None:
    play = Cause("backlash", "stretch", 0.9, 0.1, {"gap": Estimate(0.00201, "m", (0.0019, 0.0021))}, None)
    page = page_of(replace(CASE, causes=(play,)), tmp_path)
    assert page.row("backlash", "stretch")[5] == "gap 2.01 mm (1.9 to 2.1)"


def test_an_angle_that_may_be_anywhere_has_no_figures(tmp_path: Path) -> None:
    page = page_of(replace(CASE, causes=(ANY_PHASE,)), tmp_path)
    assert page.row("torque ripple", "rotate")[5] == "amplitude 0.11 N·m (0.099 to 0.121)phase not determined"


def test_an_interval_that_reaches_below_nothing_is_told_in_words(tmp_path: Path) -> None:
    closes = replace(CASE.causes[0], gap_closed=Shrink(0.89, (-0.44, 0.999), 0.9))
    shown = page_of(replace(CASE, causes=(closes,)), tmp_path).row("stribeck", "rotate")[4]
    assert shown.startswith("89 % (-44 to 99.9 %; other motion may not get closer)")


def test_the_unknown_is_a_cause_and_says_what_it_goes_with(page: Page) -> None:
    words = "goes with position and the motion of another axis and has a correlation time of 0.21 s"
    assert page.row("unknown", "rotate")[2:] == ["93 %", "9 %", "–", words, "–"]
    assert f"The unknown, 9 % of the gap, {words}." in page.text


def test_regimes_stand_before_and_after(page: Page) -> None:
    assert page.row("reversal") == ["reversal", "time to a reversal -50 to 50 ms", "10 %", "80 %"]
    assert page.row("high speed") == ["high speed", "speed 0.19 to 0.77 rad/s", "10 %", "–"]
    assert "% of its energy is in" in page.text
    assert "80 % of what is left above noise is in the regime reversal." in page.text


def test_what_could_not_be_tested_has_one_row_a_reason(page: Page) -> None:
    assert page.row("coulomb asymmetry and viscous asymmetry")[1:] == list(ONE_WAY)
    assert page.row("temperature drift")[1:] == ["too short", "start_time in recording.json, or longer"]


def test_the_method_tells_every_number_that_steers_the_answer(page: Page) -> None:
    assert page.row("rotate", "48 Hz")[2:] == ["2 mrad/s", "20 mN·m", "16 mN·m", "0.1 N·m", "p < 1e-12"]
    assert page.row("stretch", "48 Hz")[2] == "2 mm/s"
    assert "Noise of rotate, stretch: spectrum of the torque above 3 cut-offs." in page.text
    for name in asdict(Settings()):
        assert page.row(name.replace("_", " "))
    assert page.row("cutoff hz")[1] == "chosen from the recordings"
    assert page.row("timing spread")[1] == "0.5 ms"
    assert page.row("rec/<sweep>/signals.parquet")[1] == "cd" * 32


def test_nothing_is_loaded_and_every_axis_has_its_pictures(page: Page) -> None:
    assert page.loaded == []
    # seven for rotate; what stretch has is noise, so that there is nothing to place
    assert page.figures == 7 + 1


def test_the_words_are_those_of_the_field(page: Page) -> None:
    assert "nan" not in re.findall(r"\w+", page.text.lower())
    for phrase in ("tell apart", "told apart", "tells apart", "m or rad", "`"):
        assert phrase not in page.text, phrase
    assert "_" not in page.text.replace("start_time", ""), "effects and settings in words"
    assert "the friction of the model was 3 % low" in page.text


def test_two_of_a_kind_are_two(tmp_path: Path) -> None:
    shares = (Share("torque_ripple", 0.6, (0.5, 0.7)), Share("torque_ripple", 0.3, (0.2, 0.4)), Share("noise", 0.1, (0.0, 0.2)))
    gap = replace(CASE.axes["rotate"], shares=shares)
    other = placed("torque_ripple", amplitude=0.05, order=28.0, phase=0.1)
    found = page_of(replace(CASE, axes={**CASE.axes, "rotate": gap}, selected=(RIPPLE, other)), tmp_path)
    assert found.widths == pytest.approx([600.0, 300.0, 100.0])
    assert "explained by 2 × torque ripple on rotate" in found.text
    assert "torque ripple, order 24" in found.text
    assert "torque ripple, order 28" in found.text


def test_no_gap_and_held_back_blocks_are_said(tmp_path: Path) -> None:
    axes = {"rotate": CASE.axes["stretch"]}
    calm = replace(CASE, verdict=Verdict.NO_GAP, axes=axes, selected=(), causes=(), held_back=True)
    found = page_of(calm, tmp_path)
    assert "No gap beyond noise on any axis (rotate 19.5 mN·m rms)" in found.text
    assert "blocks of the recordings were held back from the fit" in found.text
    assert "No effect is added." in found.text
    assert "What the gap is made of" not in found.text
    assert found.figures == 1


def test_a_cut_off_that_a_recording_cannot_have_is_said(tmp_path: Path) -> None:
    found = page_of(replace(CASE, predictions=(slowly(CASE.predictions[0], 20),)), tmp_path)
    assert "lowered to 0.4 of the sample rate where that is less (20 Hz)" in found.text


def test_an_axis_that_never_moves_is_said(tmp_path: Path) -> None:
    run = CASE.predictions[0]
    still = replace(run.axes["stretch"], used=np.zeros(len(run.time), dtype=np.bool_))
    gap = replace(
        CASE.axes["stretch"], standstill_velocity=np.inf, torque_rms=0.0, gap_rms=0.0, where=(), shares=(),
        not_testable=(NotTestable("coulomb", *ONE_WAY),),
    )  # fmt: skip
    still_run = replace(run, axes={**run.axes, "stretch": still})
    calm = replace(CASE, axes={**CASE.axes, "stretch": gap}, predictions=(still_run,))
    found = page_of(calm, tmp_path)
    assert "No sample in motion on the validation data" in found.text
    assert found.row("stretch", "48 Hz")[2] == "never moves"
    assert found.row("coulomb")[1:] == list(ONE_WAY)
    assert "inf" not in re.findall(r"\w+", found.text)


def test_an_axis_says_its_frequency_response_or_why_it_has_none(tmp_path: Path) -> None:
    frequency = np.arange(1.0, 101.0)
    told = FrequencyResponse(
        "torque_offset", frequency, np.asarray(-0.5j / np.pi / frequency, np.complex128), np.ones(100), frequency < 80.0,
        40, 2.0, Resonances((50.0,), (25.0,)),
    )  # fmt: skip
    found = page_of(replace(CASE, responses={"rotate": told, "stretch": NoResponse("its torque was not recorded")}), tmp_path)
    assert "Anti-resonance at 25.0 Hz, resonance at 50.0 Hz, from 1 to 79 Hz: elastic between motor and load" in found.text
    assert "the load would be 3 times the motor" in found.text
    assert "These recordings do not show it: its torque was not recorded." in found.text
    assert found.figures == 7 + 1 + 1
    stiff = replace(told, resonances=Resonances((), ()))
    assert "No resonance from 1 to 79 Hz" in page_of(replace(CASE, responses={"rotate": stiff}), tmp_path).text
