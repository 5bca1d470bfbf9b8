"""The pictures of the panel in docs/images, each taken of the product as it runs, by headless Chromium.

python scripts/panel_pictures.py                 # `make panel-pictures`; all of them, some five minutes
python scripts/panel_pictures.py scope faults    # some
"""

from __future__ import annotations

import argparse
import io
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from PIL import Image
from playwright.sync_api import Locator, Page, expect, sync_playwright

from drivetwin.foundation.scratch import scratch

IMAGES = Path(__file__).parents[1] / "docs/images"

WIDTH, HEIGHT = 1280, 900
"""Of the window [pixel]."""

TALLEST = 3200
"""Of a picture [pixel]: what is below is cut off."""

COLOURS = 128
"""Of a picture: pages have few, and so its file is small."""

PATIENCE = 600.0
"""Longest wait for anything, an axis that is measured on a busy computer [s]."""


@contextmanager
def served(*arguments: str) -> Iterator[str]:
    """The address of a panel while it runs, of its own or of a command with `--live`."""
    program = [sys.executable, "-m", "drivetwin", *arguments]
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            found = next((found for line in process.stdout if (found := re.search(r"http://[^/]+/", line))), None)
            if found is None:
                raise SystemExit(f"drivetwin {' '.join(arguments)} ended without a panel")
            yield found.group()
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate()


@contextmanager
def page(address: str, theme: str, height: int = HEIGHT) -> Iterator[Page]:
    """A page of a fresh browser."""
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--enable-unsafe-swiftshader"])
        opened = browser.new_page(
            viewport={"width": WIDTH, "height": height}, color_scheme="dark" if theme == "dark" else "light"
        )
        opened.set_default_timeout(PATIENCE * 1e3)
        opened.goto(address)
        yield opened
        browser.close()


def keep(shown: Page | Locator, name: str, *, whole: bool = False) -> None:
    """Take a picture of what is in the window, or of the whole page."""
    taken = shown.screenshot(full_page=whole) if isinstance(shown, Page) else shown.screenshot()
    picture = Image.open(io.BytesIO(taken)).convert("RGB")
    picture = picture.crop((0, 0, picture.width, min(picture.height, TALLEST)))
    file = IMAGES / f"panel-{name}.png"
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)
    print(f"{file.name}: {picture.width} x {picture.height}, {file.stat().st_size / 1e3:.0f} kB", flush=True)


def in_motion(shown: Page) -> None:
    """Wait until every axis of the SCARA streams."""
    for node in (1, 2, 3):
        expect(shown.locator(f"[data-node='{node}']")).to_contain_text("7 interpolated position")


# -- views of the SCARA ---------------------------------------------------------------------------------------------------


def drives(shown: Page) -> None:
    """The first page, as `drivetwin panel` opens."""
    in_motion(shown)
    shown.wait_for_timeout(1500)
    keep(shown, "drives", whole=True)


def parameters(shown: Page) -> None:
    """The gains of the speed loop, searched by a word, the first of them read."""
    shown.locator("#views a[href='#parameters']").click()
    shown.get_by_role("searchbox").fill("speed")
    expect(shown.locator("tr:visible .value", has_text=re.compile(r"\d")).first).to_be_visible()
    shown.wait_for_timeout(3000)
    keep(shown, "parameters")


def compare(shown: Page) -> None:
    """Two values written, then compared with what was saved before."""
    shown.locator("#views a[href='#parameters']").click()
    with shown.expect_download() as saved, scratch() as folder:
        shown.get_by_role("button", name="Save as DCF").click()
        before = folder / "lift.dcf"
        saved.value.save_as(before)
        shown.get_by_role("searchbox").fill("")
        for index, value in ((0x2168, "1800"), (0x2184, "0.5")):
            line = shown.locator(f"[data-index='{index}']")
            line.locator("summary").click()
            line.locator("input").first.fill(value)
            line.get_by_text("write", exact=True).first.click()
            expect(line.locator(".value").first).to_have_text(value)
        shown.get_by_label("Compare with a file").set_input_files(before)
        expect(shown.locator("[data-is='outcome']")).to_contain_text("differ from the drive's")
        shown.locator("#changed").check()
        shown.wait_for_timeout(500)
        keep(shown.locator("body"), "compare")
        shown.locator("#changed").uncheck()
        for index, value in ((0x2168, "2400"), (0x2184, "0")):
            line = shown.locator(f"[data-index='{index}']")
            line.locator("input").first.fill(value)
            line.get_by_text("write", exact=True).first.click()
            expect(line.locator(".value").first).to_have_text(value)


def scope(shown: Page) -> None:
    """Position by PDO, speed and torque of the plant, triggered, with two cursors, and torque over speed."""
    shown.locator("#views a[href='#scope']").click()
    readings = shown.locator("[data-is='readings']")
    expect(readings).to_contain_text("rotate Position actual value")
    for name in ("lift Position actual value", "stretch Position actual value"):
        shown.get_by_role("button", name=f"{name} ✕").click()
    for name in ("velocity", "torque"):
        shown.get_by_label("Drive or truth").select_option("truth:rotate")
        shown.get_by_label("Object", exact=True).fill(name)
        shown.get_by_role("button", name="Add channel").click()
    expect(readings.locator(".truth")).to_have_count(2)
    shown.get_by_label("X", exact=True).select_option("truth:rotate:velocity")
    shown.get_by_label("Y", exact=True).select_option("truth:rotate:torque")
    shown.get_by_label("Window").select_option("10")
    shown.wait_for_timeout(12_000)  # what is before the trigger
    shown.get_by_label("Trigger", exact=True).select_option("rises")
    shown.get_by_label("Trigger channel").select_option("2:6064:00")
    shown.get_by_role("button", name="Set", exact=True).click()
    expect(shown.locator("[data-is='state']")).to_contain_text("triggered at")
    over = shown.locator("[aria-label='Channels over time'] .u-over")
    box = over.bounding_box()
    assert box is not None
    for share in (0.3, 0.7):
        over.click(position={"x": share * box["width"], "y": 50})
    expect(readings.locator("th", has_text="B − A")).to_contain_text("s")
    shown.mouse.move(5, 5)
    keep(shown, "scope", whole=True)


def faults(shown: Page) -> None:
    """Torque of one drive off, and what the controller did."""
    shown.locator("#views a[href='#faults']").click()
    shown.get_by_label("node").select_option("2")
    shown.locator("[data-is='strike']").click()
    expect(shown.locator("[data-is='controller']")).to_contain_text("The controller has ended")
    shown.wait_for_timeout(1000)
    keep(shown, "faults")
    shown.locator("[data-is='end']").first.click()


def bus(shown: Page) -> None:
    """Frames by name, and the load of the last second."""
    shown.locator("#views a[href='#bus']").click()
    expect(shown.locator("[data-is='identifiers']")).to_contain_text("heartbeat of stretch")
    shown.wait_for_timeout(5000)
    keep(shown, "bus")


def machine(shown: Page) -> None:
    """The machine in three dimensions."""
    shown.locator("#views a[href='#machine']").click()
    expect(shown.locator("[data-is='drawn']")).to_contain_text("scara: 6 geoms")
    shown.wait_for_timeout(2000)
    keep(shown, "machine", whole=True)


# -- others ---------------------------------------------------------------------------------------------------------------


def commissioning(theme: str) -> None:
    """The stage, measured."""
    with (
        served("panel", "--port", "0", "--emulate", "stage", "--profile", "cia402-full", "--allow-writes") as address,
        page(f"{address}#commissioning", theme) as shown,
    ):
        shown.locator("[data-is='measure']").click()
        expect(shown.locator("[data-is='result']")).to_contain_text("position loop: phase margin")
        shown.wait_for_timeout(1000)
        keep(shown, "commissioning", whole=True)


def run(theme: str) -> None:
    """An identification of the SCARA, at its end."""
    with (
        scratch() as folder,
        served("identify", "--machine", "scara", "--live", "--out", str(folder / "identify")) as address,
        page(f"{address}#run", theme, 1400) as shown,
    ):
        expect(shown.locator(".report")).to_be_visible(timeout=PATIENCE * 1e3)
        shown.wait_for_timeout(4000)
        keep(shown, "run")


@dataclass(frozen=True)
class View:
    """How a picture is taken, and in which theme: docs show both."""

    take: Callable[[Page], None]
    theme: str = "light"


ON_SCARA = {
    "drives": View(drives),
    "parameters": View(parameters),
    "compare": View(compare),
    "scope": View(scope),
    "bus": View(bus),
    "machine": View(machine, "dark"),
    "faults": View(faults),
}
"""One panel for all, in this order: the fault ends the motion."""

ALONE: dict[str, Callable[[str], None]] = {"commissioning": commissioning, "run": run}


def main() -> None:
    """Take the pictures that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("views", nargs="*", help=f"of {', '.join((*ON_SCARA, *ALONE))}; none: all")
    expect.set_options(timeout=PATIENCE * 1e3)
    wanted = parser.parse_args().views or [*ON_SCARA, *ALONE]
    if unknown := set(wanted) - {*ON_SCARA, *ALONE}:
        parser.error(f"no view {', '.join(sorted(unknown))}; there are {', '.join((*ON_SCARA, *ALONE))}")
    if of_scara := [name for name in ON_SCARA if name in wanted]:
        with served("panel", "--port", "0", "--allow-writes") as address:
            for name in of_scara:
                with page(address, ON_SCARA[name].theme) as shown:
                    in_motion(shown)
                    ON_SCARA[name].take(shown)
    for name, take in ALONE.items():
        if name in wanted:
            take("light")


if __name__ == "__main__":
    main()
