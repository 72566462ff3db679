"""The site from the disk, in a real browser: search, formulas, widths of a desktop and a phone."""

import os
from pathlib import Path

import pytest
from playwright.sync_api import Browser

pytestmark = pytest.mark.long
SIZES = {"desktop": {"width": 1280, "height": 850}, "phone": {"width": 390, "height": 800}}


@pytest.mark.parametrize("size", SIZES)
def test_search_finds_pages_from_the_disk_and_nothing_is_wider_than_the_screen(
    browser: "Browser", quick_site: Path, size: str
) -> None:
    page = browser.new_context(viewport=SIZES[size]).new_page()  # type: ignore[arg-type]
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request", lambda request: None if request.url.startswith(("file:", "data:")) else wrong.append(request.url)
    )
    for name in ("theory", "reference/keys", "scenarios/index", "blocksim/verification/index", "index"):
        page.goto((quick_site / f"{name}.html").resolve().as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= SIZES[size]["width"], name
        if "BLOCKSIM_SCREENSHOTS" in os.environ:
            folder = Path(os.environ["BLOCKSIM_SCREENSHOTS"])
            folder.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=folder / f"site-{size}-{name.replace('/', '-')}.png")
    page.click("label[for=__search]" if size == "phone" else ".md-search__input")
    page.keyboard.type("fragility")
    page.wait_for_selector(".md-search-result__item")
    assert "howto/fragility.html" in (page.locator(".md-search-result__item a").first.get_attribute("href") or "")
    assert wrong == []
