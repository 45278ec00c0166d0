"""What somebody found out about a node or an installation: how bad it is, what is wrong, and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple


class Level(IntEnum):
    """How bad it is; the numbers are those of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARNING = 1
    """It works, but worse than it should."""
    ERROR = 2
    """It does not do what it is there for."""
    STALE = 3
    """It says nothing any more."""


class Finding(NamedTuple):
    """One thing found.

    Attributes:
        level: How bad it is.
        words: What is wrong and, after a colon, what to do or where to look.
    """

    level: Level
    words: str


def worst(findings: Iterable[Finding]) -> Level:
    """Return the worst level; OK if nothing was found."""
    return max((finding.level for finding in findings), default=Level.OK)


def say(findings: Iterable[Finding]) -> str:
    """Return all words, the worst first; words of what is well only when nothing is wrong."""
    ordered = sorted(findings, key=lambda finding: -finding.level)
    wrong = [finding for finding in ordered if finding.level > Level.OK]
    return "; ".join(finding.words for finding in wrong or ordered)
