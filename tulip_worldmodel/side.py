"""Which half of the field is which: asked apart from where on the field the robot is.

Turned by pi about its centre the field looks the same, but for the colours of its poles. Lines, crossings, marks and
posts can therefore not tell a pose from its mirror image, however many pictures show them; any difference that they
make between the two is noise. What can are the heading, known at the start and carried on by the IMU, and the poles:

    log-odds of a hypothesis against its mirror image = ln p(yaw) - ln p(yaw + pi) + sum over poles seen,

where a pole counts for the hypothesis if it stands where it should, and against it if there should be the pole of the
other colours. A hypothesis that loses is turned round, and keeps what it knows of its place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from tulip_description.planar import wrap_angle
from tulip_vision.features import FeatureClass, Features
from tulip_worldmodel.landmarks import POLES, Landmarks, PointObservation
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.mahalanobis import gate
from tulip_worldmodel.pose_filter import PoseFilter
from tulip_worldmodel.pose_seeds import SeedFinder

TURNING_ODDS = 3.0  # nats by which the mirror image must be likelier: 20 to 1
MOST = 15.0  # nats that poles can add up to, so that they can still be refuted

OTHER = dict(zip(POLES, reversed(POLES), strict=True))


class SideJudge:
    """Keeps hypotheses on the side of the field that heading and poles speak for."""

    def __init__(self, parameters: LocalizationParameters, landmarks: Landmarks, seeds: SeedFinder) -> None:
        """Prepare.

        Args:
            parameters: See `LocalizationParameters`.
            landmarks: Of the field.
            seeds: Knows how likely a heading is.
        """
        p = self._parameters = parameters
        self._landmarks = landmarks
        self._seeds = seeds
        self._nats = p.evidence_share * math.log((1.0 - p.false_rate_other) / p.false_rate_other)

    def judge(self, hypothesis: PoseFilter, poles: Sequence[PointObservation], features: Features) -> None:
        """Count the poles of a picture for or against a hypothesis.

        Args:
            hypothesis: Predicted to the picture.
            poles: What the picture shows of poles.
            features: The picture.
        """
        p = self._parameters
        for pole in poles:
            points = self._landmarks.points[OTHER[pole.feature.kind]]
            other = PointObservation(pole.feature, points, features.camera_position, p.landmark_spread)
            limit = gate(p.gate_probability, pole.rows)
            if hypothesis.distance(pole) <= limit:
                hypothesis.side = min(MOST, hypothesis.side + self._nats)
            elif hypothesis.distance(other) <= limit:
                hypothesis.side = max(-MOST, hypothesis.side - self._nats)

    def settle(self, hypothesis: PoseFilter, heading: float) -> None:
        """Turn a hypothesis round if its mirror image is likelier.

        Args:
            hypothesis: One of those kept.
            heading: Yaw of base_footprint in map that dead reckoning has kept [rad].
        """
        if self.log_odds(hypothesis, heading) < -TURNING_ODDS:
            hypothesis.turn_round()

    def log_odds(self, hypothesis: PoseFilter, heading: float) -> float:
        """Return how much likelier a hypothesis is than its mirror image [nats]."""
        yaw = hypothesis.pose.yaw
        here = self._seeds.heading_prior(yaw, heading)
        return here - self._seeds.heading_prior(wrap_angle(yaw + math.pi), heading) + hypothesis.side


def is_pole(kind: FeatureClass) -> bool:
    """Return whether features of this class tell the two halves of the field apart."""
    return kind in POLES
