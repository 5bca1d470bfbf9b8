"""The view that commissions: an axis of the emulated machine is measured from the page, and the page shows what was found."""

from __future__ import annotations

import re

from browser_bench import browser_page, needs_chromium
from panel_bench import panel
from playwright.sync_api import expect

pytestmark = needs_chromium

MEASURED_WITHIN = 500e3
"""How long a busy computer may take to measure an axis [ms]; some 70 s of the machine's time."""


def test_an_axis_is_measured_and_its_margins_are_shown() -> None:
    with panel("--emulate", "stage", "--profile", "cia402-full", "--allow-writes") as served:
        with browser_page(f"{served.url}#commissioning") as page:
            expect(page.get_by_label("Axis")).to_have_value("slide")
            page.locator("[data-is='measure']").click()
            expect(page.locator("[data-is='status']")).to_contain_text("slide is being measured")
            page.locator("#move").click()
            expect(page.locator("#said")).to_contain_text("an axis is being measured; stop that first")
            result = page.locator("[data-is='result']")
            expect(result).to_contain_text("position loop: phase margin", timeout=MEASURED_WITHIN)
            expect(result.locator("tr", has_text="inertia")).to_contain_text(re.compile(r"94\.\d+ kg"))
            expect(result.locator("tr", has_text="position gain").last).to_contain_text("60FBh:01")
            expect(result.locator("canvas")).to_have_count(9)
            expect(page.locator("[data-is='status']")).to_contain_text("The controller has ended: done")
        with browser_page(f"{served.url}#commissioning", width=390, theme="dark") as page:
            expect(page.locator("[data-is='result'] canvas")).to_have_count(9)
            assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_panel_that_reads_measures_nothing() -> None:
    with panel("--emulate", "stage", "--profile", "cia402-full") as served, browser_page(f"{served.url}#commissioning") as page:
        expect(page.locator("[data-is='measure']")).to_be_disabled()
