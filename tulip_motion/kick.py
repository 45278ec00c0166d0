"""The kick: swing foot trajectories with cosine velocity profiles."""

from __future__ import annotations

import math

import numpy as np

from tulip_description.planar import Pose2D
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import FootMotion, Reference, sole_point, support_on
from tulip_motion.interface import KickGoal, Support
from tulip_motion.lipm import DcmPlan, time_constant
from tulip_motion.parameters import MotionParameters

Point = tuple[float, float, float]


def cosine_profile(time: float, duration: float) -> tuple[float, float, float]:
    """Return progress, rate and acceleration of a move whose speed follows 1 - cos(2 pi t / T).

    Progress goes from 0 to 1; speed and acceleration are zero at both ends; the peak speed is 2 / T.
    """
    t = min(max(time, 0.0), duration)
    w = 2.0 * math.pi / duration
    return (t - math.sin(w * t) / w) / duration, (1.0 - math.cos(w * t)) / duration, w * math.sin(w * t) / duration


class Kick:
    """Shifts onto the other foot, swings the kicking foot back and through the ball, and stands again."""

    def __init__(
        self,
        parameters: MotionParameters,
        goal: KickGoal,
        feet: tuple[Footstep, Footstep],
        zmp: tuple[float, float],
    ) -> None:
        """Begin from double support.

        Args:
            parameters: Of motion control.
            goal: Foot, direction and speed.
            feet: Left and right foot as they stand.
            zmp: Where the ZMP is now, in odom [m].
        """
        p = self._parameters = parameters
        self._time_constant = time_constant(p.com_height)
        self.side = goal.side
        self._feet = [feet[0], feet[1]]
        self._stance = feet[goal.side.other]
        self._start = feet[goal.side].pose
        self.finished = False
        self._time = 0.0
        self._down_at: float | None = None
        heading = self._stance.pose.yaw + goal.direction
        forward = np.array([math.cos(heading), math.sin(heading), 0.0])
        ground = np.array([self._start.x, self._start.y, 0.0])
        raised = np.array([0.0, 0.0, p.kick_height])
        back = ground + raised - p.kick_backswing * forward
        front = ground + raised + p.kick_follow_through * forward
        swing_time = 2.0 * (p.kick_backswing + p.kick_follow_through) / goal.speed
        self._path = [
            (ground, back, p.kick_lift_time),
            (back, front, swing_time),
            (front, ground + raised, p.kick_return_time),
            (ground + raised, ground, p.kick_lower_time),
        ]
        self._swing_end = p.kick_shift_time + sum(duration for _, _, duration in self._path)
        aim = sole_point(self._stance, p.zmp_forward, p.kick_zmp_inward)
        # The DCM has to be over the foot, at rest, when the foot lifts: end the plan there.
        self._plan = DcmPlan([0.0, p.kick_shift_time], [zmp, aim], self._time_constant)

    @property
    def feet(self) -> tuple[Footstep, Footstep]:
        """Left and right foot as they stand now."""
        return self._feet[0], self._feet[1]

    def tick(self, dt: float, landed: Pose2D, loads: tuple[float, float]) -> Reference:
        """Advance by one tick.

        Args:
            dt: [s].
            landed: Where the kicking foot is now, as measured, in odom; used when it touches down.
            loads: Vertical force on the left and right sole [N].
        """
        p = self._parameters
        self._time += dt
        in_air = p.kick_shift_time <= self._time and self._down_at is None
        lowering = self._time > self._swing_end - p.kick_lower_time * (1.0 - p.contact_phase)
        late = self._time > self._swing_end + p.late_contact_time * 2.0
        if in_air and lowering and (loads[self.side] > p.contact_force or late):
            self._land(landed)
            in_air = False
        elapsed = self._time - (self._down_at or 0.0)
        zmp, dcm = self._plan.evaluate(elapsed)
        if self._down_at is not None:
            self.finished = elapsed > p.stop_shift_time
        foot = self._swing() if in_air else FootMotion.resting(self._feet[self.side].pose)
        total = self._swing_end + p.stop_shift_time
        return Reference(
            support_on(self._stance.side) if in_air else Support.DOUBLE,
            self._stance,
            foot,
            zmp,
            dcm,
            self._stance.pose.yaw + 0.5 * math.remainder(foot.yaw - self._stance.pose.yaw, 2.0 * math.pi),
            0.0,
            min(self._time / total, 1.0),
        )

    def _land(self, landed: Pose2D) -> None:
        p = self._parameters
        zmp, _ = self._plan.evaluate(self._time)
        self._down_at = self._time
        self._feet[self.side] = Footstep(self.side, landed)
        left, right = (sole_point(foot, p.zmp_forward, p.zmp_inward) for foot in self._feet)
        middle = ((left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0)
        self._plan = DcmPlan([0.0, p.stop_shift_time], [zmp, middle], self._time_constant)

    def _swing(self) -> FootMotion:
        time = self._time - self._parameters.kick_shift_time
        for start, end, duration in self._path:
            if time <= duration:
                progress, rate, acceleration = cosine_profile(time, duration)
                way = end - start
                return FootMotion(start + progress * way, rate * way, acceleration * way, self._start.yaw)
            time -= duration
        down = np.array([0.0, 0.0, -self._parameters.landing_speed])
        return FootMotion(self._path[-1][1] + time * down, down, np.zeros(3), self._start.yaw)
