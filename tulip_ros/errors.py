"""The one kind of error that a user can mend; it ends a program with exit code 2 and no traceback."""

from __future__ import annotations

import difflib
import importlib.util
from collections.abc import Iterable
from pathlib import Path

EXIT_BAD_INPUT = 2
"""Exit code of a program that was given something it cannot use."""

EXIT_GIVEN_UP = 3
"""Exit code of a launch in which a node died so often that it was not started any more."""

MOST_NAMES = 12
"""More known names than this are not listed when one of them was probably meant."""


class BadInputError(Exception):
    """Something that the user gave cannot be used; the message says what, what was expected, and what to do."""


def unknown(kind: str, name: str, known: Iterable[str]) -> BadInputError:
    """Return the error for a name that does not exist.

    Args:
        kind: What it names, as in "node".
        name: The name as given.
        known: The names that exist.
    """
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=3)
    hint = f" Did you mean {' or '.join(near)}?" if near else ""
    names_shown = "" if near and len(names) > MOST_NAMES else f" Known: {', '.join(names) or 'none'}."
    return BadInputError(f"There is no {kind} {name!r}.{hint}{names_shown}")


def require(library: str, extra: str) -> None:
    """Refuse to begin without a library that not everyone needs.

    Args:
        library: Its name, as Python imports it.
        extra: The project's extra that brings it.

    Raises:
        BadInputError: if it is not installed.
    """
    if importlib.util.find_spec(library) is None:
        raise BadInputError(
            f"This needs the library {library}, which is not installed. Install the project's extra `{extra}`: "
            f"pip install -e '.[{extra}]'"
        )


def check_writable(path: Path, option: str) -> None:
    """Refuse a file that cannot be written, before the work for it is done.

    Args:
        path: The file.
        option: Where its name came from, as in "--json".

    Raises:
        BadInputError: if it cannot be written.
    """
    existed = path.exists()
    try:
        with open(path, "ab"):
            pass
        if not existed:
            path.unlink()
    except OSError as error:
        raise BadInputError(f"{option} {path} cannot be written: {error.strerror}. Name another file.") from error


def check_new_file(path: Path, option: str, force: bool) -> None:
    """Refuse a file that exists or cannot be written, before the work for it is done.

    Args:
        path: The file.
        option: Where its name came from, as in "--to".
        force: Whether it may be replaced.

    Raises:
        BadInputError: if so.
    """
    if path.is_dir():
        raise BadInputError(f"{path} is a folder; expected the name of a file.")
    if path.exists() and not force:
        raise BadInputError(f"{path} exists; name another file with {option}, or give --force to replace it.")
    if not path.parent.is_dir():
        raise BadInputError(f"There is no folder {path.parent}; make it, or name another file with {option}.")
    check_writable(path, option)
