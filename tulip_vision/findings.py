"""What a detector hands back: features, and the candidates that it refused, with the reason."""

from __future__ import annotations

from dataclasses import dataclass

from tulip_vision.features import Feature, FeatureClass


@dataclass(frozen=True)
class Refusal:
    """A candidate that was looked at and not taken, for the debug picture.

    Attributes:
        kind: What it might have been.
        pixel: u, v where it was seen [px].
        reason: Why it was refused.
    """

    kind: FeatureClass
    pixel: tuple[float, float]
    reason: str


@dataclass(frozen=True)
class Findings:
    """Result of one detector.

    Attributes:
        features: What was found.
        refusals: What was refused.
    """

    features: tuple[Feature, ...] = ()
    refusals: tuple[Refusal, ...] = ()
