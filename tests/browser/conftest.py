"""A headless Chromium, and pages of it that keep what they complain about and what they ask the network for.

Where there is none, the tests are skipped, with one line that says so. Screenshots go to the folder that
BLOCKSIM_SCREENSHOTS names, if it is set.
"""

import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Dialog, Page

NAMES = ("chromium", "chromium-browser", "google-chrome")
SCREENSHOTS = "BLOCKSIM_SCREENSHOTS"


@dataclass
class Opened:
    """A page that was opened, and its complaints."""

    page: "Page"
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def dismiss(self, dialog: "Dialog") -> None:
        """Close a dialog: there should be none."""
        self.complaints.append(f"dialog: {dialog.message}")
        dialog.dismiss()

    def state(self) -> dict[str, Any]:
        """Return the state of the player that is shown."""
        state: dict[str, Any] = self.page.evaluate(f"{PLAYER}.state()")
        return state

    def keep(self, name: str) -> None:
        """Keep a picture of the whole page, where somebody asked for it."""
        if SCREENSHOTS in os.environ:
            folder = Path(os.environ[SCREENSHOTS])
            folder.mkdir(parents=True, exist_ok=True)
            self.page.screenshot(path=folder / f"{name}.png", full_page=True)


PLAYER = "blocksim.built.get(document.querySelector('section.subject:not([hidden])').id).player"
Open = Callable[..., Opened]


@pytest.fixture(scope="session")
def browser() -> "Iterator[Browser]":
    """Give Chromium, one for all tests."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip(f"no browser: none of {', '.join(NAMES)} is installed")
    driver = pytest.importorskip("playwright.sync_api", reason="no browser: the package playwright is not installed")
    with driver.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture
def open_page(browser: "Browser") -> Iterator[Open]:
    """Open a report; at the end no page may have complained or asked for anything but its own file."""
    opened: list[Opened] = []
    contexts = []

    def open_report(path: Path, part: str = "", **options: Any) -> Opened:
        context = browser.new_context(**{"viewport": {"width": 1000, "height": 800}, **options})
        contexts.append(context)
        page = context.new_page()
        one = Opened(page)
        opened.append(one)
        page.on("console", lambda message: one.complaints.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: one.complaints.append(str(error)))
        page.on("dialog", one.dismiss)
        page.on("request", lambda request: one.requests.append(request.url))
        page.goto(path.resolve().as_uri() + part)
        return one

    yield open_report
    for context in contexts:
        context.close()
    for one in opened:
        assert one.complaints == []
        assert [url for url in one.requests if not url.startswith(("file:", "data:"))] == []
        assert sum(url.startswith("file:") for url in one.requests) == 1
