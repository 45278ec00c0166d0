"""The browser in which pages are opened, and where their pictures go; `browser.py` says whether there is one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from browser import pictures_folder  # skips where there is no playwright, which here would skip everything

    return pictures_folder(tmp_path_factory.mktemp("pictures"))


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from browser import started

    with started() as running:
        yield running
