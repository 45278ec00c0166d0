"""The one kind of error that a user can mend; it ends a program with exit code 2 and no traceback."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

EXIT_BAD_INPUT = 2
"""Exit code of a program that was given something it cannot use."""


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
    near = difflib.get_close_matches(name, names, n=1)
    hint = f" Did you mean {near[0]}?" if near else ""
    return BadInputError(f"There is no {kind} {name!r}.{hint} Known: {', '.join(names) or 'none'}.")
