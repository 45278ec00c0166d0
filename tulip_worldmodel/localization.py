"""Where the robot is on the field: one extended Kalman filter while that is clear, several while the robot is lost.

Each hypothesis is a `PoseFilter` with a weight w. A picture z multiplies the weights by its likelihood,

    w_i <- w_i p(z | i)^s / sum_j w_j p(z | j)^s,

a Gaussian-sum filter (D. L. Alspach and H. W. Sorenson, "Nonlinear Bayesian estimation using Gaussian sum
approximations", IEEE Trans. Automatic Control 17, 1972), where s < 1 allows for successive pictures that err alike.
Normally there is one. When its innovations say that it is wrong (lost.py), each picture adds the poses that explain it
(pose_seeds.py) with a small share of the weight; hypotheses that come together are merged, those that explain too
little are dropped, and the first that outweighs all others for long enough is believed alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_worldmodel.camera_error import CameraErrorParameters, own_spread
from tulip_worldmodel.direction import HORIZON
from tulip_worldmodel.landmark_association import Observation
from tulip_worldmodel.landmarks import CROSSINGS, LineObservation, PointObservation, landmarks_of
from tulip_worldmodel.localization_parameters import LocalizationParameters
from tulip_worldmodel.noise_scale import NoiseScale
from tulip_worldmodel.odometry_history import Increment
from tulip_worldmodel.pose_filter import Outcome, PoseFilter
from tulip_worldmodel.pose_seeds import HEADING_SPREAD, POSITION_SPREAD, SeedFinder, close
from tulip_worldmodel.rejected import Rejected
from tulip_worldmodel.side import SideJudge, is_pole

Array = NDArray[np.float64]

NO_LANDMARKS = (FeatureClass.BALL, FeatureClass.OPPONENT, FeatureClass.FIELD_BORDER, FeatureClass.GOAL)
"""Nothing is learnt from these: some move, a carpet ends anywhere, and a goal's posts are features themselves."""
LEAST_WEIGHT = 1e-4  # a hypothesis below it is dropped
TRUST_TIME = 10.0  # [s] in which the heading kept for the case of being lost follows the filter's


@dataclass
class _Hypothesis:
    filter: PoseFilter
    log_weight: float

    def absorb(self, other: _Hypothesis) -> None:
        """Become one with another that is close."""
        weight = float(np.logaddexp(self.log_weight, other.log_weight))
        self.filter.absorb(other.filter, math.exp(other.log_weight - weight))
        self.log_weight = weight


class Localization:
    """Pose of base_footprint in map, with its covariance."""

    def __init__(
        self,
        parameters: LocalizationParameters,
        field: Field,
        start: Pose2D,
        camera: CameraErrorParameters | None = None,
    ) -> None:
        """Begin at a known place.

        Args:
            parameters: See `LocalizationParameters`.
            field: The field to be found again.
            start: base_footprint in map, as good as `start_position_spread` and `start_heading_spread` say. Its heading
                tells which of the two equal halves is which.
            camera: How far its pose may be off; by default as vision says.
        """
        p = self._parameters = parameters
        self._camera = camera or CameraErrorParameters()
        self._landmarks = landmarks_of(field)
        self._seeds = SeedFinder(parameters, field)
        self._side = SideJudge(parameters, self._landmarks, self._seeds)
        self._scale = NoiseScale(p)
        self._systematic = np.diag([p.systematic_spread**2] * 2 + [0.0])
        spreads = (p.start_position_spread, p.start_position_spread, p.start_heading_spread)
        self._hypotheses = [_Hypothesis(PoseFilter(p, self._camera, start, spreads), 0.0)]
        self._heading = start.yaw  # [rad] by dead reckoning, drawn slowly to what was believed while all was well

    @property
    def pose(self) -> Pose2D:
        """base_footprint in map, at the last prediction: that of the heaviest hypothesis."""
        return self._best.pose

    @property
    def covariance(self) -> Array:
        """(3, 3) of x [m], y [m], yaw [rad] in map about `pose`, of all hypotheses together."""
        return self._stated([(each.filter.pose, each.filter.covariance) for each in self._hypotheses])

    @property
    def camera_error(self) -> Array:
        """(3,) estimated rotation about x, y, z of base_footprint by which the camera's pose errs [rad]."""
        return self._best.camera_error

    @property
    def noise_scale(self) -> float:
        """How many times worse vision is taken to be than it says, >= 1."""
        return self._scale.value

    @property
    def lost(self) -> bool:
        """Whether the robot does not know which of several places it is at, or none explains what it sees."""
        return len(self._hypotheses) > 1 or self._best.detector.lost

    @property
    def hypotheses(self) -> tuple[tuple[Pose2D, float], ...]:
        """Pose and weight of each hypothesis, heaviest first; the weights add up to one."""
        return tuple((each.filter.pose, math.exp(each.log_weight)) for each in self._hypotheses)

    def predict(self, moved: Increment) -> None:
        """Move with dead reckoning."""
        for each in self._hypotheses:
            each.filter.predict(moved, self._scale.value)
        self._heading = wrap_angle(self._heading + moved.pose.yaw)
        if not self.lost and self._best.detector.evidence == 0.0 and self._best.pictures > 0:
            share = 1.0 - math.exp(-moved.duration / TRUST_TIME)
            self._heading = wrap_angle(self._heading + share * wrap_angle(self._best.pose.yaw - self._heading))

    def predicted(self, moved: Increment) -> tuple[Pose2D, Array]:
        """Return pose and (3, 3) covariance after a movement, without changing the filter."""
        moments = [each.filter.predicted(moved) for each in self._hypotheses]
        return moments[0][0], self._stated(moments)

    def update(self, features: Features, since_last: float) -> tuple[Rejected, ...]:
        """Correct the pose with one picture, taken where the robot is now predicted to be.

        Args:
            features: Of the picture.
            since_last: Time since the last picture [s].

        Returns:
            The landmark features that were not used by the heaviest hypothesis.
        """
        rejected: list[Rejected] = []
        observations: list[Observation] = []
        shown: list[Feature] = []
        for feature in features.features:
            if feature.kind in NO_LANDMARKS:
                continue
            observation, reason = self._observation(feature, features.camera_position)
            if observation is None:
                rejected.append(Rejected(features.stamp, reason, feature))
            else:
                observations.append(observation)
                shown.append(feature)
        if self.lost and observations:
            self._sow(features)
        poles = [each for each in observations if isinstance(each, PointObservation) and is_pole(each.feature.kind)]
        outcomes: dict[int, Outcome] = {}
        for each in self._hypotheses:
            self._side.judge(each.filter, poles, features)
            outcome = outcomes[id(each)] = each.filter.update(observations, since_last)
            each.log_weight += self._parameters.evidence_share * outcome.log_likelihood
        for observation, nearest in zip(observations, outcomes[id(self._hypotheses[0])].nearest, strict=True):
            self._scale.add(*nearest, self._best.false_rate(observation.feature))
        self._select()
        best = outcomes[id(self._hypotheses[0])]
        return (*rejected, *(Rejected(features.stamp, reason, shown[index]) for index, reason in best.rejected))

    @property
    def _best(self) -> PoseFilter:
        return self._hypotheses[0].filter

    def _sow(self, features: Features) -> None:
        """Add the poses that explain a picture, unless they are there already."""
        p = self._parameters
        known = [each for each in self._hypotheses if not each.filter.detector.lost]
        seeds = self._seeds.find(features, self._heading)
        if not seeds:
            return
        norm = float(np.logaddexp.reduce([seed.log_weight for seed in seeds]))
        spreads = (POSITION_SPREAD, POSITION_SPREAD, HEADING_SPREAD)
        for each in self._hypotheses:
            each.log_weight += math.log(1.0 - p.seed_share)
        for seed in seeds:
            log_weight = math.log(p.seed_share) + seed.log_weight - norm
            sown = _Hypothesis(PoseFilter(p, self._camera, seed.pose, spreads), log_weight)
            twin = next((each for each in known if close(seed.pose, each.filter.pose)), None)
            if twin is None:
                self._hypotheses.append(sown)
            else:
                twin.absorb(sown)

    def _select(self) -> None:
        """Drop, merge and sort the hypotheses, and see whether one has won."""
        p = self._parameters
        for each in self._hypotheses:
            self._side.settle(each.filter, self._heading)
        alive = [each for each in self._hypotheses if not each.filter.detector.lost] or self._hypotheses
        alive.sort(key=lambda each: -each.log_weight)
        kept: list[_Hypothesis] = []
        for each in alive:
            twin = next((other for other in kept if close(each.filter.pose, other.filter.pose)), None)
            if twin is not None:
                twin.absorb(each)
            elif len(kept) < p.most_hypotheses and each.log_weight - alive[0].log_weight > math.log(LEAST_WEIGHT):
                kept.append(each)
        norm = float(np.logaddexp.reduce([each.log_weight for each in kept]))
        for each in kept:
            each.log_weight -= norm
        best = kept[0]
        certain = math.exp(best.log_weight) > p.winning_weight and best.filter.pictures >= p.winning_pictures
        if certain and best.filter.detector.evidence == 0.0:
            kept, best.log_weight = [best], 0.0
        self._hypotheses = kept

    def _stated(self, moments: list[tuple[Pose2D, Array]]) -> Array:
        """Return the (3, 3) covariance of a mixture, with what stays the same from picture to picture."""
        return self._mixed(moments) + self._systematic

    def _mixed(self, moments: list[tuple[Pose2D, Array]]) -> Array:
        """Return the (3, 3) covariance of a mixture about its first pose: sum of w (P + d d^T)."""
        if len(moments) == 1:
            return moments[0][1]
        origin = moments[0][0]
        total = np.zeros((3, 3))
        for each, (pose, covariance) in zip(self._hypotheses, moments, strict=True):
            off = np.array([pose.x - origin.x, pose.y - origin.y, wrap_angle(pose.yaw - origin.yaw)])
            total += math.exp(each.log_weight) * (covariance + np.outer(off, off))
        return total

    def _observation(self, feature: Feature, camera_position: Array) -> tuple[Observation | None, str]:
        p = self._parameters
        feature = own_spread(feature, self._camera, self._scale.value)
        lowest = -math.atan2(float(camera_position[2]), p.longest_range)
        if feature.kind is FeatureClass.LINE:
            if not (feature.elevation < HORIZON and feature.end_elevation < HORIZON):
                return None, "an end of the line is not below the horizon"
            line = LineObservation(feature, self._landmarks.lines, camera_position, p.landmark_spread)
            ends = line.ground_ends()
            if np.linalg.norm(ends.mean(axis=0)) > p.longest_range:
                return None, "too far away"
            if np.linalg.norm(ends[1] - ends[0]) < p.shortest_line:
                return None, "the piece of line is too short"
            return line, ""
        if feature.elevation > lowest:
            return None, "too far away"
        if math.isnan(feature.elevation) and feature.kind in CROSSINGS:
            return None, "a crossing without elevation"
        points = self._landmarks.points[feature.kind]
        mates = self._landmarks.mates if feature.kind is FeatureClass.GOAL_POST else None
        return PointObservation(feature, points, camera_position, p.landmark_spread, mates), ""
