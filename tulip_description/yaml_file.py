"""YAML files that people write or programs leave: read with one-line errors, written all or nothing."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

from tulip_description.yaml_text import LARGEST, load_yaml


def read_yaml(path: Path, error: type[ValueError]) -> Any:
    """Return the content of a YAML file.

    Args:
        path: The file.
        error: What is raised if it cannot be read or is no YAML that `load_yaml` takes; the message says which, in
            one line.
    """
    try:
        return load_yaml(read_start(path).decode())
    except OSError as reason:
        raise error(f"{path} cannot be read: {reason.strerror}") from reason
    except (yaml.YAMLError, UnicodeDecodeError) as reason:
        raise error(f"{path} is not YAML: {' '.join(str(reason).split())}") from reason


def read_start(path: Path) -> bytes:
    """Return the content of a YAML file, but no more of it than shows that it is too large.

    Raises:
        OSError: if it cannot be read.
    """
    with open(path, "rb") as stream:
        return stream.read(LARGEST + 1)


def write_lines(path: Path, lines: Iterable[str]) -> None:
    """Write a text file such that it is never seen half written.

    Raises:
        OSError: if it cannot be written; an older one is then still there.
    """
    temporary = path.with_name(path.name + ".new")
    temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    temporary.replace(path)
