"""A fault struck by hand: the drive says what befell it, the controller stops the others, and it can be cleared."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from browser_bench import browser_page, needs_chromium
from panel_bench import Served, page, panel
from playwright.sync_api import expect
from processes import emulator


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with panel("--allow-writes") as found:
        yield found


@needs_chromium
def test_a_fault_is_struck_seen_and_cleared(served: Served) -> None:
    """On a phone, in the dark."""
    with browser_page(f"{served.url}#faults", width=390, theme="dark") as page:
        events = page.locator("[data-is='events']")
        expect(events).to_contain_text(re.compile("stretch.*Operation enabled"))
        page.locator("#views a[href='#drives']").click()
        expect(page.locator("[data-node='3']")).to_contain_text("7 interpolated position")
        page.locator("#views a[href='#faults']").click()
        page.get_by_label("Fault").select_option("sto")
        page.locator("[name='node']").select_option("2")
        page.locator("[data-is='strike']").click()
        expect(page.locator("[data-is='struck']")).to_contain_text("node 2")
        expect(events).to_contain_text("EMCY 5441h: contact 1: safe torque off on the virtual drive")
        expect(page.locator("[data-is='controller']")).to_contain_text("The controller has ended")
        rows = [row.inner_text().split("\t")[2:] for row in events.locator("tr").all()[1:]]
        stopped = {(who, drive) for who, drive, what in rows if what in ("Shutdown", "Disable voltage", "Quick stop")}
        assert ("controller", "lift") in stopped
        assert ("controller", "stretch") in stopped
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        page.locator("[data-is='end']").click()
        expect(page.locator("[data-is='struck']")).to_contain_text("ended at")
        page.locator("#views a[href='#drives']").click()
        card = page.locator("[data-node='2']")
        expect(card.locator("[data-state='Fault']")).to_have_class(re.compile("present"))
        card.locator("[data-name='Fault reset']").click()
        expect(card.locator("[data-state='Switch on disabled']")).to_have_class(re.compile("present"))


def test_every_fault_of_the_emulator_is_offered(served: Served) -> None:
    with page(served) as looking:
        kinds = looking.ask("faults")["answer"]
        assert {"sto", "frames_lost", "friction_rise", "power_cycle"} <= set(kinds)
        assert kinds["friction_rise"]["lasts"]


@pytest.mark.parametrize(
    ("told", "why"),
    [
        ({"fault": "sto", "node": 9}, "has no node 9"),
        ({"fault": "fire", "node": 1}, "unknown fault 'fire'"),
        ({"fault": "friction_rise", "node": 1}, "friction_rise needs"),
    ],
)
def test_the_emulator_says_what_is_wrong(served: Served, told: dict[str, object], why: str) -> None:
    with page(served) as looking:
        assert why in looking.ask("strike", told=told, seconds=None)["refused"]
        assert "there is no active sto" in looking.ask("end", told={"fault": "sto", "node": 1})["refused"]


def test_no_fault_without_an_emulator_of_ones_own() -> None:
    words = ("--allow-writes", "--profile", "cia402-full")
    with emulator("--machine", "stage", *words[1:]) as bus, panel("--bus", bus, *words) as served, page(served) as looking:
        refused = looking.ask("strike", told={"fault": "sto", "node": 1}, seconds=None)["refused"]
        assert "this panel has started none" in refused
