"""The system's browser, for tests of pages; skipped where playwright or the browser is missing."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from _environment import BROWSERS

from tulip_sim.bench.faces_lookers.browser import SOFTWARE

sync_api = pytest.importorskip(
    "playwright.sync_api",
    reason="playwright is not installed: pip install -e '.[browser]' (browsers are not downloaded)",
)

CHROMIUM = next((found for name in BROWSERS if (found := shutil.which(name))), None)
MARKS = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason=f"no browser on the PATH; expected one of {', '.join(BROWSERS)}"),
]
PATIENCE = 240_000  # [ms] for a machine that is busy with other things


@contextmanager
def started() -> Iterator[Any]:
    """Run the browser."""
    # A browser that runs as root has no sandbox; the only page that it opens is our own.
    sandbox = ("--no-sandbox",) if os.getuid() == 0 else ()
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*SOFTWARE, *sandbox])
        yield browser
        browser.close()


def pictures_folder(fallback: Path) -> Path:
    """Return the folder of the screenshots: the one that TULIP_TEST_PICTURES names, to look at them afterwards."""
    named = os.environ.get("TULIP_TEST_PICTURES")
    folder = Path(named) if named else fallback
    folder.mkdir(parents=True, exist_ok=True)
    return folder
