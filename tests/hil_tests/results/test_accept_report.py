"""report.html as a parser of HTML sees it, and the arrays behind its pictures against the plant's truth."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from accept_bench import BOOT, FAULT, FEED_FORWARD, MOVE, SOAK, acceptance_of, evidence_of, with_files, with_value

from drivetwin.hil_tests.folder import write_case
from drivetwin.hil_tests.results.case_figure import axis_figure, drawn
from drivetwin.hil_tests.results.report_bars import used
from drivetwin.hil_tests.results.report_page import write_report
from drivetwin.hil_tests.results.results_file import read_results, write_results
from drivetwin.hil_tests.results.traces import Mark, Traces, read_traces
from drivetwin.hil_tests.results.trend import Trend, compare
from drivetwin.hil_tests.results.wording import against, failure_words, measured_words
from drivetwin.hil_tests.verdict import CaseResult, Failure, Measured, Outcome


class Page(HTMLParser):
    """Text outside scripts and styles, what is loaded, figures that stand open and folded, and where links go."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.text = ""
        self.loaded: list[str | None] = []
        self.links: list[str | None] = []
        self.places: list[str | None] = []
        self.shown, self.folded, self._hidden, self._templates = 0, 0, 0, 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self._hidden += tag in ("script", "style")
        self._templates += tag == "template"
        self.loaded += [named["src"]] if "src" in named else []
        self.links += [named["href"]] if "href" in named else []
        self.places += [named["id"]] if "id" in named else []
        if named.get("class") == "plotly-graph-div":
            self.shown += self._templates == 0
            self.folded += self._templates > 0

    def handle_endtag(self, tag: str) -> None:
        self._hidden -= tag in ("script", "style")
        self._templates -= tag == "template"

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.text += data


def page_of(folder: Path, *cases: CaseResult, trend: Trend | None = None) -> Page:
    write_report(acceptance_of(*cases), folder / "report.html", trend)
    return Page(folder / "report.html")


def traces_of(folder: Path) -> Traces:
    case = with_files(FAULT, folder)
    assert case.folder is not None
    traces = read_traces(case.folder)
    assert traces is not None
    return traces


def test_what_failed_stands_on_the_page_with_its_evidence(tmp_path: Path) -> None:
    page = page_of(tmp_path, BOOT, with_files(FAULT, tmp_path), SOAK)
    assert "Rejected: 1 of 2 cases failed, 1 skipped (" in page.text
    assert "Machine scara, drives servoone, bus embedded at 1000 kbit/s, clock sync, cycle 1 ms, seed 0" in page.text
    assert "still moves <0.3 s> after the fault" in page.text
    assert "1.062 s" in page.text
    assert "The bus around 1.062 s" in page.text
    assert "error 2310h" in page.text
    assert page.text.index("0f 00 11 22") < page.text.index("here it failed") < page.text.index("requested")
    assert "Traceback <most recent call last>" in page.text
    assert "skipped: the controller has no task soak" in page.text
    assert "nan" not in page.text.lower()


def test_nothing_is_loaded_and_every_link_leads_somewhere(tmp_path: Path) -> None:
    page = page_of(tmp_path)
    assert page.loaded == []
    assert {str(link).removeprefix("#") for link in page.links} <= set(page.places)


def test_the_axis_that_failed_is_pictured_open_and_accepted_cases_folded(tmp_path: Path) -> None:
    page = page_of(tmp_path, with_files(MOVE, tmp_path), with_files(FAULT, tmp_path))
    assert (page.shown, page.folded) == (1, 3)


def test_a_failure_of_no_axis_pictures_all(tmp_path: Path) -> None:
    failed = replace(FAULT, failures=FAULT.failures[1:])
    page = page_of(tmp_path, with_files(failed, tmp_path))
    assert page.shown == 3
    assert "The bus at its end" in page.text


def test_a_case_that_left_no_files_is_told_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    page = page_of(tmp_path, replace(FAULT, folder=tmp_path / "empty"))
    assert "still moves <0.3 s> after the fault" in page.text
    assert page.shown == 0


@pytest.mark.parametrize(("value", "said"), [(0.17, "Accepted: all of 1 cases passed."), (0.3, "Rejected: all of 1 cases")])
def test_a_figure_that_is_worse_than_before_makes_the_verdict(tmp_path: Path, value: float, said: str) -> None:
    write_results(acceptance_of(FEED_FORWARD), tmp_path / "results.json")
    now = with_value(FEED_FORWARD, value, 3e-3)
    page = page_of(tmp_path, now, trend=compare(acceptance_of(now), read_results(tmp_path / "results.json")))
    assert said in page.text
    assert ("regression" in page.text) is (value == 0.3)


@pytest.mark.parametrize(
    ("value", "limit", "share"),
    [(0.3, 0.2, 1.5), (0.1, 0.2, 0.5), (0.0, 0.0, 0.0), (1.0, 0.0, inf), (inf, 1.0, inf), (nan, 1.0, inf), (-1.0, 2.0, 0.0)],
)
def test_how_much_of_a_limit_is_used(value: float, limit: float, share: float) -> None:
    assert used(Measured("any", value, "s", limit=limit)) == pytest.approx(share)


NEVER = replace(
    FAULT,
    failures=(Failure("settling", "the axis does not stay", "rotate", 1.0625, inf, 0.2, "s"),),
    measured=(Measured("settling time", inf, "s", "rotate", limit=0.2),),
)


@pytest.mark.parametrize("value", [inf, nan])
def test_what_never_came_about_is_told_in_words(tmp_path: Path, value: float) -> None:
    assert against(value, 0.2, "s") == "never, limit 0.2 s"
    assert measured_words(Measured("settling time", value, "s", "rotate", limit=0.2)).endswith(": never, limit 0.2 s")
    assert failure_words(NEVER.failures[0]).endswith("(rotate, at 1.062 s, never, limit 0.2 s)")
    write_results(acceptance_of(NEVER), tmp_path / "results.json")
    trend = compare(acceptance_of(with_value(NEVER, 0.1, None)), read_results(tmp_path / "results.json"))
    page = page_of(tmp_path, NEVER, trend=trend)
    assert page.text.count("never") >= 3
    assert not re.search(r"\b(inf|nan)\b", page.text)


def test_traces_are_the_truth_that_the_stand_saw(tmp_path: Path) -> None:
    traces, truth = traces_of(tmp_path), evidence_of(tmp_path).truth
    np.testing.assert_array_equal(traces.time, truth.time)
    for place, axis in enumerate(("lift", "rotate", "stretch")):
        np.testing.assert_array_equal(traces.axes[axis].position, truth.position[:, place])
        np.testing.assert_array_equal(traces.axes[axis].torque, truth.torque[:, place])
        enabled = truth.time > 0.2
        assert np.isnan(traces.axes[axis].tracking_error[~enabled]).all()
        expected = truth.demand[enabled, place] - truth.position[enabled, place]
        np.testing.assert_array_equal(traces.axes[axis].tracking_error[enabled], expected)
    assert [traces.axes[axis].unit for axis in traces.axes] == ["m", "rad", "rad"]
    assert traces.faults == (Mark(0.75, "drive_fault node 2"),)
    assert traces.axes["rotate"].states[-1] == Mark(0.8, "fault")


@pytest.mark.parametrize("points", [50, 400])
def test_few_points_keep_the_one_sample_that_is_worst(tmp_path: Path, points: int) -> None:
    traces = traces_of(tmp_path)
    trace = traces.axes["rotate"]
    kept = drawn(traces.time, trace, points, None)
    assert len(kept) <= points + 2
    assert int(np.nanargmax(trace.tracking_error)) in kept
    assert int(np.argmax(trace.torque)) in kept
    assert {0, len(traces.time) - 1} <= set(kept.tolist())


def test_every_sample_is_drawn_where_it_failed(tmp_path: Path) -> None:
    traces = traces_of(tmp_path)
    kept = drawn(traces.time, traces.axes["rotate"], 50, (1.0, 1.1))
    inside = np.flatnonzero((traces.time >= 1.0) & (traces.time < 1.1))
    assert set(inside.tolist()) <= set(kept.tolist())


def test_the_band_shows_each_stay_in_a_state(tmp_path: Path) -> None:
    figure = axis_figure(traces_of(tmp_path), "rotate", 1e-3, [Mark(1.0625, "stopped")], None, 100)
    stays = [(bar.name, round(bar.base[0], 3), round(bar.x[0], 3)) for bar in figure.data if bar.type == "bar"]
    assert stays == [
        ("ready to switch on", 0.1, 0.1),
        ("operation enabled", 0.2, 0.55),
        ("fault reaction active", 0.75, 0.05),
        ("fault", 0.8, 1.7),
    ]
    said = [note.text for note in figure.layout.annotations]
    assert said == ["drive_fault node 2", "stopped"]


def test_forty_cases_of_a_minute_stay_below_fifteen_megabytes(tmp_path: Path) -> None:
    long = replace(MOVE, folder=tmp_path / "long")
    (tmp_path / "long").mkdir()
    write_case(long, evidence_of(tmp_path / "long", 60.0), tmp_path / "long")
    rejected = replace(long, outcome=Outcome.REJECTED, failures=FAULT.failures[1:])
    write_report(acceptance_of(*[long] * 35, *[rejected] * 5), tmp_path / "report.html")
    assert (tmp_path / "report.html").stat().st_size < 15e6
