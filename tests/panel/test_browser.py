"""The pages in a real browser: the machine moves, commands act, both themes, a phone's width, and no error on the console."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from browser_bench import browser_page, needs_chromium
from panel_bench import Served, panel, read_by_canopen
from playwright.sync_api import Page, expect
from processes import drivetwin

pytestmark = needs_chromium

PICTURES = 100
"""Looks at a machine that moves; a loaded computer draws a few pictures a second."""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with panel("--allow-writes") as found:
        yield found


def in_motion(page: Page) -> None:
    """Wait until every axis streams."""
    for node in ("1", "2", "3"):
        expect(page.locator(f"[data-node='{node}'] [data-state='Operation enabled']")).to_have_class(re.compile("present"))
        expect(page.locator(f"[data-node='{node}']")).to_contain_text("7 interpolated position")


def test_the_first_look_is_a_machine_in_motion(served: Served) -> None:
    with browser_page(served.url) as page:
        in_motion(page)
        position = page.locator("[data-node='2'] [data-is='position']")
        expect(position).to_contain_text("rad")
        before = position.inner_text()
        expect(position).not_to_have_text(before)
        expect(page.locator("[data-node='2'] .bits .set")).to_contain_text(["ready to switch on", "operation enabled"])
        expect(page.get_by_text("What to do next")).to_be_visible()
        expect(page.locator("[data-is='preview'] canvas")).to_be_visible()
        page.locator("main a[href='#scope']").click()
        expect(page.locator("#views a[href='#scope']")).to_have_attribute("aria-current", "page")
        expect(page.locator("#moves")).to_have_text("in motion")


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_phone_needs_no_scrolling_to_the_side(served: Served, theme: str) -> None:
    with browser_page(served.url, width=390, theme=theme) as page:
        in_motion(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        dark = page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(18, 25, 31)"
        assert dark == (theme == "dark")
        page.locator("#theme").click()
        assert (page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(18, 25, 31)") != dark


def test_a_drive_is_commanded_once_the_motion_has_stopped(served: Served) -> None:
    with browser_page(served.url) as page:
        in_motion(page)
        page.locator("#move").click()
        expect(page.locator("#moves")).to_contain_text("not in motion")
        card = page.locator("[data-node='1']")
        expect(card.locator("[data-state='Switch on disabled']")).to_have_class(re.compile("present"))
        expect(card.locator("[data-name='Enable operation']")).to_be_disabled()
        card.locator("[data-name='Shutdown']").click()
        expect(card.locator("[data-state='Ready to switch on']")).to_have_class(re.compile("present"))
        card.locator("[data-name='Disable voltage']").click()
        expect(card.locator("[data-state='Switch on disabled']")).to_have_class(re.compile("present"))
        page.locator("#move").click()
        in_motion(page)
        page.locator("#release").click()
        expect(page.locator("#pen")).to_have_text("nobody writes")


def test_a_parameter_is_found_written_and_read_by_a_foreign_master(served: Served) -> None:
    with browser_page(f"{served.url}#parameters") as page:
        page.get_by_role("searchbox").fill("P360")
        gain = page.locator(f"[data-index='{0x2168}']")
        expect(gain).to_contain_text("1/min")
        expect(gain.locator(".value")).to_have_text("2400")
        assert page.locator("details:visible").count() == 1
        gain.locator("input").fill("1800.5")
        gain.get_by_text("write", exact=True).click()
        expect(gain.locator(".value")).to_have_text("1800.5")
        assert read_by_canopen(served.bus, 1, 0x2168) == 1800.5
        gain.locator("input").fill("-1")
        gain.get_by_text("write", exact=True).click()
        expect(page.locator("#said")).to_contain_text("outside 0 to")
        gain.locator("input").fill("2400")
        gain.get_by_text("write", exact=True).click()
        expect(page.locator("#said")).to_be_hidden()
        assert read_by_canopen(served.bus, 1, 0x2168) == 2400.0
        page.get_by_role("searchbox").fill("no such object")
        expect(page.get_by_text(re.compile("^0 of"))).to_be_visible()


def test_a_panel_that_reads_offers_nothing_else() -> None:
    with panel() as served, browser_page(served.url) as page:
        in_motion(page)
        expect(page.locator("#pen")).to_contain_text("--allow-writes")
        assert page.locator("main button:enabled").count() == 0


def add(page: Page, where: str, what: str) -> None:
    """A channel of the scope, by the controls."""
    page.get_by_label("Drive or truth").select_option(where)
    page.get_by_label("Object", exact=True).fill(what)
    page.get_by_role("button", name="Add channel").click()


@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 390)])
def test_the_scope_is_triggered_zoomed_and_saved(served: Served, theme: str, width: int) -> None:
    with browser_page(served.url, width=width, theme=theme) as page:
        in_motion(page)
        page.locator("#views a[href='#scope']").click()
        expect(page.locator("[data-is='readings']")).to_contain_text("rotate Position actual value")
        if width == 1280:
            add(page, "truth:rotate", "velocity")
            add(page, "truth:rotate", "torque")
            expect(page.locator("[data-is='readings'] .truth")).to_have_count(2)
            page.get_by_label("X", exact=True).select_option("truth:rotate:velocity")
            page.get_by_label("Y", exact=True).select_option("truth:rotate:torque")
            expect(page.get_by_label("One channel over another").locator("canvas")).to_be_visible()
        page.get_by_label("Window").select_option("2")
        page.get_by_label("Trigger", exact=True).select_option("rises")
        page.get_by_label("Trigger channel").select_option("2:6064:00")
        former = page.locator("[data-is='state']").inner_text()
        page.get_by_role("button", name="Set", exact=True).click()
        expect(page.locator("[data-is='state']")).not_to_have_text(former)
        expect(page.locator("[data-is='state']")).to_contain_text("triggered at")
        over = page.locator("[aria-label='Channels over time'] .u-over")
        box = over.bounding_box()
        assert box is not None
        over.click(position={"x": 0.3 * box["width"], "y": 50})
        over.click(position={"x": 0.7 * box["width"], "y": 50})
        expect(page.locator("[data-is='readings'] th", has_text="B − A")).to_contain_text(re.compile(r"0\.[78]\d+ s"))
        with page.expect_download() as saved:
            page.get_by_role("button", name="Save CSV").click()
        assert saved.value.path().read_text(encoding="utf-8").startswith("time [s],lift Position actual value")
        page.get_by_role("button", name="Save recording").click()
        expect(page.locator("#said")).to_contain_text("without its torque")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        if width == 390:
            page.get_by_role("button", name="Run").click()
            page.get_by_label("Trigger", exact=True).select_option("")
            page.get_by_role("button", name="Set", exact=True).click()
            expect(page.locator("[data-is='state']")).to_have_text("runs")


def test_the_scope_is_triggered_by_a_state(served: Served) -> None:
    with browser_page(served.url) as page:
        in_motion(page)
        page.locator("#views a[href='#scope']").click()
        add(page, "2", "Statusword")
        now = page.locator("[data-is='readings'] tr[data-key='2:6041:00'] td:nth-child(3)")
        expect(now).to_have_text(re.compile(r"\d"))  # only what has had a value can change it
        if (run := page.get_by_role("button", name="Run")).is_visible():
            run.click()
        page.get_by_label("Trigger", exact=True).select_option("state")
        page.get_by_label("Trigger channel").select_option("2:6041:00")
        page.get_by_label("State", exact=True).select_option("Switch on disabled")
        page.get_by_role("button", name="Set", exact=True).click()
        page.locator("#move").click()
        expect(page.locator("[data-is='state']")).to_contain_text("triggered at")
        page.locator("#move").click()
        page.locator("#release").click()


@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 390)])
def test_the_machine_is_drawn_and_moves(served: Served, theme: str, width: int) -> None:
    with browser_page(served.url, width=width, theme=theme) as page:
        in_motion(page)
        page.locator("#views a[href='#machine']").click()
        expect(page.locator("[data-is='drawn']")).to_contain_text("scara: 6 geoms")
        axis = page.locator("[data-is='axes'] tr", has_text="rotate")
        expect(axis).to_contain_text("rad")
        expect(axis).to_contain_text("N·m")
        expect(axis).to_contain_text("none active")
        before, drawn = axis.inner_text(), page.locator(".stage canvas").screenshot()
        expect(axis).not_to_have_text(before)
        assert any(page.locator(".stage canvas").screenshot() != drawn for _ in range(PICTURES))
        assert page.evaluate("document.documentElement.scrollWidth") <= width


WEDGE = """<mujoco><compiler angle="radian"/><asset>
<mesh name="wedge" vertex="0 0 0  0.4 0 0  0.1 0.3 0  0.1 0.1 0.5"/></asset><worldbody>
<body name="arm"><joint name="turn" axis="0 0 1" range="-1 1" damping="1" armature="0.1"/>
<geom type="mesh" mesh="wedge" rgba="0.1 0.3 0.9 1" mass="1"/></body></worldbody>
<actuator><motor joint="turn" ctrlrange="-50 50"/></actuator></mujoco>"""


def test_a_mesh_is_drawn(tmp_path: Path) -> None:
    (tmp_path / "wedge.xml").write_text(WEDGE)
    made = drivetwin("machine", "new", tmp_path / "wedge.xml", "--out", tmp_path / "wedge")
    assert made.status == 0, made.err
    with panel("--emulate", tmp_path / "wedge") as served, browser_page(f"{served.url}#machine") as page:
        expect(page.locator("[data-is='drawn']")).to_contain_text("1 geoms, where")
        page.wait_for_function(BLUE)


BLUE = """() => {
  const canvas = document.querySelector(".stage canvas");
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const ctx = copy.getContext("2d");
  ctx.drawImage(canvas, 0, 0);
  const pixels = ctx.getImageData(0, 0, copy.width, copy.height).data;
  let blue = 0;
  for (let at = 0; at < pixels.length; at += 4) blue += pixels[at + 3] > 0 && pixels[at + 2] > 2 * pixels[at] ? 1 : 0;
  return blue > 1000;
}"""
"""Whether the stage shows something blue: the colour of the mesh. What WebGL draws is kept until the next frame only."""


def test_what_the_pages_load_is_small() -> None:
    pages = Path(__file__).parents[2] / "panel" / "pages"
    assert sum(file.stat().st_size for file in pages.rglob("*") if file.is_file()) < 3_000_000
    assert all((folder / "LICENSE").is_file() for folder in (pages / "vendor").iterdir())


@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 390)])
def test_the_bus_names_its_frames_and_says_how_full_it_is(served: Served, theme: str, width: int) -> None:
    with browser_page(f"{served.url}#bus", width=width, theme=theme) as page:
        expect(page.locator("[data-is='identifiers']")).to_contain_text("TPDO of rotate")
        expect(page.locator("[data-is='identifiers']")).to_contain_text("heartbeat of stretch")
        expect(page.locator("[data-is='frames']")).to_contain_text("Position actual value")
        page.get_by_label("Bit rate").select_option("125000")
        expect(page.locator("[data-is='cycles']")).to_contain_text(re.compile(r"\d+ of [1-9]\d* cycles end late"))
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.get_by_label("Bit rate").select_option("1000000")
        expect(page.locator("[data-is='cycles']")).to_contain_text(re.compile(r"^0 of [1-9]\d* cycles end late"))
