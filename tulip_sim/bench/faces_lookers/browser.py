"""Looks by the page in Chromium, which draws it without a graphics card and needs most of a core for that."""

from __future__ import annotations

import os
import shutil
import time

from tulip_sim.bench.faces_lookers.looker import PATIENCE, Tally, look, wait_for

SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
"""Options of Chromium: WebGL without a graphics card."""


def executable() -> str | None:
    """Return the browser, or None where it or playwright is missing."""
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return None
    return shutil.which("chromium") or shutil.which("google-chrome")


def see(port: int, tally: Tally) -> None:
    """Show the page, for ever; count the pictures that the browser drew."""
    from playwright.sync_api import sync_playwright

    wait_for(port)
    sandbox = ("--no-sandbox",) if os.getuid() == 0 else ()  # there is none for root; the page is our own
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable(), args=[*SOFTWARE, *sandbox])
        page = browser.new_page(viewport={"width": 1400, "height": 800})
        page.set_default_timeout(1e3 * PATIENCE)
        page.goto(f"http://127.0.0.1:{port}")
        page.get_by_role("tab", name="Nodes").wait_for()
        page.evaluate("""() => { window.drawn = 0;
            const next = () => { window.drawn += 1; requestAnimationFrame(next); }; next(); }""")
        before = 0
        while True:
            drawn = int(page.evaluate("window.drawn"))
            tally.count("browser: pictures [1/s]", drawn - before)
            before = drawn
            time.sleep(1.0)


if __name__ == "__main__":
    look(see)
