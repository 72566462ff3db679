"""The live page in a real browser: it says that it loads, then shows the report, and its policy allows all of it."""

import threading
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from blocksim.study import live
from tests.view.report.folders import write_run

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Route

pytestmark = pytest.mark.long
PLAYER = "[...document.querySelector('iframe').contentWindow.blocksim.built.values()][0].player"


def test_the_live_page_says_that_it_loads_and_shows_the_newest_frame(browser: "Browser", tmp_path: Path) -> None:
    write_run(tmp_path / "run", count=5)
    complaints: list[str] = []
    with live.open_server(tmp_path / "run") as (server, _, address):
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = browser.new_page()
        page.on("console", lambda message: complaints.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        loading: list[bool] = []

        def answer(route: "Route") -> None:
            loading.append(page.locator("#loading").is_visible())
            route.continue_()

        page.route("**/report?*", answer)
        page.goto(address)
        page.locator("#loading").wait_for(state="hidden")
        page.wait_for_function(f"document.querySelector('iframe') && {PLAYER}")
        assert page.evaluate(f"{PLAYER}.frame") == 4
        assert loading == [True]
        assert page.locator("iframe").is_visible()
        assert "5 frames" in page.locator("#told").inner_text()
        page.close()
        server.shutdown()
    assert complaints == []
