"""Chromium of the distribution, headless, by Playwright; what its console says is kept."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import ConsoleMessage, Page, expect, sync_playwright
from processes import PATIENCE

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

expect.set_options(timeout=PATIENCE * 1e3)

needs_chromium = pytest.mark.skipif(
    CHROMIUM is None and os.environ.get("CI") != "true", reason="no chromium on the PATH (apt-get install chromium)"
)


def _is_wrong(message: ConsoleMessage) -> bool:
    """An error or a warning, but for what the driver says of its own speed where no graphics card draws."""
    return message.type in ("error", "warning") and "GL Driver Message (OpenGL, Performance" not in message.text


@contextmanager
def browser_page(url: str, *, width: int = 1280, theme: str = "light") -> Iterator[Page]:
    """A page of a fresh browser. Its console and its scripts have to stay without an error, and it asks no other server."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--enable-unsafe-swiftshader"])
        page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme="dark" if theme == "dark" else "light")
        page.set_default_timeout(PATIENCE * 1e3)
        errors: list[str] = []
        asked: set[str] = set()
        page.on("console", lambda message: errors.append(message.text) if _is_wrong(message) else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("request", lambda request: asked.add(request.url.partition("//")[2].partition("/")[0]))
        page.goto(url)
        yield page
        browser.close()
    assert errors == []
    assert asked == {url.partition("//")[2].partition("/")[0]}
