"""What came of something that a person asked for, in words; and the ways in which a person can push. No ROS here."""

from __future__ import annotations

from dataclasses import dataclass

PUSHES = {"forward": 0.0, "to the left": 90.0, "backward": 180.0, "to the right": -90.0}
"""Directions of a push as the robot sees them [deg]."""


@dataclass(frozen=True)
class Outcome:
    """What came of a wish.

    Attributes:
        what: Was asked for.
        verdict: "taken", "refused" or, where nobody answered, "not done"; "sent" where nobody needs to answer.
        words: Why not, or what else the server says.
    """

    what: str
    verdict: str
    words: str = ""

    def __str__(self) -> str:
        return f"{self.what}: {self.verdict}" + (f" ({self.words})" if self.words else "")
