"""What the world model could not use, and why."""

from __future__ import annotations

from dataclasses import dataclass

from tulip_vision.features import Feature


@dataclass(frozen=True)
class Rejected:
    """A feature, or a whole picture, that changed no estimate.

    Attributes:
        stamp: Of the picture [ns].
        reason: Why, in words.
        feature: The feature, or None when the whole picture was rejected.
    """

    stamp: int
    reason: str
    feature: Feature | None = None
