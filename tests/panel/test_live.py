"""`--live`: what a command tells of itself is in a panel, with its report, until Ctrl-C; then it ends as it would have."""

from __future__ import annotations

import json
import re
import signal
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from browser_bench import browser_page, needs_chromium
from panel_bench import Served, page
from playwright.sync_api import expect
from processes import Command, drivetwin, start
from turntable import turntable

BENCH = Path(__file__).parents[2] / "hil_tests/benches/scara.yaml"

REPORT = "<title>r</title><p id='drawn'></p><script>document.getElementById('drawn').textContent = 'drawn';</script>"


def told(folder: Path, **more: Any) -> None:
    run = {"format": "run/1", "command": "diagnose model.xml", "share": 0.4, "phases": [{"name": "reading", "share": 1.0}]}
    (folder / "run.json").write_text(json.dumps({**run, **more}), encoding="utf-8")


@contextmanager
def run_panel(folder: Path) -> Iterator[Served]:
    """A panel that shows a run and no bus."""
    process = start("panel", "--port", 0, "--run", folder)
    try:
        found = re.search(r"panel on (http://[^/]+/)", process.stdout.readline())
        assert found is not None
        yield Served(found[1], "")
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate()
    assert process.returncode == 0


@contextmanager
def live(*arguments: object) -> Iterator[tuple[Command, str]]:
    """A command with `--live`, and the address of its panel; it has to be done and to end well on Ctrl-C."""
    process = start(*arguments, "--live")
    try:
        lines = iter(process.stderr.readline, "")
        found = next(match for line in lines if (match := re.search(r"panel on (http://[^/]+/)", line)))
        yield process, found[1]
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate()
    assert process.returncode == 0


@needs_chromium
def test_progress_and_report_are_shown_and_the_report_is_no_page_of_the_panel(tmp_path: Path) -> None:
    with run_panel(tmp_path) as served, browser_page(served.url, width=390) as shown:
        expect(shown.locator("#views a")).to_have_text(["run"])
        expect(shown.locator("[data-is='command']")).to_have_text("waiting for the command")
        told(tmp_path, lines=["rejected: 04_moves.to_and_fro"])
        expect(shown.locator("[data-is='command']")).to_have_text("drivetwin diagnose model.xml")
        expect(shown.get_by_label("All of it")).to_have_attribute("value", "0.4")
        expect(shown.locator("[data-is='phases']")).to_have_text("reading")
        expect(shown.locator("[data-is='lines']")).to_have_text("rejected: 04_moves.to_and_fro")
        (tmp_path / "out").mkdir()
        (tmp_path / "out/report.html").write_text(REPORT, encoding="utf-8")
        told(tmp_path, share=1.0, outcome="No gap beyond noise.", page=str(tmp_path / "out/report.html"))
        expect(shown.locator("[data-is='outcome']")).to_have_text("No gap beyond noise.")
        report = shown.frame_locator("iframe[title='Report']")
        expect(report.locator("#drawn")).to_have_text("drawn")
        assert report.locator("body").evaluate("origin") == "null"
        assert shown.evaluate("document.documentElement.scrollWidth") <= 390


def test_only_what_is_beside_the_report_is_served(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/bus.log").write_text("0.0 can0 080#\n", encoding="utf-8")
    with run_panel(tmp_path) as served:
        assert refused(f"{served.url}run/report.html") == "this run has no page yet\n"
        told(tmp_path, page=str(tmp_path / "out/report.html"))
        with urllib.request.urlopen(f"{served.url}run/bus.log") as answer:
            assert answer.read() == b"0.0 can0 080#\n"
            assert answer.headers["content-security-policy"].startswith("sandbox allow-scripts")
        for path in ("run/../run.json", "run/%2e%2e/run.json", "run/..%2frun.json", "run/"):
            assert "there is no such file" in refused(f"{served.url}{path}") or "Not Found" in refused(f"{served.url}{path}")


def refused(url: str) -> str:
    with pytest.raises(urllib.error.HTTPError, match="404") as found:
        urllib.request.urlopen(url)
    return found.value.read().decode()


def test_a_panel_without_a_bus_answers_nothing_of_one(tmp_path: Path) -> None:
    with run_panel(tmp_path) as served, page(served) as looking:
        assert looking.ask("views")["answer"] == ["run"]
        assert "has no bus and answers no 'objects'" in looking.ask("objects", node=1)["refused"]
        assert "has no bus and answers no 'watch'" in looking.ask("watch", view="drives")["refused"]


@needs_chromium
def test_an_identification_is_watched_and_is_the_same_as_one_that_nobody_watches(
    identified_stage: Path, tmp_path: Path
) -> None:
    with live("identify", "--machine", "stage", "--out", tmp_path / "live") as (_, url), browser_page(url) as shown:
        expect(shown.locator("[data-is='command']")).to_have_text("drivetwin identify stage")
        expect(shown.locator("[data-is='phases']")).to_contain_text("strokes slide")
        shown.locator("#views a[href='#drives']").click()
        expect(shown.locator("[data-node='1'] h2")).to_have_text("1 slide")
        expect(shown.locator("[data-node='1'] [data-is='position']")).to_contain_text(" m")
        shown.locator("#views a[href='#run']").click()
        expect(shown.locator("[data-is='outcome']")).to_contain_text("Errors of inertia and friction")
        expect(shown.frame_locator("iframe[title='Report']").locator("body")).to_contain_text("stage: identification")
    live_, alone = (folder / "identified.json" for folder in (tmp_path / "live", identified_stage))
    assert live_.read_bytes() == alone.read_bytes()


@needs_chromium
def test_a_diagnosis_is_watched(tmp_path: Path) -> None:
    turntable(tmp_path)
    given = (tmp_path / "model.xml", tmp_path / "fitted", "--out", tmp_path / "out")
    with live("diagnose", *given) as (_, url), browser_page(url) as shown:
        expect(shown.locator("#views a")).to_have_text(["run"])
        expect(shown.locator("[data-is='command']")).to_have_text("drivetwin diagnose model.xml")
        expect(shown.locator("[data-is='outcome']")).to_contain_text("The gap is explained by")
        expect(shown.locator("[data-is='phases']")).to_contain_text("report.html")
        report = shown.frame_locator("iframe[title='Report']")
        expect(report.locator("h1")).to_have_text("Simulation against machine")
        expect(report.locator("body")).to_contain_text("These recordings do not show it: no demand was recorded")


@needs_chromium
def test_an_acceptance_is_watched_case_by_case(tmp_path: Path) -> None:
    cases = ("--bench", BENCH, "--select", "02_enable.*", "--out", tmp_path / "out")
    with live("accept", *cases) as (_, url), browser_page(url) as shown:
        expect(shown.locator("[data-is='outcome']")).to_contain_text("Accepted: ")
        expect(shown.locator("[data-is='lines']")).to_contain_text("accepted: 02_enable.")
        expect(shown.frame_locator("iframe[title='Report']").locator("h1")).to_contain_text("Acceptance of")


def test_live_needs_a_report(tmp_path: Path) -> None:
    ended = drivetwin("diagnose", "model.xml", "swings", "--out", str(tmp_path / "out"), "--no-html", "--live")
    assert (ended.status, ended.err) == (2, "drivetwin: --live shows the report in the browser: leave --no-html out\n")
