"""The generated parts of the pages agree with what they are made from."""

from __future__ import annotations

import pytest

import docs


@pytest.mark.parametrize("page", sorted({page for page, _, _ in docs.parts()}))
def test_generated_parts_of_the_pages_are_as_written(page: str) -> None:
    text = (docs.PAGES / page).read_text()
    assert docs.render(page, text) == text, "run `python3 scripts/docs.py`"


def test_a_part_that_differs_is_made_anew() -> None:
    text = (docs.PAGES / "architecture.md").read_text()
    changed = text.replace("| `odometry` |", "| `dometry` |")
    assert changed != text
    assert docs.render("architecture.md", changed) == text


def test_a_page_without_the_marks_is_refused() -> None:
    with pytest.raises(ValueError, match=r"architecture\.md holds 0 blocks <!-- graph -->"):
        docs.render("architecture.md", "nothing")
