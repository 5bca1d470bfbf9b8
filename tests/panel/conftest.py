"""The pages of a test file share a browser."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from browser_bench import close_browser


@pytest.fixture(scope="module", autouse=True)
def browser_ends() -> Iterator[None]:
    """With the file: while Playwright runs, nothing else can run an event loop in this thread."""
    yield
    close_browser()
