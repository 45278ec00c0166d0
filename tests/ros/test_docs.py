"""The page on the architecture agrees with the graph as declared."""

from __future__ import annotations

import pytest

import docs


def test_generated_parts_of_the_page_are_as_written():
    text = docs.PAGE.read_text()
    assert docs.render(text) == text, "run `python3 scripts/docs.py`"


def test_a_part_that_differs_is_made_anew():
    text = docs.PAGE.read_text()
    changed = text.replace("| `odometry` |", "| `dometry` |")
    assert changed != text
    assert docs.render(changed) == text


def test_a_page_without_the_marks_is_refused():
    with pytest.raises(ValueError, match="holds 0 blocks <!-- graph -->"):
        docs.render("nothing")
