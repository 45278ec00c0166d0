"""YAML that anybody may have written: bounded, and read as ROS reads it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

import tulip_description
from tulip_description.yaml_text import DEEPEST, LARGEST, load_yaml
from tulip_view.fuzz.mutation import BOMB, MERGES


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 200_000, f"more than {DEEPEST} levels"),  # the library's fast loader ends the process at these
        ("{a: " * (DEEPEST + 1) + "1" + "}" * (DEEPEST + 1), f"more than {DEEPEST} levels"),
        (BOMB, "once aliases are replaced"),
        (MERGES, "once aliases are replaced"),
        ("a: &a [*a]", "alias 'a' of nothing, or of what it is a part of"),
        ("a: 1\nb: 2\na: 3", "key 'a' a second time in .* line 3"),
        ("a: " + "9" * 30, "more than 64 bits"),
        ("a: " + "9" * 9000, "a value cannot be"),
        ("a: 2013-99-99", "a value cannot be"),
        ("a: !!int x", "a value cannot be"),
        ("a: !!timestamp x", "a value cannot be"),
        ("!!python/object/apply:os.system [exit]", "could not determine a constructor"),
        ("x" * (LARGEST + 1), "expected at most"),
    ],
)
def test_what_no_file_of_settings_is_gets_refused(text: str, words: str) -> None:
    with pytest.raises(yaml.YAMLError) as refused:
        load_yaml(text)
    with pytest.raises(yaml.YAMLError):
        load_yaml(text.encode())
    assert re.search(words, " ".join(str(refused.value).split()))


def test_the_deepest_that_is_allowed_is_read() -> None:
    content = load_yaml("[" * DEEPEST + "]" * DEEPEST)
    for _ in range(DEEPEST - 1):
        [content] = content
    assert content == []


def test_aliases_and_merges_of_a_sane_size_are_read() -> None:
    assert load_yaml("a: &a {x: 1}\nb: {<<: *a, y: 2}\nc: [*a, *a]") == {
        "a": {"x": 1},
        "b": {"x": 1, "y": 2},
        "c": [{"x": 1}, {"x": 1}],
    }


def test_numbers_are_those_of_ros() -> None:
    assert load_yaml("[1e-3, 1.5e3, -2E2, 18446744073709551615]") == [0.001, 1500.0, -200.0, 2**64 - 1]


def test_own_files_are_read_as_the_library_reads_them() -> None:
    for path in Path(str(tulip_description.__file__)).parent.glob("*.yaml"):
        assert load_yaml(path.read_text()) == yaml.safe_load(path.read_text())
