"""The report as a parser of HTML sees it, and the arrays behind its pictures against plain numpy."""

from __future__ import annotations

import re
from dataclasses import asdict, fields, replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from drivetwin.diagnosis.prepare.testable import NotTestable
from drivetwin.diagnosis.report import page_shares
from drivetwin.diagnosis.report.page import write_report_page
from drivetwin.diagnosis.report.result import (
    Array,
    AxisGap,
    AxisPrediction,
    Cause,
    Diagnosis,
    Estimate,
    FrequencyResponse,
    NoResponse,
    Pattern,
    Prediction,
    Regime,
    Share,
    Shrink,
    Unknown,
    Verdict,
)
from drivetwin.diagnosis.report.view import drawn, gap_map, mean_over, spectra_of, trace_of, worst_window
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import PlacedEffect, library
from drivetwin.identification.frequency.resonances import Resonances

PERIOD, CUTOFF, STANDSTILL, NOISE = 1e-3, 48.0, 0.002, 0.02
INPUTS = {"model.xml": "ab" * 32, "rec/<sweep>/signals.parquet": "cd" * 32}


def time_of(seconds: float) -> Array:
    """Sample times [s] at 1 kHz."""
    return np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD


def coloured_noise(count: int, rms: float, seed: int = 0) -> Array:
    """White noise through the filter that torque and prediction go through, of this expected rms."""
    sections = signal.butter(4, CUTOFF, fs=1.0 / PERIOD, output="sos")
    _, response = signal.sosfreqz(sections, 8192)
    noise = signal.sosfiltfilt(sections, np.random.default_rng(seed).standard_normal(count + 2000))[1000:-1000]
    return np.asarray(rms * noise / np.sqrt(np.mean(np.abs(response) ** 4)), dtype=np.float64)


def swinging(time: Array) -> tuple[Array, Array, Array]:
    """Position, velocity, acceleration of two swings at once, so that every place sees many speeds."""
    angle = 0.5 * np.pi * time
    position = 0.35 * np.sin(angle) + 0.65 * np.sin(0.31 * angle + 1.0)
    velocity = np.gradient(position, PERIOD)
    return position, velocity, np.gradient(velocity, PERIOD)


def axis_of(time: Array, gap: Array, after: Array | None = None) -> AxisPrediction:
    """An axis that swings, measured with `gap` more than simulated; `after` is what the patch leaves."""
    position, velocity, acceleration = swinging(time)
    before = 2.0 * acceleration + np.sign(velocity) + 0.3 * velocity
    measured = before + gap
    used = np.abs(velocity) > STANDSTILL
    used[:30] = used[-30:] = False
    patched = measured - (np.zeros_like(gap) if after is None else after)
    return AxisPrediction(before, patched, measured, used, position, velocity, acceleration)


def recording_of(time: Array, gap: Array, name: str = "swing") -> Prediction:
    """A validation recording of one axis, rotate."""
    return Prediction(name, time, {"rotate": axis_of(time, gap)})


def slowly(run: Prediction, every: int) -> Prediction:
    """The same recorded at a lower rate."""
    parts = {
        axis: AxisPrediction(**{one.name: getattr(found, one.name)[::every] for one in fields(found)})
        for axis, found in run.axes.items()
    }
    return Prediction(run.recording, run.time[::every], parts)


def placed(name: str, axis: str = "rotate", **parameters: float) -> PlacedEffect:
    return PlacedEffect(axis, library()[name](**parameters), dict.fromkeys(parameters, "1"))


def estimates(**values: tuple[float, str]) -> dict[str, Estimate]:
    """Parameters whose 90 % interval is a tenth to either side."""
    return {name: Estimate(value, unit, (0.9 * value, 1.1 * value)) for name, (value, unit) in values.items()}


STRIBECK = placed("stribeck", static_torque=1.3, stribeck_velocity=0.05, exponent=1.0)
RIPPLE = placed("torque_ripple", amplitude=0.11, order=24.0, phase=0.4)
SLOW = "slow constant-velocity strokes, below a tenth of the top speed"
CAUSES = (
    Cause(
        "stribeck", "rotate", 0.97, 0.62,
        estimates(static_torque=(1.3, "N·m"), stribeck_velocity=(0.05, "rad/s"), exponent=(1.0, "1")),
        Shrink(0.63, (0.58, 0.67), 0.66), ("presliding",), SLOW, "an encoder on the joint",
    ),
    Cause(
        "torque_ripple", "rotate", 0.99, 0.18,
        estimates(amplitude=(0.11, "N·m"), order=(24.0, "1"), phase=(0.4, "rad")),
        Shrink(0.18, (0.15, 0.2), 0.19),
    ),
    Cause("unknown", "rotate", 0.93, 0.09, {}, None),
    Cause(
        "spring", "rotate", 0.66, 0.07, estimates(stiffness=(0.31, "N·m/rad"), rest=(0.1, "rad")),
        Shrink(0.07, (0.03, 0.1), None),
    ),
    Cause("presliding", "rotate", 0.06, 0.05, {}, None),
    Cause("delay", "rotate", 0.03, 0.01, {}, None),
)  # fmt: skip
SHARES = (
    Share("stribeck", 0.62, (0.58, 0.66)),
    Share("torque_ripple", 0.18, (0.15, 0.2)),
    Share("spring", 0.07, (0.04, 0.09)),
    Share("unknown", 0.09, (0.05, 0.12)),
    Share("noise", 0.04, (0.03, 0.05)),
)
ONE_WAY = ("motion in one direction only", "the same strokes in the other direction")
NOT_TESTABLE = (
    NotTestable("coulomb_asymmetry", *ONE_WAY),
    NotTestable("temperature_drift", "too short", "`start_time` in recording.json, or longer"),
    NotTestable("viscous_asymmetry", *ONE_WAY),
)


def gap_of(gap_rms: float, significant: bool) -> AxisGap:
    """An axis with all that a gap can have, or one with none of it."""
    regimes = {
        "reversal": (0.1, {"time": (-0.05, 0.05)}),
        "presliding": (0.03, {"displacement": (0.0, 0.017)}),
        "acceleration": (0.06, {"acceleration": (0.54, 1.3)}),
        "low_speed": (0.71, {"velocity": (-0.19, 0.19)}),
        "high_speed": (0.1, {"speed": (0.19, 0.77)}),
    }
    where = tuple(Regime(name, share, bounds) for name, (share, bounds) in regimes.items())
    return AxisGap(
        cutoff_hz=CUTOFF,
        standstill_velocity=STANDSTILL,
        torque_rms=1.31,
        gap_rms=gap_rms,
        noise_rms=NOISE,
        noise_found_by="spectrum of the torque above 3 cut-offs",
        model_error_rms=0.016,
        standstill_rms=0.1,
        significant=significant,
        test="gap against noise, in blocks of a second",
        p_value=1e-30 if significant else 0.41,
        shares=SHARES if significant else (Share("unknown", 0.02, (0.0, 0.1)), Share("noise", 0.98, (0.9, 1.0))),
        where=where,
        where_after=(replace(where[0], share=0.8), replace(where[3], share=0.2)) if significant else (),
        patterns=(Pattern("position", 0.18, "period 15 deg"),) if significant else (),
        unknown=Unknown(0.09, ("position", "cross_axis"), 0.21) if significant else Unknown(0.02, (), 0.0),
        not_testable=NOT_TESTABLE if significant else (),
    )


def two_axes(seconds: float = 20.0) -> Diagnosis:
    """`rotate` has a gap of three effects, something unknown and noise; `stretch` has noise."""
    time = time_of(seconds)
    position, velocity, _ = swinging(time)
    noise = coloured_noise(len(time), NOISE, 1)
    unknown = np.where(position > 0.6, 0.12 * np.sin(30.0 * position), 0.0)
    found = 0.5 * np.exp(-np.abs(velocity) / 0.12) * np.sign(velocity) + 0.11 * np.sin(24.0 * position) + 0.05 * position
    axes = {"rotate": axis_of(time, found + unknown + noise, unknown + noise), "stretch": axis_of(time, noise, noise)}
    rms = {name: float(np.sqrt(np.mean((one.measured - one.before)[one.used] ** 2))) for name, one in axes.items()}
    after = {name: float(np.sqrt(np.mean((one.measured - one.after)[one.used] ** 2))) for name, one in axes.items()}
    return Diagnosis(
        verdict=Verdict.PARTLY_EXPLAINED,
        settings=Settings(),
        axes={"rotate": gap_of(rms["rotate"], True), "stretch": gap_of(rms["stretch"], False)},
        causes=CAUSES,
        selected=(STRIBECK, RIPPLE, placed("spring", stiffness=0.31, rest=0.1)),
        after_rms=after,
        predictions=(Prediction("sweep", time, axes),),
        model_xml="<mujoco/>",
        held_back=False,
        units={"rotate": "N·m", "stretch": "N"},
        notes=("the friction of the model was 3 % low",),
    )


CASE = two_axes()


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
    assert page.row("stretch")[1:3] == ["no p = 0.41", "N"]
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
    assert first[6] == f"preslidingBy motion: {SLOW}.By sensor: an encoder on the joint."
    assert page.row("torque ripple", "rotate")[6] == "–"
    assert page.row("spring", "rotate")[4].endswith("no larger than the noise")
    assert "Below 5 %: delay on rotate 3 %." in page.text
    assert "patched.xml with effects.json adds stribeck, torque ripple and spring on rotate." in page.text


def test_the_unknown_is_a_cause_and_says_what_it_goes_with(page: Page) -> None:
    words = "goes with position and the motion of another axis and has a correlation time of 0.21 s"
    assert page.row("unknown", "rotate")[2:] == ["93 %", "9 %", "–", words, "–"]
    assert f"The unknown, 9 % of the gap, {words}." in page.text


def test_regimes_stand_before_and_after(page: Page) -> None:
    assert page.row("reversal") == ["reversal", "time to a reversal -0.05 to 0.05 s", "10 %", "80 %"]
    assert page.row("high speed") == ["high speed", "speed 0.19 to 0.77 rad/s", "10 %", "–"]
    assert "% of its energy is in" in page.text
    assert "80 % of what is left above noise is in the regime reversal." in page.text


def test_what_could_not_be_tested_has_one_row_a_reason(page: Page) -> None:
    assert page.row("coulomb asymmetry and viscous asymmetry")[1:] == list(ONE_WAY)
    assert page.row("temperature drift")[1:] == ["too short", "start_time in recording.json, or longer"]


def test_the_method_tells_every_number_that_steers_the_answer(page: Page) -> None:
    assert page.row("rotate", "48 Hz")[2:] == ["0.002 rad/s", "20 mN·m", "16 mN·m", "0.1 N·m", "p < 1e-12"]
    assert page.row("stretch", "48 Hz")[2] == "0.002 m/s"
    assert "Noise of rotate, stretch: spectrum of the torque above 3 cut-offs." in page.text
    for name in asdict(Settings()):
        assert page.row(name.replace("_", " "))
    assert page.row("cutoff hz")[1] == "chosen from the recordings"
    assert page.row("timing spread")[1] == "0.0005 s"
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


def test_the_worst_window_is_where_the_gap_was_put() -> None:
    time = time_of(60.0)
    gap = np.where((time > 31.0) & (time < 33.0), 1.0, 0.1)
    low, high = worst_window(trace_of([recording_of(time, gap)], "rotate", CUTOFF), 4.0)
    assert low < 31.05
    assert high > 32.95
    assert high - low == pytest.approx(4.0, abs=0.02)


def test_recordings_stand_one_after_the_other_with_a_break() -> None:
    runs = [recording_of(time_of(5.0), np.zeros(5000), name) for name in "ab"]
    trace = trace_of(runs, "rotate", CUTOFF)
    assert trace.starts == pytest.approx((0.0, 5.0))
    assert np.isnan(trace.time).sum() == 1
    assert np.nanmax(trace.time) == pytest.approx(10.0, abs=0.01)


def test_a_long_recording_is_thinned_but_not_where_it_is_looked_at_first() -> None:
    time = time_of(500.0)
    run = recording_of(time, np.zeros_like(time))
    trace = trace_of([run, run], "rotate", CUTOFF)
    assert 1.0 / np.nanmedian(np.diff(trace.time)) >= 4.0 * CUTOFF
    points = drawn(trace, (100.0, 104.0))
    assert len(points) < 45_000 < len(trace.time)
    shown = trace.time[points]
    assert np.isnan(shown).sum() == 1, "two recordings are not joined by a line"
    inside = (trace.time >= 97.0) & (trace.time <= 107.0)
    assert np.array_equal(shown[(shown >= 97.0) & (shown <= 107.0)], trace.time[inside])


def test_the_map_s_cells_are_rms_of_what_is_in_them() -> None:
    time = time_of(60.0)
    position = swinging(time)[0]
    trace = trace_of([recording_of(time, 0.3 * position)], "rotate", CUTOFF)
    found = gap_map(trace)
    row, column = np.unravel_index(np.nanargmax(found.before), found.before.shape)
    inside = (
        trace.used
        & (trace.position >= found.position[column])
        & (trace.position < found.position[column + 1])
        & (trace.velocity >= found.velocity[row])
        & (trace.velocity < found.velocity[row + 1])
    )
    assert found.before[row, column] == pytest.approx(np.sqrt(np.mean((0.3 * trace.position[inside]) ** 2)), rel=1e-6)
    assert np.nanmax(found.after) == pytest.approx(0.0, abs=1e-12)


def test_the_spectrum_of_noise_lies_on_the_noise_s_own() -> None:
    time = time_of(200.0)
    noise = coloured_noise(len(time), 0.05)
    found = spectra_of([recording_of(time, noise)], "rotate", 0.05, CUTOFF)
    band = found.frequency < 0.8 * CUTOFF
    assert np.mean(found.before[band] / found.noise[band]) == pytest.approx(1.0, abs=0.08)


def test_recordings_of_two_rates_are_drawn_each_at_its_own() -> None:
    """A gap of 20 Hz in a recording at 1 kHz, beside a slow one that can have no more than 4 Hz."""
    time = time_of(20.0)
    fast = recording_of(time, 0.5 * np.sin(2.0 * np.pi * 20.0 * time))
    slow = slowly(recording_of(time, np.zeros_like(time), "slow"), 100)
    trace = trace_of([slow, fast], "rotate", CUTOFF)
    step = np.diff(trace.time[~np.isnan(trace.time)])
    assert step[:190] == pytest.approx(0.1)
    assert 1.0 / step[-1] >= 4.0 * CUTOFF
    found = spectra_of([slow, fast], "rotate", 0.05, CUTOFF)
    assert found.frequency[np.argmax(found.before)] == pytest.approx(20.0, abs=0.5)
    total = np.sum(found.before) * (found.frequency[1] - found.frequency[0])
    assert total == pytest.approx(0.125, rel=0.05)
    low, high = worst_window(trace, 4.0)
    assert low > 20.0
    assert high - low == pytest.approx(4.0, abs=0.02)


def test_the_mean_over_velocity_does_not_join_both_directions() -> None:
    velocity = np.linspace(-1.0, 1.0, 2001)
    centre, mean = mean_over(velocity, np.sign(velocity) + 0.5 * velocity)
    at = np.flatnonzero(np.isnan(mean))
    assert list(centre[at]) == [0.0]
    assert np.nanmax(np.abs(mean - np.sign(centre) - 0.5 * centre)) < 0.03


def test_an_axis_says_its_frequency_response_or_why_it_has_none(tmp_path: Path) -> None:
    frequency = np.arange(1.0, 101.0)
    told = FrequencyResponse(
        "torque_offset", frequency, np.asarray(-0.5j / np.pi / frequency, np.complex128), np.ones(100), frequency < 80.0,
        40, 2.0, Resonances((50.0,), (25.0,)),
    )  # fmt: skip
    found = page_of(replace(CASE, responses={"rotate": told, "stretch": NoResponse("its torque was not recorded")}), tmp_path)
    assert "Anti-resonance at 25.0 Hz, resonance at 50.0 Hz, from 1 to 79 Hz: elastic between motor and load" in found.text
    assert "the load would be 3 times the motor" in found.text
    assert "Not told by these recordings: its torque was not recorded." in found.text
    assert found.figures == 7 + 1 + 1
    stiff = replace(told, resonances=Resonances((), ()))
    assert "No resonance from 1 to 79 Hz" in page_of(replace(CASE, responses={"rotate": stiff}), tmp_path).text
