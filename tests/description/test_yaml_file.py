"""Reading and writing of YAML files: what is wrong is told in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tulip_description.yaml_file import read_yaml, write_lines


class OddError(ValueError):
    """Of the caller."""


def test_content_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    write_lines(path, ("# noted", "name: Tülp", "numbers: [1, 2.5]"))
    assert read_yaml(path, OddError) == {"name": "Tülp", "numbers": [1, 2.5]}
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "a.yaml cannot be read: No such file"), (b"a: [1\n b", "a.yaml is not YAML: "), (b"\xff", "is not YAML: ")],
)
def test_what_cannot_be_used_is_told_in_one_line(content: bytes | None, message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(OddError, match=message) as caught:
        read_yaml(path, OddError)
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    write_lines(path, ["old: 1"])
    (tmp_path / "a.yaml.new").mkdir()
    with pytest.raises(OSError):
        write_lines(path, ["new: 1"])
    assert read_yaml(path, OddError) == {"old": 1}
