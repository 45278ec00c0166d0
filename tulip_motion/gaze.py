"""Where to look: shares the gaze's time between ball and landmarks by what the world model is least sure of.

Each gaze is worth the uncertainty that it is expected to remove per time, way there included:

    value = (trace(W_pose (P - P')) + (trace(B) - trace(B')) / w_ball^2) / (travel + look)

with the covariances of pose (P) and ball (B) without the look and after it (P', B'; see gaze_landmarks.py), and
W_pose = diag(w_xy, w_xy, w_yaw)^-2: each uncertainty is measured by the one that play can do with. The gaze of greatest
value is held until it has been looked along, then the choice is made anew. While the ball is looked at, the pose
becomes less sure, and looking at landmarks more valuable; and the other way round.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.positive import check_positive
from tulip_description.robot import Robot
from tulip_motion.gaze_landmarks import Landmarks, Sight, ball_after_look, pose_after_look
from tulip_motion.head import HeadParameters
from tulip_motion.head_geometry import HeadGeometry
from tulip_motion.head_trajectory import HeadTrajectory, travel_time
from tulip_motion.interface import GazeInput

Array = NDArray[np.float64]
Point3 = tuple[float, float, float]


@dataclass(frozen=True)
class GazeParameters:
    """Numbers of the gaze planner."""

    gaze_speed: float = HeadParameters.speed  # [rad/s] of the head, for the time of its ways
    gaze_acceleration: float = HeadParameters.acceleration  # [rad/s^2]
    gaze_limit_margin: float = HeadParameters.limit_margin  # [rad]
    gaze_settling: float = 0.06  # [s] after a way, until a picture is sharp: one picture
    gaze_look: float = 0.26  # [s] of one look: four pictures at 15 Hz, of which some miss something
    gaze_reach: float = 2.0  # [rad] pan for landmarks; farther back only the shoulders are
    gaze_pan_step: float = 0.25  # [rad] between the gazes compared: a third of half a picture
    gaze_nearest_tilt: float = 0.75  # [rad] down: landmarks from 0.7 m on
    gaze_farthest_tilt: float = 0.15  # [rad] down: landmarks up to the horizon in the upper half
    gaze_tilts: int = 3  # between the two: half a picture apart
    gaze_aside: float = 0.35  # [rad] the ball off the picture's middle, for more landmarks beside and above it
    gaze_half_width: float = 0.56  # [rad] of the picture: 35 deg less 3 deg for the blur of a moving head
    gaze_half_height: float = 0.43  # [rad] 27.7 deg less 3 deg
    gaze_azimuth_spread: float = math.radians(0.4)  # [rad] of one feature: a pixel and a half, and the association
    gaze_elevation_spread: float = math.radians(0.4)  # [rad]
    gaze_common_azimuth_spread: float = math.radians(0.4)  # [rad] of a picture: pan encoder, time stamp while turning
    gaze_tilt_spread: float = math.radians(0.6)  # [rad] of a picture: IMU, bending of legs and neck while walking
    gaze_landmark_spread: float = 0.03  # [m] lines are painted by hand
    gaze_found: float = 0.8  # of the landmarks and balls in the picture: motion blur, things in the way
    gaze_post_reach: float = 8.0  # [m] localization uses nothing farther away
    gaze_pole_reach: float = 7.0  # [m]
    gaze_crossing_reach: float = 5.0  # [m] lines are thin
    gaze_mark_reach: float = 3.5  # [m]
    gaze_ball_reach: float = 8.0  # [m]
    gaze_position_wanted: float = 0.05  # [m] of each axis: half of what play can do with, so that glances come in time
    gaze_heading_wanted: float = math.radians(1.5)  # [rad] same, as the direction of a kick
    gaze_ball_wanted: float = 0.04  # [m] of a ball near the feet: the kick's window
    gaze_ball_wanted_share: float = 0.08  # of the ball's range: how well a way to it has to be aimed
    gaze_ball_doubt: float = 0.08  # [m/s] an unseen ball may have been touched: filters do not expect that
    gaze_ball_doubt_share: float = 0.4  # of its speed: a rolling ball may be stopped or turned aside
    gaze_rolling: float = 0.4  # [m/s] a faster ball is kept in the picture's middle, where the head can lead it
    gaze_least_value: float = 0.5  # [1/s] a look that takes the ball out of the picture has to be worth that much more
    gaze_turn_cost: float = 0.3  # [1/s/rad] the same for each way that the head goes: pictures blur

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        check_positive(self, GazeParameters)
        if self.gaze_found > 1.0:
            raise ValueError(f"gaze_found is {self.gaze_found}; expected a share <= 1")
        if self.gaze_farthest_tilt >= self.gaze_nearest_tilt:
            raise ValueError(
                f"gaze_farthest_tilt is {self.gaze_farthest_tilt} rad; expected less than gaze_nearest_tilt,"
                f" {self.gaze_nearest_tilt} rad"
            )


@dataclass(frozen=True)
class Gazes:
    """Gazes to choose from, those beside the ball first.

    Attributes:
        angles: (g, 2) pan and tilt [rad].
        beside_ball: (b, 2) pan and tilt of the first b, relative to the ball [rad]; the very first is (0, 0).
    """

    angles: Array
    beside_ball: Array


@dataclass(frozen=True)
class Choice:
    """The gaze that was chosen.

    Attributes:
        until: When it has been looked along [ns].
        beside_ball: (2,) pan and tilt relative to the ball [rad], or None.
        point: In map [m], or None if it goes with the ball.
    """

    until: int
    beside_ball: Array | None
    point: Point3 | None


class GazePlanner:
    """Chooses gazes while a ball is tracked."""

    LONGEST_GAP = 0.3  # [s] between two plans; after more, the head has been on the ball meanwhile
    POINT_DISTANCE = 3.0  # [m] of the points looked at: the middle of what landmarks are away

    def __init__(self, parameters: GazeParameters, field: Field, robot: Robot) -> None:
        """Prepare for a field.

        Args:
            parameters: See `GazeParameters`.
            field: Whose landmarks are looked for.
            robot: A robot with a head.

        Raises:
            ValueError: if the robot has no head.
        """
        p = self._parameters = parameters
        self._geometry = HeadGeometry(robot, p.gaze_limit_margin)
        # The head follows the commands that come from here; it is where the same trajectory leads.
        self._head = HeadTrajectory(self._geometry.lower, self._geometry.upper, p.gaze_acceleration)
        self._landmarks = Landmarks(
            field, p.gaze_post_reach, p.gaze_pole_reach, p.gaze_crossing_reach, p.gaze_mark_reach
        )
        self._radius = field.ball_radius
        self._sight = Sight(
            p.gaze_half_width,
            p.gaze_half_height,
            p.gaze_azimuth_spread,
            p.gaze_elevation_spread,
            p.gaze_common_azimuth_spread,
            p.gaze_tilt_spread,
            p.gaze_landmark_spread,
            p.gaze_found,
        )
        pans = np.arange(-p.gaze_reach, p.gaze_reach + 1e-9, p.gaze_pan_step)
        tilts = np.linspace(p.gaze_farthest_tilt, p.gaze_nearest_tilt, p.gaze_tilts)
        self._grid = np.array([(pan, tilt) for tilt in tilts for pan in pans])
        a = p.gaze_aside
        self._beside_ball = np.array([(0, 0), (0, -a), (-a, 0), (a, 0), (-a, -a), (a, -a)], dtype=np.float64)
        self._stamp: int | None = None
        self._choice: Choice | None = None

    def plan(self, known: GazeInput) -> Point3 | None:
        """Return the point to glance at now in base_footprint [m], or None to look at the ball.

        Args:
            known: What the world model says.
        """
        gap = math.inf if self._stamp is None else (known.stamp - self._stamp) * 1e-9
        on_ball = self._towards_ball(known)
        if not 0.0 <= gap <= self.LONGEST_GAP:
            self._head.begin(on_ball)
            self._choice, gap = None, 0.0
        self._stamp = known.stamp
        if self._choice is None or known.stamp >= self._choice.until:
            self._choice = self._choose(known)
        point = self._point(known, self._choice, on_ball)
        goal = on_ball if point is None else self._geometry.angles_towards(point)
        self._head.advance(goal, np.zeros(2), np.full(2, self._parameters.gaze_speed), gap)
        return point

    def gazes(self, known: GazeInput) -> Gazes:
        """Return the gazes to choose from."""
        rolls = float(np.hypot(*known.ball_velocity)) > self._parameters.gaze_rolling
        relative = self._beside_ball[:1] if rolls else self._beside_ball
        beside = np.clip(self._towards_ball(known) + relative, self._geometry.lower, self._geometry.upper)
        return Gazes(np.vstack((beside, self._grid)), relative)

    def values(self, known: GazeInput, angles: Array, head: Array) -> tuple[Array, Array]:
        """Return what gazes are worth.

        Args:
            known: What the world model says.
            angles: (g, 2) pan and tilt of the gazes [rad].
            head: (2,) pan and tilt now [rad].

        Returns:
            (g,) expected decrease of the weighed uncertainty per time [1/s], and (g,) the time of way and look [s].
        """
        p, eye = self._parameters, self._geometry.eye
        travel = np.max(travel_time(angles - head, p.gaze_speed, p.gaze_acceleration), axis=1)
        times = travel + np.where(travel > p.gaze_settling, p.gaze_settling, 0.0) + p.gaze_look
        after = pose_after_look(known.pose, known.covariance, angles, self._landmarks, eye, self._sight)
        wanted = np.array([p.gaze_position_wanted, p.gaze_position_wanted, p.gaze_heading_wanted])
        pose_gain = ((np.diag(known.covariance) - np.diagonal(after, axis1=1, axis2=2)) / wanted**2).sum(axis=1)
        ball = known.ball + times[:, None] * known.ball_velocity
        before = self._ball_without_look(known)
        seen = ball_after_look(ball, before, angles, self._radius, eye, self._sight, p.gaze_ball_reach)
        ball_wanted = max(p.gaze_ball_wanted, p.gaze_ball_wanted_share * float(np.hypot(*known.ball)))
        ball_gain = (np.trace(before) - np.trace(seen, axis1=1, axis2=2)) / ball_wanted**2
        return (pose_gain + ball_gain) / times, times

    def _choose(self, known: GazeInput) -> Choice:
        p = self._parameters
        gazes = self.gazes(known)
        values, times = self.values(known, gazes.angles, self._head.position)
        cost = p.gaze_turn_cost * np.abs(gazes.angles - self._head.position).sum(axis=1)
        cost[len(gazes.beside_ball) :] += p.gaze_least_value
        best = int(np.argmax(values - cost))
        until = known.stamp + round(float(times[best]) * 1e9)
        if best < len(gazes.beside_ball):
            return Choice(until, gazes.beside_ball[best], None)
        point = self._geometry.point_ahead(gazes.angles[best], self.POINT_DISTANCE)
        x, y = known.pose.transform(point[:2])
        return Choice(until, None, (x, y, point[2]))

    def _point(self, known: GazeInput, choice: Choice, on_ball: Array) -> Point3 | None:
        """Return where a choice lies now, or None for the ball itself."""
        if choice.point is not None:
            x, y = known.pose.inverse().transform(choice.point[:2])
            return x, y, choice.point[2]
        if choice.beside_ball is None or not choice.beside_ball.any():
            return None
        angles = np.clip(on_ball + choice.beside_ball, self._geometry.lower, self._geometry.upper)
        return self._geometry.point_ahead(angles, self.POINT_DISTANCE)

    def _towards_ball(self, known: GazeInput) -> Array:
        x, y = known.ball.tolist()
        return self._geometry.angles_towards((x, y, self._radius))

    def _ball_without_look(self, known: GazeInput) -> Array:
        """Return (2, 2) how unsure the ball's place is after the time of one look, if nobody looks [m^2].

        The same for all gazes: a ball that grows less sure on the way is no reward for a long way.
        """
        p, whole, t = self._parameters, known.ball_covariance, self._parameters.gaze_look
        crossed = whole[:2, 2:] + whole[2:, :2]
        doubt = p.gaze_ball_doubt + p.gaze_ball_doubt_share * float(np.hypot(*known.ball_velocity))
        variance = (doubt * (known.ball_age + t)) ** 2
        covariance: Array = whole[:2, :2] + t * crossed + t**2 * whole[2:, 2:] + variance * np.eye(2)
        return covariance
