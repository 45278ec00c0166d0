"""Lines of the test kit's table, and its verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum


class Judgement(Enum):
    """What a line says."""

    PASS = "pass"
    FAIL = "FAIL"
    SKIPPED = "-"
    """Not asked of this body."""


@dataclass(frozen=True)
class Row:
    """One line.

    Attributes:
        what: Was tested.
        measured: What came out, with units.
        expected: What a driver must do.
        judgement: Whether it did.
    """

    what: str
    measured: str
    expected: str
    judgement: Judgement


def judged(what: str, measured: str, expected: str, well: bool) -> Row:
    """Return a line that passed or failed."""
    return Row(what, measured, expected, Judgement.PASS if well else Judgement.FAIL)


def skipped(what: str, why: str) -> Row:
    """Return a line about what this body is not asked for."""
    return Row(what, why, "", Judgement.SKIPPED)


def verdict(rows: Sequence[Row]) -> tuple[bool, str]:
    """Return whether nothing failed, and that in words."""
    failed = [row.what for row in rows if row.judgement is Judgement.FAIL]
    passed = sum(row.judgement is Judgement.PASS for row in rows)
    if failed:
        return False, f"{len(failed)} of {len(failed) + passed} checks failed: {', '.join(failed)}"
    return True, f"all {passed} checks passed"
