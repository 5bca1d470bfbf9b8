"""Parameters of a drive saved as a DCF and restored from it, over the bus, and in the page."""

from __future__ import annotations

import re
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import canopen
import pytest
from browser_bench import browser_page, needs_chromium
from panel_bench import Page, Served, page, panel, read_by_canopen
from playwright.sync_api import WebSocketRoute, expect
from processes import emulator


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    """Drives at rest, on somebody else's emulator."""
    with emulator("--machine", "scara") as bus, panel("--bus", bus, "--machine", "scara", "--allow-writes") as found:
        yield found


@pytest.fixture
def looking(served: Served) -> Iterator[Page]:
    with page(served) as found:
        found.ask("watch", view="drives")
        found.until(lambda told: all(node["state"] == "Switch on disabled" for node in told["nodes"]))
        yield found


def saved(served: Served, node: int) -> str:
    with urllib.request.urlopen(f"{served.url}parameters/{node}.dcf") as answer:
        text: str = answer.read().decode()
        return text


def write(looking: Page, index: int, value: str) -> None:
    assert "answer" in looking.ask("write", node=1, index=index, subindex=0, value=value)


def test_a_dcf_holds_what_the_drive_held(served: Served, looking: Page, tmp_path: Path) -> None:
    write(looking, 0x2168, "1800.5")
    file = tmp_path / "lift.dcf"
    file.write_text(saved(served, 1), encoding="ascii")
    found = canopen.import_od(str(file))
    assert found.node_id == 1
    current, pdo = found.get_variable(0x2168), found.get_variable(0x1400, 1)
    assert current is not None
    assert pdo is not None
    assert current.value == 1800.5 == read_by_canopen(served.bus, 1, 0x2168)
    assert pdo.value == 0x201


def test_it_is_restored_and_read_back(served: Served, looking: Page) -> None:
    write(looking, 0x2168, "1800.5")
    text = saved(served, 1)
    write(looking, 0x2168, "2400")
    write(looking, 0x6083, "77")
    same = looking.ask("compare", node=1, name="lift.dcf", text=text)["answer"]
    assert [0x2168, 0, 1800.5] in same["values"]
    assert same["strange"] == 0
    answer = looking.ask("restore", node=1, name="lift.dcf", text=text)["answer"]
    assert (answer["written"], answer["refused"]) == (2, [])
    assert answer["same"] > 50
    assert read_by_canopen(served.bus, 1, 0x2168) == 1800.5
    assert looking.ask("restore", node=1, name="lift.dcf", text=text)["answer"]["written"] == 0


def test_what_the_drive_does_not_take_is_named_and_stops_nothing_else(served: Served, looking: Page) -> None:
    text = saved(served, 1)
    write(looking, 0x22EA, "9")
    spoiled = re.sub(r"(\[2172\][^\[]*ParameterValue=)\S+", r"\g<1>0x7", text)
    answer = looking.ask("restore", node=1, name="lift.dcf", text=spoiled)["answer"]
    assert answer["written"] == 1
    assert answer["refused"] == ["Interpolation type (2172h:00): 7 is outside 0 to 2"]


def test_a_drive_that_has_power_is_not_rewritten() -> None:
    with panel("--allow-writes") as served, page(served) as looking:
        looking.ask("watch", view="drives")
        looking.until(lambda told: all((node["state"], node["mode"]) == ("Operation enabled", 7) for node in told["nodes"]))
        refused = looking.ask("restore", node=1, name="lift.dcf", text=saved(served, 1))["refused"]
        assert refused.startswith("lift is in Operation enabled; stop the motion and disable the drive")


def test_a_panel_that_reads_saves_and_does_not_restore() -> None:
    with emulator("--machine", "stage") as bus, panel("--bus", bus) as served, page(served) as looking:
        assert "ParameterValue=" in saved(served, 1)
        assert "--allow-writes" in looking.ask("restore", node=1, name="x.dcf", text="")["refused"]
        with pytest.raises(urllib.error.HTTPError, match="409") as refused:
            saved(served, 9)
        assert b"there is no node 9" in refused.value.read()


@needs_chromium
def test_a_click_before_the_page_was_told_of_the_drives_asks_for_no_file(served: Served) -> None:
    withheld: list[tuple[WebSocketRoute, str | bytes]] = []
    passes: list[bool] = []

    def pass_on(route: WebSocketRoute) -> None:
        def hear(text: str | bytes) -> None:
            if '"pen"' in str(text) and not passes:
                withheld.append((route, text))
            else:
                route.send(text)

        route.connect_to_server().on_message(hear)

    with browser_page(served.url) as browser:
        asked: list[str] = []
        browser.on("request", lambda request: asked.append(request.url))
        browser.route_web_socket("**/live", pass_on)
        browser.goto(f"{served.url}#parameters")
        browser.reload()
        save = browser.get_by_role("button", name="Save as DCF")
        box = save.bounding_box()
        assert box is not None
        browser.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        passes.append(True)
        for route, text in withheld:
            route.send(text)
        with browser.expect_download() as download:
            save.click()
        assert download.value.suggested_filename == "lift-1.dcf"
        assert [url.rpartition("/")[2] for url in asked if "dcf" in url] == ["1.dcf"]


@needs_chromium
@pytest.mark.parametrize(("theme", "width"), [("light", 1280), ("dark", 390)])
def test_the_page_saves_compares_and_restores(served: Served, looking: Page, tmp_path: Path, theme: str, width: int) -> None:
    write(looking, 0x2168, "2400")
    looking.ask("release")
    with browser_page(f"{served.url}#parameters", width=width, theme=theme) as browser:
        browser.evaluate("() => { window.released = []; URL.revokeObjectURL = (address) => released.push(address); }")
        with browser.expect_download() as download:
            browser.get_by_role("button", name="Save as DCF").click()
        assert browser.evaluate("released") == [], "a busy browser begins to read the file long after the click"
        file = tmp_path / download.value.suggested_filename
        download.value.save_as(file)
        assert file.name == "lift-1.dcf"
        write(looking, 0x2168, "1800.5")
        looking.ask("release")
        browser.get_by_label("Compare with").set_input_files(file)
        outcome = browser.locator("[data-is='outcome']")
        expect(outcome).to_contain_text("1 differ from the drive's")
        browser.get_by_label("only what differs from lift-1.dcf").check()
        assert browser.locator("details:visible").count() == 1
        expect(browser.locator("tr:visible [data-is='file']")).to_have_text("2400")
        browser.get_by_role("button", name="Restore").click()
        expect(outcome).to_contain_text("1 written and read back")
        assert read_by_canopen(served.bus, 1, 0x2168) == 2400.0
        assert browser.evaluate("document.documentElement.scrollWidth") <= width
        browser.locator("#release").click()


@needs_chromium
@pytest.mark.usefixtures("looking")  # the drives are at rest
def test_a_file_that_is_refused_is_not_restored_by_the_one_before(served: Served, tmp_path: Path) -> None:
    good, bad = tmp_path / "lift.dcf", tmp_path / "notes.dcf"
    good.write_text(saved(served, 1), encoding="ascii")
    bad.write_text("no parameters", encoding="ascii")
    with browser_page(f"{served.url}#parameters") as browser:
        expect(browser.get_by_role("button", name="Read all")).to_be_enabled()
        browser.get_by_label("Compare with").set_input_files(good)
        expect(browser.locator("[data-is='outcome']")).to_contain_text("values of lift.dcf")
        expect(browser.get_by_role("button", name="Restore")).to_be_enabled()
        browser.get_by_label("Compare with").set_input_files(bad)
        expect(browser.locator("#said")).to_contain_text("notes.dcf")
        expect(browser.get_by_role("button", name="Restore")).to_be_disabled()
        browser.get_by_label("Drive", exact=True).select_option("2")
        expect(browser.locator("[data-is='outcome']")).to_be_empty()
        expect(browser.get_by_role("button", name="Read all")).to_be_enabled()
