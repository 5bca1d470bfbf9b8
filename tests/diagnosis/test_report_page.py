"""The report as a parser of HTML sees it, and the arrays behind its pictures against plain numpy."""

from __future__ import annotations

from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from gap_bench import (
    CAUSES,
    CUTOFF,
    axis_of,
    coloured_noise,
    died_out_case,
    recording_of,
    slowly,
    stribeck_case,
    swinging,
    time_of,
)

from diagnosis.report_page import write_report_page
from diagnosis.report_view import drawn, gap_map, mean_over, spectra_of, trace_of, worst_window
from diagnosis.result import Diagnosis, Verdict

CASE = stribeck_case(20.0)
INPUTS = {"model.xml": "ab" * 32, "rec/<sweep>/signals.parquet": "cd" * 32}


class Page(HTMLParser):
    """Text outside scripts and styles, what is loaded from elsewhere, and how many figures there are."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.text, self.loaded, self.figures, self._hidden = "", [], 0, 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self._hidden += tag in ("script", "style")
        self.loaded += [value for name, value in named.items() if name in ("src", "href")]
        self.figures += named.get("class") == "plotly-graph-div"

    def handle_endtag(self, tag: str) -> None:
        self._hidden -= tag in ("script", "style")

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.text += data


def page_of(diagnosis: Diagnosis, folder: Path) -> Page:
    write_report_page(diagnosis, INPUTS, folder / "report.html")
    return Page(folder / "report.html")


def test_the_answer_is_on_the_page_with_its_figures_and_units(tmp_path: Path) -> None:
    page = page_of(CASE, tmp_path)
    gap, after = CASE.axes["rotate"].gap_rms, CASE.after_rms["rotate"]
    sentence = f"The gap is explained by stribeck on rotate: rotate from {gap:.3g} to {after:.3g} N·m rms"
    assert sentence in page.text
    assert "static torque 1.3 (1.2 to 1.4) N·m" in page.text
    assert "97 % (96 % to 98 %)" in page.text
    assert "is told apart by slow constant-velocity sweeps below 0.05 rad/s." in page.text
    assert "the friction of the model was 3 % low" in page.text
    assert "patched.xml with effects.json adds stribeck on rotate" in page.text
    assert "faster than rotate 0.002 rad/s, stretch 0.002 rad/s" in page.text
    assert "rec/<sweep>/signals.parquet" in page.text
    assert "nan" not in page.text.lower()


def test_a_gap_that_only_the_fitted_motion_shows_is_drawn_and_told_of_it(tmp_path: Path) -> None:
    found = died_out_case()
    page = page_of(found, tmp_path)
    assert "yes (fitted)" in page.text
    assert "Those of rotate in motion are of the fitted recordings." in page.text
    assert page.figures == 4 + 2
    assert f"{found.fitted['rotate'].gap_rms:.3g} (" in page.text
    trace = trace_of(found.shown_on("rotate"), "rotate", CUTOFF)
    assert np.nanstd(trace.gap_before) == pytest.approx(found.fitted["rotate"].gap_rms, rel=0.02)


def test_nothing_is_loaded_and_every_axis_has_its_pictures(tmp_path: Path) -> None:
    page = page_of(CASE, tmp_path)
    assert page.loaded == []
    # four for rotate; what stretch has is noise, so that there is nothing to place
    assert page.figures == 4 + 2


def test_no_gap_and_held_back_blocks_are_said(tmp_path: Path) -> None:
    time = time_of(10.0)
    noise = coloured_noise(np.random.default_rng(0), len(time), 0.02)
    calm = replace(
        stribeck_case(10.0),
        verdict=Verdict.NO_GAP,
        axes={"rotate": CASE.axes["stretch"]},
        predictions=(recording_of(time, {"rotate": axis_of(time, noise, after=noise)}),),
        selected=(),
        causes=(replace(CAUSES[4], step=1, probability=1.0),),
        held_back=True,
    )
    page = page_of(calm, tmp_path)
    assert "No gap beyond noise on any axis (rotate 0.0" in page.text
    assert "blocks of the recordings were held back from the fit" in page.text
    assert "No effect is added." in page.text


def test_a_cut_off_that_a_recording_cannot_have_is_said(tmp_path: Path) -> None:
    slow = CASE.predictions[0]
    every = slice(None, None, 20)
    axes = {
        name: type(axis)(*(getattr(axis, field)[every] for field in type(axis).__dataclass_fields__))
        for name, axis in slow.axes.items()
    }
    page = page_of(replace(CASE, predictions=(replace(slow, time=slow.time[every], axes=axes),)), tmp_path)
    assert "Butterworth filter at 48 Hz, lowered to 0.4 of the sample rate where that is less (20 Hz)" in page.text


def test_an_axis_without_motion_is_said(tmp_path: Path) -> None:
    prediction = CASE.predictions[0]
    still = replace(prediction.axes["stretch"], used=np.zeros(len(prediction.time), dtype=np.bool_))
    calm = replace(CASE, predictions=(replace(prediction, axes=prediction.axes | {"stretch": still}),))
    assert "No sample in motion on the validation data." in page_of(calm, tmp_path).text


def test_the_worst_window_is_where_the_gap_was_put() -> None:
    time = time_of(60.0)
    gap = np.where((time > 31.0) & (time < 33.0), 1.0, 0.1)
    low, high = worst_window(trace_of([recording_of(time, {"rotate": axis_of(time, gap)})], "rotate", CUTOFF), 4.0)
    assert low < 31.05
    assert high > 32.95
    assert high - low == pytest.approx(4.0, abs=0.02)


def test_recordings_stand_one_after_the_other_with_a_break() -> None:
    runs = [recording_of(time_of(5.0), {"rotate": axis_of(time_of(5.0), np.zeros(5000))}, name) for name in "ab"]
    trace = trace_of(runs, "rotate", CUTOFF)
    assert trace.starts == (0.0, pytest.approx(5.0))
    assert np.isnan(trace.time).sum() == 1
    assert np.nanmax(trace.time) == pytest.approx(10.0, abs=0.01)


def test_a_long_recording_is_thinned_but_not_where_it_is_looked_at_first() -> None:
    time = time_of(500.0)
    run = recording_of(time, {"rotate": axis_of(time, np.zeros_like(time))})
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
    trace = trace_of([recording_of(time, {"rotate": axis_of(time, 0.3 * position)})], "rotate", CUTOFF)
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
    noise = coloured_noise(np.random.default_rng(1), len(time), 0.05)
    found = spectra_of([recording_of(time, {"rotate": axis_of(time, noise)})], "rotate", 0.05, CUTOFF)
    band = found.frequency < 0.8 * CUTOFF
    assert np.mean(found.before[band] / found.noise[band]) == pytest.approx(1.0, abs=0.08)


def test_recordings_of_two_rates_are_drawn_each_at_its_own() -> None:
    """A gap of 20 Hz in a recording at 1 kHz, beside a slow one that can have no more than 4 Hz."""
    time = time_of(20.0)
    fast = recording_of(time, {"rotate": axis_of(time, 0.5 * np.sin(2.0 * np.pi * 20.0 * time))})
    slow = slowly(recording_of(time, {"rotate": axis_of(time, np.zeros_like(time))}, "slow"), 100)
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
