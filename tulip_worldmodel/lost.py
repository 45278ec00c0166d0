"""Tells from innovations alone that the robot is not where it thinks: Page's cumulative sum.

While the pose is right, a feature finds a landmark inside its gate with a probability p1 (explained_rate); while it is
wrong, only by chance, with p0 (chance_rate). For each feature the log of the likelihood ratio

    explained: ln(p0 / p1),    unexplained: ln((1 - p0) / (1 - p1))

is added up, never below zero; above a threshold h the robot is lost (E. S. Page, "Continuous inspection schemes",
Biometrika 41, 1954). Among independent samples false alarms are about exp(h) apart. Features of one picture share
their causes, so that one picture adds at most `most_evidence`.

How many are unexplained counts as well. While the pose is right they are false findings, which come now and then
wherever the head looks, also at bare carpet, where nothing explained outweighs them. With Poisson's law and means m0,
m1 a picture where the pose is right, and where it is wrong, each picture takes m1 - m0 off (`usual_evidence`).
"""

from __future__ import annotations

import math

from tulip_worldmodel.localization_parameters import LocalizationParameters


class LostDetector:
    """Evidence that the pose is wrong."""

    def __init__(self, parameters: LocalizationParameters) -> None:
        """Begin with a pose that is believed."""
        p = parameters
        self._explained = math.log(p.chance_rate / p.explained_rate)
        self._unexplained = math.log((1.0 - p.chance_rate) / (1.0 - p.explained_rate))
        self._usual = p.usual_evidence
        self._most = p.most_evidence
        self._threshold = p.lost_evidence
        self.evidence = 0.0
        """Nats, >= 0."""

    @property
    def lost(self) -> bool:
        """Whether the evidence is enough."""
        return self.evidence >= self._threshold

    def add(self, explained: int, unexplained: int) -> None:
        """Take the features of one picture.

        Args:
            explained: How many found their landmark.
            unexplained: How many have none inside their gate; those that are ambiguous count in neither.
        """
        sum_ = explained * self._explained + unexplained * self._unexplained - self._usual
        evidence = self.evidence + max(-self._most, min(self._most, sum_))
        self.evidence = max(0.0, min(evidence, 1.5 * self._threshold))  # the limit lets it recover
